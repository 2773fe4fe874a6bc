// What waits to be sent to one client of Foxglove's protocol: bounded, whatever the client does.
// Layer: studio/foxglove.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "studio/foxglove/messages.hpp"

namespace tandem::studio::foxglove {

/// In the order in which things happened. Texts stay; of a subscription's messages the newest few
/// wait, and of all of them the newest kMostBytes: older ones are left out, and counted.
class Queue {
 public:
  static constexpr std::size_t kMostMessages = 8, kMostTexts = 256, kMostBytes = 4'000'000;

  struct Message {
    SubscriptionId subscription;
    std::int64_t time_ns;
    std::shared_ptr<const std::string> payload;
    bool stays = false;  ///< true whenever it was: of a topic that keeps some
  };
  /// A file that is read when its turn comes.
  struct Asset {
    std::uint32_t request;
    std::string uri;
  };
  using Entry = std::variant<std::string, Message, Asset>;

  void text(std::string text) { put(std::move(text)); }
  void asset(Asset asset) { put(std::move(asset)); }
  /// @param most  of its subscription that wait
  void message(Message message, std::size_t most = kMostMessages);
  /// The run's time; of several that wait the newest counts. Where it went back, messages that
  /// wait are of what did not happen: viewers would take them for newer than all that comes.
  void time(std::int64_t time_ns);
  /// Nobody waits for its messages any more.
  void drop(SubscriptionId subscription);

  /// The next one to send; a time before all else.
  [[nodiscard]] std::optional<Entry> next();
  [[nodiscard]] std::optional<std::int64_t> next_time() { return std::exchange(time_ns_, {}); }
  /// Whether a quarter of what may wait does: who asks for more is to read first.
  [[nodiscard]] bool is_behind() const { return texts_ > kMostTexts / 4; }
  /// Whether more than kMostTexts waited once: the client is too slow to be kept.
  [[nodiscard]] bool is_over() const { return over_; }
  /// Messages that were left out so far.
  [[nodiscard]] std::uint64_t lost() const { return lost_; }
  [[nodiscard]] bool empty() const { return entries_.empty(); }

 private:
  void put(Entry entry);
  template <class Is>
  bool lose_first(Is is);
  template <class Is>
  void drop_all(Is is);

  std::deque<Entry> entries_;
  std::size_t texts_ = 0, text_bytes_ = 0, message_bytes_ = 0;
  std::optional<std::int64_t> time_ns_;
  std::int64_t newest_ns_ = 0;  // of time()
  std::uint64_t lost_ = 0;
  bool over_ = false;
};

}  // namespace tandem::studio::foxglove
