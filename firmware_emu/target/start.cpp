// From reset to play_recording(): vectors, floating-point unit, memory, constructors.
// Layer: firmware_emu, on the target.
#include <algorithm>
#include <cstdint>

#include "firmware_emu/target/memory.hpp"
#include "firmware_emu/target/semihosting.hpp"

// These are the linker script's.
extern "C" {
extern std::uint32_t data_from, data_begin, data_end, bss_begin, bss_end, stack_begin, stack_top;
extern void (*init_begin[])();
extern void (*init_end[])();
}

namespace {

using namespace tandem::firmware;

constexpr std::uint32_t kUnusedStack = 0x5AFE'5AFE;

[[noreturn]] void reset() {
  auto* const coprocessors = reinterpret_cast<volatile std::uint32_t*>(0xE000'ED88);  // CPACR
  *coprocessors = *coprocessors | (0xFU << 20);
  asm volatile("dsb\n isb" ::: "memory");
  std::copy(&data_from, &data_from + (&data_end - &data_begin), &data_begin);
  std::fill(&bss_begin, &bss_end, 0U);
  std::uint32_t* here;
  asm volatile("mov %0, sp" : "=r"(here));
  std::fill(&stack_begin, here - 64, kUnusedStack);  // what of it is used later: stack_bytes()
  std::for_each(init_begin, init_end, [](void (*construct)()) { construct(); });
  target::leave(target::play_recording() == 0);
}

[[noreturn]] void fault() { target::give_up("the processor has met a fault"); }

}  // namespace

namespace tandem::firmware::target {

std::uint32_t stack_bytes() noexcept {
  const std::uint32_t* used = std::find_if(&stack_begin, &stack_top,
                                           [](std::uint32_t word) { return word != kUnusedStack; });
  return static_cast<std::uint32_t>(&stack_top - used) * sizeof(std::uint32_t);
}

}  // namespace tandem::firmware::target

/// The Armv7-M vector table: the stack's top, reset, and the system's 14 exceptions.
extern "C" {
[[gnu::section(".vectors"), gnu::used]] extern const void* const vectors[16] = {
    &stack_top,
    reinterpret_cast<const void*>(&reset),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
    reinterpret_cast<const void*>(&fault),
};
}
