// tandem/state, command, statistics, faults and robot: the whole truth, in types of our own.
// Copies the images field by field into tandem_msgs, and the loop's histograms of every cycle.
#include <memory>
#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

std::vector<std::string> names(const auto& items) {
  std::vector<std::string> found;
  for (const auto& item : items) found.push_back(item.name);
  return found;
}

using Bin = tandem_msgs_msg_dds__HistogramBin_;

tandem_msgs_msg_dds__Histogram_ message_of(const rt::Histogram& histogram, std::vector<Bin>& bins) {
  for (const rt::HistogramBin& bin : histogram.bins()) bins.push_back({bin.upper_ns, bin.count});
  const rt::Percentiles p = histogram.percentiles();
  tandem_msgs_msg_dds__Histogram_ message{};
  message.count = histogram.count();
  message.p50_ns = p.p50;
  message.p99_ns = p.p99;
  message.p999_ns = p.p999;
  message.max_ns = p.max;
  refer(message.bins, std::span<const Bin>(bins));
  return message;
}

/// A message's member takes an image's field: a number, or a list.
void fill(auto& member, const auto& field) {
  if constexpr (std::is_arithmetic_v<std::remove_reference_t<decltype(member)>>) {
    member = field.front();
  } else {
    refer(member, field);
  }
}

class ImageTopics final : public TopicGroup {
 public:
  ImageTopics(OutputMaker& maker, const RunDescription& run);
  void begin(std::int64_t stamp_ns) override;
  void publish(const CycleSample& sample) override;
  void publish_faults(const std::vector<FaultEntry>& faults, std::uint64_t lost) override;

 private:
  void publish_state(const CycleSample& sample);
  void publish_command(const CycleSample& sample);
  void publish_statistics(const CycleSample& sample);

  std::uint64_t run_;
  std::string robot_, version_, hal_, hash_;
  std::int64_t period_ns_;
  TextList joints_, sensors_;
  std::vector<std::uint32_t> channels_;
  Output<tandem_msgs::State> state_;
  Output<tandem_msgs::Command> command_;
  Output<tandem_msgs::LoopStatistics> statistics_;
  Output<tandem_msgs::Robot> description_;
  Output<tandem_msgs::Faults> faults_;
};

ImageTopics::ImageTopics(OutputMaker& maker, const RunDescription& run)
    : run_(run.run),
      robot_(run.robot.name),
      version_(run.version),
      hal_(run.hal),
      hash_(run.description_hash),
      period_ns_(run.period_ns),
      joints_(names(run.robot.joints)),
      sensors_(names(run.robot.sensors)),
      state_(maker.periodic<tandem_msgs::State>(Topic::kState, "tandem/state")),
      command_(maker.periodic<tandem_msgs::Command>(Topic::kCommand, "tandem/command")),
      statistics_(
          maker.periodic<tandem_msgs::LoopStatistics>(Topic::kStatistics, "tandem/statistics")),
      description_(maker.latched<tandem_msgs::Robot>("tandem/robot")),
      faults_(maker.latched<tandem_msgs::Faults>("tandem/faults")) {
  for (const hal::SensorConfig& sensor : run.robot.sensors) {
    channels_.push_back(static_cast<std::uint32_t>(sensor.channels()));
  }
}

void ImageTopics::begin(std::int64_t /*stamp_ns*/) {
  tandem_msgs::Robot message{};
  message.run = run_;
  message.name = refer(robot_);
  message.version = refer(version_);
  message.hal = refer(hal_);
  message.description_hash = refer(hash_);
  message.period_ns = period_ns_;
  refer(message.joints, joints_.get());
  refer(message.sensors, sensors_.get());
  refer(message.sensor_channels, std::span<const std::uint32_t>(channels_));
  description_.write(message);
  publish_faults({}, 0);
}

void ImageTopics::publish(const CycleSample& sample) {
  if (sample.is_due(Topic::kState) && state_.wanted()) publish_state(sample);
  if (sample.is_due(Topic::kCommand) && command_.wanted()) publish_command(sample);
  if (sample.is_due(Topic::kStatistics) && statistics_.wanted()) publish_statistics(sample);
}

void ImageTopics::publish_state(const CycleSample& sample) {
  tandem_msgs::State message{};
  message.run = run_;
  message.phase = static_cast<std::uint8_t>(sample.phase);
  message.code = static_cast<std::uint8_t>(sample.read_code);
#define TANDEM_STATE(member, field) fill(message.member, sample.state.field());
#define TANDEM_COMMAND(member, field)
#include <image_members.inc>
#undef TANDEM_STATE
#undef TANDEM_COMMAND
  state_.write(message);
}

void ImageTopics::publish_command(const CycleSample& sample) {
  tandem_msgs::Command message{};
  message.run = run_;
#define TANDEM_STATE(member, field)
#define TANDEM_COMMAND(member, field) fill(message.member, sample.command.field());
#include <image_members.inc>
#undef TANDEM_STATE
#undef TANDEM_COMMAND
  command_.write(message);
}

void ImageTopics::publish_statistics(const CycleSample& sample) {
  const CycleRecord& loop = sample.loop;
  std::vector<Bin> wakeup, bus, work;
  tandem_msgs::LoopStatistics message{};
  message.run = run_;
  message.cycle = sample.time.cycle;
  message.time_ns = sample.time.time_ns;
  message.cycles = loop.cycles;
  message.overruns = loop.overruns;
  message.skipped = loop.skipped;
  message.dropped = loop.dropped;
  message.wakeup = message_of(loop.wakeup, wakeup);
  message.bus = message_of(loop.bus, bus);
  message.work = message_of(loop.work, work);
  statistics_.write(message);
}

void ImageTopics::publish_faults(const std::vector<FaultEntry>& faults, std::uint64_t lost) {
  std::vector<std::string> categories;
  for (const FaultEntry& fault : faults) categories.emplace_back(hal::to_string(fault.category));
  std::vector<tandem_msgs_msg_dds__Fault_> list;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    const FaultEntry& fault = faults[i];
    list.push_back({.cycle = fault.cycle,
                    .time_s = fault.time_s,
                    .joint = refer(fault.joint),
                    .board = refer(fault.board),
                    .text = refer(fault.text),
                    .category = refer(categories[i]),
                    .latched = fault.latched,
                    .cleared_s = fault.cleared_s});
  }
  tandem_msgs::Faults message{};
  message.run = run_;
  refer(message.faults, std::span<const tandem_msgs_msg_dds__Fault_>(list));
  message.lost = lost;
  faults_.write(message);
}

}  // namespace

std::unique_ptr<TopicGroup> image_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<ImageTopics>(maker, run);
}

}  // namespace tandem::dds
