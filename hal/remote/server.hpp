// The owner's end of the robot: shows each cycle on DDS, and takes one client's commands.
// Layer: hal/remote.  Thread: made and closed by one; its RemoteCommandPort is the loop's.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/result.hpp"
#include "base/spsc_ring.hpp"
#include "base/triple_buffer.hpp"
#include "hal/remote/lease.hpp"
#include "hal/remote/link.hpp"
#include "hal/remote/playout.hpp"
#include "hal/remote/server_publisher.hpp"
#include "hal/remote_command.hpp"
#include "rt/histogram.hpp"

namespace tandem::remote {

/// Commands take effect so many cycles after the robot's cycle that their numbers are, which is the
/// one that their owner saw when it gave them.
struct PlayoutConfig {
  /// To the first state of the robot that shows it.
  [[nodiscard]] std::uint64_t shown_after_cycles() const noexcept { return delay_cycles + 1; }
  std::uint64_t delay_cycles = 0;    ///< there and back: what comes later has no effect
  std::uint64_t brake_cycles = 250;  ///< in which references come to rest when commands end
};

struct ServerConfig {
  bool lockstep = false;
  bool ends_with_owner = false;        ///< the run, when an owner is done; else the next may come
  double lease_timeout_s = 1.0;        ///< an owner that is not heard for so long has lost it
  std::uint64_t max_age_cycles = 100;  ///< of the state that a command answers
  double lockstep_timeout_s = 60.0;    ///< that a cycle waits for a living owner's command
  hal::StopCategory on_lost = hal::StopCategory::kWarn;  ///< kWarn: every joint is held
  std::optional<PlayoutConfig> playout = {};  ///< empty: the newest command is followed at once
  /// That run beside the owner's, as RobotEnd has them.
  std::map<std::string, std::string> robot_controllers = {};
  /// Whether this participant may own the robot; called on DDS' threads. Empty: everybody may.
  std::function<bool(const Sender&)> admits = {};
};

class Server final : public hal::RemoteCommandPort {
 public:
  /// Begins to publish the robot. The participant outlives it.
  /// @param gains  that the robot starts with: what an owner does not change stays so
  /// Errors: what DDS refuses.
  [[nodiscard]] static Result<std::unique_ptr<Server>> open(dds::Participant& participant,
                                                            const hal::Robot& robot,
                                                            const hal::ParameterImage& gains,
                                                            LinkIdentity identity,
                                                            const ServerConfig& config);
  ~Server() override;

  /// What a client whose robot is in fault is sent; called on another thread until close().
  void set_status(std::function<std::string()> status) { publisher_.set_status(std::move(status)); }
  /// Announces that the run is over, and takes nothing any more. The loop has stopped.
  void close();

  [[nodiscard]] bool lockstep() const noexcept override { return config_.lockstep; }
  void send(const hal::PortView& view) noexcept override { publisher_.send(view, answered_); }
  [[nodiscard]] std::int64_t wait_until_ns(const hal::PortView& view) noexcept override;
  [[nodiscard]] hal::RemoteCommand exchange(const hal::PortView& view) noexcept TANDEM_RT override;
  void on_news(std::function<void()> ring) override;

  /// Its number among the servers of a domain, drawn at the start.
  [[nodiscard]] std::uint64_t number() const noexcept { return publisher_.run(); }
  /// For any thread.
  [[nodiscard]] const Lease& lease() const noexcept { return lease_; }
  [[nodiscard]] std::uint64_t count(Verdict verdict) const noexcept {
    return counts_[static_cast<std::size_t>(verdict)].load(std::memory_order_relaxed);
  }
  /// Cycles that were not shown, because the thread that sends was behind.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return publisher_.dropped(); }
  [[nodiscard]] std::uint64_t losses() const noexcept {
    return losses_.load(std::memory_order_relaxed);
  }
  /// For when the loop has stopped; null: commands are followed at once.
  [[nodiscard]] const Playout* playout() const noexcept { return playout_ ? &*playout_ : nullptr; }
  // For when the loop has stopped: of the state that each new command answers.
  [[nodiscard]] const rt::Histogram& age() const noexcept { return age_; }
  /// In cycles instead of nanoseconds.
  [[nodiscard]] const rt::Histogram& age_cycles() const noexcept { return age_cycles_; }

