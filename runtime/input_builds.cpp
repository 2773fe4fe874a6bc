// An input over several builds of its controller: what a reload hands over.
#include <algorithm>
#include <utility>

#include "runtime/input_port.hpp"

namespace tandem::runtime {

void InputPort::pass_to(std::shared_ptr<InputPort> next) {
  const std::lock_guard lock(mutex_);
  next_ = std::move(next);
}

std::shared_ptr<InputPort> InputPort::heir() const {
  std::shared_ptr<InputPort> next;
  {
    const std::lock_guard lock(mutex_);
    next = next_;
  }
  const auto later = next == nullptr ? nullptr : next->heir();
  return later == nullptr ? next : later;
}

bool InputPort::is_same_as(const InputPort& other) const noexcept {
  return block_->name == other.block_->name && block_->kind == other.block_->kind &&
         block_->components == other.block_->components && block_->units == other.block_->units &&
         block_->values() == other.block_->values();
}

void InputPort::follow(const InputPort& former) {
  mail_ = former.mail_;
  build_ = former.build_ + 1;
  same_bounds_ = min_ == former.min_ && max_ == former.max_ && max_speed_ == former.max_speed_;
}

void InputPort::go_on_as(const InputPort& former) noexcept TANDEM_RT {
  base_ = former.base_;
  row_ = former.row_;
  const InputBlock& was = *former.block_;
  const bool counts = former.holds_sample();
  if (counts && !admits(was.value)) return show();
  block_->sequence = was.sequence;
  block_->cycle = was.cycle;
  block_->fresh = was.fresh;
  block_->arrived = was.arrived;
  const bool stays = was.fresh || block_->options.after == AfterTimeout::kLast;
  hold(counts && stays ? std::span<const double>(was.value) : without_);
  show();
}

bool InputPort::holds_sample() const noexcept TANDEM_RT {
  return block_->sequence > 0 && (block_->fresh || block_->options.after == AfterTimeout::kLast);
}

/// For way-points only the bounds are compared: theirs are the joints' own as well.
bool InputPort::admits(std::span<const double> sample) const noexcept TANDEM_RT {
  if (same_bounds_) return true;
  if (block_->kind == InputKind::kTrajectory) return false;
  for (std::size_t i = 0; i < sample.size(); ++i) {
    if (!(sample[i] >= min_[i] && sample[i] <= max_[i])) return false;
  }
  return true;
}

}  // namespace tandem::runtime
