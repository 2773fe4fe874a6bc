// Messages of ROS, decoded by their published definitions: a series for each joint and sensor.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "base/bounds.hpp"
#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "log/import/bag_message.hpp"
#include "log/import/sources.hpp"
#include "log/mcap_reader.hpp"

namespace tandem::log {
namespace {

constexpr char kJointState[] = "sensor_msgs/msg/JointState";
constexpr char kImu[] = "sensor_msgs/msg/Imu";
constexpr char kWrench[] = "geometry_msgs/msg/WrenchStamped";
constexpr std::size_t kNoJoint = std::numeric_limits<std::size_t>::max();
constexpr std::size_t kMostTopics = 1'000;  // characters of their list in a message
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The member at "header.stamp.sec". @pre the definition has it
const dds::Value& member(const dds::Value& message, std::initializer_list<std::string_view> path) {
  const dds::Value* at = &message;
  for (const std::string_view name : path) at = dds::find(*at, name);
  return *at;
}

double number(const dds::Value& message, std::initializer_list<std::string_view> path) {
  return std::get<double>(member(message, path).of);
}

const std::string& text(const dds::Value& message, std::initializer_list<std::string_view> path) {
  return std::get<std::string>(member(message, path).of);
}

/// x, y, z of a vector.
std::array<double, 3> vector3(const dds::Value& message,
                              std::initializer_list<std::string_view> path) {
  const dds::Value& at = member(message, path);
  return {number(at, {"x"}), number(at, {"y"}), number(at, {"z"})};
}

std::int64_t header_ns(const dds::Value& message) {
  const dds::Value& stamp = member(message, {"header", "stamp"});
  const auto seconds = std::get<std::int64_t>(member(stamp, {"sec"}).of);
  const auto rest = std::get<std::uint64_t>(member(stamp, {"nanosec"}).of);
  return seconds * 1'000'000'000 + static_cast<std::int64_t>(rest);
}

class BagSource {
 public:
  BagSource(std::span<const ImportFile> files, const ImportMap& map, const hal::RobotConfig& robot)
      : files_(files),
        map_(map),
        robot_(robot),
        joints_(robot.joints.size()),
        topic_of_(robot.joints.size()),
        sensors_(map.sensors.size()) {}

  Result<ImportedRecording> read() {
    for (const ImportFile& file : files_) {
      path_ = file.path;
      if (Status done = read_one(file); !done) return std::unexpected(done.error());
    }
    if (Status done = check_topics(); !done) return std::unexpected(done.error());
    if (Status done = check_stamps(); !done) return std::unexpected(done.error());
    for (std::size_t s = 0; s < sensors_.size(); ++s) {
      const SensorMap& sensor = map_.sensors[s];
      if (sensors_[s].rows() == 0) {
        return std::unexpected(Error{"the recording has no topic '" + sensor.topic + "'",
                                     suggest(sensor.topic, topics_), map_.file, sensor.line,
                                     sensor.key + ".topic"});
      }
    }
    if (Status done = check_joints(); !done) return std::unexpected(done.error());
    for (ImportedSeries& series : joints_) {
      if (series.rows() > 0) recording_.series.push_back(std::move(series));
    }
    for (ImportedSeries& series : sensors_) recording_.series.push_back(std::move(series));
    for (ImportedSeries& series : recording_.series) {
      if (Status done = drop_invalid(series); !done) return std::unexpected(done.error());
    }
    recording_.excluded.invalid = distinct(std::move(invalid_));
    if (joint_topics_.size() > 1) {
      std::string names;
      for (const std::string& name : joint_topics_) names += (names.empty() ? "" : ", ") + name;
      recording_.notes.push_back("joint states of " + names);
    }
    return std::move(recording_);
  }

 private:
  std::unexpected<Error> refuse(std::string message, std::string hint, std::string key = {}) const {
    return std::unexpected(Error{std::move(message), std::move(hint), path_, 0, std::move(key)});
  }

