// The configuration of a node as a list of SDO steps: identity checks, PDO mapping, scales, gains,
// limits, protections, heartbeats.
#include "hal/ethercat-can/sdo_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "canopen/drive_abilities.hpp"
#include "canopen/objects.hpp"
#include "hal/config/drive_parameters.hpp"
#include "hal/ethercat-can/axis_codec.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/pdo_slots.hpp"
#include "hal/ethercat-can/profile_limits.hpp"

namespace tandem::hal::can {

namespace {

using namespace canopen;
namespace object = canopen::object;
using Steps = std::vector<SdoStep>;

void add_check(Steps& steps, std::uint16_t index, std::uint8_t sub, std::uint32_t value,
               SdoUse use = SdoUse::kCheck) {
  steps.push_back(write_step(index, sub, value));
  steps.back().use = use;
}

/// What the configuration says, else the sheet; what neither tells is not looked at.
/// On EtherCAT what the object 1018 would contradict by the sheet is left to the information
/// memory.
void add_identity(Steps& steps, const BoardConfig& board, bool line) {
  const DataSheet& sheet = *board.sheet;
  // A drive by its objects may say another profile, or none: then just what its sheet says.
  const auto type = sheet.value(object::kDeviceType, 0, 0).value_or(kDriveDeviceType);
  add_check(steps, object::kDeviceType, 0, static_cast<std::uint32_t>(type), SdoUse::kCheckProfile);
  const auto check = [&](IdentitySub sub, std::optional<std::uint32_t> configured,
                         std::optional<std::uint32_t> of_sheet, SdoUse use) {
    const auto wanted = configured ? configured : of_sheet;
    const bool disputed = wanted && line && is_disputed(sheet, sub, *wanted);
    if (wanted && !disputed) add_check(steps, object::kIdentity, sub, *wanted, use);
  };
  check(kVendor, board.vendor_id, sheet.vendor, SdoUse::kCheck);
  check(kProduct, board.product_code, sheet.product, SdoUse::kCheck);
  check(kRevision, board.revision, sheet.revision, SdoUse::kCheckRevision);
  check(kSerial, board.serial, {}, SdoUse::kCheck);
}

void add_sensor_identity(Steps& steps) {
  add_check(steps, object::kDeviceType, 0, kSensorDeviceType);
  add_check(steps, object::kIdentity, kVendor, kTandemVendor);
  add_check(steps, object::kIdentity, kProduct, kSensorProduct);
}

/// No entries, the entries, their number.
void add_mapping(Steps& steps, const PdoPlan& pdo) {
  if (!pdo.mapping_written) return;
  const std::uint16_t mapping = mapping_object(pdo);
  steps.push_back(write_step(mapping, 0, std::uint8_t{0}));
  std::uint8_t count = 0;
  for (const MappedField& field : pdo.fields) {
    steps.push_back(
        write_step(mapping, ++count, mapping_entry(field.index, field.sub, field.size)));
  }
  steps.push_back(write_step(mapping, 0, count));
}

/// What a slave's file wants to be written.
void add_writes(Steps& steps, const DataSheet& sheet) {
  for (const SheetWrite& write : sheet.writes) {
    SdoStep step{.sub = write.sub, .index = write.index};
    step.size = static_cast<std::uint8_t>(std::min(write.bytes.size(), step.bytes.size()));
    std::copy_n(write.bytes.begin(), step.size, step.bytes.begin());
    step.of_file = true;
    steps.push_back(step);
  }
}

/// EtherCAT: mappings, then which PDOs are the process data, in their order.
/// @param sheet  of the board, or null: a sensor of ours
void add_process_data(Steps& steps, const NodePlan& node, const DataSheet* sheet) {
  for (const PdoDirection direction : {PdoDirection::kReceive, PdoDirection::kTransmit}) {
    const auto assignment = direction == PdoDirection::kReceive ? kAssignOutputs : kAssignInputs;
    const bool assigns = sheet == nullptr || assignment_written(*sheet, direction);
    if (assigns) steps.push_back(write_step(assignment, 0, std::uint8_t{0}));
    std::uint8_t count = 0;
    for (const PdoPlan& pdo : node.pdos) {
      if (pdo.direction != direction) continue;
      add_mapping(steps, pdo);
      if (assigns) steps.push_back(write_step(assignment, ++count, mapping_object(pdo)));
    }
    if (assigns) steps.push_back(write_step(assignment, 0, count));
  }
}

/// CiA 301's procedure: out of use, the mapping, in use.
///
/// @param sheet  of the board, or null: a sensor of ours
void add_pdo(Steps& steps, const PdoPlan& pdo, const DataSheet* sheet) {
  const bool receive = pdo.direction == PdoDirection::kReceive;
  const auto offset = static_cast<std::uint16_t>(pdo.number - 1);
  const auto parameter = static_cast<std::uint16_t>(
      (receive ? object::kRpdoParameter : object::kTpdoParameter) + offset);
  // Nobody asks for a TPDO by a remote request: it would come beside the cycle.
  const std::uint32_t cob_id = receive ? pdo.cob_id : pdo.cob_id | cob::kNoRtr;
  if (pdo.id_written) steps.push_back(write_step(parameter, kPdoCobId, cob_id | cob::kInvalid));
  add_mapping(steps, pdo);
  if (pdo.type_written) steps.push_back(write_step(parameter, kPdoType, pdo.transmission));
  // An inhibit time or an event timer from power-on would hold answers to SYNC back or add others.
  for (const PdoParameterSub sub : {kPdoInhibit, kPdoEvent}) {
    const bool set = sheet != nullptr && writable(*sheet, parameter, sub) &&
                     sheet->value(parameter, sub, 0).value_or(1) != 0;
    if (set) steps.push_back(write_step(parameter, sub, std::uint16_t{0}));
  }
  if (pdo.id_written) steps.push_back(write_step(parameter, kPdoCobId, cob_id));
}

void switch_off(Steps& steps, const PdoPlan& pdo) {
  const bool receive = pdo.direction == PdoDirection::kReceive;
  const auto parameter = static_cast<std::uint16_t>(
      (receive ? object::kRpdoParameter : object::kTpdoParameter) + pdo.number - 1);
  steps.push_back(write_step(parameter, kPdoCobId, pdo.cob_id | cob::kInvalid));
}

/// Adds steps for the objects of one axis.
class AxisSteps {
 public:
  AxisSteps(Steps& steps, int axis) : steps_(steps), axis_(axis) {}
  template <class T>
  void operator()(std::uint16_t index, std::uint8_t sub, T value) {
    steps_.push_back(write_step(of_axis(index, axis_), sub, value, axis_));
  }
  void operator()(const DriveObject& object, const DriveParameters& parameters) {
    steps_.push_back({.sub = object.sub,
                      .index = of_axis(object.index, axis_),
                      .axis = static_cast<std::int8_t>(axis_),
                      .size = static_cast<std::uint8_t>(object.size()),
                      .bytes = object.encode(parameters)});
  }

