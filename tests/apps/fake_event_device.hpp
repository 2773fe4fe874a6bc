// A Linux event device as a pipe: this program's ioctl() and read() answer for pipes as the kernel
// does for /dev/input/event*, of whatever FakeEventDevice::now() says. All other files are the
// kernel's.
// Layer: tests.  Thread: any, while one test runs.
#pragma once

#include <linux/input.h>

#include <map>
#include <set>

namespace tandem::apps {

struct FakeEventDevice {
  std::map<int, input_absinfo> axes;  ///< by code, as EVIOCGABS has them
  std::set<int> buttons, down;        ///< that it has; that are down
  bool knows_capabilities = true;     ///< false: ioctl() fails, as for a file that is none
  bool knows_state = true;            ///< the same of EVIOCGKEY and EVIOCGABS
  bool pulled_out = false;            ///< read() fails with ENODEV

  static FakeEventDevice& now();
};

}  // namespace tandem::apps