  Status read_one(const ImportFile& file) {
    auto reader = McapReader::open(file.file, path_);
    if (!reader) return std::unexpected(reader.error());
    for (;;) {
      auto message = reader->next();
      if (!message) return std::unexpected(message.error());
      if (!message->has_value()) break;
      const ChannelRecord& channel = reader->channels().at((*message)->channel);
      const auto schema = reader->schemas().find(channel.schema_id);
      const std::string type =
          schema == reader->schemas().end() ? "" : ros_name(schema->second.name);
      if (Status taken = take(channel, type, **message); !taken) return taken;
    }
    if (const auto& damage = reader->damage(); !damage.empty())
      return refuse(to_string(damage.front()), "copy it again, or mend it: mcap recover");
    if (!reader->truncated()) return {};
    return refuse("the file is cut after " + std::to_string(reader->bytes()) + " bytes",
                  "copy it again, or mend it: mcap recover");
  }

  Status take(const ChannelRecord& channel, const std::string& type, const MessageView& message) {
    constexpr std::int64_t kLatest_ns = 4'000'000'000'000'000'000;
    if (message.time_ns < 0 || message.time_ns > kLatest_ns) {
      return refuse("a message was logged after the year 2096", "the file is damaged");
    }
    if (!number_.contains(channel.topic)) {
      if (topics_.size() == bounds::kLogNames.most)
        return std::unexpected(beyond(bounds::kLogNames, path_, 0, channel.topic));
      topics_.push_back(channel.topic);
      said_ += (said_.empty() ? "" : ", ") + shown(channel.topic) + " (" +
               (type.empty() ? "no type" : shown(type)) + ", " + shown(channel.message_encoding) +
               ")";
    }
    ++number_[channel.topic];
    for (std::size_t s = 0; s < sensors_.size(); ++s) {
      if (map_.sensors[s].topic == channel.topic) return take_sensor(s, channel, type, message);
    }
    if (!has_joint_states(channel.topic, type)) return {};
    const auto value = decoded(channel, type, kJointState, message);
    if (!value) return std::unexpected(value.error());
    return take_joints(channel.topic, *value, message.time_ns);
  }

  /// Named by the map; else by its type, or without one by its usual name.
  bool has_joint_states(const std::string& topic, const std::string& type) const {
    if (!map_.joint_topics.empty())
      return std::ranges::find(map_.joint_topics, topic) != map_.joint_topics.end();
    return type == kJointState ||
           (type.empty() && (topic == "joint_states" || topic.ends_with("/joint_states")));
  }

  /// A type that nobody says is the wanted one.
  Result<dds::Value> decoded(const ChannelRecord& channel, const std::string& type,
                             const char* wanted, const MessageView& message) {
    if ((!type.empty() && type != wanted) || !reads_encoding(channel.message_encoding)) {
      return refuse("the topic '" + channel.topic + "' has messages of " +
                        (type.empty() ? "no type" : type) + ", encoding '" +
                        channel.message_encoding + "'",
                    std::string("it must be ") + wanted + " in cdr, ros1 or json");
    }
    ++message_;
    auto value = decode_message(channel.message_encoding, wanted, message.data);
    if (value) return value;
    return refuse(where(channel.topic) + ": " + value.error().message,
                  "the file is damaged, or its messages are not what its schema says");
  }

  std::string where(const std::string& topic) const {
    return "message " + std::to_string(number_.at(topic)) + " of " + topic;
  }

  std::int64_t time_of(const dds::Value& message, std::int64_t log_ns) {
    const std::int64_t stamp_ns = header_ns(message);
    behind_ns_.push_back(log_ns - stamp_ns);
    stamped_ = stamped_ || stamp_ns != 0;
    return map_.stamp == "header" ? stamp_ns : log_ns;
  }

  /// The robot's joint of a name in the recording; none: it is not the robot's.
  std::optional<std::size_t> joint_of(const std::string& name) const {
    if (const auto found = map_.names.find(name); found != map_.names.end()) return found->second;
    const int index = robot_.joint_index(name);
    const bool taken = std::ranges::any_of(map_.names, [&](const auto& one) {
      return index >= 0 && one.second == static_cast<std::size_t>(index);
    });
    if (index < 0 || taken) return std::nullopt;
    return static_cast<std::size_t>(index);
  }