 private:
  Steps& steps_;
  int axis_;
};

/// What a robot.toml sets in our own boards. Another drive keeps what it was commissioned with.
void add_settings(AxisSteps& add, const RobotConfig& robot, const JointConfig& joint) {
  const DriveParameters parameters = drive_parameters(robot, joint);
  for (const DriveObject& object : kDriveObjects) {
    if (std::isnan(object.of(parameters))) continue;
    // By way of "no upper limit", so that no order of old and new limits is refused.
    if (object.index == object::kSoftwareLimits && object.sub == 1) {
      add(object::kSoftwareLimits, 2, std::numeric_limits<std::int32_t>::max());
    }
    add(object, parameters);
  }
}

/// The modes that the axis is used in must be among those that the drive itself names.
void add_mode_check(Steps& steps, const DriveAbilities& can, bool homes, int axis) {
  std::uint32_t wanted = homes ? mode_bit(Mode::kHm) : 0;
  for (const Mode mode : {can.position, can.velocity, can.torque}) {
    if (mode != Mode::kNone) wanted |= mode_bit(mode);
  }
  add_check(steps, of_axis(object::kSupportedModes, axis), 0, wanted, SdoUse::kCheckBits);
  steps.back().axis = static_cast<std::int8_t>(axis);
}

/// What a joint's scales were computed from must be what the drive has.
void add_unit_checks(Steps& steps, const DataSheet& sheet, const JointConfig& joint) {
  const DriveUnits units = units_of(sheet, joint.axis);
  const auto check = [&](const std::vector<UnitObject>& objects) {
    for (const UnitObject& unit : objects) {
      add_check(steps, unit.index, unit.sub, unit.value);
      steps.back().axis = static_cast<std::int8_t>(joint.axis);
    }
  };
  if (joint.encoder_counts_per_rev.of_sheet) check(units.position);
  if (joint.rated_torque_Nm.of_sheet) check(units.torque);
  if (joint.velocity_units_per_rev.of_sheet) check(units.velocity);
}

/// At least 1, in the drive's units.
std::uint32_t rate_units(double per_rad, double rate) {
  return std::max(1U, clamp_round<std::uint32_t>(rate * std::abs(per_rad)));
}

/// The joint's limits, by which a drive in profile modes makes its way.
void add_profile(AxisSteps& add, const DataSheet& sheet, const AxisScale& scale,
                 const JointConfig& joint) {
  const auto set = [&](std::uint16_t index, auto value) {
    if (writable(sheet, of_axis(index, joint.axis), 0)) add(index, 0, value);
  };
  const ProfileLimits most = ProfileLimits::of(joint);
  const std::uint32_t velocity = rate_units(scale.velocity_per_rad_s, most.velocity_rad_s);
  const std::uint32_t acceleration =
      rate_units(scale.acceleration_per_rad_s2, most.acceleration_rad_s2);
  set(object::kMotionProfileType, std::int16_t{0});
  set(object::kMaxProfileVelocity, velocity);
  set(object::kProfileVelocity, velocity);
  set(object::kProfileAcceleration, acceleration);
  set(object::kProfileDeceleration, acceleration);
}

/// A joint that is homed: its method and what the sheet has besides. Positions and speeds in the
/// drive's counts.
void add_homing(AxisSteps& add, const DataSheet& sheet, const AxisScale& scale,
                const JointConfig& joint) {
  const HomingConfig& homing = *joint.homing;
  const auto set = [&](std::uint16_t index, std::uint8_t sub, auto value) {
    if (writable(sheet, of_axis(index, joint.axis), sub)) add(index, sub, value);
  };
  const double velocities = scale.velocity_per_rad_s;
  set(object::kHomingMethod, 0, static_cast<std::int8_t>(homing.method));
  set(object::kHomingSpeeds, 1, rate_units(velocities, homing.speed_rad_s));
  set(object::kHomingSpeeds, 2, rate_units(velocities, homing.zero_speed_rad_s));
  set(object::kHomingAcceleration, 0,
      rate_units(scale.acceleration_per_rad_s2, homing.acceleration_rad_s2));
  set(object::kHomeOffset, 0,
      scale.to_drive(clamp_round<std::int32_t>(homing.position_rad * scale.counts_per_rad)));
}

void add_stop_options(AxisSteps& add, const StopOptions& stop) {
  for (const auto& [index, value] : {std::pair{object::kShutdownOption, stop.shutdown},
                                     {object::kDisableOption, stop.disable},
                                     {object::kHaltOption, stop.halt},
                                     {object::kFaultReactionOption, stop.fault}}) {
    if (value) add(index, 0, static_cast<std::int16_t>(*value));
  }
}

void add_axis(Steps& steps, const RobotConfig& robot, const NodePlan& node, std::size_t axis) {
  const BoardConfig& board = robot.boards[static_cast<std::size_t>(node.board)];
  const DataSheet& sheet = *board.sheet;
  const DriveAbilities& can = node.abilities[axis];
  AxisSteps add(steps, static_cast<int>(axis));
  const auto takes = [&](std::uint16_t index, std::uint8_t sub) {
    return writable(sheet, of_axis(index, static_cast<int>(axis)), sub);
  };
  if (takes(object::kQuickStopOption, 0)) {
    add(object::kQuickStopOption, 0, std::int16_t{2});  // the ramp, then disabled
  }
  // The drive adds it to every target: what somebody left there would shift the joint.
  if (takes(object::kPositionOffset, 0)) add(object::kPositionOffset, 0, std::int32_t{0});
  const JointConfig& joint = robot.joints[node.joints[axis]];
  add_stop_options(add, joint.stop_options);
  if (joint.homing) add_homing(add, sheet, AxisScale::of(robot, joint), joint);
  if (can.settings) return add_settings(add, robot, joint);
  add_mode_check(steps, can, joint.homing.has_value(), static_cast<int>(axis));
  add_unit_checks(steps, sheet, joint);
  if (!std::isnan(joint.drive.stop_deceleration_rad_s2)) {
    add(object::kQuickStopDeceleration, 0,
        rate_units(AxisScale::of(robot, joint).acceleration_per_rad_s2,
                   joint.drive.stop_deceleration_rad_s2));
  }
  if (moves_by_profile(can)) add_profile(add, sheet, AxisScale::of(robot, joint), joint);
  if (takes(object::kInterpolationPeriod, 1) && takes(object::kInterpolationPeriod, 2)) {
    const auto limits = InterpolationLimits::of(sheet, static_cast<int>(axis));
    add(object::kInterpolationPeriod, 1, std::uint8_t{0});
    steps.back().period = limits;
    add(object::kInterpolationPeriod, 2, std::int8_t{0});
    steps.back().period = limits;
  }
  // What moves with an offset alone has no other target.
  const auto demand = [&](std::uint16_t index, auto value) {
    if (!takes(index, 0)) return;
    add(index, 0, value);
    steps.back().kept = false;
  };
  demand(object::kTargetVelocity, std::int32_t{0});
  demand(object::kTargetTorque, std::int16_t{0});
  const auto reaction =
      sheet.value(of_axis(object::kAbortConnectionOption, static_cast<int>(axis)), 0, node.id);
  const bool does_nothing = reaction.value_or(0) == 0;
  if (takes(object::kAbortConnectionOption, 0) && does_nothing) {
    add(object::kAbortConnectionOption, 0, std::int16_t{3});  // quick stop
  }
  if (can.one_mode) demand(object::kMode, static_cast<std::int8_t>(first_mode(can)));
}

}  // namespace

bool SdoStep::accepts(std::span<const std::uint8_t> read) const noexcept TANDEM_RT {
  if (use == SdoUse::kCheck || use == SdoUse::kVerify) return std::ranges::equal(read, value());
  if (read.size() != sizeof(std::uint32_t) || size != sizeof(std::uint32_t)) return false;
  const auto found = get<std::uint32_t>(read.data());
  const auto wanted = get<std::uint32_t>(bytes.data());
  switch (use) {
    case SdoUse::kCheckRevision: return found >> 16 == wanted >> 16 && found >= wanted;
    case SdoUse::kCheckProfile:
      return found == wanted || (found & 0xFFFF) == (kDriveDeviceType & 0xFFFF);
    case SdoUse::kCheckBits: return (found & wanted) == wanted;
    default: return false;
  }
}

namespace {

/// Date and time of the configuration, which a hash of it stands for.
void add_names(Steps& steps, SdoUse use) {
  for (std::uint8_t sub = 1; sub <= 2; ++sub) {
    steps.push_back(write_step(object::kVerifyConfiguration, sub, std::uint32_t{0}));
    steps.back().use = use;
  }
}

/// What the sheet says cannot be read is not looked at.
void leave_out_unreadable(Steps& steps, const DataSheet& sheet) {
  std::erase_if(steps, [&](const SdoStep& step) {
    const bool reads = step.use != SdoUse::kWrite && step.use != SdoUse::kStore;
    const SheetEntry* entry = sheet.find(step.index, step.sub);
    return reads && entry != nullptr && (entry->access & kRead) == 0;
  });
}

void add_watching(Steps& steps, const NodePlan& node, const DataSheet* sheet);

}  // namespace

bool is_disputed(const DataSheet& sheet, std::uint8_t sub, std::uint32_t wanted) {
  const SheetEntry* entry = sheet.find(object::kIdentity, sub);
  return entry != nullptr && entry->value && entry->value->number != wanted;
}

std::vector<SdoStep> make_configuration(const RobotConfig& robot, const NodePlan& node) {
  Steps steps;
  const BoardConfig* board =
      node.board >= 0 ? &robot.boards[static_cast<std::size_t>(node.board)] : nullptr;
  const DataSheet* sheet = board != nullptr ? board->sheet.get() : nullptr;
  if (board != nullptr) {
    add_identity(steps, *board, node.ethercat);
    if (board->keeps_configuration) add_names(steps, SdoUse::kVerify);
  } else {
    add_sensor_identity(steps);
  }
  if (node.ethercat) {
    if (sheet != nullptr) add_writes(steps, *sheet);
    add_process_data(steps, node, sheet);
  } else {
    for (const PdoPlan& pdo : node.unused) switch_off(steps, pdo);
    for (const PdoPlan& pdo : node.pdos) add_pdo(steps, pdo, sheet);
  }
  for (std::size_t axis = 0; axis < node.joints.size(); ++axis) add_axis(steps, robot, node, axis);
  if (sheet != nullptr && offered(*sheet, object::kSyncTimeout, 0, DataType::kUnsigned32)) {
    steps.push_back(write_step(object::kSyncTimeout, 0, std::uint32_t{0}));
  }
  // On EtherCAT its state is watched, and its process data's watchdog.
  if (!node.ethercat) add_watching(steps, node, sheet);
  if (board != nullptr && board->keeps_configuration) {
    add_names(steps, SdoUse::kWrite);
    constexpr std::uint32_t kSave = 0x65766173;  // "save"
    steps.push_back(write_step(object::kStoreParameters, 1, kSave));
    steps.back().use = SdoUse::kStore;
  }
  if (sheet != nullptr) leave_out_unreadable(steps, *sheet);
  return steps;
}

namespace {

void add_watching(Steps& steps, const NodePlan& node, const DataSheet* sheet) {
  const auto takes = [&](std::uint16_t index, std::uint8_t sub) {
    return sheet == nullptr || writable(*sheet, index, sub);
  };
  const int timeout_ms = std::min(kHeartbeatPeriods * node.heartbeat_ms, 0xFFFF);
  if (node.watch == NodeWatch::kGuarding) {
    steps.push_back(
        write_step(object::kGuardTime, 0, clamp_round<std::uint16_t>(node.heartbeat_ms)));
    steps.push_back(
        write_step(object::kLifeTimeFactor, 0, static_cast<std::uint8_t>(kHeartbeatPeriods)));
    return;
  }
  if (takes(object::kHeartbeatConsumer, 1)) {
    steps.push_back(write_step(object::kHeartbeatConsumer, 1,
                               static_cast<std::uint32_t>(kMasterNodeId << 16 | timeout_ms)));
  }
  if (takes(object::kHeartbeatProducer, 0)) {
    steps.push_back(
        write_step(object::kHeartbeatProducer, 0, clamp_round<std::uint16_t>(node.heartbeat_ms)));
  }
}

}  // namespace

void name_configuration(std::span<SdoStep> steps) noexcept TANDEM_RT {
  std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a
  const auto mix = [&hash](std::uint32_t value) {
    for (int byte = 0; byte < 4; ++byte)
      hash = (hash ^ (value >> 8 * byte & 0xFF)) * 0x100000001b3U;
  };
  for (const SdoStep& step : steps) {
    const bool kept = step.use == SdoUse::kWrite && step.kept;
    if (!kept || step.index == object::kVerifyConfiguration) continue;
    mix(std::uint32_t{step.index} << 16 | std::uint32_t{step.sub} << 8 | step.size);
    mix(get<std::uint32_t>(step.bytes.data()));
  }
  for (SdoStep& step : steps) {
    if (step.index != object::kVerifyConfiguration) continue;
    const auto half = static_cast<std::uint32_t>(step.sub == 1 ? hash : hash >> 32);
    put(step.bytes.data(), half | 1U);  // 0 is a drive that was never configured
  }
}

}  // namespace tandem::hal::can
