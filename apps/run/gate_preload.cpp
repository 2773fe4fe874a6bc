// tandem_gate.so, which a run with --gate is started with (LD_PRELOAD): the C library's calls that
// have no place in a cycle come by here, and are told to the program.
#include <atomic>

#include "rt/trap_calls.hpp"

namespace {

std::atomic<void (*)(const char*)> listener{nullptr};

}  // namespace

/// From now on `note` hears of each call, on its thread, before it is made.
extern "C" __attribute__((visibility("default"))) void tandem_gate_tell(void (*note)(const char*)) {
  listener.store(note);
}

void tandem::rt::note_trapped_call(const char* call) noexcept {
  if (auto* const note = listener.load(std::memory_order_relaxed)) note(call);
}
