// Loads a shared library as it is on the disk now, whatever of it the process had opened before.
// Layer: controllers.  Thread: any, non-RT.
#pragma once

#include "base/result.hpp"
#include "base/trusted_code.hpp"

namespace tandem {

/// As dlopen(), which gives what it has under the same name: code that was built anew since would
/// not run as long as the former one is mapped. It is while a controller of it is loaded, and for
/// ever where it has symbols that are one for the whole process (STB_GNU_UNIQUE). Such a library is
/// opened beside the former one here.
///
/// Errors: TrustedCode::load()'s; it was overwritten in place while its former code is mapped;
/// a variable of its own is unique, so that the new code would have the former one's.
[[nodiscard]] Result<void*> load_newest(const TrustedCode& code);

}  // namespace tandem
