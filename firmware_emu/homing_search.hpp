// A drive's search for its home: CiA 402's methods 1 to 14, 17 to 30, 33 to 35 and 37.
// Layer: firmware_emu.  Thread: RT.
#pragma once

#include <cstdint>

#include "base/realtime.hpp"

namespace tandem {
class Archive;
}

namespace tandem::firmware {

/// What a drive sees on its way, in its own direction: a reversed one has the joint's upper limit
/// at its lower end.
struct HomingSenses {
  std::int32_t position = 0;    ///< [counts]
  bool at_low_switch = false;   ///< the limit switches at the ends of the range
  bool at_high_switch = false;  ///<
  bool at_home_switch = false;
  int index = 0;  ///< an index pulse was passed in this period: +1 upwards, -1 downwards, else 0
};

/// Stepped once per control period.
/// ```
/// kFind:   fast, the method's way, to the switch; a limit switch on the way turns it, once
/// kClear:  fast, off the switch again, for a home on the edge that is met on the way back
/// kEdge:   slowly, over the switch's edge
/// kIndex:  slowly on, to the first index pulse
/// ```
class HomingSearch {
 public:
  enum class Result : std::uint8_t { kMoves, kFound, kFailed };

  /// Whether the method is one of these.
  [[nodiscard]] static bool has(int method) noexcept TANDEM_RT;

  /// @pre has(method)
  void begin(int method) noexcept TANDEM_RT;
  /// kFailed: there is no such switch or index pulse between the limit switches.
  [[nodiscard]] Result step(const HomingSenses& seen) noexcept TANDEM_RT;

  /// Motion until the next step: direction +1 or -1; slow() with 6099:2, else with 6099:1.
  [[nodiscard]] int direction() const noexcept { return direction_; }
  [[nodiscard]] bool slow() const noexcept { return step_ == Step::kEdge || step_ == Step::kIndex; }
  /// The step() before began another leg, from rest.
  [[nodiscard]] bool turned() const noexcept { return turned_; }

  void archive(Archive& ar);

 private:
  enum class Step : std::uint8_t { kHere, kFind, kClear, kEdge, kIndex };

  void enter(Step step, int direction) noexcept;
  Result find(const HomingSenses& seen) noexcept;
  bool crosses(const HomingSenses& seen, std::int32_t way, bool closes) noexcept;

  std::int8_t method_ = 0;
  Step step_ = Step::kHere;
  std::int8_t direction_ = 0;
  bool turned_ = false;
  bool reversed_ = false;    ///< at a limit switch, in kFind
  bool was_active_ = false;  ///< the switch, in the step before
  std::int32_t was_at_ = 0;  ///< the position, in the step before
};

}  // namespace tandem::firmware
