// A folder of this process alone in the machine's temporary one, gone at the end.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <string>
#include <utility>

#include "base/result.hpp"

namespace tandem {

class TemporaryFolder {
 public:
  /// @param purpose  for who looks there: "runs" makes tandem-runs-XXXXXX
  explicit TemporaryFolder(const std::string& purpose);
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  ~TemporaryFolder();

  /// Errors: none can be made.
  [[nodiscard]] Status made() const;
  /// Empty: none could be made.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// A name in it; empty: there is none.
  [[nodiscard]] std::string below(const std::string& name) const {
    return path_.empty() ? std::string() : path_ + "/" + name;
  }

 private:
  std::string path_;
};

}  // namespace tandem
