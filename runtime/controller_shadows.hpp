// Controllers that run beside the active ones on live data, without commanding, and the switch
// that waits until they agree with what is commanded.
// Layer: runtime.  Thread: the loop's; shown() and last_switch() any.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/seqlock.hpp"
#include "hal/image.hpp"
#include "hal/predictor.hpp"
#include "runtime/claim_guard.hpp"
#include "runtime/cycle_request.hpp"
#include "runtime/hosted_controller.hpp"
#include "runtime/joint_references.hpp"

namespace tandem::runtime {

class ControllerHost;

/// A switch that happens once those to start, which are shadows, agree with what is commanded.
struct WaitingSwitch {
  ControllerSet stop = 0, start = 0;
  double within = 0.0;      ///< of the reference that leads in a joint's mode, in its unit
  std::uint64_t until = 0;  ///< cycle in which it is given up
};

/// What became of the last one.
enum class SwitchState : std::uint8_t {
  kNone,     ///< there was none
  kWaits,    ///< they do not agree yet
  kDone,     ///< it has happened
  kTimeOut,  ///< they did not agree in time, and nothing has changed
  kGivenUp,  ///< on request, or what it was asked for is gone, and nothing has changed
  kRefused,  ///< as others claim a joint by now, and nothing has changed
};
[[nodiscard]] const char* to_string(SwitchState state) noexcept;

/// Why one that waited is given up: `code` of log::EventKind::kSwitchGivenUp.
enum class SwitchEnd : std::uint8_t {
  kNone,
  kTimeOut,    ///< they did not agree in time
  kTaken,      ///< a joint is another controller's by now
  kRequested,  ///< on request
  kNoShadow,   ///< one to start is no shadow any more
  kStopped,    ///< one to stop is not active any more
};

struct SwitchLook {
  std::uint64_t asked = 0;  ///< cycle
  std::uint64_t cycle = 0;  ///< of `state`
  double difference = 0.0;  ///< the largest, of the reference that leads; NaN: of other modes
  std::int32_t joint = -1;  ///< whose that is; -1: nobody's, or not known
  SwitchState state = SwitchState::kNone;
  std::array<std::uint8_t, 3> padding{};
};

/// The shadows of a host. They are called once the command of a cycle is out, and see what the
/// active ones saw, and the command that these wrote. What they write stays here.
class ControllerShadows {
 public:
  /// So many cycles in a row without time for it end a shadow.
  static constexpr int kMostMissed = 3;

  explicit ControllerShadows(ControllerHost& host);
  ControllerShadows(const ControllerShadows&) = delete;
  ControllerShadows& operator=(const ControllerShadows&) = delete;

  /// After the last cycle. Any thread.
  [[nodiscard]] ControllerSet shown() const noexcept {
    return shown_.load(std::memory_order_acquire);
  }
  /// Any thread.
  [[nodiscard]] SwitchLook last_switch() const noexcept;

  // At a cycle's boundary. Each answers why it did nothing.

  /// Runs what is loaded in `slot`, and inactive, from this cycle on. @pre controllers run
  [[nodiscard]] CycleAnswer begin(std::size_t slot, const hal::CycleTime& time) noexcept TANDEM_RT;
  [[nodiscard]] CycleAnswer end(std::size_t slot) noexcept TANDEM_RT;
  /// All of them.
  void end_all(ShadowEnd why) noexcept TANDEM_RT;
  /// It is a shadow no more.
  void finish(std::size_t slot, ShadowEnd why, std::int32_t joint = -1,
              Code code = Code::kOk) noexcept TANDEM_RT;
  /// Its references are the command's from now on: it is active, and goes on. @pre has_started()
  void lead(std::size_t slot, hal::CommandImage& command) noexcept TANDEM_RT;
  /// From now on it waits. @pre those to start are shadows
  [[nodiscard]] CycleAnswer wait_for(const WaitingSwitch& wanted,
                                     std::uint64_t cycle) noexcept TANDEM_RT;
  [[nodiscard]] const std::optional<WaitingSwitch>& waiting() const noexcept TANDEM_RT {
    return waiting_;
  }
  /// Whether those to start agreed in the last cycle: every joint that they claim is in the same
  /// mode and interaction, and the reference that leads there is within the bound.
  [[nodiscard]] bool agree(std::uint64_t cycle) noexcept TANDEM_RT;
  /// It waits no more.
  void settle(SwitchState state, std::uint64_t cycle) noexcept TANDEM_RT;
  /// The same, with a reason for the log: take_switch_end(). Refused: none waits.
  CycleAnswer give_up(SwitchEnd why, std::uint64_t cycle) noexcept TANDEM_RT;
  /// Whether one that the waiting switch is to stop is not active any more.
  [[nodiscard]] bool lost_its_premise() const noexcept TANDEM_RT;
  [[nodiscard]] SwitchEnd take_switch_end() noexcept TANDEM_RT {
    return std::exchange(switch_end_, SwitchEnd::kNone);
  }

