#include "runtime/replay/recorded_robot.hpp"

#include <algorithm>
#include <cstring>

namespace tandem::runtime {

using log::EventKind;

namespace {

std::size_t count_of(const hal::Layout& layout, std::string_view field, std::size_t each = 1) {
  const hal::Field* found = layout.find(field);
  return found == nullptr ? 0 : found->count / each;
}

}  // namespace

ImageCopy::ImageCopy(const hal::Layout& from, const hal::Layout& to) {
  for (const hal::Field& field : to.fields()) {
    if (field.count == 0) continue;
    const hal::Field* its = from.find(field.name);
    if (its == nullptr || its->type != field.type || its->count != field.count) {
      missing_.push_back(field.name);
      continue;
    }
    const std::size_t bytes = field.count * hal::size_of(field.type);
    least_ = std::max(least_, its->offset + bytes);
    Piece* last = pieces_.empty() ? nullptr : &pieces_.back();
    if (last != nullptr && last->from + last->bytes == its->offset &&
        last->to + last->bytes == field.offset) {
      last->bytes += bytes;
    } else {
      pieces_.push_back({its->offset, field.offset, bytes});
    }
  }
}

void ImageCopy::operator()(std::span<const std::byte> body,
                           std::span<std::byte> image) const noexcept {
  if (body.size() < least_) return;
  for (const Piece& piece : pieces_) {
    std::memcpy(image.data() + piece.to, body.data() + piece.from, piece.bytes);
  }
}

RecordedRobot::RecordedRobot(const hal::RobotConfig& robot, hal::Pace pace, const RecordedRun& run)
    : pace_(pace),
      shape_(robot.shape()),
      copy_(run.state(), shape_.layout()),
      causes_(robot.joints.size(), hal::FaultCause::kDrive),
      homing_(robot.joints.size()) {
  for (std::size_t j = 0; j < homing_.size(); ++j) {
    if (robot.joints[j].homing) homing_[j].state = hal::HomingState::kNotHomed;
  }
  const hal::Layout* truth = run.truth();
  if (truth == nullptr) return;
  truth_ = std::make_unique<hal::TruthImage>(
      count_of(*truth, "position_rad"), count_of(*truth, "foot_position_m", 3),
      count_of(*truth, "loop_position_error_m"), count_of(*truth, "passive_position_rad"));
  truth_copy_ = std::make_unique<ImageCopy>(*truth, truth_->layout());
}

void RecordedRobot::begin(const RecordedCycle& cycle) {
  now_ = &cycle;
  missed_ = cycle.before;
  code_ = Code::kOk;
  off_ = false;
  for (const log::Given& given : cycle.given) {
    const auto joint = static_cast<std::size_t>(given.index);
    if (given.kind != log::GivenKind::kCause || joint >= causes_.size()) continue;
    causes_[joint] = static_cast<hal::FaultCause>(static_cast<std::uint8_t>(given.values[0]));
  }
  bool stopped = false;
  for (const log::EventText& one : cycle.events) {
    follow(one, stopped);
    stopped = stopped || log::is_stop(one.event);
  }
}

/// @param stopped  a stop was raised before it in this cycle, which ends a reset by itself
void RecordedRobot::follow(const log::EventText& one, bool stopped) {
  const log::Event& event = one.event;
  const auto joint = static_cast<std::size_t>(event.joint);
  switch (event.kind) {
    case EventKind::kBringUpDone: phase_ = hal::Phase::kOperational; break;
    case EventKind::kResetDone:
      if (event.joint < 0 && resetting_) phase_ = hal::Phase::kOperational;
      resetting_ = resetting_ && event.joint >= 0;
      break;
    case EventKind::kResetFailed:
      if (event.joint >= 0 || stopped) break;
      if (resetting_) phase_ = hal::Phase::kFault;
      resetting_ = false;
      break;
    case EventKind::kFault:
      // A controller's own names it: it comes about once more.
      if (event.joint < 0 && one.text.find(", controller '") == std::string::npos)
        code_ = static_cast<Code>(event.code);
      break;
    case EventKind::kShutDown: off_ = true; break;
    case EventKind::kHomed:
    case EventKind::kHomingFailed:
      if (joint >= homing_.size()) break;
      homing_[joint] =
          event.kind == EventKind::kHomed
              ? hal::Homing{hal::HomingState::kHomed, hal::FaultCause::kNone}
              : hal::Homing{hal::HomingState::kNotHomed, log::cause_of(event.kind, event.code)};
      break;
    case EventKind::kLinkLost: loss_ = log::cause_of(event.kind, event.code); break;
    case EventKind::kLinkBack: loss_ = hal::FaultCause::kNone; break;
    default: break;
  }
}

Code RecordedRobot::read(const hal::CycleTime& /*time*/,
                         hal::StateImage& state) noexcept TANDEM_RT {
  copy_(now_->state, state.bytes());
  if (truth_ != nullptr && !now_->truth.empty()) (*truth_copy_)(now_->truth, truth_->bytes());
  return code_;
}

void RecordedRobot::stop(hal::StopCategory category) noexcept TANDEM_RT {
  if (category == hal::StopCategory::kWarn) return;
  phase_ = hal::Phase::kFault;
  resetting_ = false;
}

void RecordedRobot::reset() noexcept TANDEM_RT {
  phase_ = hal::Phase::kBringUp;
  resetting_ = true;
  std::ranges::fill(causes_, hal::FaultCause::kDrive);
}

bool RecordedRobot::home(std::size_t joint) noexcept TANDEM_RT {
  homing_[joint].state = hal::HomingState::kHoming;
  return true;
}

}  // namespace tandem::runtime
