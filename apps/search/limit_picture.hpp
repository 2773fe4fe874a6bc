// A picture of limits by direction: how hard a push, which way, and when.
// Layer: apps/search.  Thread: any.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {

/// What was found in one direction.
struct LimitInDirection {
  double x = 0.0, y = 0.0;         ///< of what is scaled, at factor 1: x forwards, y to the left
  std::optional<double> passed{};  ///< the greatest factor that passed
  std::optional<double> failed{};  ///< the least that failed
};

/// Those that belong together.
struct LimitPanel {
  std::string title;
  std::vector<LimitInDirection> directions;
};

struct LimitPicture {
  std::string title, below;  ///< a line each
  std::string unit;          ///< of what is drawn: "Ns/kg"
  double scale = 1.0;        ///< from what was given to that
  std::vector<LimitPanel> panels;
};

/// Whether limits of a study can be drawn: directions of `key`, and a panel for each value of the
/// other [[vary]].
/// Errors: directions are no lists of two or three numbers; there are more than two [[vary]].
[[nodiscard]] Status can_be_drawn(const sweep::Study& study, const std::string& key);
/// The panels. @param limits  by the points of the study: the greatest that passed, the least that
/// failed. @pre can_be_drawn()
[[nodiscard]] std::vector<LimitPanel> panels_of(
    const sweep::Study& study, const std::string& key,
    const std::vector<std::pair<std::optional<double>, std::optional<double>>>& limits);

/// The unit that a key's name ends with: "Ns" of "push.bump.impulse_Ns"; empty: none.
[[nodiscard]] std::string unit_of_key(const std::string& key);

/// In SVG, which stands by itself: a plot in polar coordinates for each panel.
[[nodiscard]] std::string drawn(const LimitPicture& picture);

}  // namespace tandem::apps