 private:
  /// A command that has passed every check.
  struct Taken {
    hal::CommandImage command;
    hal::ParameterImage gains;
    std::uint64_t client = 0, sequence = 0, cycle = 0;
    std::int64_t state_ns = 0, sent_ns = 0;
    std::uint64_t gains_number = 0;  // another one: other gains
    bool live = false, done = false;
  };
  struct Readers {
    dds::Reader<tandem_msgs::LinkRequest> requests;
    dds::Reader<tandem_msgs::LinkCommand> commands;
  };

  Server(ServerPublisher::Writers writers, Readers readers, const hal::Robot& robot,
         const hal::ParameterImage& gains, LinkIdentity identity, const ServerConfig& config);

  void ring();
  void take_requests();
  void take_commands();
  void acquire(const tandem_msgs::LinkRequest& sample, const std::optional<Sender>& sender);
  [[nodiscard]] bool is_owner(std::uint64_t client, const std::optional<Sender>& sender);
  [[nodiscard]] Verdict judge(const tandem_msgs::LinkCommand& sample,
                              const std::optional<Sender>& sender);
  [[nodiscard]] bool unpack(const tandem_msgs::LinkCommand& sample);
  void keep_for_playout(const Taken& taken);
  void note_stops(const tandem_msgs::LinkCommand& sample);
  [[nodiscard]] hal::FaultCause loss_of(const hal::PortView& view,
                                        std::uint64_t owner) noexcept TANDEM_RT;
  void play(const hal::PortView& view, bool begins, hal::RemoteCommand& wish) noexcept TANDEM_RT;
  void measure(const hal::PortView& view, const Taken& taken) noexcept TANDEM_RT;

  LinkIdentity identity_;
  ServerConfig config_;
  Readers readers_;
  std::vector<hal::JointCapabilities> capabilities_;
  Lease lease_;
  std::array<std::atomic<std::uint64_t>, kVerdicts> counts_{};
  std::atomic<std::uint64_t> losses_{0};

  // From DDS' threads to the loop.
  Senders request_senders_, command_senders_;
  std::mutex owner_mutex_;  // of owner_sender_, and of who becomes the owner
  std::optional<Sender> owner_sender_;
  std::mutex in_mutex_;  // of what follows
  std::uint64_t gate_client_ = 0, gate_sequence_ = 0;
  std::uint32_t gate_stops_ = 0, gate_resets_ = 0;
  hal::ParameterImage gains_;  // the newest
  std::uint64_t gains_number_ = 0;
  TripleBuffer<Taken> newest_;
  std::optional<SpscRing> commands_;  // that play-out has not seen: client, image
  std::atomic<std::uint8_t> stop_;    // a hal::StopCategory, to be carried out
  std::atomic<bool> reset_{false};
  std::atomic<std::uint64_t> reset_cycle_{0};  // RemoteCommand::reset_cycle
  std::mutex ring_mutex_;
  std::function<void()> on_news_;

  // The loop's.
  std::uint64_t led_by_ = 0;  // client whose commands are followed; 0: nobody's
  Answered answered_;
  std::uint64_t answered_sequence_ = 0, done_client_ = 0;
  std::uint64_t gains_taken_ = 0;
  std::optional<Playout> playout_;
  std::uint64_t played_cycle_ = 0;
  hal::CommandImage played_, received_;
  std::int64_t waits_since_ns_ = 0;
  Silence silence_;  // of the owner
  rt::Histogram age_, age_cycles_;

  ServerPublisher publisher_;
  std::optional<OnData> on_requests_, on_commands_;  // last: they call the others
};

}  // namespace tandem::remote
