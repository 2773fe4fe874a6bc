// The C library's calls that have no place in a cycle, interposed: rt/trap_calls.cpp, linked into a
// test, or loaded before all else into a run with --gate. Whoever links it takes notes.
// Layer: rt.  Thread: any.
#pragma once

namespace tandem::rt {

/// Defined by who links the traps: `call` ("malloc") is about to be made. It must not allocate.
void note_trapped_call(const char* call) noexcept;

/// False in sanitizer builds, whose run-time interposes the same functions itself.
[[nodiscard]] bool traps_calls() noexcept;

}  // namespace tandem::rt
