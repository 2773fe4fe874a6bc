// The drive master's stages: a state machine that advances once per cycle, on the loop's thread.
//
//   kBooting ----------------> kEnabling ----------------> kRunning <-----------+
//      |     every node runs       |     every axis is        |                 |  reset(): no
//      |                           |     enabled              | fault, stop()   |  cause is left,
//      | node down, stop()         | node or axis fails,      v                 |  every axis is
//      |                           | stop()                kFaulted ------------+  enabled again
//      +-------------+-------------+
//                    v                         in kFaulted a harder reaction changes the axes'
//                 kFailed, for good            targets; the stage stays
//
// react() gives every axis its target: nothing (category 0), quick stop (category 1) or hold; an
// axis with a fault of its own gets nothing. A fault of a "warn" joint leaves the stage as it is.
// recover() brings back joints that are reset and nodes that are configured anew, one by one.
// shut_down() works in every stage: quick stop until the axes are off, 3 s at most; then the nodes
// are told to watch the master no more; then NMT pre-operational.
#include <algorithm>

#include "canopen/messages.hpp"
#include "hal/ethercat-can/drive_master_impl.hpp"

namespace tandem::hal::can {

using TargetState = AxisMaster::TargetState;

namespace {

/// How long shut_down() waits for the drives to come to rest.
constexpr std::int64_t kShutDownNs = 3'000'000'000;
/// When a drive that was enabled, and is not heard any more, counts as still enabled there.
constexpr std::int64_t kUnheardNs = 1'500'000'000;

/// What an axis has whose board is lost, until its node says more.
constexpr FaultCause kNodeLost = FaultCause::kBoardSilent;
constexpr auto kNodeLostCode = static_cast<std::uint16_t>(canopen::ErrorCode::kHeartbeatLost);

}  // namespace

void DriveMaster::Impl::advance() noexcept TANDEM_RT {
  switch (stage) {
    case MasterStage::kBooting: boot(); break;
    case MasterStage::kEnabling:
      if (std::ranges::any_of(nodes, [](const Node& n) { return !n.master.running(); })) {
        fail();
      } else if (all_enabled()) {
        set_targets(TargetState::kFollow);
        stage = MasterStage::kRunning;
        measure_start();
      }
      break;
    case MasterStage::kRunning:
      watch();
      recover();
      break;
    case MasterStage::kFaulted:
      watch();
      recover();
      enable_again();
      break;
    case MasterStage::kFailed: break;
  }
  if (resetting) watch_reset();
}

void DriveMaster::Impl::measure_start() noexcept TANDEM_RT {
  start_up = {.duration_ns = now_ns - started_ns, .axes = axes.size()};
  for (const Port& port : ports) {
    const BusStatistics passed = port.bus->statistics();
    start_up.sent += passed.sent;
    start_up.received += passed.received;
  }
}

/// Once every fault is reset: all axes again, where they are.
void DriveMaster::Impl::enable_again() noexcept TANDEM_RT {
  if (latched != StopCategory::kWarn) return;
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    if (stands_in_the_way(joint) || axes[joint].target() == TargetState::kReset) return;
  }
  bool all = true;
  for (AxisMaster& axis : axes) {
    if (axis.error() != FaultCause::kNone) continue;  // "warn": the others go on without it
    axis.set_target(TargetState::kEnable, now_ns);
    all = all && axis.enabled();
  }
  if (!all) return;
  for (AxisMaster& axis : axes) {
    if (axis.error() == FaultCause::kNone) axis.set_target(TargetState::kFollow, now_ns);
  }
  reaction = StopCategory::kWarn;
  stage = MasterStage::kRunning;
}

/// A joint whose category is "warn" never keeps the others from moving.
bool DriveMaster::Impl::stands_in_the_way(std::size_t joint) const noexcept TANDEM_RT {
  return axes[joint].error() != FaultCause::kNone && category(joint) != StopCategory::kWarn;
}

