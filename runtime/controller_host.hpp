// Hosts the controllers of a run: their claims on joints, and their calls in the cycle.
// Loaded ones are active or inactive; runtime/run_services.hpp changes that while the run goes on.
// Layer: runtime.  Thread: add, configure, name non-RT; the cycle's part RT; shown() any.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "controllers/controller.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"
#include "rt/clock.hpp"
#include "runtime/call_watch.hpp"
#include "runtime/claim_guard.hpp"
#include "runtime/controller_shadows.hpp"
#include "runtime/cycle_request.hpp"
#include "runtime/hosted_controller.hpp"
#include "runtime/joint_references.hpp"

namespace tandem::runtime {

class CycleLog;

/// A controller wrote what it had not claimed, and that was taken back.
struct Stray {
  std::uint32_t controller = 0;  ///< for ControllerHost::name()
  std::size_t joint = 0;
};

/// Two controllers that want one joint.
struct ClaimConflict {
  std::size_t joint = 0;
  std::size_t one = 0, other = 0;  ///< slots
};

/// Controllers run in the order of their slots, each on the joints that it claimed. What happens to
/// a joint that no active controller claims, or that changes hands: JointReferences.
class ControllerHost {
 public:
  using Table = std::array<HostedController*, kMostControllers>;

  /// `config` must outlive the host. `kernels` may be null.
  ControllerHost(const hal::RobotConfig& config, const tandem_kernels* kernels,
                 std::int64_t period_ns);
  ControllerHost(const ControllerHost&) = delete;
  ControllerHost& operator=(const ControllerHost&) = delete;

  // Before the run.

  /// Where the joints will stand when the run starts, in the image's order, for those who are added
  /// active from now on; empty: not known.
  void start_from(std::vector<double> position_rad) { start_rad_ = std::move(position_rad); }
  /// What is estimated, for those who are configured from now on; null: nothing.
  void show_estimate(const hal::EstimateImage* estimate) { estimate_ = estimate; }
  /// The robot's links, for the frames of marks; none: any name is a link.
  void draw_in(std::vector<std::string> links) { links_ = std::move(links); }
  /// What those who are added from now on may ask for what will happen; null: nobody.
  void predict_by(hal::Predictor* predictor) { predictor_.of(predictor); }
  /// Each call of the cycle is timed by it from now on; without a clock none is.
  void time_by(rt::Clock& clock) { clock_ = &clock; }
  /// Inputs take samples of other threads by it from now on; it outlives the cycles.
  void heed(hal::Outside& outside) noexcept { outside_ = &outside; }
  /// Who is told of each call of the cycle; null: nobody.
  void watch_calls(CallWatch* watch) { watch_ = watch; }
  /// The document of the parameters of those who are added from now on.
  void read_from(const TomlDocument& document) { document_ = document; }
  /// Configures a controller and takes its claims.
  /// @param active  false: it is loaded, and waits for its start.
  /// @param inputs  who feeds its inputs; of those that are not there `tandem input` does
  ///
  /// Errors (nothing has moved then): those of configure(), which a plugin has kStartTime for; a
  /// joint that another active controller claimed (both are named); too many controllers. After a
  /// plugin's exit(), or when it does not return, the host, and what it was given, must stay until
  /// the process ends (a_hosted_call_goes_on()).
  /// Errors in `parameters` go to the document's diagnostics: the caller looks there, too.
  [[nodiscard]] Status add(const std::string& name, ControllerSource source, TomlTable parameters,
                           bool active = true, std::span<const InputSource> inputs = {});

  /// How long the opening of a library, and a configure(), may take before the run: nobody waits
  /// for an answer yet, and a long recording takes a while to read.
  static constexpr std::chrono::milliseconds kStartTime{15000};

  // Any thread but the loop's.

