// The studio of an emulation: the plant's truth and what its boards say, step by step.
// Layer: apps/run.  Thread: main; stepped() the emulation's, which is main's too.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "base/result.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/sim/boards.hpp"
#include "hal/sim/emulator.hpp"
#include "hal/sim/plant_changes.hpp"
#include "hal/sim/truth.hpp"
#include "studio/studio.hpp"

namespace tandem::apps {

class EmulationStudio final : public sim::StepWatcher {
 public:
  /// What is shown.
  struct Subject {
    const hal::RobotConfig& config;
    std::string urdf;  ///< the description's text
    std::string file;  ///< that the user named
    std::int64_t period_ns;
    bool lockstep;
    sim::EmulatedRobot& robot;         ///< outlives the studio
    const sim::PlantChanges* changes;  ///< of the plant; null: there are none
    /// By bus; null: its load is not measured. Outlive the studio.
    std::vector<hal::can::Bus*> wires;
  };
  /// Listens, and answers. Takes all the memory of it. Before the first step, and before this
  /// thread gets the emulation's priority, which the studio's thread would inherit.
  /// Errors: studio::Studio::open()'s; no memory.
  [[nodiscard]] static Result<std::unique_ptr<EmulationStudio>> open(const StudioOptions& options,
                                                                     Subject subject);
  ~EmulationStudio() override;

  [[nodiscard]] std::string address() const { return studio_->address(); }
  /// @rt copies images into a ring
  void stepped(const sim::EmulatorStatistics& so_far, bool synced) noexcept TANDEM_RT override;
  /// Between two steps: something happened that the images do not say, as an injected fault.
  void tell(const std::string& text);
  /// When there are no more steps.
  void finish(const std::string& how) { studio_->finish(how, ""); }

 private:
  class Happenings;

  EmulationStudio(const Subject& subject, std::size_t feet, std::size_t loops, std::size_t passive);
  void show(const hal::CycleTime& time) noexcept TANDEM_RT;

  sim::EmulatedRobot* robot_;
  std::int64_t period_ns_;
  std::vector<hal::can::Bus*> wires_;
  sim::TruthFiller truth_filler_;
  sim::BoardsFiller boards_filler_;
  hal::TruthImage truth_;
  hal::BoardsImage boards_;
  std::uint64_t frames_in_ = 0, frames_out_ = 0, frames_lost_ = 0;  // until the step before
  std::shared_ptr<Happenings> happenings_;
  std::unique_ptr<studio::Studio> studio_;
};

}  // namespace tandem::apps
