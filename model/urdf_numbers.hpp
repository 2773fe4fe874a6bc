// Numbers in the attributes of a URDF.
// Layer: model, private to urdf*.cpp.  Thread: any.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::model {

/// The words of a text that has numbers. urdfdom takes blanks between them only: with a tab, or a
/// blank at the end, it leaves a link's inertial out and says nothing that is an error.
[[nodiscard]] std::vector<std::string> words_of(std::string_view text);

enum class NumberKind : std::uint8_t {
  kFinite,    ///< at most 1e30, so that no product of a few overflows
  kEndless,   ///< infinite, NaN, or beyond 1e30
  kNoNumber,  ///< the value is not to be used
};

struct NumberText {
  NumberKind kind = NumberKind::kNoNumber;
  double value = 0.0;  ///< of kEndless: as far as it can be had, ±infinity or NaN, too
};

/// Takes what C's scanf() takes of a decimal number, and a leading '+'.
[[nodiscard]] NumberText number_of(std::string_view word);

}  // namespace tandem::model
