// How much machine code each kernel of a library is, by the library's own symbol table.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "base/result.hpp"

namespace tandem::apps {

/// Bytes of machine code by kernel, of one variant: a kernel's entry and its parts, which are
/// functions KERNEL and KERNEL_0, KERNEL_1, … in a namespace that is named after the variant.
/// Errors: no ELF file for this kind of machine; no symbol table (stripped).
[[nodiscard]] Result<std::map<std::string, std::uint64_t>> kernel_text_bytes(
    const std::string& library, const std::string& variant);

}  // namespace tandem::apps