  /// Less than a client waits for an answer.
  static constexpr std::chrono::milliseconds kConfigureTime{4000};
  /// A controller that is ready to be inserted. The run goes on whatever its configure() does.
  /// @param limit      empty: the caller waits for its configure(), however long that takes
  /// @param start_rad  as start_from(); empty: not known
  /// Errors: what its configure() says; it throws, calls exit(), does not return within `limit`; a
  /// joint index or mode that the robot lacks; a joint that it claims twice; an input that makes no
  /// sense, or does not fit its source; a signal or a mark that cannot be.
  [[nodiscard]] Result<std::unique_ptr<HostedController>> configure(
      const std::string& name, ControllerSource source, TomlTable parameters,
      std::optional<std::chrono::milliseconds> limit = kConfigureTime,
      std::span<const double> start_rad = {}, std::span<const InputSource> inputs = {});
  /// It will be loaded: gives it the number and the times of its name.
  void enter(HostedController& one);
  /// It is loaded: its library is among code() from now on.
  void note_code(const HostedController& one);
  /// The first joint that two of `active` claim.
  [[nodiscard]] static std::optional<ClaimConflict> find_conflict(
      const Table& table, ControllerSet active) noexcept TANDEM_RT;
  /// Name of a controller that is or was loaded.
  [[nodiscard]] std::string name(std::size_t id) const { return names_->name(id); }
  /// Names and times of all that are or were loaded.
  [[nodiscard]] const std::shared_ptr<ControllerNames>& names() const noexcept { return names_; }
  [[nodiscard]] std::int64_t period_ns() const noexcept { return period_ns_; }
  /// Who is active, and done, after the last cycle.
  struct Shown {
    ControllerSet active = 0, done = 0;
  };
  [[nodiscard]] Shown shown() const noexcept TANDEM_RT;
  [[nodiscard]] const std::vector<hal::JointCapabilities>& capabilities() const noexcept {
    return capabilities_;
  }

  /// Every plugin that was loaded, in order, also of those that are gone.
  [[nodiscard]] std::vector<ControllerCode> code() const;

  using Owned = std::array<std::unique_ptr<HostedController>, kMostControllers>;
  /// What is loaded, by slot: add()'s before the run, RunServices' while it goes on.
  [[nodiscard]] Owned& owned() noexcept { return owned_; }
  /// Gains of the drives' loops, as they are asked for. The loop's.
  [[nodiscard]] hal::ParameterImage& gains() noexcept { return gains_; }

  // The loop's, at a cycle's boundary. Each answers why it did nothing.

  [[nodiscard]] CycleAnswer insert(std::size_t slot,
                                   HostedController& controller) noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer remove(std::size_t slot) noexcept TANDEM_RT;
  /// Puts `next`, which has a succession, in the place of what is in `slot`, active as that was.
  /// When controllers are `running`, an active one goes on with the former's state, or is started,
  /// and its joints change hands as in switch_over().
  [[nodiscard]] CycleAnswer replace(std::size_t slot, HostedController& next, bool running,
                                    const hal::CycleTime& time,
                                    JointImages images) noexcept TANDEM_RT;
  /// What is in `slot`, or null.
  [[nodiscard]] HostedController* at(std::size_t slot) const noexcept TANDEM_RT {
    return table_[slot];
  }
  /// All of them; none when a controller of them has gone.
  [[nodiscard]] CycleAnswer set_parameters(
      std::span<const ParameterChange> changes) noexcept TANDEM_RT;
  /// Changes when a parameter may have another value. Any thread.
  [[nodiscard]] std::uint64_t parameter_changes() const noexcept {
    return parameter_changes_.load(std::memory_order_acquire);
  }
  static constexpr std::size_t kToldParameters = 16;
  /// The log gets what controllers that came during the run have as parameters, at most
  /// kToldParameters a cycle. Of one that has been set it has that.
  void tell_parameters(const hal::CycleTime& time, CycleLog& log) noexcept TANDEM_RT;
  /// Stops and starts controllers, all or none. When they are `running`, every joint that changes
  /// hands does so without a bump (BumplessTransfer): one that moves brakes, what nobody has is
  /// held where it comes to rest, and who starts sees the joint there. Else it is who will start.
  [[nodiscard]] CycleAnswer switch_over(ControllerSet stop, ControllerSet start, bool running,
                                        const hal::CycleTime& time,
                                        JointImages images) noexcept TANDEM_RT;

  // The cycle.

