// What `tandem top` shows: one look at a run, as the lines of a screen.
// Layer: apps/clients.  Thread: any; plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "apps/text/console.hpp"

namespace tandem::apps {

/// Answers of a run to questions that only read: docs/json.md.
struct TopLook {
  Json loop;         ///< loop.show
  Json clock;        ///< clock.show
  Json controllers;  ///< controller.list
  Json joints;       ///< joint.list
  Json faults;       ///< fault.show
};

/// By what the joints are sorted: the robot's order, their names, or the largest magnitude first.
enum class TopSort : std::uint8_t {
  kRobot,
  kName,
  kError,  ///< position against reference
  kVelocity,
  kTorque,
  kCurrent,
  kTemperature,
  kAge
};
inline constexpr int kTopSorts = 8;
[[nodiscard]] const char* to_string(TopSort sort);

/// How the user wants to see it.
struct TopView {
  static constexpr std::size_t kAnyWidth = 10'000;

  std::size_t width = kAnyWidth;  ///< columns; as many as all texts need, if that is less
  std::size_t height = 0;         ///< lines; 0: as many as it takes, and no line about keys
  bool dims = false;              ///< bold and dim are there
  bool colours = false;           ///< red is there
  std::string filter{};           ///< part of the names of the joints that are shown
  TopSort sort = TopSort::kRobot;
  std::size_t first = 0;  ///< joints that are scrolled away
  bool typing = false;    ///< the filter is being typed
  bool frozen = false;
  bool help = false;
  double old_s = 0.0;  ///< time since the last answer of the run

  /// What a key does, as a terminal sends it: one byte, or the several of an arrow.
  /// @return false: it ends the program
  bool press(std::string_view key);
};

/// From then on a look without an answer is called old [s].
inline constexpr double kTopOld_s = 1.0;

enum class TopStyle : std::uint8_t { kPlain, kHead, kDim, kAlarm };
struct TopLine {
  std::string text;
  TopStyle style = TopStyle::kPlain;
};

/// The lines, none wider than view.width, and no more of them than view.height.
[[nodiscard]] std::vector<TopLine> top_lines(const TopLook& look, const TopView& view);
/// A line for a terminal: bold, dim and red as far as `view` has them.
[[nodiscard]] std::string painted(const TopLine& line, const TopView& view);

/// The joints of a look that the filter leaves, sorted.
[[nodiscard]] std::vector<Json> top_joints(const TopLook& look, const TopView& view);
/// A heading, and a line for each joint.
[[nodiscard]] std::vector<TopLine> joint_table(const std::vector<Json>& joints,
                                               const TopView& view);

}  // namespace tandem::apps
