// Loops over arrays in the widest vectors that the CPU has.
// Layer: base.  Thread: any.
#pragma once

/// TANDEM_WIDE before a function whose loops treat every element alike: g++ compiles it for AVX2 as
/// well, and the CPU's is called. Elements are computed as without it, so results have the same
/// bits. TANDEM_EACH_ALONE before a loop: no element that it writes is another's input.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__OPTIMIZE__)
#define TANDEM_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define TANDEM_WIDE
#endif
#if defined(__GNUC__) && !defined(__clang__)
#define TANDEM_EACH_ALONE _Pragma("GCC ivdep")
#else
#define TANDEM_EACH_ALONE
#endif
