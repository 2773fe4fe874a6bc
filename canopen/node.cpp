// NMT state machine, dispatch of frames by COB-ID, heartbeats both ways, error history 1003.
#include "canopen/node.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"

namespace tandem::canopen {

namespace {

constexpr std::uint32_t kNoCobId = 0xFFFFFFFF;
constexpr std::uint8_t kGuardToggle = 0x80;

}  // namespace

Node::Node(const NodeConfig& config, ObjectDictionary& od) : config_(config), sdo_(od, config.id) {
  add_objects(od);
  find_pdos();
}

void Node::add_objects(ObjectDictionary& od) {
  using namespace object;
  od.add_value(kDeviceType, 0, config_.device_type);
  od.add(object::kErrorRegister, 0, error_register_, kReadTpdo);
  od.add(object::kErrorHistory, 0, history_count_, kReadWrite, {0, 0}, this);
  for (std::size_t i = 0; i < history_.size(); ++i) {
    od.add(object::kErrorHistory, static_cast<std::uint8_t>(i + 1), history_[i], kRead, {}, this);
  }
  od.add_value<std::uint32_t>(kSyncId, 0, cob::kSync);
  od.add(kSyncPeriod, 0, sync_period_us_, kReadWrite);
  od.add_string(kDeviceName, 0, config_.name);
  od.add(kGuardTime, 0, guarding_.time_ms, kReadWrite);
  od.add(kLifeTimeFactor, 0, guarding_.life_factor, kReadWrite);
  od.add_value<std::uint32_t>(kEmergencyId, 0,
                              cob::kEmergency + static_cast<std::uint32_t>(config_.id));
  od.add_value<std::uint8_t>(kHeartbeatConsumer, 0, kHeartbeatConsumers);
  for (std::size_t i = 0; i < consumers_.size(); ++i) {
    od.add(kHeartbeatConsumer, static_cast<std::uint8_t>(i + 1), consumers_[i].object, kReadWrite,
           {0, 0x007FFFFF}, this);
  }
  od.add(kHeartbeatProducer, 0, producer_ms_, kReadWrite, {}, this);
  od.add_value<std::uint8_t>(kIdentity, 0, 4);
  od.add_value(kIdentity, kVendor, config_.vendor);
  od.add_value(kIdentity, kProduct, config_.product);
  od.add_value(kIdentity, kRevision, config_.revision);
  od.add_value(kIdentity, kSerial, config_.serial);
  od.add_value<std::uint8_t>(kErrorBehaviour, 0, 1);
  od.add(kErrorBehaviour, 1, error_behaviour_, kReadWrite, {0, 2});
  for (int i = 0; i < kPdosPerNode; ++i) {
    rpdos_[i].add_to(od, PdoDirection::kReceive, i + 1, config_.id, config_.max_pdo_bytes);
    tpdos_[i].add_to(od, PdoDirection::kTransmit, i + 1, config_.id, config_.max_pdo_bytes);
  }
}

NodeEvents Node::take(const Frame& frame, FrameSink& out) noexcept TANDEM_RT {
  const auto id = static_cast<std::uint32_t>(config_.id);
  if (state_ == NmtState::kBootUp) return 0;  // not on the bus yet
  if (frame.id == cob::kNmt) return on_nmt(frame, out);
  if (state_ == NmtState::kStopped) {
    if ((frame.id & kFunctionMask) == cob::kHeartbeat) on_heartbeat(frame);
    return 0;
  }
  if (frame.id == cob::kSync) return on_sync();
  if (frame.id == cob::kSdoRequest + id) {
    sdo_.receive(frame, out);
    find_pdos();  // it may have written their identifiers
    return 0;
  }
  if ((frame.id & kFunctionMask) == cob::kHeartbeat) {
    on_heartbeat(frame);
    return 0;
  }
  return state_ == NmtState::kOperational ? on_rpdo(frame, out) : NodeEvents{0};
}

NodeEvents Node::process(std::int64_t dt_ns, FrameSink& out) noexcept TANDEM_RT {
  if (state_ == NmtState::kBootUp) {  // the boot-up message, then pre-operational by itself
    out.push(make_heartbeat(config_.id, NmtState::kBootUp));
    since_heartbeat_ns_ = 0;
    return enter(NmtState::kPreOperational);
  }
  produce_heartbeat(dt_ns, out);
  const auto events =
      static_cast<NodeEvents>(watch_heartbeats(dt_ns, out) | watch_guarding(dt_ns, out));
  if (state_ != NmtState::kStopped) sdo_.process(dt_ns, out);
  if (state_ == NmtState::kOperational) {
    for (std::size_t i = 0; i < tpdos_.size(); ++i) {
      if (tpdo_in_use_[i]) tpdos_[i].process(dt_ns, out);
    }
  }
  return events;
}

void Node::transmit_synchronous(FrameSink& out) noexcept TANDEM_RT {
  if (state_ != NmtState::kOperational) return;
  for (std::size_t i = 0; i < tpdos_.size(); ++i) {
    if (tpdo_in_use_[i]) tpdos_[i].sync(out);
  }
}

bool Node::answer_remote(std::uint32_t id, FrameSink& out) noexcept TANDEM_RT {
  if (id == cob::kHeartbeat + static_cast<std::uint32_t>(config_.id)) return answer_guard(out);
  if (state_ != NmtState::kOperational) return false;
  return std::ranges::any_of(tpdos_, [&](const TxPdo& pdo) { return pdo.answer_remote(id, out); });
}

bool Node::heartbeat_lost() const noexcept {
  return guarding_.lost || std::ranges::any_of(consumers_, &Consumer::lost);
}

NodeEvents Node::on_nmt(const Frame& frame, FrameSink& out) noexcept TANDEM_RT {
  const auto message = parse_nmt(frame);
  if (!message || (message->node != 0 && message->node != config_.id)) return 0;
  switch (message->command) {
    case NmtCommand::kStart: return enter(NmtState::kOperational);
    case NmtCommand::kStop: return enter(NmtState::kStopped);
    case NmtCommand::kEnterPreOperational: return enter(NmtState::kPreOperational);
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication: {
      NodeEvents events = enter(NmtState::kBootUp);
      reset_communication();
      events |=
          message->command == NmtCommand::kResetNode ? kEventResetNode : kEventResetCommunication;
      return events | process(0, out);
    }
  }
  return 0;
}

NodeEvents Node::on_sync() noexcept {
  applied_rpdos_ = 0;
  NodeEvents events = kEventSync;
  if (state_ != NmtState::kOperational) return events;
  for (int i = 0; i < kPdosPerNode; ++i) {
    if (rpdo_ids_[i] == kNoCobId || !rpdos_[i].sync()) continue;
    applied_rpdos_ |= static_cast<std::uint8_t>(1u << i);
    events |= kEventRpdo;
  }
  return events;
}

NodeEvents Node::on_rpdo(const Frame& frame, FrameSink& out) noexcept {
  const int number = number_of_rpdo(frame.id);
  if (number < 0) return 0;
  switch (rpdos_[static_cast<std::size_t>(number)].receive(frame)) {
    case RxPdo::Taken::kNotMine:
    case RxPdo::Taken::kLatched: break;
    case RxPdo::Taken::kApplied:
      applied_rpdos_ |= static_cast<std::uint8_t>(1u << number);
      return kEventRpdo;
    case RxPdo::Taken::kTooShort:
      raise_error(ErrorCode::kPdoTooShort, error_register::kCommunication, 0, out);
      break;
  }
  return 0;
}

void Node::find_pdos() noexcept TANDEM_RT {
  for (std::size_t i = 0; i < rpdos_.size(); ++i) {
    rpdo_ids_[i] = rpdos_[i].in_use() ? rpdos_[i].cob_id() : kNoCobId;
    tpdo_in_use_[i] = tpdos_[i].in_use();
  }
}

void Node::on_heartbeat(const Frame& frame) noexcept {
  const auto message = parse_heartbeat(frame);
  if (!message) return;
  for (Consumer& consumer : consumers_) {
    if (consumer.node() != message->node || (consumer.object & 0xFFFF) == 0) continue;
    consumer.heard = true;
    consumer.lost = false;
    consumer.silent_ns = 0;
  }
}

NodeEvents Node::watch_heartbeats(std::int64_t dt_ns, FrameSink& out) noexcept {
  NodeEvents events = 0;
  for (Consumer& consumer : consumers_) {
    if (!consumer.heard || consumer.lost) continue;
    consumer.silent_ns += dt_ns;
    if (consumer.silent_ns < (consumer.object & 0xFFFF) * kNsPerMs) continue;
    consumer.lost = true;
    events = static_cast<NodeEvents>(events | lose_master(out));
  }
  return events;
}

// CiA 301: a node that produces heartbeats is not guarded as well.
bool Node::answer_guard(FrameSink& out) noexcept TANDEM_RT {
  if (state_ == NmtState::kBootUp || producer_ms_ != 0) return false;
  Frame answer = make_heartbeat(config_.id, state_);
  answer.data[0] |= guarding_.toggle;
  out.push(answer);
  guarding_.toggle ^= kGuardToggle;
  guarding_.heard = true;
  guarding_.lost = false;
  guarding_.silent_ns = 0;
  return true;
}

NodeEvents Node::watch_guarding(std::int64_t dt_ns, FrameSink& out) noexcept {
  const std::int64_t life_ns = std::int64_t{guarding_.time_ms} * guarding_.life_factor * kNsPerMs;
  if (life_ns == 0 || producer_ms_ != 0 || !guarding_.heard || guarding_.lost) return 0;
  guarding_.silent_ns += dt_ns;
  if (guarding_.silent_ns < life_ns) return 0;
  guarding_.lost = true;
  return lose_master(out);
}

NodeEvents Node::lose_master(FrameSink& out) noexcept {
  raise_error(ErrorCode::kHeartbeatLost, error_register::kCommunication, 0, out);
  return static_cast<NodeEvents>(kEventHeartbeatLost | communication_error());
}

NodeEvents Node::communication_error() noexcept {
  if (error_behaviour_ == 2) return enter(NmtState::kStopped);
  if (error_behaviour_ == 0 && state_ == NmtState::kOperational) {
    return enter(NmtState::kPreOperational);
  }
  return 0;
}

NodeEvents Node::enter(NmtState state) noexcept {
  const NmtState before = state_;
  state_ = state;
  if (before == state) return 0;
  if (state == NmtState::kOperational) {
    for (RxPdo& pdo : rpdos_) pdo.restart();
    for (TxPdo& pdo : tpdos_) pdo.restart();
    find_pdos();  // another wire than CAN may have written their identifiers
    return kEventOperational;
  }
  if (state != NmtState::kPreOperational) sdo_.reset();
  return before == NmtState::kOperational ? NodeEvents{kEventLeftOperational} : NodeEvents{0};
}

void Node::reset_communication() noexcept TANDEM_RT {
  applied_rpdos_ = 0;
  error_register_ = 0;
  error_behaviour_ = 0;
  history_count_ = 0;
  history_.fill(0);
  producer_ms_ = 0;
  sync_period_us_ = 0;
  since_heartbeat_ns_ = 0;
  consumers_.fill({});
  guarding_ = {};
  for (RxPdo& pdo : rpdos_) pdo.reset();
  for (TxPdo& pdo : tpdos_) pdo.reset();
  find_pdos();
}

void Node::produce_heartbeat(std::int64_t dt_ns, FrameSink& out) noexcept {
  if (producer_ms_ == 0) return;
  since_heartbeat_ns_ += dt_ns;
  const std::int64_t period_ns = producer_ms_ * kNsPerMs;
  if (since_heartbeat_ns_ < period_ns) return;
  since_heartbeat_ns_ %= period_ns;
  out.push(make_heartbeat(config_.id, state_));
}

void Node::raise_error(ErrorCode code, std::uint8_t error_register, int axis,
                       FrameSink& out) noexcept TANDEM_RT {
  error_register_ |= static_cast<std::uint8_t>(error_register | error_register::kGeneric);
  std::shift_right(history_.begin(), history_.end(), 1);
  history_[0] = static_cast<std::uint32_t>(code) | (static_cast<std::uint32_t>(axis) << 16);
  if (history_count_ < kErrorHistory) ++history_count_;
  if (state_ == NmtState::kStopped || state_ == NmtState::kBootUp) return;
  out.push(make_emergency({.node = static_cast<std::uint8_t>(config_.id),
                           .code = code,
                           .error_register = error_register_,
                           .manufacturer = {static_cast<std::uint8_t>(axis)}}));
}

void Node::clear_errors(FrameSink& out) noexcept TANDEM_RT {
  if (error_register_ == 0) return;
  error_register_ = 0;
  if (state_ == NmtState::kStopped || state_ == NmtState::kBootUp) return;
  out.push(make_emergency({.node = static_cast<std::uint8_t>(config_.id)}));
}

// The history's entries exist as far as it is filled.
AbortCode Node::check_read(const ObjectEntry& entry) const noexcept TANDEM_RT {
  const bool empty = entry.index == object::kErrorHistory && entry.sub > history_count_;
  return empty ? AbortCode::kNoData : AbortCode::kNone;
}

AbortCode Node::check(const ObjectEntry& entry, const std::uint8_t* bytes) noexcept TANDEM_RT {
  if (entry.index != object::kHeartbeatConsumer) return AbortCode::kNone;
  const auto wanted = get<std::uint32_t>(bytes);
  const auto node = static_cast<std::uint8_t>(wanted >> 16);
  if (node == 0 || (wanted & 0xFFFF) == 0) return AbortCode::kNone;
  if (node > kMaxNodeId) return AbortCode::kRange;
  for (std::size_t i = 0; i < consumers_.size(); ++i) {  // CiA 301: a node only once
    const bool active = (consumers_[i].object & 0xFFFF) != 0;
    if (i + 1 != entry.sub && active && consumers_[i].node() == node) {
      return AbortCode::kIncompatibleParameter;
    }
  }
  return AbortCode::kNone;
}

void Node::written(const ObjectEntry& entry) noexcept TANDEM_RT {
  if (entry.index == object::kErrorHistory) history_.fill(0);
  if (entry.index == object::kHeartbeatProducer) since_heartbeat_ns_ = 0;
  if (entry.index == object::kHeartbeatConsumer) {
    Consumer& consumer = consumers_[entry.sub - 1u];
    consumer.heard = false;
    consumer.lost = false;
    consumer.silent_ns = 0;
  }
}

void Node::archive(Archive& ar) {
  ar(state_, applied_rpdos_, error_register_, error_behaviour_, history_count_, producer_ms_,
     sync_period_us_, since_heartbeat_ns_, history_, sdo_);
  for (Consumer& c : consumers_) ar(c.object, c.heard, c.lost, c.silent_ns);
  ar(guarding_.time_ms, guarding_.life_factor, guarding_.toggle, guarding_.heard, guarding_.lost,
     guarding_.silent_ns);
  for (RxPdo& pdo : rpdos_) ar(pdo);
  for (TxPdo& pdo : tpdos_) ar(pdo);
  if (ar.reading()) find_pdos();
}

}  // namespace tandem::canopen
