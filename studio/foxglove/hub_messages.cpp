// What a client may say, and what follows. What would change the run is refused in words.
#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "apps/text/json_reader.hpp"
#include "base/nearest.hpp"
#include "studio/foxglove/hub.hpp"

namespace tandem::studio::foxglove {
namespace {

using apps::Json;

constexpr char kReadOnly[] =
    "nothing is published or called here: this server only shows. The run's own page and "
    "`tandem ask` change it";
constexpr char kNoGraph[] = "the graph of connections is not served here";

/// What a client says in bytes, by the first of them.
constexpr std::pair<char, const char*> kBinary[] = {
    {1, kReadOnly}, {2, kReadOnly}, {3, "a run has no playback: its page can pause it"}};

/// A number of 32 bits; empty: it is none.
std::optional<std::uint32_t> number_of(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

std::optional<std::uint32_t> number_at(const Json& object, const char* key) {
  if (!object.is_object()) return std::nullopt;
  const auto found = object.find(key);
  return found == object.end() ? std::nullopt : number_of(*found);
}

std::string text_at(const Json& message, const char* key) {
  const auto found = message.find(key);
  return found == message.end() || !found->is_string() ? "" : found->get<std::string>();
}

/// The list at `key`, of `most` elements at most; null: it is none.
const Json* list_at(const Json& message, const char* key, std::size_t most) {
  const auto found = message.find(key);
  return found == message.end() || !found->is_array() || found->size() > most ? nullptr : &*found;
}

}  // namespace

const Hub::Row Hub::kRows[] = {
    {"subscribe", &Hub::on_subscribe},
    {"unsubscribe", &Hub::on_unsubscribe},
    {"getParameters", &Hub::on_get_parameters},
    {"setParameters", &Hub::on_set_parameters},
    {"subscribeParameterUpdates", &Hub::on_subscribe_parameters},
    {"unsubscribeParameterUpdates", &Hub::on_unsubscribe_parameters},
    {"fetchAsset", &Hub::on_fetch_asset},
    {"advertise", nullptr, kReadOnly},
    {"unadvertise", nullptr, kReadOnly},
    {"subscribeConnectionGraph", nullptr, kNoGraph},
    {"unsubscribeConnectionGraph", nullptr, kNoGraph},
};

void Hub::refuse(Client& client, std::string_view message) {
  client.out.text(status_text(StatusLevel::kError, message));
}

void Hub::bad(Client& client, std::string_view message) {
  refuse(client, message);
  if (++client.bad >= kMostBad) client.close = Close::kPolicy;
}

void Hub::receive(ClientNumber number, std::string_view message, bool binary, Clock::time_point) {
  const auto found = clients_.find(number);
  if (found == clients_.end() || ended_) return;
  Client& client = found->second;
  if (client.close != Close::kNot || client.out.is_over()) return;
  if (message.size() > kMostFromClient) {
    return bad(client, fmt::format("a message of more than {} bytes", kMostFromClient));
  }
  if (binary) return receive_binary(client, message);
  const Result<Json> read = apps::read_json_object(message);
  if (!read) return bad(client, read.error().message);
  const std::string op = text_at(*read, "op");
  const auto* const row = std::ranges::find_if(kRows, [&](const Row& one) { return op == one.op; });
  if (row == std::end(kRows)) {
    return bad(client, fmt::format("unknown op \"{}\"", op.substr(0, kMostNamed)));
  }
  client.bad = 0;
  if (row->handler == nullptr) return refuse(client, fmt::format("{}: {}", op, row->refusal));
  (this->*row->handler)(client, *read);
}

void Hub::receive_binary(Client& client, std::string_view message) {
  const auto* const known = std::ranges::find_if(
      kBinary, [&](const auto& one) { return message.starts_with(one.first); });
  if (known == std::end(kBinary)) return bad(client, "a binary message of an unknown kind");
  client.bad = 0;
  refuse(client, known->second);
}

void Hub::on_subscribe(Client& client, const Json& message) {
  const Json* list = list_at(message, "subscriptions", topics_.size());
  if (list == nullptr) {
    return refuse(client, "subscribe: \"subscriptions\" is no list of up to one a channel");
  }
  for (const Json& one : *list) {
    const auto subscription = number_at(one, "id"), channel = number_at(one, "channelId");
    if (!subscription || !channel) {
      return refuse(client, "subscribe: \"id\" or \"channelId\" is no number of 32 bits");
    }
    subscribe(client, *subscription, *channel);
  }
}

void Hub::subscribe(Client& client, SubscriptionId subscription, ChannelId channel) {
  const auto topic = topics_.find(channel);
  if (topic == topics_.end() || !client.told.contains(channel)) {
    return refuse(client, fmt::format("subscribe: there is no channel {}", channel));
  }
  const bool used = std::ranges::any_of(
      client.subscriptions, [&](const auto& its) { return its.second == subscription; });
  if (used || client.subscriptions.contains(channel)) {
    return refuse(client, fmt::format("subscribe: {} or {} is subscribed to already", subscription,
                                      topic->second.channel.topic));
  }
  client.subscriptions.emplace(channel, subscription);
  subscribed_ = true;
  const std::size_t most = std::max(topic->second.channel.keeps, Queue::kMostMessages);
  for (const auto& [time_ns, payload] : topic->second.kept) {
    client.out.message({subscription, time_ns, payload, true}, most);
  }
}

void Hub::on_unsubscribe(Client& client, const Json& message) {
  const Json* list = list_at(message, "subscriptionIds", kMostNames);
  if (list == nullptr) return refuse(client, "unsubscribe: \"subscriptionIds\" is no list");
  for (const Json& one : *list) {
    const auto subscription = number_of(one);
    const auto its = std::ranges::find_if(client.subscriptions, [&](const auto& entry) {
      return subscription && entry.second == *subscription;
    });
    if (its == client.subscriptions.end()) {
      refuse(client,
             "unsubscribe: there is no subscription " + apps::json_text(one).substr(0, kMostNamed));
      return;
    }
    client.out.drop(its->second);
    client.subscriptions.erase(its);
  }
}

/// Names of parameters; what is none is answered.
bool Hub::all_names(Client& client, const Json& message, std::set<std::string>& names) {
  const Json* list = list_at(message, "parameterNames", kMostNames);
  const bool well = list != nullptr &&
                    std::ranges::all_of(*list, [](const Json& one) { return one.is_string(); });
  if (!well) {
    refuse(client, fmt::format("\"parameterNames\" is no list of up to {} names", kMostNames));
    return false;
  }
  for (const Json& one : *list) names.insert(one.get<std::string>());
  return true;
}

void Hub::on_get_parameters(Client& client, const Json& message) {
  std::set<std::string> names;
  if (!all_names(client, message, names)) return;
  std::vector<Parameter> wanted;
  if (feed_.parameters) wanted = feed_.parameters();
  std::erase_if(wanted,
                [&](const Parameter& one) { return !names.empty() && !names.contains(one.name); });
  client.out.text(parameters_text(wanted, text_at(message, "id").substr(0, kMostNamed)));
}

/// Who has asked shows what it wanted until it hears what there is.
void Hub::on_set_parameters(Client& client, const Json& message) {
  refuse(client,
         "setParameters: parameters are only shown here. `tandem controller set` changes them, and "
         "the run's own page");
  const Json* list = list_at(message, "parameters", kMostNames);
  if (list == nullptr) return;
  Json names = Json::array();
  for (const Json& one : *list) {
    if (one.is_object()) names.push_back(text_at(one, "name"));
  }
  if (!names.empty()) {
    on_get_parameters(client,
                      {{"parameterNames", std::move(names)}, {"id", text_at(message, "id")}});
  }
}

void Hub::on_subscribe_parameters(Client& client, const Json& message) {
  std::set<std::string> names;
  if (!all_names(client, message, names)) return;
  if (names.empty()) client.all_parameters = true;
  client.parameters.merge(names);
  if (client.parameters.size() > kMostNames) {
    client.parameters.clear();
    client.all_parameters = true;
  }
}

void Hub::on_unsubscribe_parameters(Client& client, const Json& message) {
  std::set<std::string> names;
  if (!all_names(client, message, names)) return;
  if (names.empty()) {
    client.all_parameters = false;
    client.parameters.clear();
  }
  for (const std::string& name : names) client.parameters.erase(name);
}

void Hub::on_fetch_asset(Client& client, const Json& message) {
  const auto request = number_at(message, "requestId");
  if (!request) return refuse(client, "fetchAsset: \"requestId\" is no number of 32 bits");
  if (client.assets >= kMostAssets) {
    return refuse(client,
                  fmt::format("fetchAsset: {} files wait already: read them first", kMostAssets));
  }
  ++client.assets;
  client.out.asset({*request, text_at(message, "uri")});
}

}  // namespace tandem::studio::foxglove
