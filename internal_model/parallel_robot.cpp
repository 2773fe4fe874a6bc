#include "internal_model/parallel_robot.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "base/archive.hpp"

namespace tandem::internal_model {
namespace {

constexpr auto kPoll = std::chrono::microseconds(100);
constexpr std::size_t kRecords = 512;  // on a clock: half a second at 1 kHz

hal::ParallelView nothing(const hal::ImageShape& shape, const hal::TruthImage* truth) {
  const std::vector<double> zeros(shape.joints);
  hal::ParallelView view{hal::StateImage(shape), zeros, zeros, zeros};
  if (truth != nullptr) view.truth = *truth;
  return view;
}

}  // namespace

ParallelRobot::ParallelRobot(const ParallelParts& parts, const hal::ImageShape& shape,
                             const hal::ParameterImage& gains, std::int64_t period_ns)
    : second_(&parts.second),
      truth_(parts.truth),
      recorder_(parts.recorder),
      all_counts_(parts.first.pace() == hal::Pace::kSimulatedClock),
      tape_(shape, gains, all_counts_ ? 2 * DuplicatingBackend::kMostBehind : kRecords),
      backend_(parts.first, tape_, shape.joints, done_, parts.first_truth),
      bases_(parts.first_truth != nullptr && parts.truth != nullptr),
      state_(shape),
      command_(shape),
      gains_(gains),
      differences_(shape),
      shown_{Shown(nothing(shape, parts.truth)), Shown(nothing(shape, parts.truth))} {
  if (all_counts_) backend_.archive_second_by([this](Archive& ar) { return archive(ar); });
  if (recorder_ == nullptr) return;
  state_channel_ =
      recorder_->add_channel("/tandem/parallel/state", "tandem/msg/State", state_.layout());
  if (truth_ != nullptr) {
    truth_channel_ =
        recorder_->add_channel("/tandem/parallel/truth", "tandem/msg/Truth", truth_->layout());
  }
  recorder_->open_side(static_cast<std::int64_t>(DuplicatingBackend::kMostBehind) * period_ns);
}

ParallelRobot::~ParallelRobot() { (void)finish(); }

void ParallelRobot::start() {
  thread_ = std::thread([this] { run(); });
}

ParallelResult ParallelRobot::finish() {
  closing_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  result_.missed = tape_.dropped();
  return result_;
}

/// The loop's, which waits for it: the thread has emptied the tape.
bool ParallelRobot::archive(Archive& ar) {
  while (snapshot_pending()) std::this_thread::sleep_for(kPoll);  // the thread reads the robot
  if (!second_->archive(ar)) return false;
  ar(state_, last_time_, diverged_, differences_, result_.cycles);
  bool stopped = !result_.fault.empty();
  ar(stopped);
  if (!stopped) result_.fault.clear();
  if (stopped && result_.fault.empty()) result_.fault = second_->status_text();
  if (ar.reading()) show_again();
  return true;
}

/// As it is at a moment to which time went back; how far the two are apart, the next cycle says.
void ParallelRobot::show_again() {
  for (Shown& one : shown_) {
    hal::ParallelView& view = one.back();
    view.state.assign(state_);
    if (truth_ != nullptr) view.truth->assign(*truth_);
    for (auto* apart : {&view.position_rad, &view.velocity_rad_s, &view.torque_Nm}) {
      std::ranges::fill(*apart, 0.0);
    }
    view.behind_cycles = 0;
    one.publish();
  }
}

const hal::ParallelView* ParallelRobot::Shown::newest() noexcept {
  any_ = views_.refresh() || any_;
  return any_ ? &views_.front() : nullptr;
}

void ParallelRobot::run() {
  for (;;) {
    const bool last = closing_.load(std::memory_order_acquire);  // before the tape is emptied
    while (const CommandRecord* record = tape_.front()) {
      result_.most_behind = std::max<std::uint64_t>(result_.most_behind, tape_.size());
      take_snapshot();
      if (!diverged_) play(*record);
      last_number_ = record->number;
      tape_.pop();
      done_.fetch_add(1, std::memory_order_release);
    }
    take_snapshot();
    if (last) return;
    std::this_thread::sleep_for(kPoll);
  }
}

/// The calls of one cycle in the loop's order.
void ParallelRobot::play(const CommandRecord& record) {
  if (record.number != last_number_ + 1) make_up(record);
  last_time_ = record.time;
  for (std::size_t i = 0; i < record.calls_before; ++i) call(record.calls[i]);
  second_->exchange(record.time);
  if (second_->read(record.time, state_) == Code::kDiverged) {
    diverged_ = true;
    return note_fault();
  }
  state_.cycle()[0] = record.time.cycle;
  state_.time_ns()[0] = record.time.time_ns;
  ++result_.cycles;
  for (std::size_t i = record.calls_before; i < record.calls_made; ++i) call(record.calls[i]);
  if (record.new_gains) gains_ = record.gains;
  if (record.written) {
    command_.assign(record.command);
    commanded_ = true;
    (void)second_->write(command_, gains_);
  }
  if (record.shut_down) (void)second_->shut_down();
  const bool asked = record.calls_made > 0 || record.shut_down;
  if (second_->phase() == hal::Phase::kFault && !asked && result_.fault.empty()) note_fault();
  differences_.compare(record.state, state_);
  if (both_follow(record)) {
    differences_.take(record.state, state_);
    compare_bases(record);
  }
  if (!record.again) log(record.time.time_ns);
  show(record);
}

void ParallelRobot::compare_bases(const CommandRecord& record) {
  if (!bases_) return;
  std::array<double, 7> base{};
  std::ranges::copy(truth_->base_position_m(), base.begin());
  std::ranges::copy(truth_->base_quaternion(), base.begin() + 3);
  differences_.take_base(record.base, base);
}

/// Cycles whose records found no place: the second robot goes on by its last command.
void ParallelRobot::make_up(const CommandRecord& record) {
  for (std::uint64_t left = record.number - last_number_ - 1; left > 0; --left) {
    const std::uint64_t cycle = record.time.cycle - left;
    if (cycle <= last_time_.cycle) continue;
    last_time_.cycle = cycle;
    last_time_.time_ns = static_cast<std::int64_t>(cycle) * record.time.period_ns;
    last_time_.period_ns = record.time.period_ns;
    if (second_->read(last_time_, state_) == Code::kDiverged) return;
    if (commanded_) (void)second_->write(command_, gains_);
  }
}

void ParallelRobot::call(const BackendCall& call) noexcept {
  switch (call.what) {
    case BackendCall::What::kStop: return second_->stop(call.category);
    case BackendCall::What::kReset: return second_->reset();
    case BackendCall::What::kHome: (void)second_->home(call.joint); return;
    case BackendCall::What::kStopHoming: return second_->stop_homing(call.joint);
  }
}

/// Their command: neither in bring-up, in fault nor shutting down.
bool ParallelRobot::both_follow(const CommandRecord& record) const {
  return record.written && record.phase == hal::Phase::kOperational &&
         second_->phase() == hal::Phase::kOperational;
}

void ParallelRobot::note_fault() { result_.fault = second_->status_text(); }

void ParallelRobot::log(std::int64_t time_ns) {
  if (recorder_ == nullptr) return;
  if (all_counts_) recorder_->wait_for_side_space(2);
  recorder_->push_side(state_channel_, time_ns, state_.bytes());
  if (truth_ != nullptr) recorder_->push_side(truth_channel_, time_ns, truth_->bytes());
}

void ParallelRobot::show(const CommandRecord& record) {
  for (Shown& one : shown_) {
    fill(one.back(), record);
    one.publish();
  }
}

void ParallelRobot::fill(hal::ParallelView& view, const CommandRecord& record) const {
  view.state.assign(state_);
  if (truth_ != nullptr) view.truth->assign(*truth_);
  const bool both = both_follow(record);
  for (std::size_t j = 0; j < view.position_rad.size(); ++j) {
    const hal::StateImage& one = record.state;
    view.position_rad[j] = both ? one.position_rad()[j] - state_.position_rad()[j] : 0.0;
    view.velocity_rad_s[j] = both ? one.velocity_rad_s()[j] - state_.velocity_rad_s()[j] : 0.0;
    view.torque_Nm[j] = both ? one.torque_Nm()[j] - state_.torque_Nm()[j] : 0.0;
  }
  view.behind_cycles = tape_.size() - 1;
  view.missed = tape_.dropped();
}

bool ParallelRobot::snapshot_now(std::uint64_t next_cycle) noexcept TANDEM_RT {
  if (snapshot_pending()) return false;
  snapshot_cycle_ = next_cycle;
  snapshot_after_.store(backend_.cycles(), std::memory_order_release);
  return true;
}

/// When one is wanted of now. Between two records; one that came too late for it is none.
void ParallelRobot::take_snapshot() {
  const std::uint64_t after = snapshot_after_.load(std::memory_order_acquire);
  if (after == kNone || last_number_ < after) return;
  constexpr std::size_t kMostKept = 4;  // somebody has not come for the others
  Archive ar;                           // grows; this thread may
  if (last_number_ == after && second_->archive(ar)) {
    const std::lock_guard lock(snapshot_mutex_);
    if (snapshots_.size() == kMostKept) snapshots_.erase(snapshots_.begin());
    snapshots_.push_back({snapshot_cycle_, {ar.bytes().begin(), ar.bytes().end()}});
  }
  snapshot_after_.store(kNone, std::memory_order_release);
  snapshot_there_.notify_all();
}

std::optional<std::vector<std::byte>> ParallelRobot::wait_snapshot(std::uint64_t next_cycle,
                                                                   double patience_s) {
  std::unique_lock lock(snapshot_mutex_);
  const auto found = [&] {
    return std::ranges::find(snapshots_, next_cycle, &Snapshot::next_cycle);
  };
  snapshot_there_.wait_for(lock, std::chrono::duration<double>(patience_s),
                           [&] { return found() != snapshots_.end(); });
  const auto it = found();
  if (it == snapshots_.end()) return std::nullopt;
  std::vector<std::byte> bytes = std::move(it->bytes);
  snapshots_.erase(it);
  return bytes;
}

}  // namespace tandem::internal_model
