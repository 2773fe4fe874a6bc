// Messages of Foxglove's WebSocket protocol to its clients: JSON texts and binary frames.
// Layer: studio/foxglove.  Thread: any.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace tandem::studio::foxglove {

/// Both names have the messages that are used here in common.
inline constexpr std::string_view kSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// Number of a topic. In a run it is never used for another one.
using ChannelId = std::uint32_t;
/// A client's own number of its subscription.
using SubscriptionId = std::uint32_t;

/// A topic whose messages are CDR of a ROS 2 definition.
struct Channel {
  std::string topic;        ///< "/joint_states"
  std::string schema_name;  ///< "sensor_msgs/msg/JointState"
  std::string schema;       ///< the definition's text ("ros2msg")
  std::size_t keeps = 0;    ///< newest messages that who subscribes later gets
};

/// A parameter of the run.
struct Parameter {
  using Value = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;
  std::string name;
  Value value;
  bool operator==(const Parameter&) const = default;
};

/// What does not change in a run.
struct Description {
  std::string name{};     ///< of the server, for people
  std::string session{};  ///< another one: another run
  bool time = false;      ///< the run's time is not the wall clock's: the server tells it
};

enum class StatusLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };

[[nodiscard]] std::string server_info_text(const Description& run);
[[nodiscard]] std::string status_text(StatusLevel level, std::string_view message);
using NumberedChannel = std::pair<ChannelId, const Channel*>;
[[nodiscard]] std::string advertise_text(std::span<const NumberedChannel> channels);
[[nodiscard]] std::string unadvertise_text(std::span<const ChannelId> channels);
/// @param id  the question's; empty: nobody asked
[[nodiscard]] std::string parameters_text(std::span<const Parameter> parameters,
                                          std::string_view id);

[[nodiscard]] std::string message_frame(SubscriptionId subscription, std::int64_t time_ns,
                                        std::string_view payload);
[[nodiscard]] std::string time_frame(std::int64_t time_ns);
[[nodiscard]] std::string asset_frame(std::uint32_t request, std::string_view bytes);
[[nodiscard]] std::string no_asset_frame(std::uint32_t request, std::string_view why);

}  // namespace tandem::studio::foxglove
