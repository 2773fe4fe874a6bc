// diagnostics: how run, loop, boards, joints and sensors are, in words.
// Level and text of run, loop and every board, joint and sensor; docs/ros2.md has the thresholds.
#include <fmt/core.h>
#include <algorithm>
#include <iterator>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"
#include "hal/config/capabilities.hpp"
#include "hal/homing.hpp"

namespace tandem::dds {
namespace {

constexpr std::uint32_t kStaleCycles = 10;  // as the loop takes a joint for lost
const std::string kNotKnown{"not known"};   // what a drive does not tell
constexpr double kHotShare = 0.9;           // of the winding's limit

using KeyValue = diagnostic_msgs_msg_dds__KeyValue_;
using StatusMessage = diagnostic_msgs_msg_dds__DiagnosticStatus_;

/// The newest fault of `name` that is latched, a warning only where there is nothing else; null:
/// there is none.
const FaultEntry* latched(const std::vector<FaultEntry>& faults, const std::string& name) {
  const FaultEntry* found = nullptr;
  for (const FaultEntry& fault : faults) {
    if (!fault.latched || fault.joint != name) continue;
    const bool warns = fault.category == hal::StopCategory::kWarn;
    if (found == nullptr || !warns || found->category == hal::StopCategory::kWarn) found = &fault;
  }
  return found;
}

std::string percentiles(const rt::Percentiles& p) {
  const auto us = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
  return fmt::format("{:.1f} / {:.1f} / {:.1f} / {:.1f}", us(p.p50), us(p.p99), us(p.p999),
                     us(p.max));
}

std::string percentiles(const rt::Histogram& histogram) {
  return percentiles(histogram.percentiles());
}

/// diagnostic_msgs/DiagnosticStatus' levels.
enum class HealthLevel : std::uint8_t { kOk = 0, kWarn = 1, kError = 2, kStale = 3 };

/// One status before it becomes a message.
struct HealthStatus {
  HealthLevel level = HealthLevel::kOk;
  std::string name, message, hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

class DiagnosticTopics final : public TopicGroup {
 public:
  DiagnosticTopics(OutputMaker& maker, const RunDescription& run);
  void publish(const CycleSample& sample) override;

  /// Everything that a message says: the run, the loop, then each board, joint and sensor.
  [[nodiscard]] std::vector<HealthStatus> statuses(const CycleSample& sample);

 private:
  [[nodiscard]] HealthStatus run(const CycleSample& sample) const;
  [[nodiscard]] HealthStatus loop(const CycleSample& sample);
  [[nodiscard]] HealthStatus joint(const CycleSample& sample, std::size_t index) const;
  [[nodiscard]] HealthStatus sensor(const CycleSample& sample, std::size_t index) const;

