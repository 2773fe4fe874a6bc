// Figures as data: curves, reference lines, labels with units. gnuplot.hpp draws them.
// Layer: report.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

namespace tandem::report {

inline constexpr double kDegrees = 180.0 / std::numbers::pi;  ///< of a radian

/// What a curve is, which decides how it looks.
enum class CurveStyle : std::uint8_t {
  kMeasured,      ///< solid, blue
  kReference,     ///< dashed, orange: what was asked for
  kComputed,      ///< dashed, orange: what a model says
  kSecond,        ///< solid, purple: the other side, or the other log
  kThird,         ///< solid, grey
  kFourth,        ///< solid, green
  kFifth,         ///< solid, brown
  kSixth,         ///< solid, light blue
  kSecondDashed,  ///< dashed, purple
  kSeventh,       ///< solid, dark orange
  kStill,         ///< solid, thin, light grey: what does not change
  kStick,         ///< solid with round joints, blue
  kStickSecond,   ///< the same, dark grey
  kStickThird,    ///< the same, light grey
};

struct Curve {
  std::string label;  ///< in the key; empty: none
  CurveStyle style = CurveStyle::kMeasured;
  std::vector<double> x;
  std::vector<double> y;  ///< as long as x; a NaN interrupts the line
  char log = 0;           ///< of several logs that of this letter: 'A'; 0: there is one
};

/// What a picture's key says of a curve: "measured, B".
[[nodiscard]] std::string key_text(const Curve& curve);

/// A text centred at a point.
struct Note {
  std::string text;
  double x = 0.0;
  double y = 0.0;
};

/// A horizontal line across the plot; its label stands in the key.
struct Level {
  std::string label;  ///< empty: none
  double y = 0.0;
};

/// A vertical line at a moment, its label in the key.
struct Mark {
  std::string label;  ///< empty: none
  double x = 0.0;
  bool fault = true;  ///< false: what happened is none
};

struct Figure {
  std::string name;  ///< file name without ending
  std::string title;
  std::string x_label;  ///< with unit
  std::string y_label;  ///< with unit
  std::vector<Curve> curves{};
  std::vector<Level> levels{};
  std::vector<Mark> marks{};
  std::vector<Note> notes{};
  std::vector<std::string> signals{};  ///< of the studio's page that have the same curves:
                                       ///< "controller/squat.depth"; empty: none have
  double range_until_x = std::numeric_limits<double>::infinity();  ///< what lies beyond it, as what
                                                                   ///< follows a fault, does not
                                                                   ///< widen the range of y
  bool log_axes = false;    ///< both logarithmic; only what is positive is drawn
  double zero_x = 0.0;      ///< of log_axes: where on x the number 0 stands; 0: nowhere
  bool points = false;      ///< a point at each sample
  bool equal_axes = false;  ///< one metre is as long across as it is up; no numbers across
};

/// Whether x is time.
[[nodiscard]] constexpr bool is_over_time(const Figure& figure) {
  return !figure.equal_axes && !figure.log_axes;
}

/// Removes curves without a number: what a log lacks, as the references of a recording.
void drop_empty_curves(Figure& figure);

/// The usual distance between neighbours: the median. 0 of less than two.
[[nodiscard]] double usual_step(std::span<const double> x);

/// A step of so many usual ones is a gap: samples are missing there.
inline constexpr double kGapSteps = 5.0;

/// Where stretches without a missing sample begin: 0, and behind every gap or step back.
[[nodiscard]] std::vector<std::size_t> stretches(std::span<const double> x);

/// Puts a NaN into every curve where samples are missing, by stretches(): its line ends there.
void break_at_gaps(Figure& figure);

/// The curve with some `most` points: the extremes of each run of samples are kept, so that no peak
/// is lost, and its gaps.
[[nodiscard]] Curve decimated(const Curve& curve, std::size_t most);

}  // namespace tandem::report
