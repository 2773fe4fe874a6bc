#include "internal_model/prediction_service.hpp"

#include <fmt/core.h>
#include <time.h>

#include <algorithm>
#include <chrono>

#include "base/bounds.hpp"
#include "base/clock_ns.hpp"

namespace tandem::internal_model {
namespace {

constexpr auto kLook = std::chrono::microseconds(200);
constexpr double kPatience_s = 2.0;  // for a cycle, and for the internal model's snapshot

hal::Prediction room_for(std::size_t joints, std::int64_t horizon_ns, std::int64_t period_ns) {
  hal::Prediction room;
  const auto cycles = static_cast<std::size_t>((horizon_ns + period_ns - 1) / period_ns);
  room.joints = joints;
  room.period_ns = period_ns;
  room.reference_rad.resize(cycles * joints);
  room.position_rad.resize(cycles * joints);
  room.torque_Nm.resize(cycles * joints);
  room.base.resize(cycles * 7);
  return room;
}

Error over() {
  return {.message = "the run ended before its prediction was there",
          .hint = "ask while it goes on",
          .file = {},
          .key = {}};
}

/// A row of the copy, after a cycle of it.
void note(const Fork& fork, hal::Prediction& out) {
  const std::size_t at = out.cycles * out.joints;
  const hal::StateImage& state = fork.cycle->state();
  const auto to = [at](std::vector<double>& row) {
    return row.begin() + static_cast<std::ptrdiff_t>(at);
  };
  std::ranges::copy(fork.cycle->command().position_rad(), to(out.reference_rad));
  std::ranges::copy(state.position_rad(), to(out.position_rad));
  std::ranges::copy(state.torque_Nm(), to(out.torque_Nm));
  const auto base = out.base.begin() + static_cast<std::ptrdiff_t>(out.cycles * 7);
  std::ranges::copy(fork.truth->base_position_m(), base);
  std::ranges::copy(fork.truth->base_quaternion(), base + 3);
  ++out.cycles;
}

}  // namespace

void PredictionService::attach(runtime::RobotCycle& cycle, ParallelRobot* parallel, MakeFork fork) {
  cycle_ = &cycle;
  parallel_ = parallel;
  make_fork_ = std::move(fork);
  simulated_ = cycle.config().loop.pacing == rt::Pacing::kSimulated;
  Archive measured;
  (void)cycle.write_down(measured, whole());
  for (HandOver* one : {&controller_, &tool_}) {  // twice as much: controllers may be loaded
    one->archive = std::make_unique<Archive>(2 * measured.bytes().size() + 65'536);
  }
  if (prepared_ns_ > 0) {
    answers_ = std::make_unique<TripleBuffer<hal::Prediction>>(
        room_for(cycle.state().joints(), prepared_ns_, period_ns_));
  }
  thread_ = std::thread([this] { run(); });
}

void PredictionService::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_.store(true, std::memory_order_release);
  }
  news_.notify_all();
  if (thread_.joinable()) thread_.join();
}

Status PredictionService::check_horizon(std::int64_t horizon_ns) const {
  const std::size_t columns = cycle_ == nullptr ? 0 : 3 * cycle_->state().joints() + 7;
  const auto cycles = static_cast<std::size_t>(std::max<std::int64_t>(0, horizon_ns / period_ns_));
  if (horizon_ns >= period_ns_ && horizon_ns <= hal::kMostHorizon_ns) {
    if (cycles * columns <= bounds::kPredicted.most) return {};
    return std::unexpected(beyond(bounds::kPredicted));
  }
  const auto seconds = [](std::int64_t ns) {
    return fmt::format("{:g} s", static_cast<double>(ns) * 1e-9);
  };
  return fail("a horizon of " + seconds(horizon_ns) + " is out of range",
              "from one cycle, " + seconds(period_ns_) + ", to " + seconds(hal::kMostHorizon_ns));
}