  Status take_joints(const std::string& topic, const dds::Value& value, std::int64_t log_ns) {
    const std::int64_t time_ns = time_of(value, log_ns);
    const auto list = [&](std::string_view name) -> const dds::Value::List& {
      return std::get<dds::Value::List>(member(value, {name}).of);
    };
    const auto& names = list("name");
    for (const char* field : {"position", "velocity", "effort"}) {
      const std::size_t size = list(field).size();
      if (size == 0 || size == names.size()) continue;
      if (map_.excludes(Trouble::kInvalid)) {
        invalid_.push_back(message_);
        return {};
      }
      return refuse(where(topic) + " has " + std::to_string(names.size()) + " names and " +
                        std::to_string(size) + " of " + field,
                    "its publisher is at fault; exclude = [\"invalid\"] leaves such messages out");
    }
    std::vector<std::size_t> joints;  // of the robot, in the message's order
    for (const dds::Value& one : names) {
      const std::string& name = std::get<std::string>(one.of);
      joints.push_back(joint_of(name).value_or(kNoJoint));
      if (joints.back() == kNoJoint) {
        if (Status known = note_unknown(name); !known) return known;
        continue;
      }
      if (Status own = check_topic(joints.back(), topic); !own) return own;
      if (std::ranges::count(joints, joints.back()) == 1) continue;
      if (!map_.excludes(Trouble::kInvalid)) {
        return refuse(where(topic) + " names '" + name + "' twice",
                      "its publisher is at fault; exclude = [\"invalid\"] leaves such messages out",
                      name);
      }
      invalid_.push_back(message_);
      return {};
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (joints[i] == kNoJoint) continue;
      const auto of = [&](const char* field) {
        return list(field).empty() ? kNone : std::get<double>(list(field)[i].of);
      };
      add_joint(joints[i], time_ns, {of("position"), of("velocity"), of("effort")}, topic);
    }
    return {};
  }

  /// A joint comes from one topic: of two, such as a driver's and one that gathers all joints,
  /// nobody knows which to believe.
  Status check_topic(std::size_t joint, const std::string& topic) {
    std::string& own = topic_of_[joint];
    if (own.empty()) {
      own = topic;
      if (std::ranges::find(joint_topics_, topic) == joint_topics_.end())
        joint_topics_.push_back(topic);
    }
    if (own == topic) return {};
    return refuse("the joint '" + robot_.joints[joint].name +
                      "' is in two topics of joint states: '" + own + "' and '" + topic + "'",
                  "name those to take, one or a list: [bag] joint_states = " + quoted_text(own),
                  "bag.joint_states");
  }

  Status note_unknown(const std::string& name) {
    auto& ignored = recording_.excluded.ignored;
    if (std::ranges::find(ignored, name) != ignored.end()) return {};
    const auto listed = [&](const char* one) {
      return std::ranges::find(map_.ignore, one) != map_.ignore.end();
    };
    if (ignored.size() == bounds::kLogNames.most)
      return std::unexpected(beyond(bounds::kLogNames, path_, 0, name));
    ignored.push_back(name);
    const bool follows = robot_.follower(name) != nullptr;
    if (follows || listed("*") || listed(name.c_str())) return {};
    std::vector<std::string> known;
    for (const hal::JointConfig& joint : robot_.joints) known.push_back(joint.name);
    if (std::ranges::find(known, name) != known.end()) {
      return refuse("the recording's joint '" + name +
                        "' has the name of a joint that [bag.names] "
                        "gives to another",
                    "correct [bag.names], or name it in `ignore`", name);
    }
    return refuse(
        "the recording's joint '" + name + "' is none of the robot's",
        "say whose it is in [bag.names], name it in `ignore`, or name the topics to take in "
        "[bag] joint_states; " +
            suggest(name, known),
        name);
  }

