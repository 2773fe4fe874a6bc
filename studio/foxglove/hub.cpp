#include "studio/foxglove/hub.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tandem::studio::foxglove {
namespace {

constexpr std::chrono::seconds kLostAgain{1};

Frame as_frame(bool binary, std::string bytes) {
  return {binary, std::make_shared<const std::string>(std::move(bytes))};
}

}  // namespace

ChannelId Hub::open(Channel channel) {
  topics_.emplace(++newest_channel_, Topic{std::move(channel), {}});
  return newest_channel_;
}

void Hub::close(ChannelId channel) { topics_.erase(channel); }

bool Hub::wanted(ChannelId channel) const {
  return std::ranges::any_of(
      clients_, [&](const auto& one) { return one.second.subscriptions.contains(channel); });
}

void Hub::put(ChannelId channel, std::int64_t time_ns, std::string payload) {
  const auto topic = topics_.find(channel);
  if (topic == topics_.end()) return;
  const std::size_t keeps = topic->second.channel.keeps;
  const auto shared = std::make_shared<const std::string>(std::move(payload));
  for (auto& [number, client] : clients_) {
    const auto its = client.subscriptions.find(channel);
    if (its == client.subscriptions.end()) continue;
    client.out.message({its->second, time_ns, shared, keeps > 0},
                       std::max(keeps, Queue::kMostMessages));
  }
  std::deque<Stamped>& kept = topic->second.kept;
  if (keeps > 0) kept.emplace_back(time_ns, shared);
  if (kept.size() > keeps) kept.pop_front();
}

Hub::ClientNumber Hub::connect(std::string) {
  const ClientNumber number = ++newest_;
  Client& client = clients_[number];
  client.out.text(server_info_text(run_));
  tell_channels(client);
  return number;
}

void Hub::tick(Clock::time_point now) {
  if (ended_) return;
  if (run_.time && feed_.time_ns) {
    const std::int64_t time_ns = feed_.time_ns();
    for (auto& [number, client] : clients_) client.out.time(time_ns);
  }
  if (feed_.publish) feed_.publish(std::exchange(subscribed_, false));
  tell_parameters();
  for (auto& [number, client] : clients_) {
    tell_channels(client);
    tell_lost(client, now);
  }
}

/// Topics have come or gone.
void Hub::tell_channels(Client& client) {
  std::vector<ChannelId> gone;
  for (const ChannelId id : client.told) {
    if (!topics_.contains(id)) gone.push_back(id);
  }
  for (const ChannelId id : gone) {
    client.told.erase(id);
    client.subscriptions.erase(id);
  }
  if (!gone.empty()) client.out.text(unadvertise_text(gone));
  std::vector<NumberedChannel> come;
  for (const auto& [id, topic] : topics_) {
    if (client.told.insert(id).second) come.emplace_back(id, &topic.channel);
  }
  if (!come.empty()) client.out.text(advertise_text(come));
}

void Hub::tell_parameters() {
  if (!feed_.parameter_version) return;
  const std::uint64_t version = feed_.parameter_version();
  if (version == parameter_version_) return;
  parameter_version_ = version;
  const std::vector<Parameter> before = std::exchange(parameters_, feed_.parameters());
  std::vector<Parameter> changed;
  for (const Parameter& one : parameters_) {
    if (std::ranges::find(before, one) == before.end()) changed.push_back(one);
  }
  for (auto& [number, client] : clients_) {
    std::vector<Parameter> its;
    for (const Parameter& one : changed) {
      if (client.all_parameters || client.parameters.contains(one.name)) its.push_back(one);
    }
    if (!its.empty()) client.out.text(parameters_text(its, {}));
  }
}

/// Once a second at most, and not while it is not even read.
void Hub::tell_lost(Client& client, Clock::time_point now) {
  const std::uint64_t lost = client.out.lost();
  if (lost == client.lost_told || now < client.lost_due || client.out.is_behind()) return;
  client.lost_due = now + kLostAgain;
  client.out.text(status_text(
      StatusLevel::kWarning,
      fmt::format("{} messages were left out: this program reads too slowly; subscribe to less",
                  lost - client.lost_told)));
  client.lost_told = lost;
}

void Hub::end(std::string_view how, std::string_view) {
  if (std::exchange(ended_, true)) return;
  const std::string text = status_text(
      StatusLevel::kInfo, "the run is over" + (how.empty() ? "" : ": " + std::string(how)));
  for (auto& [number, client] : clients_) {
    client.out.text(text);
    client.close = Close::kGoingAway;
  }
}

std::optional<Frame> Hub::next(ClientNumber number) {
  const auto found = clients_.find(number);
  if (found == clients_.end()) return std::nullopt;
  Client& client = found->second;
  if (const auto time_ns = client.out.next_time()) return as_frame(true, time_frame(*time_ns));
  const std::optional<Queue::Entry> entry = client.out.next();
  return entry ? std::optional(frame_of(client, *entry)) : std::nullopt;
}

Frame Hub::frame_of(Client& client, const Queue::Entry& entry) {
  if (const auto* text = std::get_if<std::string>(&entry)) return as_frame(false, *text);
  if (const auto* message = std::get_if<Queue::Message>(&entry)) {
    return as_frame(true,
                    message_frame(message->subscription, message->time_ns, *message->payload));
  }
  const auto& [request, uri] = std::get<Queue::Asset>(entry);
  --client.assets;
  const Result<std::string> bytes =
      feed_.asset ? feed_.asset(uri) : Result<std::string>(fail("there are no files here"));
  return as_frame(true, bytes ? asset_frame(request, *bytes)
                              : no_asset_frame(request, bytes.error().to_string()));
}

Close Hub::closing(ClientNumber number) const {
  const auto client = clients_.find(number);
  if (client == clients_.end()) return Close::kGoingAway;
  return client->second.out.is_over() ? Close::kPolicy : client->second.close;
}

bool Hub::is_behind(ClientNumber number) const {
  const auto client = clients_.find(number);
  return client != clients_.end() && client->second.out.is_behind();
}

}  // namespace tandem::studio::foxglove
