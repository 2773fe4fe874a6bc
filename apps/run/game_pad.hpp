// Game pads of this machine, as Linux' event devices, that feed inputs of a run's controllers.
// Layer: apps/run.  Thread: opened and closed by main; one of its own reads them all.
#pragma once

#include <linux/input.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/open_file.hpp"
#include "base/result.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// One axis or button, and the component that it is.
struct PadPart {
  std::size_t component = 0;
  std::uint16_t type = EV_ABS;  ///< or EV_KEY
  std::uint16_t code = 0;
  double gain = 1.0;            ///< at the end of its way; negative: the other direction
  double min = 0.0, max = 1.0;  ///< raw
  double raw = 0.0;

  /// @param deadband  share of its way about the middle, of an axis
  [[nodiscard]] double value(double deadband) const;
};

/// "-ABS_Y 0.5", "BTN_SOUTH" for a component. Errors: no such axis or button (the nearest is
/// suggested); another number than one.
[[nodiscard]] Result<PadPart> parse_pad_part(const std::string& text);

/// What a pad's events make of its parts.
class GamePad {
 public:
  GamePad(Descriptor device, std::shared_ptr<runtime::InputPort> port, std::vector<PadPart> parts)
      : device_(std::move(device)), port_(std::move(port)), parts_(std::move(parts)) {}

  /// Opens the device that an input names, as it stands: a button may be down. Errors: there is
  /// none, or it may not be read; it is no event device; it lacks an axis or button; the input has
  /// no such component, or it would be beyond its bounds.
  [[nodiscard]] static Result<GamePad> open(std::shared_ptr<runtime::InputPort> port);

  /// -1: the pad is gone.
  [[nodiscard]] int descriptor() const noexcept { return device_.get(); }
  /// Reads what waits, and offers a sample at the end of each report. False: the pad is gone, which
  /// its input says.
  bool read();
  /// Opens it again, where it is there again. What else is wrong with it then its input says.
  void look_for();
  /// Offers the state as it is, when it is a while since the last time: a stick that does not move
  /// sends nothing.
  void offer_again();

 private:
  void offer();
  bool read_events();
  bool take(const input_event& event);
  bool look();

  Descriptor device_;
  std::shared_ptr<runtime::InputPort> port_;
  std::vector<PadPart> parts_;
  bool dropped_ = false;  // the kernel lost events: until the report's end they mean nothing
  std::string missed_;    // what was told of a pad that is gone
  std::chrono::steady_clock::time_point offered_, looked_for_;
};

/// One that is pulled out falls silent, so that its input times out; plugged in again it goes on.
class GamePads {
 public:
  /// The pads of every input whose source is one; null when none is. Errors: GamePad::open()'s,
  /// with the place in the experiment.
  [[nodiscard]] static Result<std::unique_ptr<GamePads>> open(runtime::RunServices& services);
  ~GamePads();
  GamePads(const GamePads&) = delete;
  GamePads& operator=(const GamePads&) = delete;

 private:
  GamePads() = default;
  void run();

  std::vector<GamePad> pads_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace tandem::apps