FaultCause DriveMaster::Impl::cause(std::size_t joint) const noexcept TANDEM_RT {
  const AxisMaster& axis = axes[joint];
  constexpr auto kInput = static_cast<std::uint16_t>(canopen::ErrorCode::kEmergencyInput);
  FaultCause cause = axis.error();
  if (is_of_board(cause) && cause != FaultCause::kIgnoresStop) {
    cause = nodes[joint_node[joint]].master.error();
    // Links know fewer causes than the node: the rest is in its own text.
    const bool refused =
        cause == FaultCause::kWrongIdentity || cause == FaultCause::kNotOperational;
    const bool known = cause != FaultCause::kNone && cause != FaultCause::kNoBootUp &&
                       cause != FaultCause::kIgnoresStop;  // its joints that had obeyed
    return refused ? FaultCause::kBoardRefused : known ? cause : kNodeLost;
  }
  if (cause == FaultCause::kDrive && axis.fault_code() == kInput)
    return FaultCause::kEmergencyInput;
  return cause == FaultCause::kNone ? FaultCause::kDrive : cause;
}

/// reset() is through when every joint follows again, or when nothing is under way any more and a
/// cause is still there.
void DriveMaster::Impl::watch_reset() noexcept TANDEM_RT {
  bool under_way = stage == MasterStage::kFaulted;
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    const AxisMaster& axis = axes[joint];
    const Node& node = node_of(joint);
    const bool node_starts =
        is_of_board(axis.error()) && (node.recovering || node.master.running());
    if (axis.target() == TargetState::kReset || node_starts) return;
    if (stage == MasterStage::kFaulted && stands_in_the_way(joint)) under_way = false;
    if (stage == MasterStage::kRunning && axis.error() == FaultCause::kNone &&
        axis.target() != TargetState::kFollow) {
      under_way = true;
    }
  }
  resetting = under_way;
}

void DriveMaster::Impl::boot() noexcept TANDEM_RT {
  bool all_ready = true;
  bool all_running = true;
  for (const Node& node : nodes) {
    const NodeStage at = node.master.stage();
    if (at == NodeStage::kDown) return fail();
    all_ready = all_ready && at == NodeStage::kReady;
    all_running = all_running && at == NodeStage::kRunning;
  }
  if (all_ready) {
    for (Node& node : nodes) node.master.start(now_ns, ports[node.plan.bus].sink);
  } else if (all_running) {
    set_targets(TargetState::kBringUp);
    stage = MasterStage::kEnabling;
  }
}

/// Finds what went wrong since the last cycle, and carries the worst stop category out.
void DriveMaster::Impl::watch() noexcept TANDEM_RT {
  StopCategory worst = StopCategory::kWarn;
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    AxisMaster& axis = axes[joint];
    const Node& node = node_of(joint);
    bool is_new = false;
    if (node.master.stage() == NodeStage::kDown && !is_of_board(axis.error())) {
      axis.latch(kNodeLost, kNodeLostCode, now_ns);
      axis.set_target(TargetState::kNothing, now_ns);
      is_new = true;
    } else {
      is_new = axis.check(now_ns);
    }
    if (is_new) worst = std::min(worst, category(joint));
  }
  if (stops_drives(worst)) (void)react(worst);
}

/// A drive that stays enabled after a stop does not hear its commands, or does not heed them.
void DriveMaster::Impl::watch_stops() noexcept TANDEM_RT {
  if (!shutting_down && stage != MasterStage::kFaulted && stage != MasterStage::kFailed) return;
  const bool ends = shutting_down && now_ns - shut_down_since_ns >= kUnheardNs;
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    AxisMaster& axis = axes[joint];
    const bool unheard = ends && axis.enabled() && axis.error() == FaultCause::kNone &&
                         node_of(joint).master.error() != FaultCause::kBoardRebooted;
    if (axis.ignores_stop(now_ns) || unheard) ignored_stop(joint);
  }
}

