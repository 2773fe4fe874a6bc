// What both ends of the network proxy share: whose robot it is, its topics, its clock.
// Layer: hal/remote.  Thread: any.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock_ns.hpp"
#include "base/realtime.hpp"
#include "dds/endpoint.hpp"
#include "dds/service.hpp"
#include "hal/image.hpp"
#include "hal/robot.hpp"

namespace tandem::remote {

namespace tandem_msgs = dds::tandem_msgs;

/// kp, ki and kd of every loop, as the link's samples list them joint by joint.
inline constexpr std::size_t kGainsPerJoint = 3 * hal::kPidLoops;

/// Raised with every change of what the link's samples mean: their members, the numbers of stop
/// categories, phases, modes, codes and causes, the images' fields. Builds before 2 say no number;
/// they and later ones do not hear each other.
inline constexpr std::uint32_t kLinkProtocol = 7;

/// What two processes must agree on before one drives the other's robot.
struct LinkIdentity {
  std::uint32_t protocol = kLinkProtocol;
  std::string robot;
  std::string description_hash;  ///< of everything its kernels are made from
  std::int64_t period_ns = 0;
  std::vector<std::string> joints;
  std::vector<std::string> sensors;
  std::uint32_t state_bytes = 0;  ///< of its images
  std::uint32_t command_bytes = 0;

  bool operator==(const LinkIdentity&) const = default;
};
[[nodiscard]] LinkIdentity identity_of(const hal::Robot& robot, std::string description_hash,
                                       std::int64_t period_ns);
/// What `there` has otherwise than `here`, in words; empty: nothing. @pre one protocol
[[nodiscard]] std::string difference(const LinkIdentity& here, const LinkIdentity& there);

/// What a server does at the robot's end of a link, and its owner counts with.
struct RobotEnd {
  /// From a command's number to the state that shows it; 0: each command is followed at once.
  std::uint64_t playout_cycles = 0;
  /// Controllers beside the owner's, with their parameters: "NAME" and "NAME.KEY", sorted.
  std::map<std::string, std::string> controllers = {};

  bool operator==(const RobotEnd&) const = default;
};
/// As of Identity: the play-out, or the first key that the two have otherwise.
[[nodiscard]] std::string difference(const RobotEnd& here, const RobotEnd& there);

inline constexpr const char* kServerTopic = "tandem/link/server";
inline constexpr const char* kRequestTopic = "tandem/link/request";
inline constexpr const char* kRobotEndTopic = "tandem/link/robot_end";
inline constexpr const char* kStateTopic = "tandem/link/state";
inline constexpr const char* kCommandTopic = "tandem/link/command";
/// Late joiners get the last sample; nobody is waited for.
[[nodiscard]] dds::Qos link_qos();
/// A dds::Writer or Reader of the link. Errors: Endpoint::create()'s.
template <class End>
[[nodiscard]] Result<End> open_end(dds::Participant& participant, const char* topic) {
  return End::create(participant, participant.topic_name(topic), link_qos());
}

enum class LeaseAction : std::uint8_t { kAcquire = 0, kRenew = 1, kRelease = 2 };

/// A number that no other process draws; not 0.
[[nodiscard]] std::uint64_t draw_number();

/// Every value of a command is finite, every mode one that there is.
[[nodiscard]] bool is_sound(const hal::CommandImage& command) noexcept;

/// By the participant that writes a sample the two ends know each other once they have met: the
/// numbers in the samples are on topics that everybody in the domain can read.
using Sender = dds::ParticipantId;

/// Finds it for the samples of one reader, on the thread that takes them.
class Senders {
 public:
  explicit Senders(dds_entity_t reader) noexcept : reader_(reader) {}
  /// Empty: its writer is gone. A writer is looked up once as long as no other writes.
  [[nodiscard]] const std::optional<Sender>& of(const dds_sample_info_t& sample);

 private:
  dds_entity_t reader_;
  dds_instance_handle_t writer_ = 0;
  std::optional<Sender> sender_;
};

/// Calls a function on a thread of Cyclone DDS whenever a reader has samples, until this goes.
class OnData {
 public:
  OnData(dds_entity_t reader, std::function<void()> call);
  ~OnData();
  OnData(const OnData&) = delete;
  OnData& operator=(const OnData&) = delete;

 private:
  dds_entity_t reader_;
  std::function<void()> call_;
};

}  // namespace tandem::remote
