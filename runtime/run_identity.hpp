// What makes a run the function that it is: a snapshot fits only where all of it is the same.
// Layer: runtime.  Thread: made non-RT; archive() the loop's.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/archive.hpp"

namespace tandem::runtime {

/// Named hashes of whatever the next cycle follows from and no snapshot holds: robot, kernels,
/// plant, options. Of a cycle that nobody names anything of: none.
class RunIdentity {
 public:
  /// `what`, in one piece or several: the same name again adds to it. A difference is told of the
  /// name that was added first.
  void add(std::string_view name, std::string_view what);
  /// Name of the first part that `other` has otherwise, or that one of them lacks; empty: they are
  /// the same.
  [[nodiscard]] std::string difference(const RunIdentity& other) const;
  /// Writing takes no heap of its own. What is read may be anybody's bytes.
  void archive(Archive& ar);

 private:
  struct Part {
    std::array<char, 56> name{};  ///< what does not fit is left out
    std::uint64_t hash = 0xCBF29CE484222325U;
    [[nodiscard]] std::string_view text() const;
  };
  [[nodiscard]] const Part* find(std::string_view name) const;

  std::vector<Part> parts_;
};

}  // namespace tandem::runtime
