#include "firmware_emu/target/semihosting.hpp"

#include <charconv>
#include <cstring>

namespace tandem::firmware::target {
namespace {

enum Call : std::uint32_t {
  kOpen = 0x01,
  kWriteText = 0x04,
  kWrite = 0x05,
  kRead = 0x06,
  kExit = 0x18
};

std::int32_t call(Call what, const void* with) noexcept {
  register std::uint32_t r0 asm("r0") = what;
  register const void* r1 asm("r1") = with;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return static_cast<std::int32_t>(r0);
}

}  // namespace

HostFile::HostFile(const char* name, Use use) noexcept : use_(use) {
  const std::uint32_t with[] = {reinterpret_cast<std::uintptr_t>(name),
                                static_cast<std::uint32_t>(use), std::strlen(name)};
  handle_ = call(kOpen, with);
}

bool HostFile::raw(void* bytes, std::size_t size) noexcept {
  auto* at = static_cast<std::uint8_t*>(bytes);
  for (; size > 0; --size, ++at) {
    if (use_ == Use::kWrite) {
      if (at_ == kBuffer && !flush()) return false;
      buffer_[at_++] = *at;
      continue;
    }
    if (at_ == filled_) {
      const std::uint32_t with[] = {static_cast<std::uint32_t>(handle_),
                                    reinterpret_cast<std::uintptr_t>(buffer_), kBuffer};
      filled_ = kBuffer - static_cast<std::size_t>(call(kRead, with));  // says how many it did not
      at_ = 0;
      if (filled_ == 0) return false;
    }
    *at = buffer_[at_++];
  }
  return true;
}

bool HostFile::flush() noexcept {
  const std::uint32_t with[] = {static_cast<std::uint32_t>(handle_),
                                reinterpret_cast<std::uintptr_t>(buffer_), at_};
  at_ = 0;
  return call(kWrite, with) == 0;
}

void say(const char* text) noexcept { (void)call(kWriteText, text); }

void say(const char* name, std::uint32_t value) noexcept {
  char digits[12];
  *std::to_chars(digits, digits + sizeof digits - 1, value).ptr = '\0';
  say(name);
  say(" ");
  say(digits);
  say("\n");
}

void leave(bool well) noexcept {
  constexpr std::uintptr_t kApplicationExit = 0x20026, kRunTimeError = 0x20023;
  (void)call(kExit, reinterpret_cast<const void*>(well ? kApplicationExit : kRunTimeError));
  for (;;) {
  }
}

void give_up(const char* why) noexcept {
  say(why);
  say("\n");
  leave(false);
}

}  // namespace tandem::firmware::target
