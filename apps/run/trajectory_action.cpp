#include "apps/run/trajectory_action.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

namespace tandem::apps {
namespace {

using GoalClock = TrajectoryGoals::Clock;
using SignalName = TrajectorySignals;

constexpr std::uint64_t kOfAction = ~std::uint64_t{0};   // for the lease: no handle of a writer
constexpr std::chrono::milliseconds kGoalLook{10};       // between two looks at a goal
constexpr std::chrono::milliseconds kFeedbackEvery{50};  // as joint_trajectory_controller's default

builtin_interfaces_msg_dds__Time_ to_time(std::int64_t ns) {
  return {.sec = static_cast<std::int32_t>(ns / 1'000'000'000),
          .nanosec = static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

GoalId id_of(const unique_identifier_msgs_msg_dds__UUID_& uuid) {
  GoalId id{};
  std::ranges::copy(uuid.uuid, id.begin());
  return id;
}

action_msgs_msg_dds__GoalInfo_ info_of(const TrajectoryGoal& goal) {
  action_msgs_msg_dds__GoalInfo_ info{.goal_id = {}, .stamp = to_time(goal.stamp_ns)};
  std::ranges::copy(goal.id, info.goal_id.uuid);
  return info;
}

/// `values` as a sequence of the message's type.
template <class Sequence, class Values>
Sequence sequence_of(Values& values) {
  const auto size = static_cast<std::uint32_t>(values.size());
  return {._maximum = size, ._length = size, ._buffer = values.data(), ._release = false};
}

}  // namespace

TrajectoryAction::TrajectoryAction(std::shared_ptr<runtime::InputPort> port, const FeedParts& parts,
                                   std::shared_ptr<InputLease> lease)
    : port_(std::move(port)), parts_(parts), lease_(std::move(lease)) {}

Result<std::unique_ptr<TrajectoryAction>> TrajectoryAction::open(
    std::shared_ptr<runtime::InputPort> port, const FeedParts& parts,
    std::shared_ptr<InputLease> lease) {
  const std::string given = port->source().action;
  const std::string name = given.starts_with('/') ? given : port->controller() + "/" + given;
  std::unique_ptr<TrajectoryAction> action(
      new TrajectoryAction(std::move(port), parts, std::move(lease)));
  if (const Status made = action->make(name); !made) return std::unexpected(made.error());
  action->watcher_ = std::thread([&one = *action] { one.watch(); });
  return action;
}

Status TrajectoryAction::make(const std::string& name) {
  if (const Status found = find_signals(); !found) return found;
  dds::Participant& participant = parts_.participant;
  const std::string topic = "rt" + dds::full_name(participant, name) + "/_action/";
  auto feedback = dds::Writer<Feedback>::create(participant, topic + "feedback", {});
  if (!feedback) return std::unexpected(feedback.error());
  feedback_ = std::make_unique<dds::Writer<Feedback>>(std::move(*feedback));
  auto status = dds::Writer<StatusArray>::create(participant, topic + "status",
                                                 {.transient_local = true, .depth = 1});
  if (!status) return std::unexpected(status.error());
  status_ = std::make_unique<dds::Writer<StatusArray>>(std::move(*status));
  auto server = dds::ServiceServer::open(participant);
  if (!server) return std::unexpected(server.error());
  server_ = std::move(*server);
  const Status added[]{
      server_->add<SendRequest, SendResponse>(
          name + "/_action/send_goal",
          [this](const SendRequest& request, const dds::Asker& asker) {
            return read(request, asker);
          }),
      server_->add<ResultRequest, ResultResponse>(
          name + "/_action/get_result",
          [this](const ResultRequest& request, const dds::Asker&) { return read(request); }),
      server_->add<CancelRequest, CancelResponse>(
          name + "/_action/cancel_goal",
          [this](const CancelRequest& request, const dds::Asker& asker) {
            return read(request, asker);
          }),
  };
  for (const Status& one : added) {
    if (!one) return one;
  }
  return server_->start(true);
}

TrajectoryAction::~TrajectoryAction() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    if (TrajectoryGoal* const goal = goals_.active()) {
      end(*goal, GoalStatus::kAborted, TrajectoryError::kInvalidGoal, "the run has ended");
    }
    more_.notify_all();
  }
  if (watcher_.joinable()) watcher_.join();
}

/// On the clock that stamps of goals are of.
std::int64_t TrajectoryAction::now_ns() const {
  if (parts_.simulated_time) return parts_.services.time_ns();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// Those of the controller as it is loaded now.
Status TrajectoryAction::find_signals() {
  loads_ = parts_.services.loads();
  for (const runtime::ControllerSignals& one : parts_.services.signals()) {
    if (one.controller != port_->controller()) continue;
    const auto told = one.block->declared();
    if (std::ranges::find(told, SignalName::kOutcome, &hal::SignalInfo::name) == told.end()) break;
    signals_ = one.block;
    return {};
  }
  Error error = port_->source().where;
  error.message = "'" + port_->controller() + "' does not tell how a trajectory ends";
  error.hint = "leave `action` out, or use trajectory_follower";
  return std::unexpected(std::move(error));
}

TrajectoryAction::Told TrajectoryAction::told() const {
  const hal::SignalBlock::Look look = signals_->look();
  const auto of = [&](const char* name) {
    const auto its = std::ranges::find(signals_->declared(), name, &hal::SignalInfo::name);
    return its == signals_->declared().end() || look.values.size() <= its->first
               ? -1.0
               : look.values[its->first];
  };
  return {of(SignalName::kCycle),     of(SignalName::kOutcome),
          of(SignalName::kJoint),     of(SignalName::kError),
          of(SignalName::kTolerance), of(SignalName::kOfVelocity),
          of(SignalName::kTime),      look.cycle};
}

// ---- requests ----

/// Accepted, the goal leads from the next cycle on. One before it that is under way is aborted.
Status TrajectoryAction::accept(const SendRequest& request, const dds::Asker& asker,
                                std::int64_t now) {
  if (const Status may = lease_->check(asker); !may) return may;
  const GoalId id = id_of(request.goal_id);
  if (goals_.find(id) != nullptr) return fail("this goal is known already", "give each its own id");
  const auto sample = runtime::goal_sample(request.goal, port_->input(), now);
  if (!sample) return std::unexpected(sample.error());
  if (const Status fits = port_->check(*sample); !fits) return fits;
  if (const Status may = lease_->take(*port_, asker, kOfAction); !may) return may;
  const auto number = port_->offer(runtime::InputFeeder::kTopic, *sample);
  if (!number) return std::unexpected(number.error());
  if (TrajectoryGoal* const former = goals_.active()) {
    end(*former, GoalStatus::kAborted, TrajectoryError::kInvalidGoal,
        "Current goal preempted by new incoming action.");
  }
  lease_->keep(true);
  const double start_s = (*sample)[port_->input().terms_at()];
  goals_.add({.id = id,
              .stamp_ns = now,
              .begin_ns = now + static_cast<std::int64_t>(std::llround(start_s * 1e9)),
              .sample = *number,
              .cycle = {},
              .words = {},
              .ended_at = {}},
             GoalClock::now());
  say_status();
  more_.notify_all();
  return {};
}

dds::ServiceWork<TrajectoryAction::SendResponse> TrajectoryAction::read(const SendRequest& request,
                                                                        const dds::Asker& asker) {
  const std::lock_guard lock(mutex_);
  if (auto heir = port_->heir()) port_ = std::move(heir);  // its controller was reloaded
  const std::int64_t now = now_ns();
  const Status accepted = ending_ ? fail("the run ends") : accept(request, asker, now);
  if (!accepted) port_->refuse(accepted.error());
  return {.at_once = true, .answer = [now, yes = accepted.has_value()](SendResponse& reply, auto&) {
            reply.accepted = yes;
            reply.stamp = to_time(now);
          }};
}

dds::ServiceWork<TrajectoryAction::ResultResponse> TrajectoryAction::read(
    const ResultRequest& request) {
  const GoalId id = id_of(request.goal_id);
  return {.at_once = true,
          .answer =
              [this, id](ResultResponse& reply, dds::ReplyMemory& memory) {
                const std::lock_guard lock(mutex_);
                const TrajectoryGoal* const goal = goals_.find(id);
                reply.result.error_string = memory.text(goal == nullptr ? "" : goal->words);
                if (goal == nullptr) return;  // STATUS_UNKNOWN
                reply.status = static_cast<std::int8_t>(goal->status);
                reply.result.error_code = static_cast<std::int32_t>(goal->error);
              },
          .ready =
              [this, id] {
                const std::lock_guard lock(mutex_);
                const TrajectoryGoal* const goal = goals_.find(id);
                return goal == nullptr || has_ended(goal->status);
              }};
}

dds::ServiceWork<TrajectoryAction::CancelResponse> TrajectoryAction::read(
    const CancelRequest& request, const dds::Asker& asker) {
  const std::lock_guard lock(mutex_);
  const auto& stamp = request.goal_info.stamp;
  bool is_active = false;
  CancelCode code =
      goals_.wants_cancelled(id_of(request.goal_info.goal_id),
                             std::int64_t{stamp.sec} * 1'000'000'000 + stamp.nanosec, is_active);
  if (is_active) {
    const Status may = lease_->check(asker);
    if (!may) {
      port_->refuse(may.error());
      code = CancelCode::kRejected;
      is_active = false;
    } else if (goals_.active()->status == GoalStatus::kExecuting) {
      stop(*goals_.active());
    }
  }
  const action_msgs_msg_dds__GoalInfo_ info =
      is_active ? info_of(*goals_.active()) : action_msgs_msg_dds__GoalInfo_{};
  return {.at_once = true,
          .answer = [code, is_active, info](CancelResponse& reply, dds::ReplyMemory& memory) {
            reply.return_code = static_cast<std::int8_t>(code);
            auto* const one = memory.array<action_msgs_msg_dds__GoalInfo_>(is_active ? 1 : 0);
            if (one != nullptr) *one = info;
            reply.goals_canceling._buffer = one;
            reply.goals_canceling._length = reply.goals_canceling._maximum = is_active ? 1 : 0;
          }};
}

/// Its references come to rest; then it is cancelled.
void TrajectoryAction::stop(TrajectoryGoal& goal) {
  const std::vector<double> nothing(port_->input().values(), 0.0);
  const auto number = port_->offer(runtime::InputFeeder::kTopic, nothing);
  if (!number) return;  // no input refuses this
  goal.status = GoalStatus::kCanceling;
  goal.sample = *number;
  goal.cycle.reset();
  say_status();
}

// ---- how a goal stands ----

void TrajectoryAction::watch() {
  std::unique_lock lock(mutex_);
  GoalClock::time_point fed_back;
  while (!ending_) {
    TrajectoryGoal* const goal = goals_.active();
    if (goal == nullptr) {
      more_.wait(lock);
      continue;
    }
    if (look_at(*goal) && GoalClock::now() - fed_back >= kFeedbackEvery) {
      fed_back = GoalClock::now();
      say_feedback(*goal);
    }
    more_.wait_for(lock, kGoalLook);
  }
}

bool TrajectoryAction::look_at(TrajectoryGoal& goal) {
  if (auto heir = port_->heir()) port_ = std::move(heir);
  const Status runs = parts_.services.check_runs(*port_);
  const bool told = parts_.services.loads() == loads_ || find_signals().has_value();
  if (!runs || !told) {
    end(goal, goal.status == GoalStatus::kCanceling ? GoalStatus::kCanceled : GoalStatus::kAborted,
        TrajectoryError::kInvalidGoal,
        runs ? "its controller is unloaded" : "stopped: " + runs.error().message);
    return false;
  }
  if (!goal.cycle) goal.cycle = port_->taken(goal.sample);
  if (goal.cycle) judge(goal);
  return !has_ended(goal.status);
}

void TrajectoryAction::judge(TrajectoryGoal& goal) {
  const Told now = told();
  if (now.cycle != static_cast<double>(*goal.cycle)) {
    if (now.at_cycle <= *goal.cycle) return;  // the signals of that cycle are not out yet
    return end(goal, GoalStatus::kAborted, TrajectoryError::kInvalidGoal,
               "its controller has left the trajectory");
  }
  const auto outcome = static_cast<TrajectoryOutcome>(now.outcome);
  switch (outcome) {
    case TrajectoryOutcome::kUnderWay: return;
    case TrajectoryOutcome::kReached:
      return end(goal, GoalStatus::kSucceeded, TrajectoryError::kNone,
                 "Goal successfully reached!");
    case TrajectoryOutcome::kHolds:
      return end(goal, GoalStatus::kCanceled, TrajectoryError::kNone, "cancelled: the joints hold");
    case TrajectoryOutcome::kOffPath:
      return end(goal, GoalStatus::kAborted, TrajectoryError::kPathTolerance, words_of(outcome));
    case TrajectoryOutcome::kOffGoal:
      return end(goal, GoalStatus::kAborted, TrajectoryError::kGoalTolerance, words_of(outcome));
  }
}

/// Joint, error, tolerance and time.
std::string TrajectoryAction::words_of(TrajectoryOutcome outcome) const {
  const Told now = told();
  const auto joint = static_cast<std::size_t>(std::max(now.joint, 0.0));
  const std::vector<std::string>& names = port_->input().components;
  const bool path = outcome == TrajectoryOutcome::kOffPath;
  const char* const unit = now.of_velocity == 0.0 ? "rad" : "rad/s";
  return fmt::format(
      "joint '{}' is {:.4g} {} from its {}, beyond the tolerance of {:.4g} {}, "
      "{:.3f} s after the trajectory's beginning: the joints hold",
      joint < names.size() ? names[joint] : "", std::abs(now.error), unit,
      path ? "reference" : "goal", now.tolerance, unit, now.time_s);
}

void TrajectoryAction::end(TrajectoryGoal& goal, GoalStatus status, TrajectoryError error,
                           std::string words) {
  goals_.end(goal, status, error, std::move(words), GoalClock::now());
  lease_->keep(false);
  say_status();
  server_->wake();
}

void TrajectoryAction::say_status() {
  std::vector<action_msgs_msg_dds__GoalStatus_> list;
  for (const TrajectoryGoal& goal : goals_.all()) {
    list.push_back({.goal_info = info_of(goal), .status = static_cast<std::int8_t>(goal.status)});
  }
  StatusArray message{};
  message.status_list = sequence_of<decltype(message.status_list)>(list);
  (void)status_->write(message);
}

/// The references are of positions alone.
void TrajectoryAction::say_feedback(const TrajectoryGoal& goal) {
  std::vector<std::string> names = port_->input().components;
  std::vector<double> wanted(names.size(), 0.0), is(wanted), speed(wanted), off(wanted);
  for (const runtime::JointInfo& joint : parts_.services.joints()) {
    const auto at = static_cast<std::size_t>(std::ranges::find(names, joint.name) - names.begin());
    if (at == names.size()) continue;
    wanted[at] = joint.look.commanded_rad;
    is[at] = joint.look.position_rad;
    speed[at] = joint.look.velocity_rad_s;
    off[at] = is[at] - wanted[at];
  }
  std::vector<char*> texts;
  for (std::string& name : names) texts.push_back(name.data());
  std::string frame;
  const std::int64_t now = now_ns();
  const auto after = to_time(std::max<std::int64_t>(now - goal.begin_ns, 0));
  Feedback message{};
  std::ranges::copy(goal.id, message.goal_id.uuid);
  auto& its = message.feedback;
  its.header.stamp = to_time(now);
  its.header.frame_id = frame.data();
  its.joint_names = sequence_of<decltype(its.joint_names)>(texts);
  its.desired.positions = sequence_of<decltype(its.desired.positions)>(wanted);
  its.actual.positions = sequence_of<decltype(its.actual.positions)>(is);
  its.actual.velocities = sequence_of<decltype(its.actual.velocities)>(speed);
  its.error.positions = sequence_of<decltype(its.error.positions)>(off);
  for (auto* point : {&its.desired, &its.actual, &its.error}) {
    point->time_from_start = {.sec = after.sec, .nanosec = after.nanosec};
  }
  (void)feedback_->write(message);
}

}  // namespace tandem::apps