  // The cycle.

  [[nodiscard]] ControllerSet set() const noexcept TANDEM_RT { return set_; }
  [[nodiscard]] bool is_one(std::size_t slot) const noexcept TANDEM_RT {
    return (set_ & only(slot)) != 0;
  }
  /// Whether it was called yet.
  [[nodiscard]] bool has_started(std::size_t slot) const noexcept TANDEM_RT {
    return is_one(slot) && (starting_ & only(slot)) == 0;
  }
  /// What the active ones have written in this cycle.
  void offer(const hal::CommandImage& led) noexcept TANDEM_RT;
  /// Calls them, when offer() was called since.
  /// @param due_ns  when the next cycle begins; what would not be done until then is left out
  void run(const hal::CycleTime& time, const hal::StateImage& state,
           std::int64_t due_ns) noexcept TANDEM_RT;
  /// It was the reason that a cycle was late. In simulated time nothing is.
  void end_late(std::size_t slot) noexcept TANDEM_RT;
  /// What followed them in their cycle took so long, until `now_ns`.
  void note_end_of_cycle(std::int64_t now_ns) noexcept TANDEM_RT;
  /// While one is called: what it calls of ours knows.
  [[nodiscard]] bool at_work() const noexcept TANDEM_RT { return at_work_; }
  /// That have ended by themselves since the last call.
  [[nodiscard]] ControllerSet take_ended() noexcept TANDEM_RT { return std::exchange(ended_, 0); }

  /// After the gains.
  void archive(Archive& ar);

 private:
  void call(std::size_t slot, const hal::CycleTime& time,
            const hal::StateImage& state) noexcept TANDEM_RT;
  [[nodiscard]] Code call(HostedController& one, bool starts, const hal::CycleTime& time,
                          const hal::StateImage& state, std::int32_t& stray) noexcept TANDEM_RT;
  [[nodiscard]] bool has_room(const Shadow& shadow, std::int64_t due_ns) const noexcept TANDEM_RT;
  [[nodiscard]] Shadow& at(std::size_t slot) const noexcept TANDEM_RT;
  void keep_gains() noexcept TANDEM_RT;
  void put_gains_back() noexcept TANDEM_RT;
  void show() noexcept TANDEM_RT;

  ControllerHost& host_;
  ControllerSet set_ = 0;
  ControllerSet starting_ = 0;  // of these: not called yet
  ControllerSet compared_ = 0;  // of these: in the last cycle
  ControllerSet ended_ = 0;     // of take_ended()
  SwitchEnd switch_end_ = SwitchEnd::kNone;
  hal::CommandImage led_;  // of offer()
  bool offered_ = false;
  bool real_time_ = false;
  bool at_work_ = false;
  ClaimGuard guard_;
  hal::ParameterImage gains_;  // as they are without them
  std::int64_t done_ns_ = -1;  // when the last call of this cycle ended; -1: none was
  std::int64_t tail_ns_ = 0;   // what followed took
  std::optional<WaitingSwitch> waiting_;
  SwitchLook look_;
  std::atomic<ControllerSet> shown_{0};
  Seqlock<SwitchLook> shown_switch_{1};
};

/// A run's predictor as its controllers have it: a shadow must not take others' answers, and gets
/// none.
class SharedPredictor final : public hal::Predictor {
 public:
  explicit SharedPredictor(const ControllerShadows& shadows) : shadows_(&shadows) {}
  void of(hal::Predictor* predictor) noexcept { of_ = predictor; }
  /// What controllers get: null where there is none.
  [[nodiscard]] hal::Predictor* get() noexcept { return of_ == nullptr ? nullptr : this; }

  [[nodiscard]] Status prepare(std::int64_t horizon_ns) override {
    return of_->prepare(horizon_ns);
  }
  bool ask(std::int64_t horizon_ns) noexcept TANDEM_RT override {
    return !shadows_->at_work() && of_->ask(horizon_ns);
  }
  [[nodiscard]] const hal::Prediction* newest() noexcept TANDEM_RT override {
    return shadows_->at_work() ? nullptr : of_->newest();
  }

 private:
  const ControllerShadows* shadows_;
  hal::Predictor* of_ = nullptr;
};

}  // namespace tandem::runtime
