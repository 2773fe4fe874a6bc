// A robot that does what a log says it did, whatever it is commanded.
// Layer: runtime/replay.  Thread: as hal::Backend; begin() the loop's, between two cycles.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/backend.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/truth.hpp"
#include "runtime/replay/recorded_run.hpp"

namespace tandem::runtime {

/// Bytes of a logged image as an image of this program: by the fields' names.
class ImageCopy {
 public:
  /// @param from  the log's; outlives it, as `to` does
  ImageCopy(const hal::Layout& from, const hal::Layout& to);
  void operator()(std::span<const std::byte> body, std::span<std::byte> image) const noexcept;
  /// Fields of the image that the log does not have.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

 private:
  struct Piece {
    std::size_t from, to, bytes;
  };
  std::vector<Piece> pieces_;
  std::size_t least_ = 0;  // bytes of a body that has all
  std::vector<std::string> missing_;
};

/// States are the log's. Phases, faults and their causes, homing and the link follow from its
/// events: a drive that answers is one whose answer was recorded in this cycle.
class RecordedRobot final : public hal::Backend {
 public:
  /// @param pace  the recorded robot's
  RecordedRobot(const hal::RobotConfig& robot, hal::Pace pace, const RecordedRun& run);

  /// The next exchange() and read() are those of `cycle`, which stays until then.
  void begin(const RecordedCycle& cycle);
  /// The simulation's, where the log has one; else null.
  [[nodiscard]] const hal::TruthImage* truth() const noexcept { return truth_.get(); }
  /// Fields of the state that the log lacks.
  [[nodiscard]] const std::vector<std::string>& missing() const { return copy_.missing(); }

  [[nodiscard]] hal::Pace pace() const noexcept override { return pace_; }
  [[nodiscard]] hal::Phase phase() const noexcept override { return phase_; }
  [[nodiscard]] std::string status_text() const override { return "as recorded"; }
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage&,
                           const hal::ParameterImage&) noexcept TANDEM_RT override {
    return Code::kOk;
  }
  [[nodiscard]] hal::FaultCause fault_cause(std::size_t joint) const noexcept TANDEM_RT override {
    return causes_[joint];
  }
  void stop(hal::StopCategory category) noexcept TANDEM_RT override;
  void reset() noexcept TANDEM_RT override;
  bool home(std::size_t joint) noexcept TANDEM_RT override;
  void stop_homing(std::size_t) noexcept TANDEM_RT override {}
  [[nodiscard]] hal::Homing homing(std::size_t joint) const noexcept TANDEM_RT override {
    return homing_[joint];
  }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override { return off_; }
  [[nodiscard]] std::uint64_t missed() const noexcept TANDEM_RT override { return missed_; }
  [[nodiscard]] hal::FaultCause link_loss() const noexcept TANDEM_RT override { return loss_; }
  [[nodiscard]] bool archive(Archive&) override { return false; }

 private:
  void follow(const log::EventText& one, bool stopped);

  const hal::Pace pace_;
  hal::StateImage shape_;  // for its layout
  ImageCopy copy_;
  std::unique_ptr<hal::TruthImage> truth_;
  std::unique_ptr<ImageCopy> truth_copy_;
  const RecordedCycle* now_ = nullptr;
  std::uint64_t missed_ = 0;
  hal::Phase phase_ = hal::Phase::kBringUp;
  Code code_ = Code::kOk;
  bool resetting_ = false, off_ = false;
  hal::FaultCause loss_ = hal::FaultCause::kNone;
  std::vector<hal::FaultCause> causes_;
  std::vector<hal::Homing> homing_;
};

}  // namespace tandem::runtime
