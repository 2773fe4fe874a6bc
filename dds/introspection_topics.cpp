// controller_manager/introspection_data and controller_manager/statistics, as ros2_control's
// pal_statistics publishes them: the same numbers as NAME/full, with their names, and as NAME/names
// and NAME/values. Nothing is gathered while nobody listens.
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dds/hardware_interfaces.hpp"
#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

using pal_statistics_msgs::Statistics;
using pal_statistics_msgs::StatisticsNames;
using pal_statistics_msgs::StatisticsValues;
using NamedNumber = pal_statistics_msgs_msg_dds__Statistic_;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

/// Three topics of one list of numbers.
class NumberTopics {
 public:
  /// @param every  whose rate is theirs
  NumberTopics(OutputMaker& maker, Topic every, const std::string& name) {
    if (maker.every(every) == 0) return;
    full_ = maker.periodic<Statistics>(every, name + "/full");
    names_ = maker.latched<StatisticsNames>(name + "/names");
    values_ = maker.periodic<StatisticsValues>(every, name + "/values");
  }
  [[nodiscard]] bool wanted() const {
    return full_.wanted() || names_.wanted() || values_.wanted();
  }
  /// What the numbers are called from now on, and that they are when it is something else.
  void call(std::vector<std::string> names, std::int64_t stamp_ns);
  /// @pre  as many as names
  void write(std::span<const double> values, std::int64_t stamp_ns);

 private:
  [[nodiscard]] std_msgs_msg_dds__Header_ header(std::int64_t stamp_ns) const {
    return {ros_time(stamp_ns), refer(no_frame_)};
  }

  std::string no_frame_;
  std::vector<std::string> texts_;
  std::unique_ptr<TextList> list_;  // of texts_
  std::uint32_t version_ = 0;
  std::vector<NamedNumber> named_;  // reused
  Output<Statistics> full_;
  Output<StatisticsNames> names_;
  Output<StatisticsValues> values_;
};

void NumberTopics::call(std::vector<std::string> names, std::int64_t stamp_ns) {
  if (list_ != nullptr && names == texts_) return;
  texts_ = std::move(names);
  list_ = std::make_unique<TextList>(texts_);
  ++version_;
  StatisticsNames message{};
  message.header = header(stamp_ns);
  refer(message.names, list_->get());
  message.names_version = version_;
  names_.write(message);
}

void NumberTopics::write(std::span<const double> values, std::int64_t stamp_ns) {
  if (values_.wanted()) {
    StatisticsValues message{};
    message.header = header(stamp_ns);
    refer(message.values, values);
    message.names_version = version_;
    values_.write(message);
  }
  if (!full_.wanted()) return;
  named_.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) named_[i] = {list_->get()[i], values[i]};
  Statistics message{};
  message.header = header(stamp_ns);
  refer(message.statistics, std::span<const NamedNumber>(named_));
  full_.write(message);
}

/// A distribution's figures.
struct FigureRow {
  const char* name;
  std::int64_t rt::Percentiles::*value;
};
constexpr std::array<FigureRow, 4> kFigures{{{"p50", &rt::Percentiles::p50},
                                             {"p99", &rt::Percentiles::p99},
                                             {"p999", &rt::Percentiles::p999},
                                             {"max", &rt::Percentiles::max}}};
/// The loop's.
struct LoopRow {
  const char* name;
  rt::Histogram CycleRecord::*times;
};
constexpr std::array<LoopRow, 3> kLoopTimes{{{"wakeup_time", &CycleRecord::wakeup},
                                             {"bus_time", &CycleRecord::bus},
                                             {"work_time", &CycleRecord::work}}};
struct CountRow {
  const char* name;
  std::uint64_t CycleRecord::*count;
};
constexpr std::array<CountRow, 4> kLoopCounts{{{"cycles", &CycleRecord::cycles},
                                               {"overruns", &CycleRecord::overruns},
                                               {"skipped", &CycleRecord::skipped},
                                               {"dropped", &CycleRecord::dropped}}};

/// Names and numbers of one sample.
struct Numbers {
  std::vector<std::string> names;
  std::vector<double> values;

  void add(std::string name, double value) {
    names.push_back(std::move(name));
    values.push_back(value);
  }
  void add(const std::string& name, const rt::Percentiles& times) {
    constexpr double kMicrosecond = 1e3;
    for (const FigureRow& row : kFigures) {
      add(name + "/" + row.name,
          times.max == 0 ? kNoNumber : static_cast<double>(times.*row.value) / kMicrosecond);
    }
  }
};

