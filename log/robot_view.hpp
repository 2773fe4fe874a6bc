// What a ROS viewer needs to show the robot of a log: its description, the state of its joints and
// where its links are. Made from the images that the log has anyway.
// Layer: log.  Thread: set up non-RT; follow() the recorder's.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/realtime.hpp"
#include "hal/cycle_time.hpp"
#include "hal/follower.hpp"
#include "hal/image.hpp"
#include "log/bytes.hpp"
#include "log/mcap_writer.hpp"

namespace tandem::log {

/// The definition of a type that viewers know, with those that it needs ("ros2msg"). @pre it is one
/// of log/CMakeLists.txt's
[[nodiscard]] std::string_view view_definition(std::string_view type);

/// A link on the one that carries it.
struct ViewedLink {
  std::string parent{}, name{};
  std::array<double, 3> xyz_m{};                     ///< in the parent's frame, the joint at 0
  std::array<double, 4> quaternion{0., 0., 0., 1.};  ///< x y z w
  std::array<double, 3> axis{};  ///< of the joint between them, in the link's frame; of length 1
  bool slides = false;           ///< along the axis; else it turns about it
  int joint = -1;                ///< whose position in the images counts; -1: the link is fixed
  double multiplier = 1.0, offset = 0.0;  ///< of that position, for a joint that follows it
};

/// The robot, as viewers want to know it.
struct ViewedRobot {
  std::string urdf{};        ///< the description's text; empty: the log has nothing for viewers
  std::string base_link{};   ///< of a floating base: the root link; empty: the base does not move
  std::string fixed_root{};  ///< of a base that does not move: the root link, which stands in odom
  std::vector<ViewedLink> links{};         ///< all but the root, and those that nobody measures
  std::vector<hal::Follower> followers{};  ///< joints that follow those of the images
};

/// Topics /joint_states, /tf, /tf_static and /robot_description, of the types that ROS 2 has for
/// them.
class RobotView {
 public:
  /// Simulated time from one message of a topic to the next: 50 Hz. A cycle that takes longer has
  /// one each.
  static constexpr std::int64_t kPeriod_ns = 20'000'000;
  /// Whether that is due in a cycle, by its nominal time.
  [[nodiscard]] static bool begins_period(const hal::CycleTime& time) noexcept TANDEM_RT {
    return time.time_ns / kPeriod_ns != (time.time_ns - time.period_ns) / kPeriod_ns;
  }

  RobotView() = default;  ///< of no robot: no topics
  /// @param joints  names in the images' order
  RobotView(ViewedRobot robot, std::vector<std::string> joints);

  /// A channel of the log: it looks for /tandem/state and /tandem/truth or, where there is none
  /// before it, /tandem/estimate.
  void take_channel(std::uint16_t channel, std::string_view topic, const hal::Layout& layout);
  /// Once all channels are known, and for each file again: makes those that it can fill.
  void add_channels(McapWriter& writer);

  /// Whether a channel's messages are in each file again.
  [[nodiscard]] bool repeats(std::uint16_t channel) const noexcept {
    return state_.channel >= 0 && (channel == description_ || (stands_ && channel == tf_static_));
  }

  /// Calls `emit` for each message that comes with an image: the first one of every 20 ms has
  /// some. The description and what does not move come with a file's first state.
  void follow(std::uint16_t channel, std::int64_t time_ns, std::span<const std::byte> image,
              const std::function<void(std::uint16_t, std::span<const std::byte>)>& emit);

 private:
  /// A source's image: whose channel, and when a message was last made from it.
  struct Source {
    int channel = -1;
    std::int64_t last_period = std::numeric_limits<std::int64_t>::min();
    [[nodiscard]] bool due(std::uint16_t of, std::int64_t time_ns);
  };
  /// @return false: a joint's board has not answered yet
  bool write_joint_states(std::int64_t time_ns, std::span<const std::byte> state);
  void write_links(std::int64_t time_ns, std::span<const std::byte> state);
  void write_fixed_links(std::int64_t time_ns);
  /// @return false: the base's place is no number
  [[nodiscard]] bool write_base(std::int64_t time_ns, std::span<const std::byte> truth);

  ViewedRobot robot_;
  std::vector<std::string> joints_;
  Source state_, truth_;
  hal::Layout state_layout_, truth_layout_;
  bool moves_ = false, stands_ = false;  // some link, some other
  std::uint16_t joint_states_ = 0, tf_ = 0, tf_static_ = 0, description_ = 0;  // channels
  bool described_ = false;
  Bytes body_;                  // reused
  std::vector<double> values_;  // reused
};

}  // namespace tandem::log
