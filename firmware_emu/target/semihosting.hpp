// Files and the last word of a program that runs under a debugger or in an emulator: Arm's
// semihosting calls ("Semihosting for AArch32 and AArch64", ABI 2023Q3).
// Layer: firmware_emu, on the target.  Thread: the only one.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tandem::firmware::target {

/// A file of the machine that the debugger runs on, through a buffer.
class HostFile {
 public:
  enum class Use : std::uint32_t { kRead = 1, kWrite = 5 };  // fopen's "rb" and "wb"

  HostFile(const char* name, Use use) noexcept;
  [[nodiscard]] bool is_open() const noexcept { return handle_ >= 0; }
  /// Fills the bytes, or writes them. @return false: the file ends before, or takes no more
  [[nodiscard]] bool raw(void* bytes, std::size_t size) noexcept;
  /// What waits in the buffer is written. @return whether it was
  [[nodiscard]] bool flush() noexcept;

 private:
  static constexpr std::size_t kBuffer = 16384;
  Use use_;
  std::int32_t handle_;
  std::size_t at_ = 0, filled_ = 0;
  std::uint8_t buffer_[kBuffer];
};

void say(const char* text) noexcept;
/// `name` and the number, on a line.
void say(const char* name, std::uint32_t value) noexcept;
[[noreturn]] void leave(bool well) noexcept;
/// Says why, and leaves.
[[noreturn]] void give_up(const char* why) noexcept;

}  // namespace tandem::firmware::target
