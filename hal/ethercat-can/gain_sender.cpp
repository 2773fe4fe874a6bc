#include "hal/ethercat-can/gain_sender.hpp"

#include <algorithm>

#include "base/archive.hpp"

namespace tandem::hal::can {
namespace {

/// By PidLoop: the object of axis 0, whose entries 1 and on are the values.
constexpr std::array kObjects{canopen::object::kPositionGains, canopen::object::kVelocityGains,
                              canopen::object::kTorqueGains, canopen::object::kCurrentGains};
static_assert(kObjects.size() == kPidLoops);
constexpr std::array kValues{&PidGains::kp, &PidGains::ki, &PidGains::kd};
constexpr std::size_t kItemsPerAxis = kPidLoops * kValues.size();

}  // namespace

GainSender::GainSender(const std::vector<std::size_t>& joints, const ParameterImage& initial) {
  for (const std::size_t joint : joints) {
    Axis& axis = axes_.emplace_back(Axis{.joint = joint});
    std::ranges::copy(initial.all().subspan(joint * kPidLoops, kPidLoops), axis.initial.begin());
  }
  restart();
}

void GainSender::send(const ParameterImage& parameters, canopen::SdoClient& sdo,
                      canopen::FrameSink& out) noexcept TANDEM_RT {
  if (sdo.status() == canopen::SdoClient::Status::kBusy) return;
  if (sending_ >= 0 && sdo.status() == canopen::SdoClient::Status::kAborted) {
    refused_.step = {
        .sub = sdo.sub(),
        .index = sdo.index(),
        .axis = static_cast<std::int8_t>(static_cast<std::size_t>(sending_) / kItemsPerAxis)};
    refused_.code = sdo.abort_code();
  }
  sending_ = -1;
  const auto changed = [&](const Axis& axis) {
    return parameters.revision(axis.joint) != axis.revision;
  };
  if (std::ranges::none_of(axes_, changed)) return;  // nearly always
  const std::size_t items = axes_.size() * kItemsPerAxis;
  for (std::size_t i = 0; i < items; ++i) {
    const std::size_t now = (next_item_ + i) % items;
    const std::size_t number = now / kItemsPerAxis;
    Axis& axis = axes_[number];
    if (!changed(axis)) continue;
    const std::size_t loop = now % kItemsPerAxis / kValues.size();
    const std::size_t which = now % kValues.size();
    const double wanted = parameters.gains(axis.joint, static_cast<PidLoop>(loop)).*kValues[which];
    double& sent = axis.sent[loop].*kValues[which];
    if (wanted == sent) continue;
    sent = wanted;
    const SdoStep step = write_step(canopen::of_axis(kObjects[loop], static_cast<int>(number)),
                                    static_cast<std::uint8_t>(which + 1), static_cast<float>(sent));
    sdo.download(step.index, step.sub, step.value(), out);
    sending_ = static_cast<std::int16_t>(now);
    next_item_ = now;
    return;
  }
  for (Axis& axis : axes_) axis.revision = parameters.revision(axis.joint);
}

void GainSender::restart() noexcept TANDEM_RT {
  give_way();
  for (Axis& axis : axes_) {
    axis = {.joint = axis.joint, .initial = axis.initial, .sent = axis.initial};
  }
}

void GainSender::archive(Archive& ar) {
  for (Axis& axis : axes_) ar(axis.sent, axis.revision);
  ar(next_item_, sending_, refused_.step, refused_.code);
}

}  // namespace tandem::hal::can
