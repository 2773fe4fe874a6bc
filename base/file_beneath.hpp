// Files of one folder and those below it, asked for by somebody who may read nothing else.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/result.hpp"

namespace tandem {

/// The whole content of `folder`/`way`. No way leads out of the folder: each part is opened in the
/// one before, and none of them may be "..", ".", empty or a link.
/// @param way  "meshes/foot.stl"
/// Errors: such a part; what is not there, no regular file, or larger than `most_bytes`.
[[nodiscard]] Result<std::string> read_beneath(const std::string& folder, std::string_view way,
                                               std::uint64_t most_bytes);

}  // namespace tandem
