#include "studio/foxglove/messages.hpp"

#include <bit>
#include <cmath>
#include <cstring>

#include "apps/text/console.hpp"

namespace tandem::studio::foxglove {
namespace {

using apps::Json;
using apps::json_text;

static_assert(std::endian::native == std::endian::little, "frames are little endian");

enum class Kind : std::uint8_t { kMessage = 1, kTime = 2, kAsset = 4 };

template <class T>
void put(std::string& frame, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  frame.append(bytes, sizeof value);
}

/// A number that is none has no value, which JSON cannot say otherwise.
Json value_json(const Parameter::Value& value) {
  return std::visit([](const auto& its) { return Json(its); }, value);
}

/// What JSON's numbers do not tell by themselves.
const char* type_of(const Parameter::Value& value) {
  if (std::holds_alternative<double>(value)) return "float64";
  return std::holds_alternative<std::vector<double>>(value) ? "float64_array" : nullptr;
}

std::string asset(std::uint32_t request, bool found, std::string_view why, std::string_view bytes) {
  std::string frame;
  frame.reserve(10 + why.size() + bytes.size());
  put(frame, Kind::kAsset);
  put(frame, request);
  put(frame, static_cast<std::uint8_t>(found ? 0 : 1));
  put(frame, static_cast<std::uint32_t>(why.size()));
  return frame.append(why).append(bytes);
}

}  // namespace

std::string server_info_text(const Description& run) {
  Json capabilities = {"parameters", "parametersSubscribe", "assets"};
  if (run.time) capabilities.push_back("time");
  return json_text({{"op", "serverInfo"},
                    {"name", run.name},
                    {"capabilities", std::move(capabilities)},
                    {"supportedEncodings", Json::array()},
                    {"metadata", Json::object()},
                    {"sessionId", run.session}});
}

std::string status_text(StatusLevel level, std::string_view message) {
  return json_text({{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}});
}

std::string advertise_text(std::span<const NumberedChannel> channels) {
  Json list = Json::array();
  for (const auto& [id, channel] : channels) {
    list.push_back({{"id", id},
                    {"topic", channel->topic},
                    {"encoding", "cdr"},
                    {"schemaName", channel->schema_name},
                    {"schema", channel->schema},
                    {"schemaEncoding", "ros2msg"}});
  }
  return json_text({{"op", "advertise"}, {"channels", std::move(list)}});
}

std::string unadvertise_text(std::span<const ChannelId> channels) {
  return json_text({{"op", "unadvertise"},
                    {"channelIds", std::vector<ChannelId>(channels.begin(), channels.end())}});
}

std::string parameters_text(std::span<const Parameter> parameters, std::string_view id) {
  Json list = Json::array();
  for (const Parameter& one : parameters) {
    Json its = {{"name", one.name}, {"value", value_json(one.value)}};
    if (const char* type = type_of(one.value)) its["type"] = type;
    list.push_back(std::move(its));
  }
  Json text = {{"op", "parameterValues"}, {"parameters", std::move(list)}};
  if (!id.empty()) text["id"] = id;
  return json_text(text);
}

std::string message_frame(SubscriptionId subscription, std::int64_t time_ns,
                          std::string_view payload) {
  std::string frame;
  frame.reserve(13 + payload.size());
  put(frame, Kind::kMessage);
  put(frame, subscription);
  put(frame, static_cast<std::uint64_t>(time_ns));
  return frame.append(payload);
}

std::string time_frame(std::int64_t time_ns) {
  std::string frame;
  put(frame, Kind::kTime);
  put(frame, static_cast<std::uint64_t>(time_ns));
  return frame;
}

std::string asset_frame(std::uint32_t request, std::string_view bytes) {
  return asset(request, true, {}, bytes);
}

std::string no_asset_frame(std::uint32_t request, std::string_view why) {
  return asset(request, false, why, {});
}

}  // namespace tandem::studio::foxglove