/// What its commands do not reach, NMT stop may: the board reacts as to a lost connection.
void DriveMaster::Impl::ignored_stop(std::size_t joint) noexcept TANDEM_RT {
  Node& node = node_of(joint);
  axes[joint].latch(FaultCause::kIgnoresStop, kNodeLostCode, now_ns);
  axes[joint].set_target(TargetState::kNothing, now_ns);
  if (node.master.stage() != NodeStage::kDown) {
    node.master.fail(FaultCause::kIgnoresStop, now_ns);
    (void)node.exchange.end_commands();
    ports[node.plan.bus].sink.push(canopen::make_nmt(canopen::NmtCommand::kStop, node.plan.id));
  }
  if (!shutting_down && stage == MasterStage::kFaulted) (void)react(category(joint));
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

/// @return whether an axis is to do something else than before.
bool DriveMaster::Impl::react(StopCategory category) noexcept TANDEM_RT {
  reaction = std::min(reaction, category);  // the lower the number, the harder the stop
  stage = MasterStage::kFaulted;
  const TargetState target = reaction == StopCategory::kCategory0   ? TargetState::kNothing
                             : reaction == StopCategory::kCategory1 ? TargetState::kQuickStop
                                                                    : TargetState::kHold;
  bool changed = false;
  for (AxisMaster& axis : axes) {
    TargetState its = axis.error() == FaultCause::kNone ? target : TargetState::kNothing;
    if (is_of_motion(axis.error()) && target != TargetState::kNothing) {
      its = TargetState::kQuickStop;  // it has no fault of its own: it can brake
    }
    changed = changed || axis.target() != its;
    axis.set_target(its, now_ns);
  }
  return changed;
}

void DriveMaster::stop(StopCategory category) noexcept TANDEM_RT {
  Impl& m = *impl_;
  if (category == StopCategory::kWarn || m.shutting_down) return;
  m.latched = std::min(m.latched, category);
  m.resetting = false;
  if (m.stage == Impl::MasterStage::kFailed) return;
  if (m.stage == Impl::MasterStage::kBooting || m.stage == Impl::MasterStage::kEnabling) {
    m.fail();
  } else if (!m.react(category)) {
    return;  // it has been reported
  }
  m.make_commands(nullptr);  // this cycle's SYNC is over: the next one makes it take effect
  m.write_pdos();
  (void)m.flush();
}

void DriveMaster::reset() noexcept TANDEM_RT {
  Impl& m = *impl_;
  if (m.shutting_down ||
      (m.stage != Impl::MasterStage::kFaulted && m.stage != Impl::MasterStage::kRunning))
    return;
  m.latched = StopCategory::kWarn;
  m.resetting = true;
  for (std::size_t joint = 0; joint < m.axes.size(); ++joint) {
    if (m.axes[joint].target() == TargetState::kHome)
      m.axes[joint].set_target(TargetState::kEnable, m.now_ns);
    m.reset_joint(joint);
  }
}

/// Goes on with what reset_joint() began: drives that are reset, nodes that are configured anew.
void DriveMaster::Impl::recover() noexcept TANDEM_RT {
  for (Node& node : nodes) {
    const bool sensor_lost = node.plan.sensor >= 0 && node.master.stage() == NodeStage::kDown;
    if (sensor_lost) {  // it moves nothing: it may come back by itself
      node.master.restart(now_ns);
      node.recovering = true;
    }
    if (!node.recovering) continue;
    if (node.master.stage() == NodeStage::kReady) {
      node.master.start(now_ns, ports[node.plan.bus].sink);
    } else if (node.master.running()) {
      node.recovering = false;
      node.exchange.restart();
    } else if (node.master.stage() == NodeStage::kDown) {
      node.recovering = false;  // a new reset may try again
    }
  }
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    AxisMaster& axis = axes[joint];
    if (is_of_board(axis.error())) {
      if (node_of(joint).master.running() && axis.heard()) axis.clear_error();
    } else if (axis.target() == TargetState::kReset) {
      if (axis.in_reset()) continue;
      axis.clear_error();
      axis.set_target(TargetState::kNothing, now_ns);
    }
    const bool idle_alone = stage == MasterStage::kRunning &&
                            axis.target() == TargetState::kNothing &&
                            axis.error() == FaultCause::kNone;
    if (idle_alone) axis.set_target(TargetState::kEnable, now_ns);
    if (stage == MasterStage::kRunning && axis.target() == TargetState::kEnable && axis.enabled()) {
      axis.set_target(TargetState::kFollow, now_ns);
    }
  }
}