  void add_joint(std::size_t joint, std::int64_t time_ns, std::array<double, 3> values,
                 const std::string& topic) {
    ImportedSeries& series = joints_[joint];
    if (series.columns.empty()) {
      const std::string& name = robot_.joints[joint].name;
      series.name = "joint " + name;
      series.joints = {joint};
      for (const SignalMap& signal : map_.signals) {
        series.columns.push_back(
            {topic + " " + name + " " + signal.key, path_, {false, signal.field, joint}, {}});
      }
    }
    const auto place = std::ranges::find(map_.joints, joint) - map_.joints.begin();
    series.time_ns.push_back(time_ns);
    series.message.push_back(message_);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const SignalMap& signal = map_.signals[i];  // position, velocity, torque
      const auto p = static_cast<std::size_t>(place);
      const bool mapped = p < signal.scale.size();
      series.columns[i].values.push_back(mapped ? signal.scale[p] * values[i] + signal.offset[p]
                                                : values[i]);
    }
  }

  Status take_sensor(std::size_t index, const ChannelRecord& channel, const std::string& type,
                     const MessageView& message) {
    const SensorMap& sensor = map_.sensors[index];
    const hal::SensorConfig& config = robot_.sensors[sensor.sensor];
    const bool imu = config.type == hal::SensorType::kImu;
    const auto value = decoded(channel, type, imu ? kImu : kWrench, message);
    if (!value) return std::unexpected(value.error());
    const std::string& frame = text(*value, {"header", "frame_id"});
    if (!frame.empty() && frame != config.link && frame != sensor.frame) {
      return std::unexpected(
          Error{"the messages of " + channel.topic + " are in the frame '" + frame +
                    "', the robot's sensor is in that of '" + config.link + "'",
                "say frame = \"" + frame + "\" when the two have the same origin and axes",
                map_.file, sensor.line, sensor.key + ".frame"});
    }
    ImportedSeries& series = sensors_[index];
    if (series.columns.empty()) start_sensor(series, sensor, channel.topic);
    series.time_ns.push_back(time_of(*value, message.time_ns));
    series.message.push_back(message_);
    const std::vector<double> channels = imu ? imu_channels(*value) : wrench_channels(*value);
    for (std::size_t c = 0; c < channels.size(); ++c) {
      series.columns[c].values.push_back(sensor.scale[c] * channels[c]);
    }
    return {};
  }

  void start_sensor(ImportedSeries& series, const SensorMap& sensor,
                    const std::string& topic) const {
    const hal::SensorConfig& config = robot_.sensors[sensor.sensor];
    std::size_t first = 0;
    for (std::size_t s = 0; s < sensor.sensor; ++s) first += robot_.sensors[s].channels();
    series.name = "sensor " + config.name;
    series.sensors = {sensor.sensor};
    if (config.type == hal::SensorType::kImu) series.quaternions = {0};
    for (std::size_t c = 0; c < config.channels(); ++c) {
      series.columns.push_back(
          {topic + " channel " + std::to_string(c), path_, {false, "sensor", first + c}, {}});
    }
  }

  static std::vector<double> imu_channels(const dds::Value& value) {
    const auto rate = vector3(value, {"angular_velocity"});
    const auto force = vector3(value, {"linear_acceleration"});
    std::array<double, 4> q{};
    const auto& covariance =
        std::get<dds::Value::List>(member(value, {"orientation_covariance"}).of);
    if (std::get<double>(covariance[0].of) != -1.0) {
      const dds::Value& o = member(value, {"orientation"});
      q = {number(o, {"x"}), number(o, {"y"}), number(o, {"z"}), number(o, {"w"})};
    }
    return {q[0], q[1], q[2], q[3], rate[0], rate[1], rate[2], force[0], force[1], force[2]};
  }

  static std::vector<double> wrench_channels(const dds::Value& value) {
    const auto force = vector3(value, {"wrench", "force"});
    const auto moment = vector3(value, {"wrench", "torque"});
    return {force[0], force[1], force[2], moment[0], moment[1], moment[2]};
  }

