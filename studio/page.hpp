// The page: what the build has embedded of studio/page, or one that says how to get it.
// Layer: studio.  Thread: any; constant.
#pragma once

#include <span>
#include <string_view>

namespace tandem::studio {

struct Asset {
  std::string_view path;  ///< "/studio.js"
  std::string_view type;  ///< "text/javascript; charset=utf-8"
  std::string_view bytes;
  bool gzip = false;  ///< what `bytes` are
};

[[nodiscard]] std::span<const Asset> assets();

}  // namespace tandem::studio
