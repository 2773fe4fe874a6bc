// /parameter_events: which parameters of the node's controllers came, changed and went.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

using ParameterMessage = rcl_interfaces_msg_dds__Parameter_;

/// Two that are no numbers are the same.
bool same_number(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool same_value(const NodeParameter& a, const NodeParameter& b) {
  return a.type == b.type && same_number(a.number, b.number) && a.text == b.text &&
         std::ranges::equal(a.numbers, b.numbers, same_number);
}

/// Refers to `one`.
ParameterMessage message_of(const NodeParameter& one) {
  using Type = NodeParameter::Type;
  ParameterMessage message{};
  message.name = refer(one.name);
  message.value.type = static_cast<std::uint8_t>(one.type);
  message.value.string_value = refer(one.text);
  switch (one.type) {
    case Type::kBool: message.value.bool_value = one.number == 1.0; break;
    case Type::kInteger: message.value.integer_value = std::int64_t(one.number); break;
    case Type::kDouble: message.value.double_value = one.number; break;
    case Type::kDoubles:
      refer(message.value.double_array_value, std::span<const double>(one.numbers));
      break;
    case Type::kNotSet:
    case Type::kText: break;
  }
  return message;
}

/// Compares what there is with what there was, when there may be a difference.
class ParameterTopics final : public TopicGroup {
 public:
  explicit ParameterTopics(OutputMaker& maker)
      : node_(maker.full_node_name()), events_(maker.parameter_events()) {}
  void follow(const ControllerFeed& feed) override { feed_ = feed; }
  void publish(const CycleSample&) override {}
  void publish_news(const News& news) override;

 private:
  using Known = std::map<std::string, NodeParameter>;

  std::string node_;
  ControllerFeed feed_;
  std::uint64_t version_ = 0;
  Known known_;
  Output<rcl_interfaces::ParameterEvent> events_;
};

void ParameterTopics::publish_news(const News& news) {
  if (!feed_.parameters) return;
  const std::uint64_t version = feed_.parameter_version();
  if (version == version_) return;
  version_ = version;
  Known now;
  for (NodeParameter& one : feed_.parameters()) {
    if (one.type != NodeParameter::Type::kNotSet) now.insert_or_assign(one.name, std::move(one));
  }
  std::vector<ParameterMessage> came, changed, went;
  for (const auto& [name, one] : now) {
    const auto before = known_.find(name);
    if (before == known_.end()) {
      came.push_back(message_of(one));
    } else if (!same_value(before->second, one)) {
      changed.push_back(message_of(one));
    }
  }
  for (auto& [name, one] : known_) {
    if (now.contains(name)) continue;
    one = {.name = name};  // its value is gone
    went.push_back(message_of(one));
  }
  if (!came.empty() || !changed.empty() || !went.empty()) {
    rcl_interfaces::ParameterEvent message{};
    message.stamp = ros_time(news.now_ns);
    message.node = refer(node_);
    refer(message.new_parameters, std::span<const ParameterMessage>(came));
    refer(message.changed_parameters, std::span<const ParameterMessage>(changed));
    refer(message.deleted_parameters, std::span<const ParameterMessage>(went));
    events_.write(message);
  }
  known_ = std::move(now);
}

}  // namespace

std::unique_ptr<TopicGroup> parameter_topics(OutputMaker& maker, const RunDescription&) {
  return std::make_unique<ParameterTopics>(maker);
}

}  // namespace tandem::dds
