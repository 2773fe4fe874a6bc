// From the layout to what a cycle runs through: ports, nodes, axes, lists of copies.
#include <algorithm>

#include "hal/config/capabilities.hpp"
#include "hal/ethercat-can/drive_master_impl.hpp"

namespace tandem::hal::can {

namespace {

/// A sensor has no time-out of its own in the configuration.
constexpr int kSensorTimeoutCycles = 10;
/// Traits of each joint, by what its board's PDOs carry.
std::vector<AxisTraits> traits_of(const RobotConfig& robot, const PdoLayout& layout) {
  std::vector<AxisTraits> traits(robot.joints.size());
  for (const NodePlan& node : layout.nodes) {
    for (std::size_t axis = 0; axis < node.joints.size(); ++axis) {
      const bool homes = robot.joints[node.joints[axis]].homing && node.abilities[axis].homing &&
                         node.carries(axis, WireField::kMode);
      const std::uint16_t cause =
          canopen::of_axis(canopen::object::kErrorCode, static_cast<int>(axis));
      const bool ours =
          node.board < 0 || robot.boards[static_cast<std::size_t>(node.board)].eds.empty();
      traits[node.joints[axis]] = {
          .can = node.abilities[axis],
          .tells_velocity = node.carries(axis, WireField::kVelocity),
          .tells_mode = node.carries(axis, WireField::kModeDisplay),
          .homes = homes,
          .tells_motor = node.carries(axis, WireField::kMotorPosition),
          .asks_cause =
              !node.carries(axis, WireField::kErrorCode) &&
              (node.ethercat ||
               robot.boards[static_cast<std::size_t>(node.board)].sheet->find(cause) != nullptr),
          .follow = FollowLimits::of(robot.joints[node.joints[axis]], ours),
          .motion = MotionLimits::of(robot.joints[node.joints[axis]]),
          .profile = ProfileLimits::of(robot.joints[node.joints[axis]])};
    }
  }
  return traits;
}

}  // namespace

DriveMaster::Impl::Node::Node(NodePlan node_plan, std::vector<SdoStep> steps, int timeout,
                              const ParameterImage& initial)
    : plan(std::move(node_plan)),
      master(plan.id, plan.heartbeat_ms, plan.boot_time_ns, plan.watch, std::move(steps),
             plan.start_time_ns),
      gains(plan.joints, initial),
      timeout_cycles(timeout) {}

DriveMaster::Impl::Impl(const RobotConfig& robot_config, PdoLayout layout,
                        std::span<Bus* const> buses)
    : robot(robot_config), joint_node(robot.joints.size()), joint_fresh(robot.joints.size()) {
  const std::size_t frames = 16 + layout.nodes.size() * 8;
  for (Bus* bus : buses) ports.emplace_back(*bus, frames);
  const std::vector<AxisTraits> traits = traits_of(robot, layout);
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    const GainsConfig& gains = robot.gains_of(robot.joints[j]);
    axes.emplace_back(AxisScale::of(robot, robot.joints[j]), traits[j], gains.stiffness_Nm_rad,
                      gains.damping_Nms_rad);
  }
  const ParameterImage initial = initial_parameters(robot);
  for (NodePlan& plan : layout.nodes) {
    Port& port = ports[plan.bus];
    const std::int64_t heartbeat_ns = std::int64_t{plan.heartbeat_ms} * 1'000'000;
    port.heartbeat_ns =
        port.heartbeat_ns == 0 ? heartbeat_ns : std::min(port.heartbeat_ns, heartbeat_ns);
    port.nodes[static_cast<std::size_t>(plan.id)] = static_cast<std::int16_t>(nodes.size());
    for (const std::size_t joint : plan.joints) joint_node[joint] = nodes.size();
    for (const PdoPlan& pdo : plan.pdos) {
      const bool sampled = pdo.group == PdoGroup::kFeedback || pdo.group == PdoGroup::kSensor;
      if (!sampled || pdo.part + 1 != plan.parts) continue;
      std::uint32_t& last = port.last_tpdo[static_cast<std::size_t>(plan.id)];
      last = std::max(last, canopen::cob::tpdo(pdo.number, 0));
    }
    auto steps = make_configuration(robot, plan);
    const int timeout =
        plan.board < 0 ? kSensorTimeoutCycles
                       : robot.boards[static_cast<std::size_t>(plan.board)].command_timeout_cycles;
    nodes.emplace_back(std::move(plan), std::move(steps), timeout, initial);
  }
  std::size_t channel = 0;
  for (Node& node : nodes) {  // nodes and axes keep their places from now on
    node.exchange.connect(node.plan, axes, counter, ports[node.plan.bus].sent_ns);
    node.first_channel = channel;
    channel += node.exchange.channels().size();
  }
}

}  // namespace tandem::hal::can
