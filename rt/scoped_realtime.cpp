// The thread-local depth counter that the allocation and lock traps of tests/support read.
#include "rt/scoped_realtime.hpp"

namespace tandem::rt {
namespace {

// initial-exec: a thread-local of another model could itself allocate on first use.
__attribute__((tls_model("initial-exec"))) thread_local int depth = 0;

}  // namespace

ScopedRealtime::ScopedRealtime() noexcept TANDEM_RT { ++depth; }
ScopedRealtime::~ScopedRealtime() noexcept TANDEM_RT { --depth; }
bool in_realtime() noexcept TANDEM_RT { return depth > 0; }

}  // namespace tandem::rt