Result<Answer> PredictionService::predict(std::int64_t horizon_ns) {
  if (const Status right = check_horizon(horizon_ns); !right) return std::unexpected(right.error());
  const std::lock_guard one(tools_);
  if (const Status there = wait_for_loop(); !there) return std::unexpected(there.error());
  Question question{horizon_ns, std::unexpected(over())};
  std::unique_lock lock(mutex_);
  if (closing()) return std::unexpected(over());
  question_ = &question;
  news_.notify_all();
  news_.wait(lock, [&] { return question.done; });
  return std::move(question.answer);
}

/// Until the loop has written the tool's snapshot.
Status PredictionService::wait_for_loop() {
  tool_.stage.store(Stage::kWanted, std::memory_order_release);
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatience_s);
  while (tool_.stage.load(std::memory_order_acquire) != Stage::kTaken) {
    const bool late = std::chrono::steady_clock::now() > until;
    if (!closing() && !late) {
      std::this_thread::sleep_for(kLook);
      continue;
    }
    Stage wanted = Stage::kWanted;
    if (!tool_.stage.compare_exchange_strong(wanted, Stage::kIdle)) break;  // just now
    if (closing()) return std::unexpected(over());
    return fail(fmt::format("the run has made no cycle for {:g} s, so there is nothing to begin at",
                            kPatience_s),
                "let its time go on: tandem clock resume");
  }
  return {};
}

Status PredictionService::prepare(std::int64_t horizon_ns) {
  if (Status right = check_horizon(horizon_ns); !right) return right;
  if (cycle_ != nullptr && horizon_ns > prepared_ns_) {
    return fail("a prediction cannot be prepared while the run goes on",
                "name the controller in the experiment");
  }
  prepared_ns_ = std::max(prepared_ns_, horizon_ns);
  return {};
}

bool PredictionService::ask(std::int64_t horizon_ns) noexcept TANDEM_RT {
  if (horizon_ns < period_ns_ || horizon_ns > prepared_ns_) return false;
  asked_ns_ = horizon_ns;
  ++asked_;
  return true;
}

const hal::Prediction* PredictionService::newest() noexcept TANDEM_RT {
  if (answers_ == nullptr) return nullptr;
  any_answer_ = answers_->refresh() || any_answer_;
  return any_answer_ ? &answers_->front() : nullptr;
}

Archive& PredictionService::archive() noexcept TANDEM_RT {
  for_controller_ = controller_wants();
  Archive& archive = for_controller_ ? *controller_.archive : *tool_.archive;
  archive.clear();
  return archive;
}

void PredictionService::taken(std::uint64_t next_cycle, std::int64_t took_ns) noexcept {
  HandOver& to = for_controller_ ? controller_ : tool_;
  to.next_cycle = next_cycle;
  to.took_ns = took_ns;
  if (parallel_ != nullptr) (void)parallel_->snapshot_now(next_cycle);  // wanted() has looked
  if (for_controller_) {
    snapped_ = controller_ticket_ = asked_;
    controller_ns_ = asked_ns_;
  }
  to.stage.store(Stage::kTaken, std::memory_order_release);
  if (!for_controller_ || !simulated_) return;
  news_.notify_all();
  while (controller_waits() && !closing()) std::this_thread::sleep_for(kLook / 4);
  while (answered_.load(std::memory_order_acquire) != snapped_ && !closing()) {
    std::this_thread::sleep_for(kLook / 4);
  }
}

void PredictionService::run() {
  std::unique_lock lock(mutex_);
  while (!closing()) {
    const auto something = [&] { return closing() || question_ != nullptr || controller_waits(); };
    if (answers_ == nullptr) {
      news_.wait(lock, something);
    } else {  // the loop of a robot wakes nobody
      news_.wait_for(lock, std::chrono::milliseconds(1), something);
    }
    if (closing()) break;
    if (controller_waits()) {
      lock.unlock();
      answer_controller();
      lock.lock();
    } else if (question_ != nullptr) {
      Question& question = *question_;
      lock.unlock();
      auto answer = answer_tool(question.horizon_ns);
      lock.lock();
      question.answer = std::move(answer);
      question.done = true;
      question_ = nullptr;
      news_.notify_all();
    }
  }
  if (question_ != nullptr) question_->done = true;  // its answer says that the run is over
  question_ = nullptr;
  news_.notify_all();
}

