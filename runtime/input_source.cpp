#include "runtime/input_source.hpp"

#include <filesystem>
#include <iterator>

namespace tandem::runtime {
namespace {

// A key a line.
// clang-format off
constexpr Key<InputSource> kInput[] = {
  choice<&InputSource::feeder>("source", kInputFeeders, "who feeds it: `tandem input`, the rows of `timeline`, those of `file`, a ROS 2 topic, a game pad. Only this one does ([controllers.md](controllers.md#inputs))"),
  key<&InputSource::components>("components", "`timeline`: what a row has after its time").within("list of names").by_default("every component, in the input's order"),
  by_hand<InputSource>("timeline", "–", "list of lists of numbers", "`timeline`: each row is the time after the controller's start [s], then the components. Those that it lacks have the input's values without a sample. Of a trajectory a row is a way-point, `[time_s, after_s, position…]`, and rows of one time are one sample"),
  key<&InputSource::file>("file", "`file`: a CSV file of such rows, whose first line is `time_s` and the components; or a log (`.mcap`), whose samples of this input arrive in the cycles in which they did").within("path, from this file's folder").by_default("–"),
  key<&InputSource::repeat_s>("repeat_s", {0.0, 3600.0}, "`timeline` and `file`: a row is a sample again and again, this time apart, until the next row; 0: once"),
  key<&InputSource::topic>("topic", "`topic`: its ROS 2 name, in the namespace of `[dds]`: `\"cmd_vel\"`; `\"/cmd_vel\"` is without it").by_default("–"),
  key<&InputSource::type>("type", "`topic`: of its messages").by_default("the first of the input's kind: [ros2.md](ros2.md#inputs)"),
  key<&InputSource::action>("action", "`topic`: of a trajectory, a ROS 2 action `control_msgs/action/FollowJointTrajectory` beside it: `\"follow_joint_trajectory\"` is `CONTROLLER/follow_joint_trajectory`, in the namespace of `[dds]` ([ros2.md](ros2.md#follow-a-joint-trajectory))").by_default("`\"\"`: none"),
  key<&InputSource::frame>("frame", "`topic`: the `header.frame_id` that a stamped twist, wrench or pose has to name. Others are refused: nothing is transformed").by_default("`\"\"`: none"),
  key<&InputSource::device>("device", "`gamepad`: its event device: `\"/dev/input/by-id/…-event-joystick\"`").by_default("–"),
  by_hand<InputSource>("mapping", "–", "table", "`gamepad`: `{ x = \"-ABS_Y 0.5\", yaw = \"ABS_RX\", stop = \"BTN_SOUTH\" }`: each component's axis or button, with a minus sign for the other direction and what it is at the end; else 1"),
  key<&InputSource::deadband>("deadband", {0.0, 0.9}, "`gamepad`: share of an axis' way about its middle that is 0"),
};
// clang-format on

/// Keys of one source that stand with another would change nothing, and look as if they did.
void refuse_others(TomlTable& table, InputFeeder feeder) {
  using enum InputFeeder;
  constexpr struct {
    const char* key;
    InputFeeder of, or_of;
  } kOf[]{{"timeline", kTimeline, kTimeline}, {"components", kTimeline, kTimeline},
          {"repeat_s", kTimeline, kFile},     {"file", kFile, kFile},
          {"topic", kTopic, kTopic},          {"type", kTopic, kTopic},
          {"action", kTopic, kTopic},         {"frame", kTopic, kTopic},
          {"device", kGamepad, kGamepad},     {"mapping", kGamepad, kGamepad},
          {"deadband", kGamepad, kGamepad}};
  for (const auto& row : kOf) {
    if (!table.has(row.key) || feeder == row.of || feeder == row.or_of) continue;
    table.error(row.key, "its source is \"" + std::string(to_string(feeder)) + "\"",
                "write source = \"" + std::string(to_string(row.of)) + "\", or leave the key out");
  }
}

InputSource read_source(TomlTable table, const std::string& name) {
  InputSource source{.name = name, .where = table.error_at({}, {})};
  read_keys(table, kInput, source);
  refuse_others(table, source.feeder);
  if (source.feeder == InputFeeder::kTimeline) {
    const std::size_t columns = source.components.empty() ? 0 : source.components.size() + 1;
    source.timeline = table.rows("timeline", columns);
  }
  const auto need = [&](InputFeeder feeder, const char* key, const std::string& value) {
    if (source.feeder == feeder && value.empty())
      table.error(key, "is missing",
                  "the source \"" + std::string(to_string(feeder)) + "\" needs it");
  };
  need(InputFeeder::kFile, "file", source.file);
  need(InputFeeder::kTopic, "topic", source.topic);
  need(InputFeeder::kGamepad, "device", source.device);
  if (!source.file.empty()) {
    const std::filesystem::path folder = table.folder();
    source.file = (folder / source.file).lexically_normal().string();
  }
  if (source.feeder == InputFeeder::kGamepad) {
    TomlTable mapping = table.table("mapping");
    for (const std::string& component : mapping.keys()) {
      source.mapping[component] = mapping.text(component);
    }
    mapping.finish();
  }
  table.finish();
  return source;
}

}  // namespace

std::vector<InputSource> read_input_sources(TomlTable& controller) {
  std::vector<InputSource> sources;
  TomlTable inputs = controller.table_or_empty("inputs");
  for (const std::string& name : inputs.keys()) {
    sources.push_back(read_source(inputs.table(name), name));
  }
  inputs.finish();
  return sources;
}

void describe_inputs(KeyPage& page) { page.add("[controller.inputs.NAME]", kInput); }

}  // namespace tandem::runtime
