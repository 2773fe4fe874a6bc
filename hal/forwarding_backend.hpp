// A backend that stands before another one: every call is passed on.
// Layer: hal.  Thread: as hal::Backend.
#pragma once

#include <string>

#include "hal/backend.hpp"

namespace tandem::hal {

/// Passes every call on to `to`, which outlives it, unchanged. Who stands between a loop and its
/// robot derives from it and overrides what it changes, so that a call that is new in Backend
/// reaches the robot by itself. What each call means: hal/backend.hpp.
class ForwardingBackend : public Backend {
 public:
  explicit ForwardingBackend(Backend& to) : to_(&to) {}

  [[nodiscard]] Pace pace() const noexcept override { return to_->pace(); }
  [[nodiscard]] Phase phase() const noexcept override { return to_->phase(); }
  [[nodiscard]] std::string status_text() const override { return to_->status_text(); }
  [[nodiscard]] bool waits_for_bus() const noexcept override { return to_->waits_for_bus(); }
  void exchange(const CycleTime& time) noexcept override { to_->exchange(time); }
  [[nodiscard]] Code read(const CycleTime& time, StateImage& state) noexcept TANDEM_RT override {
    return to_->read(time, state);
  }
  [[nodiscard]] Code write(const CommandImage& command,
                           const ParameterImage& parameters) noexcept TANDEM_RT override {
    return to_->write(command, parameters);
  }
  [[nodiscard]] FaultCause fault_cause(std::size_t joint) const noexcept TANDEM_RT override {
    return to_->fault_cause(joint);
  }
  [[nodiscard]] std::string fault_text(FaultCause cause, std::uint32_t code) const override {
    return to_->fault_text(cause, code);
  }
  void stop(StopCategory category) noexcept TANDEM_RT override { to_->stop(category); }
  void reset() noexcept TANDEM_RT override { to_->reset(); }
  [[nodiscard]] bool resets_one_joint() const noexcept TANDEM_RT override {
    return to_->resets_one_joint();
  }
  bool home(std::size_t joint) noexcept TANDEM_RT override { return to_->home(joint); }
  void stop_homing(std::size_t joint) noexcept TANDEM_RT override { to_->stop_homing(joint); }
  [[nodiscard]] Homing homing(std::size_t joint) const noexcept TANDEM_RT override {
    return to_->homing(joint);
  }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override { return to_->shut_down(); }
  void last_command(const CommandImage& command) noexcept TANDEM_RT override {
    to_->last_command(command);
  }
  [[nodiscard]] bool command_in_force(CommandImage& command) const noexcept TANDEM_RT override {
    return to_->command_in_force(command);
  }
  [[nodiscard]] std::uint64_t missed() const noexcept TANDEM_RT override { return to_->missed(); }
  [[nodiscard]] std::int64_t clock_shift_ns() const noexcept TANDEM_RT override {
    return to_->clock_shift_ns();
  }
  [[nodiscard]] FaultCause link_loss() const noexcept TANDEM_RT override {
    return to_->link_loss();
  }
  bool set_link(const LinkChange& change) noexcept TANDEM_RT override {
    return to_->set_link(change);
  }
  [[nodiscard]] InjectedFault next_injected() noexcept TANDEM_RT override {
    return to_->next_injected();
  }
  void heed(Outside& outside) noexcept override { to_->heed(outside); }
  std::size_t forget_waiting() noexcept override { return to_->forget_waiting(); }
  [[nodiscard]] bool archive(Archive& ar) override { return to_->archive(ar); }
  [[nodiscard]] Result<KeptElsewhere> keep() override { return to_->keep(); }
  [[nodiscard]] Status go_back(const KeptElsewhere& kept) override { return to_->go_back(kept); }
  void forget(const KeptElsewhere& kept) noexcept override { to_->forget(kept); }

 protected:
  [[nodiscard]] Backend& to() const noexcept { return *to_; }

 private:
  Backend* to_;
};

}  // namespace tandem::hal
