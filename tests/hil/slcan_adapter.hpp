// The far end of a serial CAN adapter: the kernel's slcan driver believes that it talks to one.
// Layer: tests.  Thread: any.
#pragma once

#include <fcntl.h>
#include <linux/sockios.h>
#include <linux/tty.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

#include "tests/hil/can_interfaces.hpp"

namespace tandem::test {

/// A classic interface of the kernel's CAN device layer, up. write() is what the adapter sends:
/// "t70A105\r" a frame, "sp130140\r" error-passive, "sb255001\r" bus-off, "sa001000\r" active.
class SlcanAdapter {
 public:
  ~SlcanAdapter() { unplug(); }

  /// @return why there can be none here; empty when it is there.
  [[nodiscard]] std::string open() {
    if (std::getenv("TANDEM_HIL_NAMESPACE") != nullptr) {
      return "a serial adapter's interface appears on the machine itself, not in this network "
             "namespace: TANDEM_HIL=uml runs this test";
    }
    master_ = ::posix_openpt(O_RDWR | O_NOCTTY);
    if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0) {
      return std::string("no pseudo-terminal: ") + std::strerror(errno);
    }
    terminal_ = ::open(::ptsname(master_), O_RDWR | O_NOCTTY);
    termios raw{};
    if (terminal_ < 0 || ::tcgetattr(terminal_, &raw) != 0) {
      return std::string("no pseudo-terminal: ") + std::strerror(errno);
    }
    ::cfmakeraw(&raw);
    ::tcsetattr(terminal_, TCSANOW, &raw);
    const int discipline = N_SLCAN;
    if (::ioctl(terminal_, TIOCSETD, &discipline) != 0) {
      return std::string("no slcan (module slcan, and the right to use it): ") +
             std::strerror(errno);
    }
    char name[IFNAMSIZ] = {};
    if (::ioctl(terminal_, SIOCGIFNAME, name) != 0) return std::strerror(errno);
    interface_ = name;
    shell("ip link set " + interface_ + " up");
    return {};
  }

  [[nodiscard]] const std::string& interface() const { return interface_; }

  void write(const std::string& text) const {
    EXPECT_EQ(::write(master_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  /// The next `bytes` that the driver has sent; fewer when they do not come within five seconds.
  [[nodiscard]] std::string read(std::size_t bytes) const {
    std::string text;
    pollfd wait{.fd = master_, .events = POLLIN, .revents = 0};
    while (text.size() < bytes && ::poll(&wait, 1, 5000) > 0) {
      char more[256];
      const ssize_t got = ::read(master_, more, std::min(sizeof(more), bytes - text.size()));
      if (got <= 0) break;
      text.append(more, static_cast<std::size_t>(got));
    }
    return text;
  }

  /// The interface is removed.
  void unplug() {
    if (terminal_ >= 0) ::close(terminal_);
    if (master_ >= 0) ::close(master_);
    terminal_ = master_ = -1;
  }

 private:
  int master_ = -1;
  int terminal_ = -1;
  std::string interface_;
};

}  // namespace tandem::test
