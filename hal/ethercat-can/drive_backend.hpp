// A robot whose drives a DriveMaster leads, whatever its buses are.
// Layer: hal/ethercat-can.  Thread: as hal::Backend.
#pragma once

#include <memory>
#include <string>

#include "hal/backend.hpp"
#include "hal/ethercat-can/drive_master.hpp"

namespace tandem::hal::can {

/// What the master answers alone.
class DriveBackend : public Backend {
 public:
  [[nodiscard]] Code write(const CommandImage& command,
                           const ParameterImage& parameters) noexcept TANDEM_RT override {
    return master_->send(command, parameters);
  }
  [[nodiscard]] FaultCause fault_cause(std::size_t joint) const noexcept TANDEM_RT override {
    return master_->fault_cause(joint);
  }
  [[nodiscard]] std::string fault_text(FaultCause cause, std::uint32_t code) const override {
    return cause == FaultCause::kDrive ? DriveMaster::error_text(code)
                                       : Backend::fault_text(cause, code);
  }
  void stop(StopCategory category) noexcept TANDEM_RT override { master_->stop(category); }
  void reset() noexcept TANDEM_RT override { master_->reset(); }
  bool home(std::size_t joint) noexcept TANDEM_RT override { return master_->home(joint); }
  void stop_homing(std::size_t joint) noexcept TANDEM_RT override { master_->stop_homing(joint); }
  [[nodiscard]] Homing homing(std::size_t joint) const noexcept TANDEM_RT override {
    return master_->homing(joint);
  }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override { return master_->shut_down(); }

  [[nodiscard]] const DriveMaster& master() const noexcept { return *master_; }

 protected:
  explicit DriveBackend(std::unique_ptr<DriveMaster> master) : master_(std::move(master)) {}

  const std::unique_ptr<DriveMaster> master_;
};

}  // namespace tandem::hal::can