class IntrospectionTopics final : public TopicGroup {
 public:
  IntrospectionTopics(OutputMaker& maker, const RunDescription& run);
  void follow(const ControllerFeed& feed) override { feed_ = feed; }
  void publish(const CycleSample& sample) override;

 private:
  void renew(std::int64_t stamp_ns);
  void publish_interfaces(const CycleSample& sample);
  void publish_statistics(const CycleSample& sample);

  std::vector<std::string> joints_;
  std::vector<hal::MotorFeedback> tells_;  // of each joint's drive
  std::vector<std::string> interfaces_;    // names of what is no controller's
  std::function<std::vector<std::pair<std::string, rt::Percentiles>>()> controllers_;
  ControllerFeed feed_;
  std::uint64_t version_ = 0;  // of signals_
  std::vector<ControllerFeed::Signals> signals_;
  std::vector<double> values_;  // reused
  NumberTopics data_, statistics_;
};

IntrospectionTopics::IntrospectionTopics(OutputMaker& maker, const RunDescription& run)
    : tells_(hal::motor_feedback(run.robot)),
      controllers_(run.controllers),
      data_(maker, Topic::kIntrospection, "controller_manager/introspection_data"),
      statistics_(maker, Topic::kStatistics, "controller_manager/statistics") {
  for (const hal::JointConfig& joint : run.robot.joints) joints_.push_back(joint.name);
  for (const std::string& joint : joints_) {
    for (const CommandInterface& one : kCommandInterfaces)
      interfaces_.push_back("command_interface." + joint + "/" + one.name);
  }
  for (const std::string& joint : joints_) {
    for (const StateInterface& one : kStateInterfaces)
      interfaces_.push_back("state_interface." + joint + "/" + one.name);
  }
  for (const hal::SensorConfig& sensor : run.robot.sensors) {
    for (const char* const one : sensor_interfaces(sensor.type))
      interfaces_.push_back("state_interface." + sensor.name + "/" + one);
  }
}

void IntrospectionTopics::publish(const CycleSample& sample) {
  if (sample.is_due(Topic::kIntrospection) && data_.wanted()) publish_interfaces(sample);
  if (sample.is_due(Topic::kStatistics) && statistics_.wanted()) publish_statistics(sample);
}

/// Controllers have come or gone, or nobody has listened yet.
void IntrospectionTopics::renew(std::int64_t stamp_ns) {
  const std::uint64_t version = feed_.version ? feed_.version() : 1;
  if (version == version_) return;
  version_ = version;
  signals_ = feed_.signals ? feed_.signals() : std::vector<ControllerFeed::Signals>();
  std::vector<std::string> names = interfaces_;
  for (const auto& [controller, block] : signals_) {
    for (const std::string& name : block->number_names(joints_))
      names.push_back(controller + "." + name);
  }
  data_.call(std::move(names), stamp_ns);
}

void IntrospectionTopics::publish_interfaces(const CycleSample& sample) {
  renew(sample.stamp_ns);
  const hal::StateImage& state = sample.state;
  values_.clear();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    for (const CommandInterface& one : kCommandInterfaces)
      values_.push_back((sample.command.*one.values)()[j]);
  }
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const bool heard = state.age_cycles()[j] <= state.cycle()[0];
    for (const StateInterface& one : kStateInterfaces) {
      const bool told = one.told == nullptr || tells_[j].*one.told;
      values_.push_back(heard && told ? (state.*one.values)()[j] : kNoNumber);
    }
  }
  values_.insert(values_.end(), state.sensor().begin(), state.sensor().end());
  for (const auto& [controller, block] : signals_) {
    const hal::SignalBlock::Look look = block->look();
    values_.insert(values_.end(), look.values.begin(), look.values.end());
    values_.insert(values_.end(), block->numbers() - look.values.size(), kNoNumber);
  }
  data_.write(values_, sample.stamp_ns);
}

void IntrospectionTopics::publish_statistics(const CycleSample& sample) {
  Numbers all;
  for (const CountRow& row : kLoopCounts)
    all.add(std::string("controller_manager.") + row.name,
            static_cast<double>(sample.loop.*row.count));
  for (const LoopRow& row : kLoopTimes)
    all.add(std::string("controller_manager.") + row.name, (sample.loop.*row.times).percentiles());
  if (controllers_) {
    for (const auto& [name, times] : controllers_()) all.add(name + ".stats/execution_time", times);
  }
  statistics_.call(std::move(all.names), sample.stamp_ns);
  statistics_.write(all.values, sample.stamp_ns);
}

}  // namespace

std::unique_ptr<TopicGroup> introspection_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<IntrospectionTopics>(maker, run);
}

}  // namespace tandem::dds
