// What waits to be sent to one client: bounded, whatever the client does.
// Layer: studio.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "studio/messages.hpp"
#include "studio/protocol.hpp"

namespace tandem::studio {

/// Texts and windows, in their order, then ticks. Of ticks the newest kMostTicks wait: the oldest
/// is merged into the next, and counted as lost.
class Outbox {
 public:
  static constexpr std::size_t kMostTicks = 4, kMostMessages = 256, kMostBytes = 4'000'000;

  using Frame = studio::Frame;

  void text(std::shared_ptr<const std::string> text) { put({false, std::move(text)}); }
  void text(std::string text) { this->text(std::make_shared<const std::string>(std::move(text))); }
  void window(std::string frame) {
    put({true, std::make_shared<const std::string>(std::move(frame))});
  }
  void tick(Tick tick);
  /// Ticks of a former subscription: nobody waits for them.
  void drop_ticks() { ticks_.clear(); }

  /// The next one to send.
  [[nodiscard]] std::optional<Frame> next();
  [[nodiscard]] bool empty() const { return messages_.empty() && ticks_.empty(); }
  /// Whether a quarter of what may wait does: who asks for more is to read first.
  [[nodiscard]] bool is_behind() const {
    return messages_.size() > kMostMessages / 4 || bytes_ > kMostBytes / 4;
  }
  /// Whether more than kMostMessages or kMostBytes waited once: the client is too slow to be kept.
  [[nodiscard]] bool is_over() const { return over_; }
  [[nodiscard]] std::uint32_t lost() const { return lost_; }
  void clear();

 private:
  void put(Frame frame);

  std::deque<Frame> messages_;
  std::size_t bytes_ = 0;
  std::deque<Tick> ticks_;
  std::uint32_t lost_ = 0;
  bool over_ = false;
};

}  // namespace tandem::studio
