// Loads a shared library as it is on the disk now, whatever of it the process had opened before.
// Layer: controllers.  Thread: any, non-RT.
#pragma once

#include <string>

#include "base/result.hpp"
#include "base/trusted_code.hpp"

namespace tandem {

/// As dlopen(), which gives what it has under the same name: code that was built anew since would
/// not run as long as the former one is mapped. It is while a controller of it is loaded, and for
/// ever where it has symbols that are one for the whole process (STB_GNU_UNIQUE). Such a library is
/// opened beside the former one here.
///
/// A library that it names as needed, and of which the program has another version, is loaded for
/// it alone: each calls its own. (What it allocates by malloc() is then not seen by traps.)
///
/// Errors: TrustedCode::load()'s; it was overwritten in place while its former code is mapped; a
/// variable is unique, so that the new code would have the former one's; a library that it needs
/// was built anew, and is mapped as it was; one that it brings without naming it would call the
/// program's version of it; another library, which is named, has not returned from its static
/// initialisers or its clean-up, and its call was given up.
[[nodiscard]] Result<void*> load_newest(const TrustedCode& code);

/// dlclose(), for at most 4 s. What does not return by then, and what is closed while another
/// library does not, stays mapped.
void close_library(void* library, const std::string& path) noexcept;

}  // namespace tandem
