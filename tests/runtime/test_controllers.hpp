// Controllers for tests of the loop: one that moves joints on a sine, and one that misbehaves.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "controllers/controller.hpp"

namespace tandem::runtime::test {

/// Moves its joints by 0.2 rad, 1 Hz, about where they stood.
class Sine : public Controller {
 public:
  explicit Sine(std::vector<std::size_t> joints,
                hal::ControlMode mode = hal::ControlMode::kPosition)
      : joints_(std::move(joints)), mode_(mode), middle_(joints_.size()) {}

  Status configure(ControllerSetup& setup) override {
    amplitude_rad_ = setup.parameters.number_or("amplitude_rad", 0.2, kPositive);
    for (const std::size_t joint : joints_) setup.claim(joint, mode_);
    return {};
  }
  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    ++starts;
    began_ns_ = time.time_ns;
    for (std::size_t i = 0; i < joints_.size(); ++i) middle_[i] = state.position_rad()[joints_[i]];
  }
  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    ++updates;
    while (hangs) {
    }
    if (allocates) last_words_ = std::make_unique<int>(updates);
    if (answer != Code::kOk) return answer;
    const double t = static_cast<double>(time.time_ns - began_ns_) * 1e-9;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      command.position_rad()[joints_[i]] = middle_[i] + amplitude_rad_ * std::sin(6.283 * t);
      if (not_finite) {
        command.position_rad()[joints_[i]] = std::numeric_limits<double>::quiet_NaN();
      }
    }
    return Code::kOk;
  }
  bool can_retreat() const noexcept override { return retreats; }
  bool retreat(const hal::CycleTime&, const hal::StateImage&) noexcept override {
    if (retreats) ++retreating;
    return retreats;
  }
  void stop() noexcept override { ++stops; }
  void archive(Archive& ar) override { ar(began_ns_, middle_); }

  Code answer = Code::kOk;
  bool retreats = false;  ///< it can
  int retreating = 0;     ///< calls of retreat() that it answered so
  bool not_finite = false, allocates = false;
  std::atomic<bool> hangs{false};  ///< the next update() does not return while it is set
  int updates = 0, starts = 0, stops = 0;

 private:
  std::vector<std::size_t> joints_;
  hal::ControlMode mode_;
  double amplitude_rad_ = 0.0;
  std::int64_t began_ns_ = 0;
  std::vector<double> middle_;
  std::unique_ptr<int> last_words_;
};

/// Runs joint 0 up to a speed within 0.2 s, and on.
class Runner : public Controller {
 public:
  /// @param says_speed  it writes the velocity's reference, too
  explicit Runner(double speed_rad_s, bool says_speed = true)
      : speed_rad_s_(speed_rad_s), says_speed_(says_speed) {}
  Status configure(ControllerSetup& setup) override {
    setup.claim(0, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    place_rad_ = state.position_rad()[0];
    cycles_ = 0;
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    const double x = std::min(1.0, ++cycles_ / 200.0);
    const double speed = speed_rad_s_ * x * x * (3.0 - 2.0 * x);
    place_rad_ += speed * 1e-3;
    command.position_rad()[0] = place_rad_;
    if (says_speed_) command.velocity_rad_s()[0] = speed;
    return ends ? Code::kStopped : Code::kOk;
  }
  bool ends = false;  ///< it is done, in motion

 private:
  double speed_rad_s_;
  bool says_speed_;
  double place_rad_ = 0.0;
  int cycles_ = 0;
};

/// Keeps joint 0 where it was at the start, or 0.2 rad below.
class Keeper : public Controller {
 public:
  explicit Keeper(bool goes_back = false) : goes_back_(goes_back) {}
  Status configure(ControllerSetup& setup) override {
    setup.claim(0, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept override {
    place_rad_ = state.position_rad()[0] - (goes_back_ ? 0.2 : 0.0);
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    command.position_rad()[0] = place_rad_;
    command.velocity_rad_s()[0] = 0.0;
    return Code::kOk;
  }

 private:
  bool goes_back_;
  double place_rad_ = 0.0;
};

/// Claims one joint and writes every field of every joint, in start() and update().
class Stray : public Controller {
 public:
  /// @param chooses  it claims its joint with its modes
  Stray(std::size_t joint, bool chooses) : joint_(joint), chooses_(chooses) {}

  Status configure(ControllerSetup& setup) override {
    if (chooses_) {
      setup.claim_with_modes(joint_, hal::ControlMode::kPosition);
    } else {
      setup.claim(joint_, hal::ControlMode::kPosition);
    }
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage& command) noexcept override {
    scribble(command);
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    scribble(command);
    return Code::kOk;
  }

  hal::ControlMode mode = hal::ControlMode::kTorque;
  double value = 0.07;
  bool scribbles = true;

 private:
  void scribble(hal::CommandImage& command) const noexcept {
    if (!scribbles) return;
    for (std::size_t j = 0; j < command.joints(); ++j) {
      command.position_rad()[j] = value;
      command.velocity_rad_s()[j] = value;
      command.torque_Nm()[j] = value;
      command.voltage_V()[j] = value;
      command.current_A()[j] = value;
      command.stiffness_Nm_rad()[j] = value;
      command.damping_Nms_rad()[j] = value;
      command.mode()[j] = static_cast<std::int8_t>(mode);
      command.interaction()[j] = 1;
      command.fault_reset()[j] = 1;
    }
  }

  std::size_t joint_;
  bool chooses_;
};

/// Claims one joint, and sets the gains of another, or of the same, in its first update().
class Tuner : public Controller {
 public:
  Tuner(std::size_t joint, std::size_t tuned, hal::PidGains gains)
      : joint_(joint), tuned_(tuned), wanted_(gains) {}

  Status configure(ControllerSetup& setup) override {
    setup.claim(joint_, hal::ControlMode::kPosition);
    gains_ = &setup.gains;
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    if (!done_) gains_->set_gains(tuned_, hal::PidLoop::kPosition, wanted_);
    done_ = true;
    return Code::kOk;
  }

 private:
  std::size_t joint_, tuned_;
  hal::PidGains wanted_;
  hal::ParameterImage* gains_ = nullptr;
  bool done_ = false;
};

/// Parameters without a file.
inline TomlTable parameters(const std::string& text = "") {
  return TomlDocument::parse(text, "x.toml")->root();
}

}  // namespace tandem::runtime::test
