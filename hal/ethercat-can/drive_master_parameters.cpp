// Gains that change at run time: one SDO at a time per board, until the drive has what the
// parameter image asks for.
#include <algorithm>

#include "canopen/sdo.hpp"
#include "hal/ethercat-can/drive_master_impl.hpp"
#include "hal/ethercat-can/sdo_sequence.hpp"

namespace tandem::hal::can {
namespace {

/// Items of one axis' parameters: kp, ki, kd of each loop.
constexpr std::size_t kItemsPerLoop = 3;
constexpr std::size_t kItemsPerAxis = kPidLoops * kItemsPerLoop;

double& item(PidGains& gains, std::size_t which) noexcept {
  return which == 0 ? gains.kp : which == 1 ? gains.ki : gains.kd;
}

}  // namespace

void DriveMaster::Impl::send_parameters(const ParameterImage& parameters) noexcept TANDEM_RT {
  for (Node& node : nodes) {
    if (node.plan.board >= 0 && node.master.running()) send_parameter(node, parameters);
  }
}

/// A fault whose cause no PDO tells: 603F has it, and on EtherCAT the emergency that waits in the
/// mailbox comes first.
void DriveMaster::Impl::ask_cause(Node& node) noexcept TANDEM_RT {
  canopen::SdoClient& sdo = node.master.sdo();
  if (!node.master.running()) {
    node.asking = -1;
    return;
  }
  if (sdo.status() == canopen::SdoClient::Status::kBusy) return;
  if (node.asking >= 0) {
    const std::size_t joint = node.plan.joints[static_cast<std::size_t>(node.asking)];
    node.asking = -1;
    const bool read = sdo.status() == canopen::SdoClient::Status::kDone && sdo.value().size() >= 2;
    if (read) axes[joint].take_cause(canopen::get<std::uint16_t>(sdo.value().data()));
  }
  for (std::size_t axis = 0; axis < node.plan.joints.size(); ++axis) {
    AxisMaster& asked = axes[node.plan.joints[axis]];
    if (!asked.wants_cause()) continue;
    asked.cause_asked();
    node.asking = static_cast<std::int16_t>(axis);
    node.sending = -1;
    sdo.upload(canopen::of_axis(canopen::object::kErrorCode, static_cast<int>(axis)), 0,
               ports[node.plan.bus].sink);
    return;
  }
}

/// A master that falls silent without this is an error to the node (8130), though the run ends as
/// it should. NMT pre-operational follows at once, in which the node answers SDOs too.
void DriveMaster::Impl::end_watch(Node& node) noexcept TANDEM_RT {
  const auto watches = [](const SdoStep& step) {
    const bool guards = step.index == canopen::object::kHeartbeatConsumer ||
                        step.index == canopen::object::kLifeTimeFactor;
    return guards && step.use == SdoUse::kWrite;
  };
  const auto armed = std::ranges::find_if(node.master.steps(), watches);
  const bool off = std::ranges::all_of(node.plan.joints, [&](auto j) { return axes[j].off(); });
  const NodeMaster& master = node.master;
  const auto place = static_cast<std::size_t>(armed - master.steps().begin());
  // A start that failed has armed those that came so far; a node that is lost is to notice it.
  const bool lost = master.stage() == NodeStage::kDown &&
                    master.error() != FaultCause::kNotOperational &&
                    master.error() != FaultCause::kBoardRefused;
  const bool reached = master.running() || master.step() > place;
  if (lost || !reached || armed == master.steps().end() || !off) return;
  static constexpr std::array<std::uint8_t, 4> kNobody{};
  node.master.sdo().download(armed->index, armed->sub, std::span(kNobody).first(armed->size),
                             ports[node.plan.bus].sink);
}

/// Finishes the transfer under way, then starts the next item that differs from what the drive has.
void DriveMaster::Impl::send_parameter(Node& node,
                                       const ParameterImage& parameters) noexcept TANDEM_RT {
  canopen::SdoClient& sdo = node.master.sdo();
  if (node.asking >= 0 || sdo.status() == canopen::SdoClient::Status::kBusy) return;
  if (node.sending >= 0 && sdo.status() == canopen::SdoClient::Status::kAborted) {
    refused_node = static_cast<std::int32_t>(&node - nodes.data());
    refused_step = {
        .sub = sdo.sub(),
        .index = sdo.index(),
        .axis = static_cast<std::int8_t>(static_cast<std::size_t>(node.sending) / kItemsPerAxis)};
    refused_code = sdo.abort_code();
  }
  node.sending = -1;
  const auto changed = [&](std::size_t joint) {
    return parameters.revision(joint) != sent_revision[joint];
  };
  if (std::ranges::none_of(node.plan.joints, changed)) return;  // nearly always
  const std::size_t items = node.plan.joints.size() * kItemsPerAxis;
  for (std::size_t i = 0; i < items; ++i) {
    const std::size_t now = (node.next_item + i) % items;
    const std::size_t axis = now / kItemsPerAxis;
    const std::size_t joint = node.plan.joints[axis];
    if (!changed(joint)) continue;
    const auto loop = static_cast<PidLoop>(now % kItemsPerAxis / kItemsPerLoop);
    const std::size_t which = now % kItemsPerLoop;
    PidGains wanted = parameters.gains(joint, loop);
    PidGains& sent = sent_gains[joint * kPidLoops + static_cast<std::size_t>(loop)];
    if (item(wanted, which) == item(sent, which)) continue;
    const SdoStep step =
        write_step(canopen::of_axis(gains_object(loop), static_cast<int>(axis)),
                   static_cast<std::uint8_t>(which + 1), static_cast<float>(item(wanted, which)));
    sdo.download(step.index, step.sub, step.value(), ports[node.plan.bus].sink);
    item(sent, which) = item(wanted, which);
    node.sending = static_cast<std::int16_t>(now);
    node.next_item = now;
    return;
  }
  for (const std::size_t joint : node.plan.joints) {
    sent_revision[joint] = parameters.revision(joint);
  }
}

}  // namespace tandem::hal::can
