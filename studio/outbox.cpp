#include "studio/outbox.hpp"

namespace tandem::studio {

void Outbox::put(Frame frame) {
  if (over_) return;
  bytes_ += frame.bytes->size();
  messages_.push_back(std::move(frame));
  if (messages_.size() <= kMostMessages && bytes_ <= kMostBytes) return;
  clear();
  over_ = true;
}

void Outbox::tick(Tick tick) {
  if (over_) return;
  ticks_.push_back(std::move(tick));
  if (ticks_.size() <= kMostTicks) return;
  ticks_[1].merge_before(ticks_[0]);
  ticks_.pop_front();
  ++lost_;
}

std::optional<Outbox::Frame> Outbox::next() {
  if (!messages_.empty()) {
    Frame frame = std::move(messages_.front());
    messages_.pop_front();
    bytes_ -= frame.bytes->size();
    return frame;
  }
  if (ticks_.empty()) return std::nullopt;
  Frame frame{true, std::make_shared<const std::string>(tick_frame(ticks_.front(), lost_))};
  ticks_.pop_front();
  return frame;
}

void Outbox::clear() {
  messages_.clear();
  ticks_.clear();
  bytes_ = 0;
}

}  // namespace tandem::studio
