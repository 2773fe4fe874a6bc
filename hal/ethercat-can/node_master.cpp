// One node's stages: wait for boot-up, configure by SDO, ready, starting, running; down with an
// error that says why. docs/wire.md lists the frames.
#include "hal/ethercat-can/node_master.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"

namespace tandem::hal::can {

using canopen::AbortCode;
using canopen::FrameSink;
using canopen::NmtState;
using canopen::SdoClient;

namespace {

bool is_interpolation_period(std::uint16_t index) noexcept {
  return index >= 0x6000 && index < 0xA000 &&
         (index - 0x6000) % canopen::kAxisStride == canopen::object::kInterpolationPeriod - 0x6000;
}

}  // namespace

NodeMaster::NodeMaster(int id, int heartbeat_ms, std::int64_t boot_time_ns, NodeWatch watch,
                       std::vector<SdoStep> steps, std::int64_t start_time_ns)
    : id_(id),
      heartbeat_timeout_ns_(std::int64_t{kHeartbeatPeriods} * heartbeat_ms * 1'000'000),
      boot_time_ns_(boot_time_ns),
      start_time_ns_(start_time_ns),
      watch_(watch),
      steps_(std::move(steps)),
      sdo_(id) {}

void NodeMaster::set_times(std::int64_t period_ns,
                           std::int64_t sync_timeout_ns) noexcept TANDEM_RT {
  for (SdoStep& step : steps_) {
    const bool writes = step.use == SdoUse::kWrite;
    if (writes && is_interpolation_period(step.index)) {
      const auto told = interpolation_period(period_ns, step.period);
      if (told && step.sub == 1) canopen::put(step.bytes.data(), told->units);
      if (told && step.sub == 2) canopen::put(step.bytes.data(), told->power);
    }
    if (step.index != canopen::object::kSyncTimeout) continue;
    canopen::put(step.bytes.data(), canopen::clamp_round<std::uint32_t>(
                                        static_cast<double>(sync_timeout_ns) / 1000.0));
  }
  name_configuration(steps_);
}

void NodeMaster::restart(std::int64_t now_ns) noexcept TANDEM_RT {
  enter(NodeStage::kWaitBootUp, now_ns);
  error_ = FaultCause::kNone;
  next_reset_ns_ = now_ns;
  reboots_ = 0;
}

void NodeMaster::on_heartbeat(NmtState state, std::int64_t now_ns) noexcept TANDEM_RT {
  nmt_ = state;
  heard_ns_ = now_ns;
  if (state == NmtState::kBootUp) {
    if (stage_ == NodeStage::kDown) return;
    const bool again = booted_ns_ == now_ns;  // no node boots twice in a cycle
    booted_ns_ = now_ns;
    if (again) return fail(FaultCause::kTwoBoards, now_ns);
    const bool expected = stage_ == NodeStage::kWaitBootUp;
    const bool too_often = !expected && ++reboots_ > kReboots;
    if (stage_ == NodeStage::kRunning || too_often) return fail(FaultCause::kBoardRebooted, now_ns);
    return enter(NodeStage::kConfigure, now_ns);
  }
  if (stage_ == NodeStage::kStarting && state == NmtState::kOperational) {
    enter(NodeStage::kRunning, now_ns);
  } else if (stage_ == NodeStage::kStarting && state == NmtState::kStopped) {
    fail(FaultCause::kNotOperational, now_ns);
  } else if (stage_ == NodeStage::kRunning && state != NmtState::kOperational) {
    fail(FaultCause::kBoardStopped, now_ns);
  }
}

void NodeMaster::on_tpdo(std::int64_t now_ns) noexcept TANDEM_RT {
  const std::int64_t heartbeat_ns = heartbeat_timeout_ns_ / kHeartbeatPeriods;
  if (stage_ != NodeStage::kStarting || 2 * heartbeat_ns <= start_time_ns_) return;
  nmt_ = NmtState::kOperational;
  enter(NodeStage::kRunning, now_ns);
}

void NodeMaster::on_sdo(const canopen::Frame& frame, FrameSink& out) noexcept TANDEM_RT {
  sdo_.receive(frame, out);
}

void NodeMaster::process(std::int64_t now_ns, std::int64_t dt_ns,
                         FrameSink& out) noexcept TANDEM_RT {
  switch (stage_) {
    case NodeStage::kWaitBootUp:
      if (now_ns - since_ns_ >= 2 * boot_time_ns_) return fail(FaultCause::kNoBootUp, now_ns);
      if (now_ns < next_reset_ns_) return;
      out.push(canopen::make_nmt(canopen::NmtCommand::kResetNode, id_));
      next_reset_ns_ = now_ns + boot_time_ns_;
      return;
    case NodeStage::kConfigure: return configure(now_ns, dt_ns, out);
    case NodeStage::kReady: guard(now_ns, out); return watch_heartbeat(now_ns);
    case NodeStage::kStarting:
      if (watch_ == NodeWatch::kNothing) return enter(NodeStage::kRunning, now_ns);
      guard(now_ns, out);
      watch_heartbeat(now_ns);
      if (stage_ == NodeStage::kStarting && now_ns - since_ns_ >= start_time_ns_) {
        fail(FaultCause::kNotOperational, now_ns);
      }
      return;
    case NodeStage::kRunning:
      sdo_.process(dt_ns, kSdoAnswerNs, out);
      guard(now_ns, out);
      return watch_heartbeat(now_ns);
    case NodeStage::kDown: return;
  }
}

void NodeMaster::configure(std::int64_t now_ns, std::int64_t dt_ns, FrameSink& out) noexcept {
  if (!requested_) return request(out);
  const bool stores = steps_[step_].use == SdoUse::kStore;
  sdo_.process(dt_ns, stores ? kStoreNs : kSdoAnswerNs, out);
  if (sdo_.status() == SdoClient::Status::kBusy) return;
  step_answered(now_ns);
  if (stage_ == NodeStage::kConfigure) request(out);
}

void NodeMaster::request(FrameSink& out) noexcept {
  const SdoStep& step = steps_[step_];
  if (step.use != SdoUse::kWrite && step.use != SdoUse::kStore) {
    sdo_.upload(step.index, step.sub, out);
  } else {
    sdo_.download(step.index, step.sub, step.value(), out);
  }
  requested_ = true;
}

/// What a drive has kept is not written again.
bool NodeMaster::skips(const SdoStep& step) const noexcept {
  return unchanged_ && step.kept && (step.use == SdoUse::kWrite || step.use == SdoUse::kStore);
}

void NodeMaster::step_answered(std::int64_t now_ns) noexcept {
  if (!step_passed(now_ns)) return;
  tries_ = 0;
  ++step_;
  while (step_ < steps_.size() && skips(steps_[step_])) ++step_;
  if (step_ == steps_.size()) {
    heard_ns_ = now_ns;  // its heartbeat has just been switched on
    enter(NodeStage::kReady, now_ns);
  }
}

/// @return false: it is asked again, or the node is down
bool NodeMaster::step_passed(std::int64_t now_ns) noexcept {
  const SdoStep& step = steps_[step_];
  if (sdo_.status() == SdoClient::Status::kAborted) {
    const AbortCode code = sdo_.abort_code();
    if (code == AbortCode::kTimeout) {
      // A frame was lost; or the boot-up was that of power-on, and the node is in its reset.
      if (++tries_ < kSdoTries || now_ns < next_reset_ns_) return false;
    }
    if (step.use == SdoUse::kStore) store_code_ = code;
    if (step.use == SdoUse::kVerify) unchanged_ = false;
    const bool need_not_exist = step.use == SdoUse::kCheckBits && code == AbortCode::kNoObject;
    if (need_not_exist || step.use == SdoUse::kStore || step.use == SdoUse::kVerify) return true;
    abort_code_ = code;
    fail(FaultCause::kBoardRefused, now_ns);
    return false;
  }
  if (step.use == SdoUse::kWrite || step.use == SdoUse::kStore) return true;
  const bool same = step.accepts(sdo_.value());
  if (step.use == SdoUse::kVerify) {
    unchanged_ = same && (step.sub == 1 || unchanged_);
    return true;
  }
  if (same) return true;
  std::array<std::uint8_t, 4> bytes{};
  std::copy_n(sdo_.value().begin(), std::min<std::size_t>(4, sdo_.value().size()), bytes.begin());
  read_value_ = canopen::get<std::uint32_t>(bytes.data());
  fail(FaultCause::kWrongIdentity, now_ns);
  return false;
}

void NodeMaster::start(std::int64_t now_ns, FrameSink& out) noexcept TANDEM_RT {
  out.push(canopen::make_nmt(canopen::NmtCommand::kStart, id_));
  enter(NodeStage::kStarting, now_ns);
}

/// Asks for the node's state: an RTR frame under its heartbeat's identifier.
void NodeMaster::guard(std::int64_t now_ns, FrameSink& out) noexcept {
  if (watch_ != NodeWatch::kGuarding || now_ns < next_guard_ns_) return;
  out.push(canopen::make_guard_request(id_));
  next_guard_ns_ = now_ns + heartbeat_timeout_ns_ / kHeartbeatPeriods;
}

void NodeMaster::watch_heartbeat(std::int64_t now_ns) noexcept {
  if (watch_ == NodeWatch::kNothing) return;
  if (now_ns - heard_ns_ < heartbeat_timeout_ns_) return;
  const bool guarded = watch_ == NodeWatch::kGuarding;
  fail(guarded ? FaultCause::kGuardingLost : FaultCause::kHeartbeatLost, now_ns);
}

void NodeMaster::fail(FaultCause error, std::int64_t now_ns) noexcept TANDEM_RT {
  error_ = error;
  trouble_ns_ = now_ns;
  stage_ = NodeStage::kDown;
}

void NodeMaster::enter(NodeStage stage, std::int64_t now_ns) noexcept {
  stage_ = stage;
  since_ns_ = now_ns;
  if (stage == NodeStage::kConfigure || stage == NodeStage::kWaitBootUp) {
    step_ = 0;
    tries_ = 0;
    requested_ = false;
    unchanged_ = false;
    store_code_ = AbortCode::kNone;
  }
}

void NodeMaster::archive(Archive& ar) {
  ar(stage_, error_, nmt_, requested_, unchanged_, store_code_, tries_, reboots_, step_, since_ns_,
     next_reset_ns_, next_guard_ns_, heard_ns_, booted_ns_, trouble_ns_, abort_code_, read_value_,
     sdo_);
  for (SdoStep& step : steps_) ar(step.bytes);  // set_times() has been there
}

}  // namespace tandem::hal::can