  /// Its calls so far, in their order.
  [[nodiscard]] std::span<const ControllerCall> calls() const noexcept TANDEM_RT {
    return {calls_.data(), called_};
  }
  /// The reason for a late cycle.
  struct Slow {
    std::int32_t controller = -1;  ///< for name(); -1: none of them
    bool shadow = false;           ///< it is one: without it the cycle would have been in time
  };
  /// A cycle begins: the calls of the one before are forgotten. That one was late, and took
  /// `late_ns`; 0: it was not. A shadow that is the reason is ended.
  /// @return whose call was the longest: of the shadows where the cycle would have been in time
  ///         without them, else of the active ones where they took at least half of it
  Slow begin_cycle(std::int64_t late_ns) noexcept TANDEM_RT;
  /// Inputs of everything that is loaded.
  [[nodiscard]] std::size_t inputs() const noexcept TANDEM_RT;
  /// Between two cycles: samples that wait are refused. @return how many. May block
  std::size_t forget_waiting();
  /// Before the controllers' calls: the active ones get their newest samples, which go to the log.
  /// @param open  false: they get none
  void take_inputs(const hal::CycleTime& time, bool open, CycleLog& log) noexcept TANDEM_RT;
  /// First cycle: holds every joint, sets the claimed modes, lets the active controllers seed
  /// theirs. Joints go over from `command`, which may be in motion when another loop sent it.
  void start(const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT;
  /// Every cycle, the first included.
  /// @return kOk; kStopped when a controller is active, and every active one is done (one that is
  ///         done keeps its last references) and came with the experiment; else the first code
  ///         that is neither, failed_controller() says whose.
  [[nodiscard]] Code update(const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT;
  /// Tells the active controllers.
  void stop() noexcept TANDEM_RT;
  /// A stop of category 2: those that can retreat go on to do so, the others are stopped.
  /// @return false: none can, and nothing has changed
  [[nodiscard]] bool retreat(const hal::CycleTime& time, JointImages images) noexcept TANDEM_RT;
  /// What was taken back in this cycle, of a controller and joint of which it is the first time.
  [[nodiscard]] std::optional<Stray> take_stray() noexcept TANDEM_RT {
    return std::exchange(stray_, std::nullopt);
  }

  /// Whose update() was called since the last take_updated().
  [[nodiscard]] ControllerSet take_updated() noexcept TANDEM_RT {
    return std::exchange(updated_, 0);
  }
  /// By slot; null: there is none. The loop's.
  [[nodiscard]] const Table& loaded() const noexcept TANDEM_RT { return table_; }

  /// That are loaded.
  [[nodiscard]] std::size_t size() const noexcept;
  /// For name(): the controller whose code update() returned last.
  [[nodiscard]] std::size_t failed_controller() const noexcept { return failed_controller_; }
  /// For name(): the controller that is in a call of the cycle; -1: none. Any thread.
  [[nodiscard]] std::int32_t at_work() const noexcept {
    return at_work_.load(std::memory_order_relaxed);
  }
  /// The slot of the active controller that claims `joint`, or -1.
  [[nodiscard]] std::int32_t owner(std::size_t joint) const noexcept TANDEM_RT {
    return owner_[joint];
  }
  /// The same for name().
  [[nodiscard]] std::int32_t owner_id(std::size_t joint) const noexcept TANDEM_RT {
    const std::int32_t slot = owner_[joint];
    return slot < 0 ? -1 : static_cast<std::int32_t>(table_[static_cast<std::size_t>(slot)]->id);
  }
  /// The slot of one of `by` that claims `joint`, or -1.
  [[nodiscard]] std::int32_t claimant(std::size_t joint, ControllerSet by) const noexcept TANDEM_RT;
  [[nodiscard]] JointReferences& references() noexcept { return references_; }
  /// Those that run beside the active ones without commanding.
  [[nodiscard]] ControllerShadows& shadows() noexcept { return shadows_; }
  [[nodiscard]] const ControllerShadows& shadows() const noexcept { return shadows_; }
  /// A number of what is loaded: slots, names, claims and how many parameters each has.
  [[nodiscard]] std::uint64_t fingerprint() const noexcept;
  void archive(Archive& ar);

 private:
  friend class ControllerShadows;

  [[nodiscard]] Status check_claims(const std::string& name,
                                    std::span<const ControllerSetup::Claim> claims) const;
  void settle_ended(JointImages images) noexcept TANDEM_RT;
  [[nodiscard]] const hal::StateImage& at_rest(const hal::StateImage& state,
                                               ControllerSet start) noexcept TANDEM_RT;
  void go_on_as(const HostedController& former, HostedController& next, const hal::CycleTime& time,
                JointImages images) noexcept TANDEM_RT;
  void call_starts(ControllerSet start, const hal::CycleTime& time, JointImages images,
                   bool inputs_wait = true) noexcept TANDEM_RT;
  [[nodiscard]] bool is_active(std::size_t slot) const noexcept TANDEM_RT {
    return (active_ & only(slot)) != 0;
  }
  [[nodiscard]] Code call_update(HostedController& one, const hal::CycleTime& time,
                                 JointImages images) noexcept TANDEM_RT;
  void take_back(HostedController& one, hal::CommandImage& command) noexcept TANDEM_RT;
  void set_active(ControllerSet active) noexcept TANDEM_RT;
  void show() noexcept TANDEM_RT;
  class InCall;

  const hal::RobotConfig* config_;
  const hal::Robot robot_;  // what the controllers see of it
  hal::ParameterImage gains_;
  const tandem_kernels* kernels_;
  std::int64_t period_ns_;
  std::vector<double> start_rad_;         // of start_from()
  std::vector<std::string> links_;        // of draw_in()
  std::optional<TomlDocument> document_;  // of read_from()
  mutable std::mutex code_mutex_;
  std::vector<ControllerCode> code_;
  const hal::EstimateImage* estimate_ = nullptr;
  std::vector<hal::JointCapabilities> capabilities_;

  // The loop's.
  Table table_{};
  ControllerSet active_ = 0, done_ = 0;
  ControllerSet ended_ = 0;          // of done_: in the last cycle
  ControllerSet updated_ = 0;        // of take_updated()
  std::vector<std::int32_t> owner_;  // by joint: an active one's slot, or -1
  JointReferences references_;
  hal::StateImage at_rest_;      // what a start sees of joints that brake
  hal::CommandImage discarded_;  // of a start whose references nobody wants
  ClaimGuard guard_;
  ControllerShadows shadows_;
  SharedPredictor predictor_{shadows_};
  std::optional<Stray> stray_;
  std::size_t failed_controller_ = 0;
  std::atomic<std::uint64_t> shown_{0};  // active, and done in the upper half
  std::atomic<std::int32_t> at_work_{-1};
  std::atomic<std::uint64_t> parameter_changes_{0};
  rt::Clock* clock_ = nullptr;
  hal::Outside own_outside_;
  hal::Outside* outside_ = &own_outside_;
  CallWatch* watch_ = nullptr;
  std::array<ControllerCall, kMostControllers> calls_{};  // of this cycle; more are not kept
  std::size_t called_ = 0;

  const std::shared_ptr<ControllerNames> names_ = std::make_shared<ControllerNames>();

  Owned owned_;
};

/// One call of the cycle into a controller: who is at work, and how long it takes.
class ControllerHost::InCall {
 public:
  InCall(ControllerHost& host, HostedController& one,
         ControllerFunction function) noexcept TANDEM_RT : host_(host),
                                                           one_(one) {
    host.at_work_.store(static_cast<std::int32_t>(one.id), std::memory_order_relaxed);
    if (host.clock_ != nullptr) begin_ns_ = host.clock_->now_ns();
    if (host.watch_ != nullptr) host.watch_->enter(one.id, function);
  }
  ~InCall() {
    if (host_.watch_ != nullptr) host_.watch_->leave();
    if (host_.clock_ != nullptr) note(host_.clock_->now_ns() - begin_ns_);
    host_.at_work_.store(-1, std::memory_order_relaxed);
  }
  InCall(const InCall&) = delete;
  InCall& operator=(const InCall&) = delete;

  [[nodiscard]] Controller* operator->() const noexcept TANDEM_RT { return one_.controller.get(); }

 private:
  void note(std::int64_t took_ns) noexcept TANDEM_RT {
    if (!host_.outside_->closed) one_.times->calls.record(took_ns);  // not of what has been
    if (host_.called_ == host_.calls_.size()) return;
    host_.calls_[host_.called_++] = {one_.id, begin_ns_, took_ns, host_.shadows_.at_work()};
  }

  ControllerHost& host_;
  HostedController& one_;
  std::int64_t begin_ns_ = 0;
};

}  // namespace tandem::runtime
