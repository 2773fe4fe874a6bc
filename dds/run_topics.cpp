// Which topics there are. Each says what it needs of a cycle; only that is copied.
#include "dds/run_topics.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "base/clock_ns.hpp"
#include "base/file_name.hpp"
#include "dds/message_parts.hpp"

namespace tandem::dds {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr auto kClockAtLeast = std::chrono::milliseconds(100);  // while the simulation stands still
constexpr auto kOffsetGood = std::chrono::seconds(1);

/// CLOCK_REALTIME less CLOCK_MONOTONIC, the reading that was disturbed least.
std::int64_t wall_less_monotonic() {
  std::int64_t offset = 0, best = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < 5; ++i) {
    const std::int64_t before = clock_ns(CLOCK_MONOTONIC);
    const std::int64_t wall = clock_ns(CLOCK_REALTIME);
    const std::int64_t took = clock_ns(CLOCK_MONOTONIC) - before;
    if (took >= best) continue;
    best = took;
    offset = wall - before - took / 2;
  }
  return offset;
}

Status check_names(const hal::RobotConfig& robot, const std::vector<std::string>& wrenches) {
  std::set<std::string> names, sites;
  for (const std::string& site : wrenches) {
    if (sites.insert(topic_token(site)).second) continue;
    return fail(
        "two sites of [[estimation.wrench]] are called '" + topic_token(site) + "' in ROS 2",
        "rename '" + site + "': only letters, digits and _ make a difference");
  }
  for (const hal::SensorConfig& sensor : robot.sensors) {
    if (names.insert(topic_token(sensor.name)).second) continue;
    return fail("two sensors are called '" + topic_token(sensor.name) + "' in ROS 2",
                "rename '" + sensor.name + "': only letters, digits and _ make a difference");
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<RunTopics>> RunTopics::create(Outlets& outlets, const RunDescription& run) {
  if (const Status names = check_names(run.robot, run.wrenches); !names)
    return std::unexpected(names.error());
  std::unique_ptr<RunTopics> made(new RunTopics(outlets, run));
  if (made->error_) return std::unexpected(*made->error_);
  return made;
}

RunTopics::RunTopics(Outlets& outlets, const RunDescription& run)
    : simulated_time_(run.simulated_time) {
  OutputMaker maker(outlets, run.period_ns, counts_);
  for (std::size_t t = 0; t < kTopics; ++t) every_[t] = maker.every(static_cast<Topic>(t));
  const bool bases = run.estimate != nullptr && run.estimate->estimates_base();
  if (!run.simulated_time) every_[static_cast<std::size_t>(Topic::kClock)] = 0;
  if (run.truth == nullptr && !bases) every_[static_cast<std::size_t>(Topic::kOdom)] = 0;
  if (!run.parallel) every_[static_cast<std::size_t>(Topic::kParallel)] = 0;
  if (run.simulated_time) clock_ = maker.periodic<rosgraph_msgs::Clock>(Topic::kClock, "clock");
  for (MakeTopics* topics :
       {joint_topics, sensor_topics, wrench_topics, frame_topics, image_topics, diagnostic_topics,
        controller_topics, parameter_topics, mark_topics, introspection_topics}) {
    groups_.push_back(topics(maker, run));
  }
  if (run.parallel) groups_.push_back(parallel_topics(maker, run));
  error_ = maker.error();
}

void RunTopics::start(FaultFeed faults, hal::ParallelSource* parallel,
                      const ControllerFeed& controllers) {
  for (const auto& group : groups_) group->show(parallel);
  for (const auto& group : groups_) group->follow(controllers);
  fault_source_ = std::move(faults);
  wall_offset_ns_ = wall_less_monotonic();
  offset_due_ = SteadyClock::now() + kOffsetGood;
  for (const auto& group : groups_) group->begin(simulated_time_ ? 0 : clock_ns(CLOCK_REALTIME));
  if (simulated_time_) publish_clock();
}

void RunTopics::count(const hal::CycleTimes& times) {
  const bool first = loop_.cycles++ == 0;
  loop_.overruns = times.overruns;
  loop_.skipped = times.skipped;
  if (times.wakeup_ns >= 0) loop_.wakeup.record(times.wakeup_ns);
  if (times.bus_ns >= 0) loop_.bus.record(times.bus_ns);
  if (!first) loop_.work.record(times.work_ns);  // of the cycle before
}

void RunTopics::publish(const hal::CycleView& cycle, std::uint32_t due) {
  clock_ns_ = cycle.time.time_ns;
  const CycleSample sample{.time = cycle.time,
                           .stamp_ns = stamp_ns(cycle),
                           .phase = cycle.phase,
                           .read_code = cycle.read_code,
                           .due = due,
                           .state = cycle.state,
                           .command = cycle.command,
                           .truth = cycle.truth,
                           .estimate = cycle.estimate,
                           .loop = loop_,
                           .faults = faults_};
  stamp_less_time_ns_ = sample.stamp_ns - cycle.time.time_ns;
  if (sample.is_due(Topic::kClock)) publish_clock();  // before what is stamped with it
  for (const auto& group : groups_) group->publish(sample);
}

void RunTopics::publish_news(std::optional<std::int64_t> newest_ns) {
  look_at_faults();
  const News news{simulated_time_ ? clock_ns_ : clock_ns(CLOCK_REALTIME), stamp_less_time_ns_};
  for (const auto& group : groups_) group->publish_news(news);
  if (newest_ns) clock_ns_ = *newest_ns;
  if (simulated_time_ && SteadyClock::now() >= clock_due_) publish_clock();
}

void RunTopics::publish_clock() {
  clock_due_ = SteadyClock::now() + kClockAtLeast;
  if (clock_.wanted()) clock_.write({ros_time(clock_ns_)});
}

void RunTopics::look_at_faults() {
  const std::uint64_t version = fault_source_.version();
  if (version == fault_version_) return;
  fault_version_ = version;
  faults_ = fault_source_.faults();
  for (const auto& group : groups_) group->publish_faults(faults_, fault_source_.lost());
}

/// The wall clock may be set or slewed while the loop's clock goes on: it is looked at now and
/// then, on this thread.
std::int64_t RunTopics::stamp_ns(const hal::CycleView& cycle) {
  if (simulated_time_) return cycle.time.time_ns;
  const SteadyClock::time_point now = SteadyClock::now();
  if (now >= offset_due_) {
    wall_offset_ns_ = wall_less_monotonic();
    offset_due_ = now + kOffsetGood;
  }
  const std::int64_t wakeup_ns = std::max<std::int64_t>(0, cycle.times.wakeup_ns);
  return cycle.times.begin_ns - wakeup_ns + wall_offset_ns_;
}

}  // namespace tandem::dds
