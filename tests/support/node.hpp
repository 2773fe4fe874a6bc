// The JavaScript of other projects as a witness.
// Layer: tests.  Thread: any.
#pragma once

namespace tandem::test {

/// The program node, for a test of tandem_uses_node(); null: it is not installed.
#ifdef TANDEM_NODE
inline constexpr const char* kNode = TANDEM_NODE;
#else
inline constexpr const char* kNode = nullptr;
#endif

}  // namespace tandem::test
