// Instead of the libraries' operator new, whose heap is not linked, and of what they throw with.
#include "firmware_emu/target/memory.hpp"

#include <bits/functexcept.h>

#include <cstddef>
#include <new>

#include "firmware_emu/target/semihosting.hpp"

namespace tandem::firmware::target {
namespace {

constexpr std::size_t kBytes = 96 * 1024;
alignas(std::max_align_t) std::byte memory[kBytes];
std::size_t given = 0;
bool closed = false;

void* give(std::size_t size) noexcept {
  constexpr std::size_t kAlign = alignof(std::max_align_t);
  size = (size + kAlign - 1) / kAlign * kAlign;
  if (closed) give_up("memory was asked for after the board was made");
  if (size > kBytes - given) give_up("the board needs more memory than there is");
  void* const at = memory + given;
  given += size;
  return at;
}

}  // namespace

void close_memory() noexcept { closed = true; }
std::uint32_t memory_bytes() noexcept { return static_cast<std::uint32_t>(given); }

}  // namespace tandem::firmware::target

using tandem::firmware::target::give_up;

void* operator new(std::size_t size) { return tandem::firmware::target::give(size); }
void* operator new[](std::size_t size) { return tandem::firmware::target::give(size); }
void operator delete(void*) noexcept {}
void operator delete[](void*) noexcept {}
void operator delete(void*, std::size_t) noexcept {}
void operator delete[](void*, std::size_t) noexcept {}

namespace std {
void __throw_length_error(const char* what) { give_up(what); }
void __throw_logic_error(const char* what) { give_up(what); }
void __throw_out_of_range_fmt(const char* what, ...) { give_up(what); }
void __throw_bad_function_call() { give_up("an empty function was called"); }
void __throw_bad_alloc() { give_up("memory"); }
void __throw_bad_array_new_length() { give_up("memory"); }
}  // namespace std

extern "C" {
void __cxa_pure_virtual() { give_up("a pure virtual function was called"); }
void __cxa_atexit() {}  // nothing ends here
void* __dso_handle = nullptr;
void abort() { give_up("abort"); }
}
