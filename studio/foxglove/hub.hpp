// Foxglove's WebSocket protocol, read only and without a network: a run's topics, parameters and
// meshes for Foxglove, Lichtblick and other programs that speak it. docs/foxglove.md says what of
// it there is. Start here.
// Layer: studio/foxglove.  Thread: the studio's.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/text/console.hpp"
#include "base/result.hpp"
#include "studio/foxglove/messages.hpp"
#include "studio/foxglove/queue.hpp"
#include "studio/protocol.hpp"

namespace tandem::studio::foxglove {

/// Where it all comes from.
struct Feed {
  /// Opens and closes channels, and puts what is new into those that somebody wants. Once a tick.
  /// @param again  the newest cycle's, too: somebody has subscribed since
  std::function<void(bool again)> publish{};
  std::function<std::int64_t()> time_ns{};  ///< of the newest cycle, as the messages' stamps
  std::function<std::uint64_t()> parameter_version{};    ///< another one: some may be different
  std::function<std::vector<Parameter>()> parameters{};  ///< all that have a value
  std::function<Result<std::string>(const std::string& uri)> asset{};  ///< a file's bytes
};

class Hub final : public Protocol {
 public:
  static constexpr std::size_t kMostClients = 16, kMostAssets = 64, kMostNames = 1024;

  explicit Hub(Description run) : run_(std::move(run)) {}
  /// Once. What the functions use outlives this.
  void start(Feed feed) { feed_ = std::move(feed); }

  // --- the topics ---

  /// A topic from now on: clients hear of it at the next tick.
  [[nodiscard]] ChannelId open(Channel channel);
  void close(ChannelId channel);
  /// Whether somebody has subscribed.
  [[nodiscard]] bool wanted(ChannelId channel) const;
  /// To whom has subscribed; the newest Channel::keeps also to those who come later.
  void put(ChannelId channel, std::int64_t time_ns, std::string payload);

  // --- the clients ---

  [[nodiscard]] std::span<const std::string_view> names() const override { return kSubprotocols; }
  [[nodiscard]] std::size_t most_clients() const override { return kMostClients; }
  [[nodiscard]] std::size_t clients() const override { return clients_.size(); }
  [[nodiscard]] ClientNumber connect(std::string name) override;
  void disconnect(ClientNumber number) override { clients_.erase(number); }
  void receive(ClientNumber number, std::string_view message, bool binary,
               Clock::time_point now) override;
  void tick(Clock::time_point now) override;
  void end(std::string_view how, std::string_view log) override;
  [[nodiscard]] std::optional<Frame> next(ClientNumber number) override;
  [[nodiscard]] Close closing(ClientNumber number) const override;
  [[nodiscard]] bool is_behind(ClientNumber number) const override;

 private:
  using Stamped = std::pair<std::int64_t, std::shared_ptr<const std::string>>;
  struct Topic {
    Channel channel;
    std::deque<Stamped> kept;
  };
  struct Client {
    Queue out;
    std::map<ChannelId, SubscriptionId> subscriptions;
    std::set<ChannelId> told;  // channels that it knows of
    bool all_parameters = false;
    std::set<std::string> parameters;  // whose changes it wants
    std::size_t assets = 0;            // that wait
    std::uint64_t lost_told = 0;
    Clock::time_point lost_due;
    Close close = Close::kNot;
    int bad = 0;  // messages in a row
  };
  using Handler = void (Hub::*)(Client&, const apps::Json&);
  /// What a client may say; null: it is refused politely.
  struct Row {
    const char* op;
    Handler handler;
    const char* refusal = nullptr;
  };
  static const Row kRows[];

  void refuse(Client& client, std::string_view message);
  void bad(Client& client, std::string_view message);
  void receive_binary(Client& client, std::string_view message);
  void on_subscribe(Client& client, const apps::Json& message);
  void on_unsubscribe(Client& client, const apps::Json& message);
  void on_get_parameters(Client& client, const apps::Json& message);
  void on_set_parameters(Client& client, const apps::Json& message);
  void on_subscribe_parameters(Client& client, const apps::Json& message);
  void on_unsubscribe_parameters(Client& client, const apps::Json& message);
  void on_fetch_asset(Client& client, const apps::Json& message);
  [[nodiscard]] bool all_names(Client& client, const apps::Json& message,
                               std::set<std::string>& names);
  void subscribe(Client& client, SubscriptionId subscription, ChannelId channel);
  void tell_channels(Client& client);
  void tell_parameters();
  void tell_lost(Client& client, Clock::time_point now);
  [[nodiscard]] Frame frame_of(Client& client, const Queue::Entry& entry);

  Description run_;
  Feed feed_;
  std::map<ChannelId, Topic> topics_;
  ChannelId newest_channel_ = 0;
  std::map<ClientNumber, Client> clients_;
  ClientNumber newest_ = 0;
  bool subscribed_ = false;  // somebody has, since the last tick
  std::uint64_t parameter_version_ = 0;
  std::vector<Parameter> parameters_;  // of that version
  bool ended_ = false;
};

}  // namespace tandem::studio::foxglove
