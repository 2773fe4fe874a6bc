// tandem/controller/NAME/marks: what controllers draw, for RViz and Foxglove.
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"
#include "hal/marker.hpp"

namespace tandem::dds {
namespace {

using MarkerMessage = visualization_msgs_msg_dds__Marker_;

/// The topic of one controller. At its end viewers are told that nothing is left.
class MarkTopic {
 public:
  MarkTopic(const std::string& whose, std::shared_ptr<const hal::MarkBlock> marks)
      : controller(whose), block(std::move(marks)) {
    for (const hal::MarkInfo& mark : block->declared())
      spaces_.push_back(controller + "/" + mark.name);
  }
  ~MarkTopic() {
    if (last_.drawn == 0) return;
    last_.drawn = 0;
    write();
  }
  MarkTopic(const MarkTopic&) = delete;
  MarkTopic& operator=(const MarkTopic&) = delete;

  /// @param stamp_less_time_ns  of a cycle
  void publish(std::int64_t stamp_less_time_ns) {
    const hal::MarkBlock::State now = block->look();
    if (now.time_ns < 0 || now.time_ns == last_.time_ns) return;
    last_ = now;
    stamp_less_time_ns_ = stamp_less_time_ns;
    write();
  }

  const std::string controller;
  const std::shared_ptr<const hal::MarkBlock> block;
  Output<visualization_msgs::MarkerArray> output;

 private:
  void write();

  std::vector<std::string> spaces_;  // by mark
  hal::MarkBlock::State last_;
  std::int64_t stamp_less_time_ns_ = 0;
};

void MarkTopic::write() {
  const auto marks = block->declared();
  const std::string none;
  std::vector<hal::Marker> markers;  // what the messages refer to
  std::vector<std::vector<geometry_msgs_msg_dds__Point_>> points(marks.size());
  std::vector<MarkerMessage> messages(marks.size());
  markers.reserve(marks.size());
  for (std::size_t i = 0; i < marks.size(); ++i) {
    const hal::Marker& marker = markers.emplace_back(hal::marker_of(marks[i], last_, i));
    for (const auto& [x, y, z] : marker.points_m) points[i].push_back({x, y, z});
    const auto& [px, py, pz] = marker.position_m;
    const auto& [qx, qy, qz, qw] = marker.quaternion;
    const auto& [sx, sy, sz] = marker.scale_m;
    const auto& [r, g, b, a] = marks[i].rgba;
    MarkerMessage& message = messages[i];
    message.header = {ros_time(last_.time_ns + stamp_less_time_ns_), refer(marks[i].link)};
    message.ns = refer(spaces_[i]);
    message.id = static_cast<std::int32_t>(i);
    message.type = marker.type;
    message.action = marker.action;
    message.pose = {{px, py, pz}, {qx, qy, qz, qw}};
    message.scale = {sx, sy, sz};
    message.color = {r, g, b, a};
    message.frame_locked = true;
    refer(message.points, std::span<const geometry_msgs_msg_dds__Point_>(points[i]));
    message.text = refer(marker.text);
    message.texture_resource = message.mesh_resource = refer(none);
    message.texture.header.frame_id = message.texture.format = refer(none);
    message.mesh_file.filename = refer(none);
  }
  visualization_msgs::MarkerArray message{};
  refer(message.markers, std::span<const MarkerMessage>(messages));
  output.write(message);
}

/// Marks have the newest places when a sample is due, once each.
class MarkTopics final : public TopicGroup {
 public:
  MarkTopics(OutputMaker& maker, const RunDescription&) : maker_(maker) {}
  void follow(const ControllerFeed& feed) override { feed_ = feed; }
  void publish(const CycleSample& sample) override;

 private:
  void renew();

  OutputMaker maker_;
  ControllerFeed feed_;
  std::uint64_t version_ = 0;
  std::vector<std::unique_ptr<MarkTopic>> topics_;
};

void MarkTopics::publish(const CycleSample& sample) {
  if (!sample.is_due(Topic::kMarks) || !feed_.marks) return;
  if (const std::uint64_t version = feed_.version(); version != version_) {
    version_ = version;
    renew();
  }
  for (const auto& topic : topics_) {
    if (topic->output.wanted()) topic->publish(sample.stamp_ns - sample.time.time_ns);
  }
}

/// Controllers have come or gone: those that stayed keep their topics.
void MarkTopics::renew() {
  auto before = std::exchange(topics_, {});
  for (auto& [controller, block] : feed_.marks()) {
    const auto same = std::ranges::find_if(
        before, [&](const auto& one) { return one != nullptr && one->block == block; });
    topics_.push_back(same != before.end() ? std::move(*same)
                                           : std::make_unique<MarkTopic>(controller, block));
  }
  before.clear();  // a topic of the same name as a new one ends first
  for (const auto& one : topics_) {
    if (one->output.exists()) continue;
    one->output = maker_.periodic<visualization_msgs::MarkerArray>(
        Topic::kMarks, "tandem/controller/" + one->controller + "/marks");
  }
}

}  // namespace

std::unique_ptr<TopicGroup> mark_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<MarkTopics>(maker, run);
}

}  // namespace tandem::dds
