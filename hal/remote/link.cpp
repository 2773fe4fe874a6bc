// Compares the two ends' robots joint by joint, and checks that a command has valid modes and
// finite numbers.
#include "hal/remote/link.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace tandem::remote {
namespace {

/// "joint 3 is 'elbow' here and 'wrist' there".
std::string name_difference(const char* what, const std::vector<std::string>& here,
                            const std::vector<std::string>& there) {
  if (here.size() != there.size()) {
    return std::string("it has ") + std::to_string(there.size()) + " " + what + "s there, " +
           std::to_string(here.size()) + " here";
  }
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (here[i] == there[i]) continue;
    return std::string(what) + " " + std::to_string(i) + " is '" + there[i] + "' there and '" +
           here[i] + "' here";
  }
  return {};
}

void on_data(dds_entity_t, void* call) { (*static_cast<std::function<void()>*>(call))(); }

}  // namespace

LinkIdentity identity_of(const hal::Robot& robot, std::string description_hash,
                         std::int64_t period_ns) {
  LinkIdentity identity;
  identity.robot = robot.name;
  identity.description_hash = std::move(description_hash);
  identity.period_ns = period_ns;
  for (const auto& joint : robot.joints) identity.joints.push_back(joint.name);
  for (const auto& sensor : robot.sensors) identity.sensors.push_back(sensor.name);
  const hal::ImageShape shape = robot.shape();
  identity.state_bytes = static_cast<std::uint32_t>(hal::StateImage(shape).bytes().size());
  identity.command_bytes = static_cast<std::uint32_t>(hal::CommandImage(shape).bytes().size());
  return identity;
}

std::string difference(const LinkIdentity& here, const LinkIdentity& there) {
  if (here.robot != there.robot) {
    return "the robot is '" + there.robot + "' there and '" + here.robot + "' here";
  }
  if (auto joints = name_difference("joint", here.joints, there.joints); !joints.empty()) {
    return joints;
  }
  if (auto sensors = name_difference("sensor", here.sensors, there.sensors); !sensors.empty()) {
    return sensors;
  }
  if (here.period_ns != there.period_ns) {
    return "the period is " + std::to_string(there.period_ns) + " ns there and " +
           std::to_string(here.period_ns) + " ns here";
  }
  if (here.description_hash != there.description_hash) {
    return "its description is another one there (" + there.description_hash.substr(0, 12) +
           "…, here " + here.description_hash.substr(0, 12) + "…)";
  }
  return here == there ? "" : "its images have other fields there: another version of Tandem";
}

std::string difference(const RobotEnd& here, const RobotEnd& there) {
  const auto playout = [](std::uint64_t cycles) {
    return cycles == 0 ? std::string("no [teleoperation]")
                       : "[teleoperation] with effects " + std::to_string(cycles) +
                             " cycles after a command's number";
  };
  if (here.playout_cycles != there.playout_cycles) {
    return "there is " + playout(there.playout_cycles) + " there, and " +
           playout(here.playout_cycles) + " here";
  }
  std::map<std::string, std::string> all = here.controllers;
  all.insert(there.controllers.begin(), there.controllers.end());
  const auto value = [](const RobotEnd& end, const std::string& key) {
    const auto found = end.controllers.find(key);
    return found == end.controllers.end() ? std::string("not given") : found->second;
  };
  for (const auto& [key, ignored] : all) {
    if (value(here, key) == value(there, key)) continue;
    return "teleoperation.robot_controller." + key + " is " + value(there, key) + " there and " +
           value(here, key) + " here";
  }
  return {};
}

dds::Qos link_qos() {
  dds::Qos qos;
  qos.reliable = true;
  qos.transient_local = true;
  qos.depth = 4;
  return qos;
}

std::uint64_t draw_number() {
  std::random_device draw;
  const std::uint64_t number = (std::uint64_t{draw()} << 32) | draw();
  return number == 0 ? 1 : number;
}

bool is_sound(const hal::CommandImage& command) noexcept {
  for (const auto values :
       {command.position_rad(), command.velocity_rad_s(), command.torque_Nm(), command.voltage_V(),
        command.current_A(), command.stiffness_Nm_rad(), command.damping_Nms_rad()}) {
    if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) {
      return false;
    }
  }
  constexpr auto kFirst = static_cast<std::int8_t>(hal::ControlMode::kIdle);
  constexpr auto kLast = static_cast<std::int8_t>(hal::ControlMode::kCurrent);
  return std::ranges::all_of(command.mode(),
                             [](std::int8_t mode) { return kFirst <= mode && mode <= kLast; }) &&
         std::ranges::all_of(command.interaction(), [](std::uint8_t one) { return one <= 1; });
}

const std::optional<Sender>& Senders::of(const dds_sample_info_t& sample) {
  if (sample.publication_handle == writer_ && sender_) return sender_;
  writer_ = sample.publication_handle;
  sender_ = dds::participant_of(reader_, writer_);
  return sender_;
}

OnData::OnData(dds_entity_t reader, std::function<void()> call)
    : reader_(reader), call_(std::move(call)) {
  dds_listener_t* listener = dds_create_listener(&call_);
  dds_lset_data_available(listener, on_data);
  dds_set_listener(reader_, listener);
  dds_delete_listener(listener);
  call_();  // what came before
}

OnData::~OnData() { dds_set_listener(reader_, nullptr); }

}  // namespace tandem::remote
