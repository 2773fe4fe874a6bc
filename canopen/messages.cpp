// Bytes of each message written and read explicitly; parse functions refuse wrong identifiers and
// lengths.
#include "canopen/messages.hpp"

#include <algorithm>

#include "canopen/bytes.hpp"

namespace tandem::canopen {

namespace {

/// The node id of a frame whose COB-ID is `base` + node, or 0.
std::uint8_t node_of(const Frame& frame, std::uint32_t base) noexcept {
  if (frame.id <= base || frame.id > base + kMaxNodeId) return 0;
  return static_cast<std::uint8_t>(frame.id - base);
}

Frame short_frame(std::uint32_t id, std::uint8_t length) noexcept {
  Frame frame;
  frame.id = id;
  frame.length = length;
  return frame;
}

constexpr std::uint8_t kPastOrderBytes = 5, kPastAnswerBytes = 8;

void put_order(Frame& frame, const PastOrderMessage& message) noexcept {
  frame.data[0] = static_cast<std::uint8_t>(message.order);
  put(&frame.data[1], message.number);
}

PastOrderMessage order_in(const Frame& frame) noexcept {
  return {static_cast<PastOrder>(frame.data[0]), get<std::uint32_t>(&frame.data[1])};
}

}  // namespace

const char* to_string(NmtState state) noexcept {
  switch (state) {
    case NmtState::kBootUp: return "boot-up";
    case NmtState::kStopped: return "stopped";
    case NmtState::kOperational: return "operational";
    case NmtState::kPreOperational: return "pre-operational";
  }
  return "unknown";
}

Frame make_nmt(NmtCommand command, int node) noexcept TANDEM_RT {
  Frame frame = short_frame(cob::kNmt, 2);
  frame.data[0] = static_cast<std::uint8_t>(command);
  frame.data[1] = static_cast<std::uint8_t>(node);
  return frame;
}

Frame make_time(std::int64_t time_ns) noexcept TANDEM_RT {
  constexpr std::int64_t kMsPerDay = 86'400'000;
  const std::int64_t time_ms = time_ns / 1'000'000;
  Frame frame = short_frame(cob::kTime, 6);
  put(frame.data.data(), static_cast<std::uint32_t>(time_ms % kMsPerDay));
  put(frame.data.data() + 4, static_cast<std::uint16_t>(time_ms / kMsPerDay));
  return frame;
}

Frame make_past_order(const PastOrderMessage& message) noexcept TANDEM_RT {
  Frame frame = short_frame(cob::kPastOrder, kPastOrderBytes);
  put_order(frame, message);
  return frame;
}

std::optional<PastOrderMessage> parse_past_order(const Frame& frame) noexcept TANDEM_RT {
  if (frame.id != cob::kPastOrder || frame.length != kPastOrderBytes) return std::nullopt;
  return order_in(frame);
}

Frame make_past_answer(const PastAnswerMessage& message) noexcept TANDEM_RT {
  Frame frame = short_frame(cob::kPastAnswer, kPastAnswerBytes);
  put_order(frame, message.to);
  frame.data[5] = static_cast<std::uint8_t>(message.refusal);
  put(&frame.data[6], message.size);
  return frame;
}

std::optional<PastAnswerMessage> parse_past_answer(const Frame& frame) noexcept TANDEM_RT {
  if (frame.id != cob::kPastAnswer || frame.length != kPastAnswerBytes) return std::nullopt;
  return PastAnswerMessage{order_in(frame), static_cast<PastRefusal>(frame.data[5]),
                           get<std::uint16_t>(&frame.data[6])};
}

std::optional<NmtMessage> parse_nmt(const Frame& frame) noexcept TANDEM_RT {
  if (frame.id != cob::kNmt || frame.length != 2) return std::nullopt;
  switch (const auto command = static_cast<NmtCommand>(frame.data[0])) {
    case NmtCommand::kStart:
    case NmtCommand::kStop:
    case NmtCommand::kEnterPreOperational:
    case NmtCommand::kResetNode:
    case NmtCommand::kResetCommunication: return NmtMessage{command, frame.data[1]};
  }
  return std::nullopt;
}

Frame make_sync() noexcept TANDEM_RT { return short_frame(cob::kSync, 0); }

Frame make_heartbeat(int node, NmtState state) noexcept TANDEM_RT {
  Frame frame = short_frame(cob::kHeartbeat + static_cast<std::uint32_t>(node), 1);
  frame.data[0] = static_cast<std::uint8_t>(state);
  return frame;
}

Frame make_guard_request(int node) noexcept TANDEM_RT {
  Frame frame = short_frame(cob::kHeartbeat + static_cast<std::uint32_t>(node), 1);
  frame.flags = kFlagRtr;
  return frame;
}

std::optional<HeartbeatMessage> parse_heartbeat(const Frame& frame) noexcept TANDEM_RT {
  const std::uint8_t node = node_of(frame, cob::kHeartbeat);
  if (node == 0 || frame.length != 1) return std::nullopt;
  return HeartbeatMessage{node, static_cast<NmtState>(frame.data[0] & 0x7F)};
}

Frame make_emergency(const EmergencyMessage& message) noexcept TANDEM_RT {
  Frame frame = short_frame(cob::kEmergency + message.node, 8);
  put(frame.data.data(), static_cast<std::uint16_t>(message.code));
  frame.data[2] = message.error_register;
  std::ranges::copy(message.manufacturer, frame.data.begin() + 3);
  return frame;
}

std::optional<EmergencyMessage> parse_emergency(const Frame& frame) noexcept TANDEM_RT {
  const std::uint8_t node = node_of(frame, cob::kEmergency);
  if (node == 0 || frame.length != 8) return std::nullopt;
  EmergencyMessage message;
  message.node = node;
  message.code = static_cast<ErrorCode>(get<std::uint16_t>(frame.data.data()));
  message.error_register = frame.data[2];
  std::copy_n(frame.data.begin() + 3, message.manufacturer.size(), message.manufacturer.begin());
  return message;
}

}  // namespace tandem::canopen
