// tandem/controller/NAME: the signals of every controller that declares some; and /rosout: what
// controllers say.
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

/// The topic of one controller.
struct SignalTopic {
  std::string controller;
  std::shared_ptr<const hal::SignalBlock> block;
  std::unique_ptr<TextList> names, units;  // by number
  Output<tandem_msgs::Signals> output;
  std::int64_t shown_ns = -1;
};

/// Signals have the newest values when a sample is due, once each: their cycle is in it.
class ControllerTopics final : public TopicGroup {
 public:
  ControllerTopics(OutputMaker& maker, const RunDescription& run)
      : maker_(maker), run_(run.run), rosout_(maker.rosout()) {
    for (const hal::JointConfig& joint : run.robot.joints) joints_.push_back(joint.name);
  }
  void follow(const ControllerFeed& feed) override { feed_ = feed; }
  void publish(const CycleSample& sample) override;
  void publish_news(const News& news) override;

 private:
  void renew();
  void publish(SignalTopic& topic);

  OutputMaker maker_;
  std::uint64_t run_;
  std::vector<std::string> joints_;
  ControllerFeed feed_;
  std::uint64_t version_ = 0;
  std::vector<SignalTopic> topics_;
  Output<rcl_interfaces::Log> rosout_;
  std::uint64_t texts_seen_ = 0;
  std::vector<hal::TextEvent> texts_;  // reused
};

void ControllerTopics::publish(const CycleSample& sample) {
  if (!sample.is_due(Topic::kSignals) || !feed_.signals) return;
  if (const std::uint64_t version = feed_.version(); version != version_) {
    version_ = version;
    renew();
  }
  for (SignalTopic& topic : topics_) {
    if (topic.output.wanted()) publish(topic);
  }
}

/// Controllers have come or gone: those that stayed keep their topics.
void ControllerTopics::renew() {
  std::vector<SignalTopic> before = std::exchange(topics_, {});
  for (auto& [controller, block] : feed_.signals()) {
    const auto same = std::ranges::find(before, block, &SignalTopic::block);
    if (same != before.end()) {
      topics_.push_back(std::move(*same));
      before.erase(same);
      continue;
    }
    std::vector<std::string> units;
    for (const hal::SignalInfo& one : block->declared())
      units.insert(units.end(), one.count, one.unit);
    SignalTopic& made = topics_.emplace_back();
    made.controller = controller;
    made.names = std::make_unique<TextList>(block->number_names(joints_));
    made.units = std::make_unique<TextList>(std::move(units));
    made.block = std::move(block);
  }
  before.clear();  // a topic of the same name as a new one ends first
  for (SignalTopic& one : topics_) {
    if (one.output.exists()) continue;
    one.output = maker_.periodic<tandem_msgs::Signals>(Topic::kSignals,
                                                       "tandem/controller/" + one.controller);
  }
}

void ControllerTopics::publish(SignalTopic& topic) {
  const hal::SignalBlock::Look look = topic.block->look();
  if (look.time_ns < 0 || std::exchange(topic.shown_ns, look.time_ns) == look.time_ns) return;
  tandem_msgs::Signals message{};
  message.run = run_;
  message.cycle = look.cycle;
  message.time_ns = look.time_ns;
  message.controller = refer(topic.controller);
  refer(message.names, topic.names->get());
  refer(message.units, topic.units->get());
  refer(message.values, std::span<const double>(look.values));
  topic.output.write(message);
}

void ControllerTopics::publish_news(const News& news) {
  if (!feed_.texts) return;
  texts_.clear();
  feed_.texts(texts_seen_, texts_);
  for (const hal::TextEvent& event : texts_) {
    const std::string name(event.controller()), words = event.words();
    const std::string function = "cycle " + std::to_string(event.cycle), none;
    rcl_interfaces::Log message{};
    message.stamp = ros_time(event.time_ns + news.stamp_less_time_ns);
    message.level = static_cast<std::uint8_t>(event.level);
    message.name = refer(name);
    message.msg = refer(words);
    message.file = refer(none);
    message.function = refer(function);
    rosout_.write(message);
  }
}

}  // namespace

std::unique_ptr<TopicGroup> controller_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<ControllerTopics>(maker, run);
}

}  // namespace tandem::dds
