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

NodeMaster::NodeMaster(int id, int heartbeat_ms, std::vector<SdoStep> steps)
    : id_(id),
      heartbeat_timeout_ns_(std::int64_t{kHeartbeatPeriods} * heartbeat_ms * 1'000'000),
      steps_(std::move(steps)),
      sdo_(id) {}

void NodeMaster::set_sync_timeout(std::int64_t timeout_ns) noexcept TANDEM_RT {
  for (SdoStep& step : steps_) {
    if (step.index != canopen::object::kSyncTimeout) continue;
    canopen::put(step.bytes.data(),
                 canopen::clamp_round<std::uint32_t>(static_cast<double>(timeout_ns) / 1000.0));
  }
}

void NodeMaster::restart(std::int64_t now_ns) noexcept TANDEM_RT {
  enter(NodeStage::kWaitBootUp, now_ns);
  error_ = NodeError::kNone;
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
    if (again) return fail(NodeError::kTwoNodes, now_ns);
    const bool expected = stage_ == NodeStage::kWaitBootUp;
    const bool too_often = !expected && ++reboots_ > kReboots;
    if (stage_ == NodeStage::kRunning || too_often) return fail(NodeError::kRebooted, now_ns);
    return enter(NodeStage::kConfigure, now_ns);
  }
  if (stage_ == NodeStage::kStarting && state == NmtState::kOperational) {
    enter(NodeStage::kRunning, now_ns);
  } else if (stage_ == NodeStage::kRunning && state != NmtState::kOperational) {
    fail(NodeError::kLeftOperational, now_ns);
  }
}

void NodeMaster::on_sdo(const canopen::Frame& frame, FrameSink& out) noexcept TANDEM_RT {
  sdo_.receive(frame, out);
}

void NodeMaster::process(std::int64_t now_ns, std::int64_t dt_ns,
                         FrameSink& out) noexcept TANDEM_RT {
  switch (stage_) {
    case NodeStage::kWaitBootUp:
      if (now_ns - since_ns_ >= kBootTimeoutNs) return fail(NodeError::kNoBootUp, now_ns);
      if (now_ns < next_reset_ns_) return;
      out.push(canopen::make_nmt(canopen::NmtCommand::kResetNode, id_));
      next_reset_ns_ = now_ns + kResetEveryNs;
      return;
    case NodeStage::kConfigure: return configure(now_ns, dt_ns, out);
    case NodeStage::kReady: return watch_heartbeat(now_ns);
    case NodeStage::kStarting:
      watch_heartbeat(now_ns);
      if (stage_ == NodeStage::kStarting && now_ns - since_ns_ >= kStartTimeoutNs) {
        fail(NodeError::kNotOperational, now_ns);
      }
      return;
    case NodeStage::kRunning:
      sdo_.process(dt_ns, kSdoAnswerNs, out);
      return watch_heartbeat(now_ns);
    case NodeStage::kDown: return;
  }
}

void NodeMaster::configure(std::int64_t now_ns, std::int64_t dt_ns, FrameSink& out) noexcept {
  if (!requested_) return request(out);
  sdo_.process(dt_ns, kSdoAnswerNs, out);
  if (sdo_.status() == SdoClient::Status::kBusy) return;
  step_answered(now_ns);
  if (stage_ == NodeStage::kConfigure) request(out);
}

void NodeMaster::request(FrameSink& out) noexcept {
  const SdoStep& step = steps_[step_];
  if (step.use != SdoUse::kWrite) {
    sdo_.upload(step.index, step.sub, out);
  } else {
    sdo_.download(step.index, step.sub, step.value(), out);
  }
  requested_ = true;
}

void NodeMaster::step_answered(std::int64_t now_ns) noexcept {
  if (sdo_.status() == SdoClient::Status::kAborted) {
    abort_code_ = sdo_.abort_code();
    if (abort_code_ == AbortCode::kTimeout && ++tries_ < kSdoTries) return;  // a frame was lost
    return fail(NodeError::kSdoAbort, now_ns);
  }
  const SdoStep& step = steps_[step_];
  if (step.use != SdoUse::kWrite && !step.accepts(sdo_.value())) {
    std::array<std::uint8_t, 4> bytes{};
    std::copy_n(sdo_.value().begin(), std::min<std::size_t>(4, sdo_.value().size()), bytes.begin());
    read_value_ = canopen::get<std::uint32_t>(bytes.data());
    return fail(NodeError::kWrongIdentity, now_ns);
  }
  tries_ = 0;
  if (++step_ == steps_.size()) {
    heard_ns_ = now_ns;  // its heartbeat has just been switched on
    enter(NodeStage::kReady, now_ns);
  }
}

void NodeMaster::start(std::int64_t now_ns, FrameSink& out) noexcept TANDEM_RT {
  out.push(canopen::make_nmt(canopen::NmtCommand::kStart, id_));
  enter(NodeStage::kStarting, now_ns);
}

void NodeMaster::watch_heartbeat(std::int64_t now_ns) noexcept {
  if (now_ns - heard_ns_ >= heartbeat_timeout_ns_) fail(NodeError::kHeartbeatLost, now_ns);
}

void NodeMaster::fail(NodeError error, std::int64_t now_ns) noexcept TANDEM_RT {
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
  }
}

void NodeMaster::archive(Archive& ar) {
  ar(stage_, error_, nmt_, requested_, tries_, reboots_, step_, since_ns_, next_reset_ns_,
     heard_ns_, booted_ns_, trouble_ns_, abort_code_, read_value_, sdo_);
}

}  // namespace tandem::hal::can