  Status check_topics() {
    for (const std::string& topic : map_.joint_topics) {
      if (number_.contains(topic)) continue;
      return refuse("has no topic '" + topic + "'", suggest(topic, topics_), "bag.joint_states");
    }
    const bool any =
        std::ranges::any_of(joints_, [](const ImportedSeries& s) { return s.rows() > 0; });
    if (any) return {};
    if (!recording_.excluded.ignored.empty()) {
      return refuse("has no joint states of this robot: none of its joints is the robot's",
                    "say whose they are in [bag.names]", "bag.names");
    }
    return refuse("has no joint states of this robot; it has " +
                      (said_.empty() ? "no messages" : shown(said_, kMostTopics)),
                  "record a topic of sensor_msgs/JointState, such as /joint_states; [bag] "
                  "joint_states names one whose type is not said");
  }

  Status check_stamps() {
    std::ranges::sort(behind_ns_);
    const auto ms = [&](double share) {
      const auto at = static_cast<std::size_t>(share * static_cast<double>(behind_ns_.size() - 1));
      return std::to_string(static_cast<double>(behind_ns_[at]) * 1e-6) + " ms";
    };
    if (map_.stamp.empty()) {
      return std::unexpected(Error{
          "which time is a sample's: its header's stamp, or when it was logged? It was logged " +
              ms(0.0) + " to " + ms(1.0) + " after its stamp, " + ms(0.5) + " on the median",
          "say [bag] stamp = \"header\" or \"log\"", map_.file, 0, "bag.stamp"});
    }
    if (map_.stamp == "header" && !stamped_) {
      return refuse("the headers' stamps are all 0", "say [bag] stamp = \"log\"", "bag.stamp");
    }
    return {};
  }

  Status check_joints() {
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const std::string& name = robot_.joints[j].name;
      const bool missing = map_.missing.contains(j);
      if (missing == (joints_[j].rows() == 0)) continue;
      if (missing) {
        return std::unexpected(Error{"the recording has the joint '" + name + "'",
                                     "remove it there", map_.file, 0, "missing_joints"});
      }
      return refuse("lacks the robot's joint '" + name + "'",
                    "say which of the recording's it is in [bag.names], or where it is: "
                    "[missing_joints] " +
                        name + " = 0.0",
                    name);
    }
    return {};
  }

  /// Columns without any number are absent (an interface that the robot does not have); rows with a
  /// hole in the others are errors, or left out.
  Status drop_invalid(ImportedSeries& series) {
    std::erase_if(series.columns, [](const ImportedColumn& column) {
      return column.target.field != "sensor" && column.target.field != "position_rad" &&
             std::ranges::all_of(column.values, [](double one) { return std::isnan(one); });
    });
    std::vector<std::size_t> kept;
    for (std::size_t row = 0; row < series.rows(); ++row) {
      const auto hole = std::ranges::find_if(series.columns, [row](const ImportedColumn& column) {
        return !std::isfinite(column.values[row]);
      });
      if (hole == series.columns.end()) {
        kept.push_back(row);
        continue;
      }
      if (!map_.excludes(Trouble::kInvalid)) {
        return refuse("sample " + std::to_string(row + 1) + " of " + hole->name + " is not finite",
                      "leave such samples out by exclude = [\"invalid\"]", series.name);
      }
      invalid_.push_back(series.message[row]);
    }
    keep_rows(series, kept);
    return {};
  }

  std::span<const ImportFile> files_;
  const ImportMap& map_;
  const hal::RobotConfig& robot_;
  std::string path_;  // being read
  std::vector<ImportedSeries> joints_;
  std::vector<std::string> topic_of_;  // of each joint; empty: not met
  std::vector<ImportedSeries> sensors_;
  std::vector<std::string> topics_, joint_topics_;  // in their order; those with joints taken
  std::string said_;                                // the topics with types and encodings
  std::map<std::string, std::uint64_t> number_;     // messages of each topic so far
  std::uint32_t message_ = 0;                       // those decoded so far
  std::vector<std::uint32_t> invalid_;              // of them
  std::vector<std::int64_t> behind_ns_;             // log time minus stamp
  bool stamped_ = false;
  ImportedRecording recording_;
};

}  // namespace

Result<ImportedRecording> read_bag_recording(std::span<const ImportFile> files,
                                             const ImportMap& map, const hal::RobotConfig& robot) {
  return BagSource(files, map, robot).read();
}

}  // namespace tandem::log
