#include "tests/apps/fake_event_device.hpp"

#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstring>

namespace tandem::apps {
namespace {

bool is_pipe(int descriptor) {
  struct stat is {};
  return ::fstat(descriptor, &is) == 0 && S_ISFIFO(is.st_mode);
}

int failed(int error) {
  errno = error;
  return -1;
}

int put_bits(const std::set<int>& codes, unsigned long request, void* to) {
  auto* bytes = static_cast<unsigned char*>(to);
  std::memset(bytes, 0, _IOC_SIZE(request));
  for (const int code : codes) bytes[code / 8] |= static_cast<unsigned char>(1 << code % 8);
  return static_cast<int>(_IOC_SIZE(request));
}

int answer(unsigned long request, void* to) {
  const FakeEventDevice& device = FakeEventDevice::now();
  const auto number = static_cast<int>(_IOC_NR(request));
  if (_IOC_TYPE(request) != 'E') return failed(ENOTTY);
  if (number == EV_ABS + 0x20 || number == EV_KEY + 0x20) {  // EVIOCGBIT
    if (!device.knows_capabilities) return failed(ENOTTY);
    std::set<int> axes;
    for (const auto& [code, info] : device.axes) axes.insert(code);
    return put_bits(number == EV_KEY + 0x20 ? device.buttons : axes, request, to);
  }
  if (!device.knows_state) return failed(ENODEV);
  if (number == 0x18) return put_bits(device.down, request, to);  // EVIOCGKEY
  const auto axis = device.axes.find(number - 0x40);              // EVIOCGABS
  if (number < 0x40 || axis == device.axes.end()) return failed(EINVAL);
  std::memcpy(to, &axis->second, sizeof axis->second);
  return 0;
}

}  // namespace

FakeEventDevice& FakeEventDevice::now() {
  static FakeEventDevice device;
  return device;
}

}  // namespace tandem::apps

extern "C" int ioctl(int descriptor, unsigned long request, ...) noexcept {
  std::va_list list;
  va_start(list, request);
  void* const to = va_arg(list, void*);
  va_end(list);
  if (tandem::apps::is_pipe(descriptor)) return tandem::apps::answer(request, to);
  return static_cast<int>(::syscall(SYS_ioctl, descriptor, request, to));
}

extern "C" ssize_t read(int descriptor, void* to, std::size_t bytes) {
  if (tandem::apps::FakeEventDevice::now().pulled_out && tandem::apps::is_pipe(descriptor)) {
    return tandem::apps::failed(ENODEV);
  }
  return ::syscall(SYS_read, descriptor, to, bytes);
}
