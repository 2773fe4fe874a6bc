#include "hal/remote/operator_end.hpp"

#include <utility>

namespace tandem::remote {

OperatorEnd::OperatorEnd(hal::Backend& robot, End twin, std::uint64_t unanswered_cycles)
    : ForwardingBackend(robot),
      twin_(std::move(twin.robot)),
      twin_side_(std::move(twin.side)),
      answers_(unanswered_cycles) {}

hal::Phase OperatorEnd::phase() const noexcept {
  const hal::Phase phase = to().phase();
  const bool waits = !linked_ && twin_ && twin_->phase() == hal::Phase::kBringUp;
  return phase == hal::Phase::kOperational && waits ? hal::Phase::kBringUp : phase;
}

void OperatorEnd::stop(hal::StopCategory category) noexcept TANDEM_RT {
  ended_ = true;
  to().stop(category);
  if (twin_) twin_->stop(category);
}

void OperatorEnd::reset() noexcept TANDEM_RT {
  linked_ = ended_ = false;
  to().reset();
  if (twin_) twin_->reset();
}

bool OperatorEnd::shut_down() noexcept TANDEM_RT {
  ended_ = true;
  const bool robot = to().shut_down();
  const bool twin = twin_ == nullptr || twin_->shut_down();
  return robot && twin;
}

}  // namespace tandem::remote
