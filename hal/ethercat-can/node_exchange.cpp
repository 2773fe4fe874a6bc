#include "hal/ethercat-can/node_exchange.hpp"

#include <algorithm>

#include "base/archive.hpp"
#include "base/seen_count.hpp"
#include "canopen/messages.hpp"

namespace tandem::hal::can {

using canopen::PdoCopies;
using canopen::PdoCopy;
using canopen::PdoDirection;

void NodeExchange::connect(const NodePlan& plan, std::span<AxisMaster> axes, std::uint8_t& counter,
                           const SentTimes& sent_ns) {
  plan_ = &plan;
  counter_ = &counter;
  sent_ns_ = &sent_ns;
  for (const PdoPlan& pdo : plan.pdos)
    if (pdo.group == PdoGroup::kSensor) channels_.resize(channels_.size() + pdo.fields.size());
  sample_.resize(channels_.size());
  const auto variable = [&](const PdoPlan& pdo, const MappedField& field) -> void* {
    switch (field.field) {
      case WireField::kSensorChannel: return &sample_[field.axis];
      case WireField::kCycleEcho: return &echo_;
      case WireField::kCycleCounter: return &counter;
      default: break;
    }
    AxisMaster& axis = axes[plan.joints[field.axis]];
    if (pdo.direction == PdoDirection::kReceive) return axis.command_variable(field.field);
    return pdo.group == PdoGroup::kSlowFeedback || !is_sampled(field.field)
               ? axis.slow_variable(field.field)
               : axis.sample_variable(field.field);
  };
  for (const PdoPlan& pdo : plan.pdos) {
    std::vector<PdoCopy> copies;
    for (const MappedField& field : pdo.fields)
      copies.push_back({.data = variable(pdo, field), .offset = field.offset, .size = field.size});
    if (pdo.direction != PdoDirection::kReceive) {
      receives_[static_cast<std::size_t>(pdo.number - 1)] = compile(pdo, std::move(copies));
      continue;
    }
    Send& send = sends_.emplace_back();
    send.storage = std::move(copies);
    send.copies = PdoCopies(send.storage);
    send.in_every_cycle = pdo.group == PdoGroup::kCommand;
    send.frame.id = pdo.cob_id;
    send.frame.length = canopen::frame_length(pdo.bytes);
    if (send.frame.length > canopen::kClassicFrameBytes)
      send.frame.flags = canopen::kFlagFd | canopen::kFlagBrs;
  }
}

NodeExchange::Receive NodeExchange::compile(const PdoPlan& pdo, std::vector<PdoCopy> copies) const {
  Receive receive = {.storage = std::move(copies),
                     .in_use = true,
                     .channels = pdo.group == PdoGroup::kSensor,
                     .bytes = pdo.bytes,
                     .part = pdo.group == PdoGroup::kSlowFeedback ? -1 : pdo.part};
  receive.copies = PdoCopies(receive.storage);  // a vector's elements stay when it is moved
  for (const MappedField& field : pdo.fields) {
    receive.echo |= field.field == WireField::kCycleEcho;
    if (pdo.group != PdoGroup::kFeedback || field.field == WireField::kCycleEcho) continue;
    const std::size_t joint = plan_->joints[field.axis];
    if (std::ranges::find(receive.joints, joint) == receive.joints.end())
      receive.joints.push_back(joint);
  }
  // A sample of several parts is that of all axes, and its last part makes it whole.
  if (pdo.group == PdoGroup::kFeedback && plan_->parts > 1) receive.joints = plan_->joints;
  return receive;
}

bool NodeExchange::take(int number, const canopen::Frame& frame, std::int64_t at_ns,
                        std::span<std::uint8_t> fresh) noexcept TANDEM_RT {
  const Receive& pdo = receives_[static_cast<std::size_t>(number - 1)];
  if (!pdo.in_use || frame.length < pdo.bytes) return false;
  if (number == 1) ++answers_;
  if (pdo.part >= 0) {
    if (pdo.part != 0 && pdo.part != next_part_) return true;
    next_part_ = pdo.part + 1;
  }
  const bool whole = next_part_ == plan_->parts;
  pdo.copies.from_wire(frame.data.data());
  for (const std::size_t joint : pdo.joints) fresh[joint] = whole ? 1 : 0;
  if (pdo.part >= 0 && whole) on_sample(at_ns);
  if (pdo.echo) on_echo(at_ns);
  if (pdo.channels && whole) channels_ = sample_;
  return true;
}

void NodeExchange::on_echo(std::int64_t at_ns) noexcept TANDEM_RT {
  const auto trip = static_cast<std::uint8_t>(*counter_ - echo_);
  if (trip == 0 || trip > counters_sent_) return;  // it has not had a command yet
  count_up(trip_.cycles[std::min<std::size_t>(trip, RoundTrip::kMostCycles - 1)]);
  const std::int64_t sent_ns = (*sent_ns_)[echo_];
  if (trip == 1 && sent_ns != 0 && at_ns > sent_ns) trip_.time.record(at_ns - sent_ns);
}

/// Until this cycle's commands go out, SYNC is what its counter was handed over with.
void NodeExchange::on_sample(std::int64_t at_ns) noexcept TANDEM_RT {
  const std::int64_t sync_ns = (*sent_ns_)[*counter_];
  if (sync_ns != 0 && at_ns > sync_ns) trip_.answer.record(at_ns - sync_ns);
}

bool NodeExchange::end_cycle(std::span<const std::uint8_t> fresh) noexcept TANDEM_RT {
  const bool whole = plan_->board >= 0
                         ? std::ranges::all_of(plan_->joints, [&](auto j) { return fresh[j] != 0; })
                         : next_part_ == plan_->parts;
  next_part_ = 0;
  doubled_cycles_ = answers_ > 1 ? doubled_cycles_ + 1 : 0;
  answers_ = 0;
  silent_cycles_ = whole ? 0 : silent_cycles_ + 1;
  return whole;
}

void NodeExchange::write(canopen::FrameSink& out) noexcept TANDEM_RT {
  if (counters_sent_ < 0xFF) ++counters_sent_;
  for (Send& pdo : sends_) {
    if (!pdo.in_every_cycle && pdo.sent != 0 && !pdo.copies.differ(pdo.frame.data.data())) continue;
    canopen::Frame* frame = out.next();
    if (frame == nullptr) continue;
    *frame = pdo.frame;
    pdo.copies.to_wire(frame->data.data());
    if (pdo.in_every_cycle) continue;
    pdo.copies.to_wire(pdo.frame.data.data());
    pdo.sent = 1;
  }
}

void NodeExchange::archive(Archive& ar) {
  for (Send& pdo : sends_) ar(pdo.frame, pdo.sent);
  ar(channels_, silent_cycles_, doubled_cycles_, counters_sent_);
}

}  // namespace tandem::hal::can
