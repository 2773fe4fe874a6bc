// The owner's side of the link: a robot that another process runs, as a backend.
// Layer: hal/remote.  Thread: connect non-RT; the rest the loop's, as hal::Backend says.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "base/triple_buffer.hpp"
#include "hal/backend.hpp"
#include "hal/remote/lease.hpp"
#include "hal/remote/link.hpp"
#include "rt/histogram.hpp"

namespace tandem::remote {

struct ClientConfig {
  std::string name;                          ///< for people: "tandem run squat.toml, process 312"
  bool lockstep = false;                     ///< must be the server's
  bool own_pace = false;                     ///< the loop waits for no state; not in lockstep
  RobotEnd robot_end = {};                   ///< that the server must have
  std::uint64_t server = 0;                  ///< Server::number(); 0: the only one there is
  double connect_timeout_s = 10;             ///< for a server to be found, and to give the lease
  double server_timeout_s = 3;               ///< a server that is not heard for so long is gone
  std::function<void()> before_asking = {};  ///< for the lease; called before each attempt
  std::function<bool()> interrupted = {};    ///< true: exchange() waits no longer
  /// A drive's error code in words; empty: as Backend::fault_text() has it.
  std::function<std::string(std::uint32_t)> error_text = {};
};

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
                                                                      const Identity& identity,
                                                                      const ClientConfig& config);
  /// Gives the robot back.
  ~RemoteBackend() override;

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
  /// What the server says of itself.
  struct Told {
    Identity identity;
    std::uint64_t run = 0, owner = 0;
    std::optional<Sender> sender;
    std::string owner_name, status;
    double lease_timeout_s = 1.0;
    bool lockstep = false, ending = false;
  };
  struct Endpoints {
    dds::Reader<tandem_msgs::LinkServer> server;
    dds::Reader<tandem_msgs::LinkRobotEnd> robot_end;
    dds::Reader<tandem_msgs::LinkState> state;
    dds::Writer<tandem_msgs::LinkRequest> requests;
    dds::Writer<tandem_msgs::LinkCommand> commands;
  };

  RemoteBackend(Endpoints endpoints, const hal::Robot& robot, ClientConfig config);
  [[nodiscard]] Status find_server(const Identity& identity);
  [[nodiscard]] Status same_robot_end();
  [[nodiscard]] Status take_lease();
  void ask(Action action);
  void renew();
  void take_told();
  void take_robot_end();
  void take_states();
  [[nodiscard]] bool unpack(const tandem_msgs::LinkState& sample);
  [[nodiscard]] bool there() noexcept;
  void look() noexcept;
  [[nodiscard]] bool is_gone() const noexcept TANDEM_RT;
  void send() noexcept;
  void keep(const hal::CommandImage& command) noexcept TANDEM_RT;

  Endpoints endpoints_;
  ClientConfig config_;
  std::uint64_t client_ = draw_number();
  std::size_t joints_;

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable news_, closes_;
  Senders server_senders_, robot_end_senders_, state_senders_;
  std::optional<Sender> server_;  // once it is chosen
  std::optional<Told> told_;
  std::uint64_t told_count_ = 0;
  bool several_ = false;  // servers were heard before one was chosen
  bool closing_ = false;
  std::optional<RobotEnd> robot_end_;     // the server's
  std::optional<std::uint64_t> left_in_;  // in lockstep: the server's cycle that `done` answers
  // Written by DDS' threads, read by any.
  std::atomic<std::uint64_t> run_{0};
  std::atomic<std::int64_t> heard_ns_{0};
  std::atomic<std::uint8_t> phase_{0};  // the server's run's
  std::atomic<bool> leased_{false}, lost_{false}, ending_{false}, gone_{false};
  TripleBuffer<Seen> newest_;

  // The loop's.
  Silence silence_;  // of the server
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

  std::thread renewing_;
  std::optional<OnData> on_told_, on_robot_end_, on_states_;  // last: they call the others
};

}  // namespace tandem::remote
