// take() copies times and due images into wait-free rings on the loop's thread; run() drains them
// on the publisher's thread and makes the samples.
#include "dds/publisher.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <set>

#include "base/clock_ns.hpp"
#include "base/file_name.hpp"
#include "dds/message_parts.hpp"

namespace tandem::dds {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kTimesSlots = 16'384;
constexpr std::size_t kImageSlots = 512;
constexpr auto kPoll = std::chrono::milliseconds(1);
constexpr auto kClockAtLeast = std::chrono::milliseconds(100);  // while the simulation stands still
constexpr auto kOffsetGood = std::chrono::seconds(1);

constexpr std::uint32_t bit(Topic topic) { return 1U << static_cast<unsigned>(topic); }
constexpr std::uint32_t kNeedsState = bit(Topic::kJointStates) | bit(Topic::kDynamicJointStates) |
                                      bit(Topic::kImu) | bit(Topic::kWrench) | bit(Topic::kTf) |
                                      bit(Topic::kDiagnostics) | bit(Topic::kState);
constexpr std::uint32_t kNeedsCommand = bit(Topic::kCommand);
constexpr std::uint32_t kNeedsTruth = bit(Topic::kTf) | bit(Topic::kOdom);
constexpr std::uint32_t kNeedsEstimate = kNeedsTruth | bit(Topic::kWrench);

constexpr std::size_t aligned(std::size_t bytes) { return (bytes + 15) / 16 * 16; }

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

Result<std::unique_ptr<Publisher>> Publisher::create(Participant& participant,
                                                     const RunDescription& run) {
  if (const Status names = check_names(run.robot, run.wrenches); !names)
    return std::unexpected(names.error());
  std::unique_ptr<Publisher> made(new Publisher(participant, run));
  if (made->error_) return std::unexpected(*made->error_);
  return made;
}

Publisher::Publisher(Participant& participant, const RunDescription& run)
    : simulated_time_(run.simulated_time),
      state_(run.robot.shape()),
      command_(run.robot.shape()),
      truth_(run.truth == nullptr ? std::nullopt : std::optional(*run.truth)),
      estimate_(run.estimate == nullptr ? std::nullopt : std::optional(*run.estimate)),
      state_at_(aligned(sizeof(Head))),
      command_at_(state_at_ + aligned(state_.bytes().size())),
      truth_at_(command_at_ + aligned(command_.bytes().size())),
      estimate_at_(truth_at_ + (truth_ ? aligned(truth_->bytes().size()) : 0)),
      times_ring_(aligned(sizeof(Times)), kTimesSlots),
      image_ring_(slot_bytes(), kImageSlots) {
  OutputMaker maker(participant, run.period_ns, counts_);
  for (std::size_t t = 0; t < kTopics; ++t) every_[t] = maker.every(static_cast<Topic>(t));
  if (!run.simulated_time) every_[static_cast<std::size_t>(Topic::kClock)] = 0;
  if (run.truth == nullptr && (!estimate_ || !estimate_->estimates_base()))
    every_[static_cast<std::size_t>(Topic::kOdom)] = 0;
  if (!run.parallel) every_[static_cast<std::size_t>(Topic::kParallel)] = 0;
  if (run.simulated_time) clock_ = maker.periodic<rosgraph_msgs::Clock>(Topic::kClock, "clock");
  for (MakeTopics* topics : {joint_topics, sensor_topics, wrench_topics, frame_topics, image_topics,
                             diagnostic_topics, controller_topics, parameter_topics, mark_topics}) {
    groups_.push_back(topics(maker, run));
  }
  if (run.parallel) groups_.push_back(parallel_topics(maker, run));
  error_ = maker.error();
}

Publisher::~Publisher() { stop(); }

std::size_t Publisher::slot_bytes() const {
  return estimate_at_ + (estimate_ ? aligned(estimate_->bytes().size()) : 0);
}

void Publisher::take(const hal::CycleView& view) noexcept TANDEM_RT {
  const std::uint64_t number = taken_++;
  if (const auto slot = times_ring_.begin_push(); !slot.empty()) {
    const Times times{number, view.times};
    std::memcpy(slot.data(), &times, sizeof(times));
    times_ring_.end_push();
  }
  copy_due(view, number);
  newest_ns_.store(view.time.time_ns, std::memory_order_release);
}

/// The images that a topic is due for in this cycle.
void Publisher::copy_due(const hal::CycleView& view, std::uint64_t number) noexcept TANDEM_RT {
  std::uint32_t due = 0;
  for (std::size_t t = 0; t < kTopics; ++t) {
    if (every_[t] != 0 && view.time.cycle % every_[t] == 0) due |= 1U << t;
  }
  if (due == 0) return;
  const auto slot = image_ring_.begin_push();
  if (slot.empty()) return;
  const std::int64_t wakeup_ns = std::max<std::int64_t>(0, view.times.wakeup_ns);
  const bool truth = truth_ && view.truth != nullptr && (due & kNeedsTruth) != 0;
  const bool estimate = estimate_ && view.estimate != nullptr && (due & kNeedsEstimate) != 0;
  const Head head{number, view.time,  view.times.begin_ns - wakeup_ns,
                  due,    view.phase, view.read_code,
                  truth,  estimate};
  std::memcpy(slot.data(), &head, sizeof(head));
  const auto copy = [&](std::size_t at, std::span<const std::byte> bytes) {
    std::memcpy(slot.data() + at, bytes.data(), bytes.size());
  };
  if ((due & kNeedsState) != 0) copy(state_at_, view.state.bytes());
  if ((due & kNeedsCommand) != 0) copy(command_at_, view.command.bytes());
  if (truth) copy(truth_at_, view.truth->bytes());
  if (estimate) copy(estimate_at_, view.estimate->bytes());
  image_ring_.end_push();
}

void Publisher::start(FaultFeed faults, hal::ParallelSource* parallel,
                      const ControllerFeed& controllers) {
  for (const auto& group : groups_) group->show(parallel);
  for (const auto& group : groups_) group->follow(controllers);
  fault_source_ = std::move(faults);
  wall_offset_ns_ = wall_less_monotonic();
  offset_due_ = SteadyClock::now() + kOffsetGood;
  for (const auto& group : groups_) group->begin(simulated_time_ ? 0 : clock_ns(CLOCK_REALTIME));
  if (simulated_time_) publish_clock();
  thread_ = std::thread([this] { run(); });
}

PublishCounts Publisher::stop() {
  stop_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  counts_.dropped = image_ring_.dropped();
  return counts_;
}

void Publisher::run() {
  for (;;) {
    const bool last = stop_.load(std::memory_order_acquire);  // before the ring is emptied
    const std::int64_t newest_ns = newest_ns_.load(std::memory_order_acquire);  // and this, too
    const bool some = drain();
    look_at_faults();
    const News news{simulated_time_ ? clock_ns_ : clock_ns(CLOCK_REALTIME), stamp_less_time_ns_};
    for (const auto& group : groups_) group->publish_news(news);
    if (!some) clock_ns_ = newest_ns;  // whether or not the cycle had a place in the ring
    if (simulated_time_ && SteadyClock::now() >= clock_due_) publish_clock();
    if (last) return;
    if (!some) std::this_thread::sleep_for(kPoll);
  }
}

/// @return whether there was something to publish
bool Publisher::drain() {
  bool some = false;
  // Not more than the ring holds, so that a fast simulation does not keep the rest from its turn.
  for (std::size_t i = 0; i < kImageSlots; ++i) {
    const auto slot = image_ring_.front();
    if (slot.empty()) break;
    some = true;
    publish(slot);
    image_ring_.pop();
  }
  if (!some) count_times(std::numeric_limits<std::uint64_t>::max());
  return some;
}

/// Takes the times of every cycle up to take()'s call `up_to`.
void Publisher::count_times(std::uint64_t up_to) {
  for (auto slot = times_ring_.front(); !slot.empty(); slot = times_ring_.front()) {
    Times entry{};
    std::memcpy(&entry, slot.data(), sizeof(entry));
    if (entry.number > up_to) return;
    const hal::CycleTimes& times = entry.times;
    ++loop_.cycles;
    loop_.overruns = times.overruns;
    loop_.skipped = times.skipped;
    if (times.wakeup_ns >= 0) loop_.wakeup.record(times.wakeup_ns);
    if (times.bus_ns >= 0) loop_.bus.record(times.bus_ns);
    if (entry.number > 0) loop_.work.record(times.work_ns);  // of the cycle before
    times_ring_.pop();
  }
}

void Publisher::publish(std::span<const std::byte> slot) {
  Head head{};
  std::memcpy(&head, slot.data(), sizeof(head));
  const auto copy = [&](std::span<std::byte> bytes, std::size_t at) {
    std::memcpy(bytes.data(), slot.data() + at, bytes.size());
  };
  if ((head.due & kNeedsState) != 0) copy(state_.bytes(), state_at_);
  if ((head.due & kNeedsCommand) != 0) copy(command_.bytes(), command_at_);
  if (head.truth) copy(truth_->bytes(), truth_at_);
  if (head.estimate) copy(estimate_->bytes(), estimate_at_);
  count_times(head.number);
  loop_.dropped = image_ring_.dropped();
  clock_ns_ = head.time.time_ns;
  const CycleSample sample{.time = head.time,
                           .stamp_ns = stamp_ns(head),
                           .phase = head.phase,
                           .read_code = head.read_code,
                           .due = head.due,
                           .state = state_,
                           .command = command_,
                           .truth = head.truth ? &*truth_ : nullptr,
                           .estimate = head.estimate ? &*estimate_ : nullptr,
                           .loop = loop_,
                           .faults = faults_};
  stamp_less_time_ns_ = sample.stamp_ns - head.time.time_ns;
  if (sample.is_due(Topic::kClock)) publish_clock();  // before what is stamped with it
  for (const auto& group : groups_) group->publish(sample);
}

void Publisher::publish_clock() {
  clock_due_ = SteadyClock::now() + kClockAtLeast;
  if (clock_.wanted()) clock_.write({ros_time(clock_ns_)});
}

void Publisher::look_at_faults() {
  const std::uint64_t version = fault_source_.version();
  if (version == fault_version_) return;
  fault_version_ = version;
  faults_ = fault_source_.faults();
  for (const auto& group : groups_) group->publish_faults(faults_, fault_source_.lost());
}

/// The wall clock may be set or slewed while the loop's clock goes on: it is looked at now and
/// then, on this thread.
std::int64_t Publisher::stamp_ns(const Head& head) {
  if (simulated_time_) return head.time.time_ns;
  const SteadyClock::time_point now = SteadyClock::now();
  if (now >= offset_due_) {
    wall_offset_ns_ = wall_less_monotonic();
    offset_due_ = now + kOffsetGood;
  }
  return head.nominal_ns + wall_offset_ns_;
}

}  // namespace tandem::dds
