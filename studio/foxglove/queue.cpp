#include "studio/foxglove/queue.hpp"

#include <algorithm>

namespace tandem::studio::foxglove {
namespace {

bool is_of(const Queue::Entry& entry, SubscriptionId subscription) {
  const auto* message = std::get_if<Queue::Message>(&entry);
  return message != nullptr && message->subscription == subscription;
}

std::size_t bytes_of(const Queue::Entry& entry) {
  if (const auto* message = std::get_if<Queue::Message>(&entry)) return message->payload->size();
  if (const auto* text = std::get_if<std::string>(&entry)) return text->size();
  return std::get<Queue::Asset>(entry).uri.size();
}

}  // namespace

void Queue::put(Entry entry) {
  if (over_) return;
  ++texts_;
  text_bytes_ += bytes_of(entry);
  entries_.push_back(std::move(entry));
  if (texts_ <= kMostTexts && text_bytes_ <= kMostBytes) return;
  entries_.clear();
  over_ = true;
}

template <class Is>
bool Queue::lose_first(Is is) {
  const auto found = std::ranges::find_if(entries_, is);
  if (found == entries_.end()) return false;
  message_bytes_ -= bytes_of(*found);
  entries_.erase(found);
  ++lost_;
  return true;
}

void Queue::message(Message message, std::size_t most) {
  if (over_) return;
  const auto its = [id = message.subscription](const Entry& entry) { return is_of(entry, id); };
  message_bytes_ += message.payload->size();
  entries_.emplace_back(std::move(message));
  if (static_cast<std::size_t>(std::ranges::count_if(entries_, its)) > most) {
    (void)lose_first(its);
  }
  const auto any = [this](const Entry& entry) {
    return &entry != &entries_.back() && std::holds_alternative<Message>(entry);
  };
  while (message_bytes_ > kMostBytes && lose_first(any)) {
  }
}

void Queue::drop(SubscriptionId subscription) {
  drop_all([=](const Message& message) { return message.subscription == subscription; });
}

void Queue::time(std::int64_t time_ns) {
  time_ns_ = time_ns;
  if (time_ns >= std::exchange(newest_ns_, time_ns)) return;
  drop_all([](const Message& message) { return !message.stays; });
}

template <class Is>
void Queue::drop_all(Is is) {
  std::erase_if(entries_, [&](const Entry& entry) {
    const auto* message = std::get_if<Message>(&entry);
    if (message == nullptr || !is(*message)) return false;
    message_bytes_ -= bytes_of(entry);
    return true;
  });
}

std::optional<Queue::Entry> Queue::next() {
  if (entries_.empty()) return std::nullopt;
  Entry entry = std::move(entries_.front());
  entries_.pop_front();
  if (std::holds_alternative<Message>(entry)) {
    message_bytes_ -= bytes_of(entry);
  } else {
    --texts_;
    text_bytes_ -= bytes_of(entry);
  }
  return entry;
}

}  // namespace tandem::studio::foxglove