void DriveMaster::Impl::take_resets(const CommandImage& command) noexcept TANDEM_RT {
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    if (command.fault_reset()[joint] != 0) reset_joint(joint);
  }
}

/// Begins to clear what is latched of a joint; recover() goes on with it.
void DriveMaster::Impl::reset_joint(std::size_t joint) noexcept TANDEM_RT {
  AxisMaster& axis = axes[joint];
  if (axis.error() == FaultCause::kNone) return;
  if (!is_of_board(axis.error())) {
    axis.set_target(TargetState::kReset, now_ns);
    return;
  }
  Node& node = node_of(joint);
  if (node.recovering || node.master.stage() != NodeStage::kDown) return;
  node.recovering = true;
  node.asking = -1;
  node.master.restart(now_ns);
  node.gains.restart();
  for (const std::size_t lost : node.plan.joints) axes[lost].forget();
}

void DriveMaster::Impl::set_targets(TargetState target) noexcept TANDEM_RT {
  for (AxisMaster& axis : axes) axis.set_target(target, now_ns);
}

void DriveMaster::Impl::fail() noexcept TANDEM_RT {
  stage = MasterStage::kFailed;
  set_targets(TargetState::kNothing);
}

void DriveMaster::Impl::make_commands(const CommandImage* image) noexcept TANDEM_RT {
  StopCategory worst = StopCategory::kWarn;
  for (std::size_t joint = 0; joint < axes.size(); ++joint) {
    AxisMaster& axis = axes[joint];
    if (!axis.command(image, joint, now_ns)) continue;
    if (axis.target() == TargetState::kReset) {  // the cause is still there: stays latched
      axis.set_target(TargetState::kNothing, now_ns);
    } else {
      worst = std::min(worst, category(joint));
      if (stage == MasterStage::kEnabling) return fail();
    }
  }
  if (stops_drives(worst)) (void)react(worst);
}

bool DriveMaster::Impl::all_enabled() const noexcept TANDEM_RT {
  return std::ranges::all_of(axes, [](const AxisMaster& axis) { return axis.enabled(); });
}

bool DriveMaster::Impl::shut_down() noexcept TANDEM_RT {
  if (!shutting_down) {
    shutting_down = true;
    shut_down_since_ns = now_ns;
    set_targets(reaction == StopCategory::kCategory0 ? TargetState::kNothing
                                                     : TargetState::kQuickStop);
  }
  const bool at_rest = std::ranges::all_of(axes, [](const AxisMaster& axis) {
    return axis.off() || axis.error() == FaultCause::kIgnoresStop;
  });
  const bool done = at_rest || now_ns - shut_down_since_ns >= kShutDownNs;
  if (done) set_targets(TargetState::kNothing);
  make_commands(nullptr);
  write_pdos();
  if (!done) return false;
  for (Node& node : nodes) {
    if (node.master.error() == FaultCause::kIgnoresStop) continue;  // stopped it stays
    end_watch(node);
    ports[node.plan.bus].sink.push(
        canopen::make_nmt(canopen::NmtCommand::kEnterPreOperational, node.plan.id));
  }
  return true;
}

}  // namespace tandem::hal::can
