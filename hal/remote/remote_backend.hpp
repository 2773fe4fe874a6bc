// The owner's side of the link: a robot that another process runs, as a backend.
// Layer: hal/remote.  Thread: connect non-RT; the rest the loop's, as hal::Backend says.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/triple_buffer.hpp"
#include "hal/backend.hpp"
#include "hal/remote/link.hpp"
#include "hal/remote/server_contact.hpp"
#include "rt/histogram.hpp"

namespace tandem::remote {

/// Bring-up, limits and reactions to faults are the server's. phase() is kOperational while the
/// server runs and the lease is this client's.
class RemoteBackend final : public hal::Backend {
 public:
  /// Finds the server, compares robots and the robot's ends of the link, takes the lease.
  /// Errors: what DDS refuses; no server in time, or several while none is named; another robot
  /// (what differs is named); in lockstep and the server not, or the other way round; owned by
  /// somebody else, who is named; another play-out, or other controllers at the robot's end.
  [[nodiscard]] static Result<std::unique_ptr<RemoteBackend>> connect(dds::Participant& participant,
                                                                      const hal::Robot& robot,
                                                                      const LinkIdentity& identity,
                                                                      const ClientConfig& config);
  [[nodiscard]] hal::Pace pace() const noexcept override {
    if (config_.own_pace) return hal::Pace::kWallClock;
    return config_.lockstep ? hal::Pace::kSimulatedClock : hal::Pace::kBus;
  }
  [[nodiscard]] hal::Phase phase() const noexcept override;
  [[nodiscard]] std::string status_text() const override;
  [[nodiscard]] bool waits_for_bus() const noexcept override { return !config_.own_pace; }
  /// Sends the last command, waits for the next cycle's state; with own_pace it does not wait.
  void exchange(const hal::CycleTime& time) noexcept override;
  [[nodiscard]] std::uint64_t missed() const noexcept TANDEM_RT override { return missed_now_; }
  [[nodiscard]] Code read(const hal::CycleTime& time,
                          hal::StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const hal::CommandImage& command,
                           const hal::ParameterImage& parameters) noexcept TANDEM_RT override;
  void last_command(const hal::CommandImage& command) noexcept TANDEM_RT override;
  [[nodiscard]] bool command_in_force(hal::CommandImage& command) const noexcept TANDEM_RT override;
  [[nodiscard]] hal::FaultCause fault_cause(std::size_t joint) const noexcept TANDEM_RT override;
  [[nodiscard]] std::string fault_text(hal::FaultCause cause, std::uint32_t code) const override;
  void stop(hal::StopCategory category) noexcept TANDEM_RT override;
  void reset() noexcept TANDEM_RT override;
  /// The server is asked for the reset of all.
  [[nodiscard]] bool resets_one_joint() const noexcept TANDEM_RT override { return false; }
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override;
  [[nodiscard]] bool archive(Archive& ar) override;

  /// From sending a command to the state that shows it, on this process' clock.
  [[nodiscard]] const rt::Histogram& turn_around() const noexcept { return turn_around_; }

  // With own_pace.
  /// Before the first exchange(): where the robot stands. False: the server has sent no state
  /// within half a second, as one whose time is paused.
  [[nodiscard]] bool first_state(hal::StateImage& state);
  /// Sends a command whose cycle() is its number; exchange() then has none to send. May block.
  void post(const hal::CommandImage& command) noexcept;
  /// A state has come in this cycle.
  [[nodiscard]] bool is_fresh() const noexcept { return fresh_; }
  /// The server's cycle of the newest state.
  [[nodiscard]] std::uint64_t cycle() const noexcept { return newest_.front().cycle; }
  /// The number of the command that the joints were under in it.
  [[nodiscard]] std::uint64_t source_cycle() const noexcept { return newest_.front().source_cycle; }

  [[nodiscard]] std::uint64_t missed_cycles() const noexcept { return missed_; }

 private:
  /// A cycle of the server.
  struct Seen {
    hal::StateImage state;
    hal::CommandImage command;
    std::vector<std::uint8_t> causes;
    std::uint64_t cycle = 0, owner = 0, answered_cycle = 0, source_cycle = 0;
    std::int64_t sent_ns = 0, answered_ns = 0;
    std::uint8_t phase = 0, code = 0;
    hal::StopCategory reaction = hal::StopCategory::kWarn;
    bool is_one = false;  // not only what stands here before the first
  };
  RemoteBackend(std::unique_ptr<ServerContact> contact, dds::Reader<tandem_msgs::LinkState> states,
                dds::Writer<tandem_msgs::LinkCommand> commands, const hal::Robot& robot);
  void take_states();
  [[nodiscard]] bool unpack(const tandem_msgs::LinkState& sample);
  [[nodiscard]] bool there() noexcept;
  void send() noexcept;
  void keep(const hal::CommandImage& command) noexcept TANDEM_RT;

  std::unique_ptr<ServerContact> contact_;  // gives the robot back, last
  const ClientConfig& config_;              // the contact's
  dds::Reader<tandem_msgs::LinkState> states_;
  dds::Writer<tandem_msgs::LinkCommand> commands_;
  std::size_t joints_;

  // Under the contact's mutex: what the server's states bring, for the loop.
  Senders senders_;
  std::optional<std::uint64_t> left_in_;  // in lockstep: the server's cycle that `done` answers
  TripleBuffer<Seen> newest_;
  std::atomic<std::uint8_t> phase_{0};  // the server's run's; any thread's

  // The loop's.
  bool fresh_ = false, first_ = true, pending_ = false, live_ = false, done_ = false;
  bool ends_with_command_ = false;  // `done` comes with the controllers' last one
  std::uint64_t cycles_ahead_ = 0;  // of this loop, the server's count is
  std::int64_t ahead_ns_ = 0;
  std::uint64_t last_cycle_ = 0, missed_now_ = 0, missed_ = 0, sequence_ = 0;
  std::uint64_t reset_after_ = 0;  // the cycle whose command carries it
  bool resetting_ = false;
  bool clearing_ = false;  // a reset was asked for, and the server has shown nothing latched since
  hal::StopCategory latched_ = hal::StopCategory::kWarn, asked_ = hal::StopCategory::kWarn;
  std::uint32_t stops_ = 0, resets_ = 0;
  bool clears_ = false;  // the last command asked for a joint's fault to be cleared
  hal::CommandImage command_;
  std::vector<double> gains_;
  std::vector<std::uint32_t> revisions_;  // that were sent
  bool gains_pending_ = false;
  std::int64_t answered_ns_ = 0;
  rt::Histogram turn_around_;

  std::optional<OnData> on_states_;  // last: it calls the others
};

}  // namespace tandem::remote
