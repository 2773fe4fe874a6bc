// The texts of bring-up, faults and warnings. They allocate, so the cycle does not call them.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "hal/ethercat-can/drive_master_impl.hpp"

namespace tandem::hal::can {

namespace {

constexpr std::size_t kMostCauses = 8;  // named in one text

const char* label(const NodePlan& plan) { return plan.board >= 0 ? "board" : "sensor"; }

/// The value of a step of 1 to 4 bytes as a number, for messages about identity.
std::uint32_t number(const SdoStep& step) { return canopen::get<std::uint32_t>(step.bytes.data()); }

const char* identity_name(const SdoStep& step) {
  if (step.index == canopen::object::kDeviceType) return "device type";
  switch (step.sub) {
    case canopen::kVendor: return "vendor id";
    case canopen::kProduct: return "product code";
    case canopen::kRevision: return "revision";
    default: return "serial number";
  }
}

const char* allowed(SdoUse use) {
  if (use == SdoUse::kCheckRevision) return " or a later minor of it";
  return use == SdoUse::kCheckProfile ? ", or profile 402 (0x0192) in its lower half" : "";
}

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

}  // namespace

std::string DriveMaster::error_text(std::uint32_t code) {
  std::string_view words = canopen::to_string(static_cast<canopen::ErrorCode>(code));
  if (words.empty()) words = canopen::error_words(static_cast<std::uint16_t>(code));
  return fmt::format("{} (error code 0x{:04X})", words, code);
}

std::string DriveMaster::Impl::joint_name(std::size_t joint) const {
  const Node& node = nodes[joint_node[joint]];
  return fmt::format("joint {} (board {}, node {}, axis {})", robot.joints[joint].name,
                     node.plan.name, node.plan.id, robot.joints[joint].axis);
}

/// "object 2820:01 of joint LHip (board …)".
std::string DriveMaster::Impl::step_text(const Node& node, const SdoStep& step) const {
  const bool of_joint =
      step.axis >= 0 && static_cast<std::size_t>(step.axis) < node.plan.joints.size();
  return fmt::format(
      "object {:04X}:{:02X} of {}", step.index, step.sub,
      of_joint ? joint_name(node.plan.joints[static_cast<std::size_t>(step.axis)])
               : fmt::format("{} {} (node {})", label(node.plan), node.plan.name, node.plan.id));
}

/// Who asks for a step, where it is not the master.
std::string DriveMaster::Impl::origin_text(const Node& node, const SdoStep& step) const {
  if (!step.of_file || node.plan.board < 0) return {};
  const std::string& file = robot.boards[static_cast<std::size_t>(node.plan.board)].eds;
  return fmt::format(
      "; an InitCmd of {} asks for it: is it the file of this drive and of its firmware? An "
      "InitCmd with Disabled=\"1\" is not sent",
      file);
}

// NOLINTNEXTLINE(readability-function-size): a table
std::string DriveMaster::Impl::node_text(const Node& node) const {
  const NodeMaster& m = node.master;
  const std::string who = fmt::format("{} {} (node {}, bus {})", label(node.plan), node.plan.name,
                                      node.plan.id, robot.buses[node.plan.bus].name);
  const double limit_s = seconds(2 * node.plan.boot_time_ns);
  switch (m.error()) {
    case FaultCause::kNone: break;
    case FaultCause::kNoBootUp:
      return fmt::format(
          "{}: no boot-up message within {:.0f} s; is it powered and connected, "
          "and is its node id {}?",
          who, limit_s, node.plan.id);
    case FaultCause::kWrongIdentity: {
      const SdoStep& step = m.steps()[m.step()];
      if (step.use == SdoUse::kCheckBits) {
        return fmt::format(
            "{}: the drive has not the modes that its sheet makes the master use: {} is 0x{:X}, "
            "and "
            "the bits 0x{:X} are needed",
            who, step_text(node, step), m.read_value(), number(step));
      }
      if (step.axis >= 0) {
        return fmt::format(
            "{}: {} is {}, and its sheet says {}: the joint's scale would be wrong; set "
            "encoder_counts_per_rev and rated_torque_Nm in robot.toml",
            who, step_text(node, step), m.read_value(), number(step));
      }
      return fmt::format("{}: wrong {}: object {:04X}:{:02X} is 0x{:X} instead of 0x{:X}{}", who,
                         identity_name(step), step.index, step.sub, m.read_value(), number(step),
                         allowed(step.use));
    }
    case FaultCause::kBoardRefused: {
      const SdoStep& step = m.steps()[m.step()];
      return fmt::format("{} {} failed: {} (abort code 0x{:08X}){}",
                         step.use != SdoUse::kWrite ? "reading" : "writing", step_text(node, step),
                         canopen::to_string(m.abort_code()),
                         static_cast<std::uint32_t>(m.abort_code()), origin_text(node, step));
    }
    case FaultCause::kNotOperational:
      return fmt::format("{}: stays {} after NMT start", who, canopen::to_string(m.nmt_state()));
    case FaultCause::kBoardRebooted:
      return fmt::format("{}: booted again by itself at {:.3f} s", who,
                         seconds(m.trouble_time_ns()));
    case FaultCause::kHeartbeatLost:
      return fmt::format("{}: heartbeat lost at {:.3f} s (none for {} ms)", who,
                         seconds(m.trouble_time_ns()), kHeartbeatPeriods * node.plan.heartbeat_ms);
    case FaultCause::kGuardingLost:
      return fmt::format("{}: guarding lost at {:.3f} s (no answer to node guarding for {} ms)",
                         who, seconds(m.trouble_time_ns()),
                         kHeartbeatPeriods * node.plan.heartbeat_ms);
    case FaultCause::kBoardStopped:
      return fmt::format("{}: went to {} by itself at {:.3f} s", who,
                         canopen::to_string(m.nmt_state()), seconds(m.trouble_time_ns()));
    case FaultCause::kTwoBoards:
      return fmt::format("{}: two nodes answer under this id at {:.3f} s; give one of them another",
                         who, seconds(m.trouble_time_ns()));
    case FaultCause::kIgnoresStop:
      return fmt::format(
          "{}: a drive does not obey the stop at {:.3f} s: NMT stop was sent; cut its power "
          "(emergency stop, STO)",
          who, seconds(m.trouble_time_ns()));
    case FaultCause::kBoardSilent:
      return fmt::format("{}: no complete TPDO for {} cycles at {:.3f} s", who, node.timeout_cycles,
                         seconds(m.trouble_time_ns()));
    default: break;
  }
  switch (m.stage()) {
    case NodeStage::kWaitBootUp: return who + ": waiting for its boot-up message";
    case NodeStage::kConfigure:
      return fmt::format("{}: configuring, object {} of {}", who, m.step() + 1, m.steps().size());
    case NodeStage::kReady: return who + ": configured";
    case NodeStage::kStarting: return who + ": waiting for operational";
    default: return {};
  }
}

std::string DriveMaster::Impl::axis_text(std::size_t joint) const {
  const AxisMaster& axis = axes[joint];
  const double at_s = seconds(axis.trouble_time_ns());
  switch (axis.error()) {
    case FaultCause::kNone: return {};
    case FaultCause::kDrive:
      return fmt::format("{}: {} at {:.3f} s", joint_name(joint), error_text(axis.fault_code()),
                         at_s);
    case FaultCause::kNotEnabled:
      return fmt::format(
          "{}: stays in '{}' (statusword {:04X}:00 = 0x{:04X}) after controlword "
          "0x{:04X}",
          joint_name(joint), canopen::to_string(axis.drive()),
          canopen::of_axis(canopen::object::kStatusword, robot.joints[joint].axis),
          axis.feedback().statusword, axis.raw().controlword);
    case FaultCause::kLeftEnabled:
      return fmt::format("{}: left 'operation enabled' for '{}' by itself at {:.3f} s",
                         joint_name(joint), canopen::to_string(axis.drive()), at_s);
    case FaultCause::kNotFollowing:
      return fmt::format(
          "{}: does not follow its command at {:.3f} s: is the joint blocked, does the drive get "
          "its commands?",
          joint_name(joint), at_s);
    case FaultCause::kTooFast:
    case FaultCause::kTooStrong:
    case FaultCause::kTooPowerful:
    case FaultCause::kSwings:
      return fmt::format(
          "{}: moves beyond its limits at {:.3f} s, and its drive does not stop it: "
          "{}",
          joint_name(joint), at_s, error_text(axis.fault_code()));
    default: {
      const std::string cause = node_text(nodes[joint_node[joint]]);
      return fmt::format("{}: board lost at {:.3f} s{}{}", joint_name(joint), at_s,
                         cause.empty() ? "" : ": ", cause);
    }
  }
}

std::string DriveMaster::status_text() const {
  const Impl& m = *impl_;
  std::vector<std::string> causes;
  if (m.stage != Impl::MasterStage::kBooting && m.stage != Impl::MasterStage::kEnabling) {
    for (std::size_t j = 0; j < m.axes.size(); ++j) {
      if (std::string text = m.axis_text(j); !text.empty()) causes.push_back(std::move(text));
    }
  }
  for (const Impl::Node& node : m.nodes) {
    const bool told = !causes.empty() && node.plan.board >= 0;
    const bool waits = m.stage == Impl::MasterStage::kBooting
                           ? node.master.stage() != NodeStage::kReady
                           : !node.master.running();
    const bool has_error = node.master.error() != FaultCause::kNone;
    if (told || (!has_error && (!waits || m.stage == Impl::MasterStage::kFailed))) continue;
    if (std::string text = m.node_text(node); !text.empty()) causes.push_back(std::move(text));
  }
  for (std::size_t j = 0; m.stage == Impl::MasterStage::kEnabling && j < m.axes.size(); ++j) {
    if (m.axes[j].enabled()) continue;
    causes.push_back(fmt::format("{}: waiting for 'operation enabled', is in '{}'", m.joint_name(j),
                                 canopen::to_string(m.axes[j].drive())));
  }
  if (causes.empty() && m.latched != StopCategory::kWarn) {
    return fmt::format("stopped by request ({})", to_string(m.latched));
  }
  if (causes.empty())
    return m.stage == Impl::MasterStage::kFaulted ? "enabling every axis again" : "";
  std::string text;
  for (std::size_t i = 0; i < std::min(causes.size(), kMostCauses); ++i) {
    if (i > 0) text += '\n';
    text += causes[i];
  }
  if (causes.size() > kMostCauses) {
    text += fmt::format("\nand {} more", causes.size() - kMostCauses);
  }
  return text;
}

std::vector<std::string> DriveMaster::warnings() const {
  const Impl& m = *impl_;
  std::vector<std::string> texts;
  for (const Impl::Node& node : m.nodes) {
    if (node.missed == 0) continue;
    texts.push_back(fmt::format("{} (node {} on bus {}): {} cycles without its feedback",
                                node.plan.name, node.plan.id, m.robot.buses[node.plan.bus].name,
                                node.missed));
  }
  for (const Impl::Node& node : m.nodes) {
    if (node.master.store_code() == canopen::AbortCode::kNone) continue;
    texts.push_back(fmt::format(
        "{} (node {} on bus {}) does not store its configuration (1010:1): {}; it is written again "
        "at the next start",
        node.plan.name, node.plan.id, m.robot.buses[node.plan.bus].name,
        canopen::to_string(node.master.store_code())));
  }
  m.add_emergencies(texts);
  if (m.unsent > 0)
    texts.push_back(fmt::format("a bus did not take the commands of {} cycles", m.unsent));
  for (const Impl::Node& node : m.nodes) {
    const auto& [step, code] = node.gains.refused();
    if (step.index == 0) continue;
    texts.push_back(fmt::format("a value was refused: {}: {} (abort code 0x{:08X})",
                                m.step_text(node, step), canopen::to_string(code),
                                static_cast<std::uint32_t>(code)));
  }
  return texts;
}

/// What boards told that no fault of a joint has told already.
void DriveMaster::Impl::add_emergencies(std::vector<std::string>& texts) const {
  for (const Node& node : nodes) {
    if (node.emergencies > 0) {
      const canopen::EmergencyMessage& last = node.emergency;
      texts.push_back(
          fmt::format("{} (node {} on bus {}): emergencies that name no axis: {}; the last: {}, "
                      "register 0x{:02X}, then {:02X}",
                      node.plan.name, node.plan.id, robot.buses[node.plan.bus].name,
                      node.emergencies, error_text(static_cast<std::uint32_t>(last.code)),
                      last.error_register, fmt::join(last.manufacturer, " ")));
    }
    for (const std::size_t joint : node.plan.joints) {
      const std::uint16_t code = axes[joint].emergency_without_fault();
      if (code == 0) continue;
      texts.push_back(
          fmt::format("{}: an emergency without a fault: {}", joint_name(joint), error_text(code)));
    }
  }
}

}  // namespace tandem::hal::can