  const hal::RobotConfig& robot_;
  std::string hal_, no_frame_;
  const decltype(RunDescription::controllers) controllers_;
  std::vector<hal::MotorFeedback> tells_;  // of each joint's drive
  std::uint64_t told_overruns_ = 0, told_dropped_ = 0;
  Output<diagnostic_msgs::DiagnosticArray> output_;
};

DiagnosticTopics::DiagnosticTopics(OutputMaker& maker, const RunDescription& run)
    : robot_(run.robot),
      hal_(run.hal),
      controllers_(run.controllers),
      tells_(hal::motor_feedback(run.robot)),
      output_(
          maker.periodic<diagnostic_msgs::DiagnosticArray>(Topic::kDiagnostics, "diagnostics")) {}

HealthStatus DiagnosticTopics::run(const CycleSample& sample) const {
  HealthStatus status{.level = HealthLevel::kOk,
                      .name = "tandem: run",
                      .message = hal::to_string(sample.phase),
                      .hardware_id = robot_.name,
                      .values = {{"hal", hal_},
                                 {"phase", hal::to_string(sample.phase)},
                                 {"cycle", std::to_string(sample.time.cycle)},
                                 {"answer of the robot", to_string(sample.read_code)}}};
  std::size_t latched = 0;
  for (const FaultEntry& fault : sample.faults) {
    if (!fault.latched) continue;
    if (++latched == 1) {
      status.message = fault.joint + (fault.joint.empty() ? "" : ": ") + fault.text;
    }
    const bool warned = fault.category == hal::StopCategory::kWarn;
    status.level = std::max(status.level, warned ? HealthLevel::kWarn : HealthLevel::kError);
  }
  status.values.emplace_back("latched faults", std::to_string(latched));
  if (sample.phase == hal::RunPhase::kFaulted) status.level = HealthLevel::kError;
  return status;
}

HealthStatus DiagnosticTopics::loop(const CycleSample& sample) {
  const CycleRecord& loop = sample.loop;
  HealthStatus status{.level = HealthLevel::kOk,
                      .name = "tandem: loop",
                      .message = "on time",
                      .hardware_id = robot_.name,
                      .values = {{"cycles", std::to_string(loop.cycles)},
                                 {"overruns", std::to_string(loop.overruns)},
                                 {"skipped", std::to_string(loop.skipped)},
                                 {"cycles not published", std::to_string(loop.dropped)},
                                 {"work p50/p99/p99.9/max [us]", percentiles(loop.work)},
                                 {"wake-up p50/p99/p99.9/max [us]", percentiles(loop.wakeup)}}};
  if (loop.bus.count() > 0) {
    status.values.emplace_back("bus p50/p99/p99.9/max [us]", percentiles(loop.bus));
  }
  if (controllers_) {
    for (const auto& [name, times] : controllers_())
      status.values.emplace_back(name + " p50/p99/p99.9/max [us]", percentiles(times));
  }
  if (loop.dropped > told_dropped_) {
    status.level = HealthLevel::kWarn;
    status.message =
        fmt::format("{} cycles were not published: DDS is too slow", loop.dropped - told_dropped_);
  }
  if (loop.overruns > told_overruns_) {
    status.level = HealthLevel::kWarn;
    status.message = fmt::format("{} overruns", loop.overruns - told_overruns_);
  }
  told_dropped_ = loop.dropped;
  told_overruns_ = loop.overruns;
  return status;
}

HealthStatus DiagnosticTopics::joint(const CycleSample& sample, std::size_t index) const {
  const hal::StateImage& state = sample.state;
  const hal::JointConfig& config = robot_.joints[index];
  const auto drive = static_cast<hal::DriveState>(state.drive_state()[index]);
  const std::uint32_t age = state.age_cycles()[index];
  const double temperature_C = state.temperature_C()[index];
  HealthStatus status{
      .level = HealthLevel::kOk,
      .name = "tandem: joint " + config.name,
      .message = hal::to_string(drive),
      .hardware_id = config.board,
      .values = {
          {"drive", hal::to_string(drive)},
          {"mode", hal::to_string(static_cast<hal::ControlMode>(state.mode()[index]))},
          {"fault", fmt::format("0x{:04X}", state.fault()[index])},
          {"temperature [C]",
           tells_[index].temperature ? fmt::format("{:.1f}", temperature_C) : kNotKnown},
          {"current [A]",
           tells_[index].current ? fmt::format("{:.2f}", state.current_A()[index]) : kNotKnown},
          {"age [cycles]", std::to_string(age)}}};
  const auto homing = static_cast<hal::HomingState>(state.homing()[index]);
  if (homing != hal::HomingState::kNone) {
    status.values.push_back({"homing", hal::to_string(homing)});
  }
  const FaultEntry* const fault = latched(sample.faults, config.name);
  if (state.fault()[index] != 0 || fault != nullptr) {
    const bool warns = state.fault()[index] == 0 && age <= kStaleCycles &&
                       fault->category == hal::StopCategory::kWarn;
    status.level = warns ? HealthLevel::kWarn : HealthLevel::kError;
    status.message =
        fault == nullptr ? fmt::format("fault 0x{:04X}", state.fault()[index]) : fault->text;
  } else if (drive == hal::DriveState::kUnknown || age > kStaleCycles) {
    status.level = HealthLevel::kStale;
    status.message = fmt::format("no feedback for {} cycles", age);
  } else if (tells_[index].temperature &&
             temperature_C >= kHotShare * config.drive.temperature_limit_C) {
    status.level = HealthLevel::kWarn;
    status.message = fmt::format("the winding is hot: {:.0f} of at most {:.0f} C", temperature_C,
                                 config.drive.temperature_limit_C);
  } else if (drive == hal::DriveState::kQuickStopActive) {
    status.level = HealthLevel::kWarn;
  } else if (homing == hal::HomingState::kNotHomed && config.homing && config.homing->required) {
    status.level = HealthLevel::kWarn;
    status.message += ", not homed";
  }
  return status;
}

HealthStatus DiagnosticTopics::sensor(const CycleSample& sample, std::size_t index) const {
  const hal::SensorConfig& config = robot_.sensors[index];
  const std::uint32_t age = sample.state.sensor_age_cycles()[index];
  HealthStatus status{.level = HealthLevel::kOk,
                      .name = "tandem: sensor " + config.name,
                      .message = "fresh",
                      .hardware_id = fmt::format("{} node {}", config.bus, config.node_id),
                      .values = {{"age [cycles]", std::to_string(age)}}};
  if (const FaultEntry* const fault = latched(sample.faults, config.name); fault != nullptr) {
    status.level = HealthLevel::kError;
    status.message = fault->text;
  } else if (age > kStaleCycles) {
    status.level = HealthLevel::kStale;
    status.message = fmt::format("no feedback for {} cycles", age);
  }
  return status;
}

std::vector<HealthStatus> DiagnosticTopics::statuses(const CycleSample& sample) {
  std::vector<HealthStatus> joints, boards;
  for (std::size_t j = 0; j < robot_.joints.size(); ++j) joints.push_back(joint(sample, j));
  for (const hal::BoardConfig& board : robot_.boards) {
    HealthStatus status{.level = HealthLevel::kOk,
                        .name = "tandem: board " + board.name,
                        .message = "every axis is well",
                        .hardware_id = fmt::format("{} node {}", board.bus, board.node_id),
                        .values = {}};
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (robot_.joints[j].board != board.name) continue;
      const std::string& name = robot_.joints[j].name;
      status.values.emplace_back(name, joints[j].message);
      if (joints[j].level <= status.level) continue;
      status.level = joints[j].level;
      status.message = name + ": " + joints[j].message;
    }
    boards.push_back(std::move(status));
  }
  std::vector<HealthStatus> all{run(sample), loop(sample)};
  std::ranges::move(boards, std::back_inserter(all));
  std::ranges::move(joints, std::back_inserter(all));
  for (std::size_t s = 0; s < robot_.sensors.size(); ++s) all.push_back(sensor(sample, s));
  return all;
}

void DiagnosticTopics::publish(const CycleSample& sample) {
  if (!sample.is_due(Topic::kDiagnostics) || !output_.wanted()) return;
  const std::vector<HealthStatus> all = statuses(sample);
  std::vector<std::vector<KeyValue>> values(all.size());
  std::vector<StatusMessage> messages(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const HealthStatus& status = all[i];
    for (const auto& [key, value] : status.values) values[i].push_back({refer(key), refer(value)});
    messages[i].level = static_cast<std::uint8_t>(status.level);
    messages[i].name = refer(status.name);
    messages[i].message = refer(status.message);
    messages[i].hardware_id = refer(status.hardware_id);
    refer(messages[i].values, std::span<const KeyValue>(values[i]));
  }
  diagnostic_msgs::DiagnosticArray message{};
  message.header = {ros_time(sample.stamp_ns), refer(no_frame_)};
  refer(message.status, std::span<const StatusMessage>(messages));
  output_.write(message);
}

}  // namespace

std::unique_ptr<TopicGroup> diagnostic_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<DiagnosticTopics>(maker, run);
}

}  // namespace tandem::dds
