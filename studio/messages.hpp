// The studio's messages to its clients: JSON texts, and binary frames of ticks and windows.
// docs/studio.md says what each of them has.
// Layer: studio.  Thread: any.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/config/robot_config.hpp"
#include "studio/feed.hpp"
#include "studio/history.hpp"
#include "studio/signal_table.hpp"

namespace tandem::studio {

inline constexpr int kProtocol = 1;
inline constexpr char kSubprotocol[] = "tandem.studio.v1";

/// What does not change in a run.
struct RunDescription {
  hal::RobotConfig robot;    ///< `contact` is the ground that it stands on
  std::string urdf{};        ///< the description's text
  std::string urdf_file{};   ///< its path: meshes are beside it
  std::string version{};     ///< of Tandem
  std::string experiment{};  ///< its file's name
  std::string run{};         ///< 8 hexadecimal digits, drawn at its start
  bool simulated = false;    ///< its time is
  /// An emulation, boards and a plant without a cycle, has the --hal of the run that leads it.
  /// Empty: it is a run.
  std::string emulated{};
  std::int64_t period_ns = 1'000'000;
};

/// @param reach  cycles that each level of the history can hold; empty: there is none
[[nodiscard]] std::string hello_text(const RunDescription& run,
                                     std::span<const std::uint64_t> reach);
[[nodiscard]] std::string signals_text(std::uint32_t revision, const SignalTable& table);
[[nodiscard]] std::string events_text(std::span<const Event> events);
/// Time went back: what lies after `time_s` is forgotten.
[[nodiscard]] std::string back_text(double time_s, std::uint64_t cycle, double from_s);
[[nodiscard]] std::string error_text(std::string_view message, std::string_view hint);
/// @param json  the answer's text
[[nodiscard]] std::string answer_text(std::int64_t number, std::string_view json);
[[nodiscard]] std::string watched_text(std::string_view request, std::string_view json);
[[nodiscard]] std::string control_text(bool taken, bool yours, std::string_view by,
                                       bool went_back = false);
[[nodiscard]] std::string entered_text(bool all);
[[nodiscard]] std::string ended_text(std::string_view how, std::string_view log);

/// What became of some signals since a client's last frame.
struct Tick {
  bool stands = false;  ///< time does
  bool gap = false;     ///< cycles were lost before they reached the studio
  std::uint32_t revision = 0;
  std::uint64_t cycle = 0;
  double time_s = 0.0;
  std::vector<float> numbers{};  ///< of each signal least, largest, last

  /// Takes in what is before it, of the same revision: that one need not be sent any more.
  void merge_before(const Tick& earlier);
};
/// @param lost  frames that this client was not sent so far
[[nodiscard]] std::string tick_frame(const Tick& tick, std::uint32_t lost);

/// How a window begins.
struct FrameHead {
  std::uint32_t id = 0;
  std::size_t level = 0;
  std::size_t signals = 0, rows = 0;
  std::uint64_t cycles = 1;  ///< of a row
  double start_s = 0.0, step_s = 0.0;
};
/// @param numbers  signal by signal its rows: of one cycle a number, else least and largest
[[nodiscard]] std::string window_frame(const FrameHead& head, std::span<const float> numbers);
/// @param id  the question's
[[nodiscard]] std::string window_frame(std::uint32_t id, const History& history,
                                       const Window& window, std::span<const SignalId> signals,
                                       std::int64_t period_ns);

}  // namespace tandem::studio