/// What cannot be answered is no answer: the controller sees the one before.
void PredictionService::answer_controller() {
  const std::int64_t horizon_ns = controller_ns_;
  const std::uint64_t ticket = controller_ticket_;
  if (restore(controller_)) {
    hal::Prediction& out = answers_->back();
    run_ahead(out, horizon_ns, [this] { return closing() || controller_waits(); });
    if (out.end != hal::PredictionEnd::kCancelled) answers_->publish();
  }
  answered_.store(ticket, std::memory_order_release);
}

Result<Answer> PredictionService::answer_tool(std::int64_t horizon_ns) {
  Answer answer;
  answer.loop_bytes = tool_.archive->bytes().size();
  answer.loop_ns = tool_.took_ns;
  if (const Status restored = restore(tool_); !restored) return std::unexpected(restored.error());
  answer.prediction = room_for(fork_->cycle->state().joints(), horizon_ns, period_ns_);
  const std::size_t before = fork_->cycle->fault_log().size();
  run_ahead(answer.prediction, horizon_ns, [this] { return closing(); });
  if (answer.prediction.end == hal::PredictionEnd::kCancelled) return std::unexpected(over());
  answer.unarchived = fork_->unarchived;
  answer.faults = fork_->cycle->faults();
  answer.faults.erase(answer.faults.begin(),
                      answer.faults.begin() + static_cast<std::ptrdiff_t>(before));
  return answer;
}

/// The copy is what the run was at the snapshot.
Status PredictionService::restore(HandOver& from) {
  const bool fits = from.archive->ok();
  std::vector<std::byte> bytes(from.archive->bytes().begin(), from.archive->bytes().end());
  const std::uint64_t next_cycle = from.next_cycle;
  from.stage.store(Stage::kIdle, std::memory_order_release);
  if (!fits) {
    return fail("the run has grown too large for a prediction since it began",
                "unload controllers that were loaded while it went on");
  }
  if (fork_ == nullptr) {
    auto made = make_fork_();
    if (!made) return std::unexpected(made.error());
    fork_ = std::move(*made);
  }
  if (parallel_ != nullptr) {
    const auto model = parallel_->wait_snapshot(next_cycle, kPatience_s);
    if (!model) {
      return fail("the parallel robot is too far behind to predict from",
                  "give the machine less to do, or the run a longer period");
    }
    bytes.insert(bytes.end(), model->begin(), model->end());
  }
  const Status restored = fork_->cycle->restore(bytes);
  if (restored) return {};
  return fail("the run cannot be predicted: " + restored.error().message,
              "a prediction plays the controllers that the experiment names, as they were built at "
              "its start: unload others, and predict a reloaded one in a new run");
}

void PredictionService::run_ahead(hal::Prediction& out, std::int64_t horizon_ns,
                                  const std::function<bool()>& cancelled) {
  using hal::PredictionEnd;
  const std::int64_t wall_ns = clock_ns(CLOCK_MONOTONIC);
  const std::int64_t cpu_ns = clock_ns(CLOCK_THREAD_CPUTIME_ID);
  const auto cycles = static_cast<std::size_t>((horizon_ns + period_ns_ - 1) / period_ns_);
  out.cycles = 0;
  out.end = PredictionEnd::kHorizon;
  bool goes_on = true;
  while (out.cycles < cycles && goes_on) {
    if (cancelled()) {
      out.end = PredictionEnd::kCancelled;
      break;
    }
    goes_on = fork_->cycle->step();
    if (out.cycles == 0) out.first_cycle = fork_->cycle->state().cycle()[0];
    note(*fork_, out);
  }
  if (!goes_on && out.cycles < cycles) {
    out.end = fork_->diverged() ? PredictionEnd::kDiverged : PredictionEnd::kRunOver;
  }
  out.cpu_s = static_cast<double>(clock_ns(CLOCK_THREAD_CPUTIME_ID) - cpu_ns) * 1e-9;
  out.wall_s = static_cast<double>(clock_ns(CLOCK_MONOTONIC) - wall_ns) * 1e-9;
}

}  // namespace tandem::internal_model
