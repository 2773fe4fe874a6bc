// All the memory that the firmware has: it is given out while the board is made, and never again.
// Layer: firmware_emu, on the target.  Thread: the only one.
#pragma once

#include <cstdint>

namespace tandem::firmware::target {

/// From now on who asks for memory ends the program: the board is made.
void close_memory() noexcept;
[[nodiscard]] std::uint32_t memory_bytes() noexcept;

/// The deepest that the stack has been since reset.
[[nodiscard]] std::uint32_t stack_bytes() noexcept;

/// The program, which start.cpp calls when memory is there. @return 0: to the recording's end
int play_recording();

}  // namespace tandem::firmware::target
