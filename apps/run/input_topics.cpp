#include "apps/run/input_topics.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "dds/endpoint.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;
using Values = std::vector<double>;

constexpr std::chrono::milliseconds kLeastSilence{500};  // before another writer may feed
constexpr double kPerNs = 1e-9;

Values values_of(const dds::geometry_msgs::Twist& twist) {
  return {twist.linear.x,  twist.linear.y,  twist.linear.z,
          twist.angular.x, twist.angular.y, twist.angular.z};
}

Result<Values> sample_of(const dds::geometry_msgs::Twist& twist, const InputBlock&) {
  return values_of(twist);
}

Result<Values> sample_of(const dds::geometry_msgs::TwistStamped& stamped, const InputBlock&) {
  return values_of(stamped.twist);
}

Result<Values> sample_of(const dds::geometry_msgs::WrenchStamped& stamped, const InputBlock&) {
  const auto& force = stamped.wrench.force;
  const auto& torque = stamped.wrench.torque;
  return Values{force.x, force.y, force.z, torque.x, torque.y, torque.z};
}

/// Where the joints of the input stand in the message. Error: it has others, or lacks one.
Result<std::vector<std::size_t>> order_of(const dds::trajectory_msgs::JointTrajectory& message,
                                          const InputBlock& input) {
  const std::size_t joints = input.components.size();
  if (message.joint_names._length != joints) {
    return fail_at(
        "joint_names",
        fmt::format("{} joints are not the {} of the input", message.joint_names._length, joints),
        "name each of them, in any order");
  }
  std::vector<std::size_t> order(joints, joints);
  for (std::size_t i = 0; i < joints; ++i) {
    const auto found = std::ranges::find(input.components, message.joint_names._buffer[i]);
    const auto joint = static_cast<std::size_t>(found - input.components.begin());
    if (joint == joints || order[joint] != joints) {
      return fail_at("joint_names", "has a joint twice, or one that the input has not",
                     "name each of the input's, in any order");
    }
    order[joint] = i;
  }
  return order;
}

/// It begins when it arrives, whatever its stamp says. No points: the joints stay.
Result<Values> sample_of(const dds::trajectory_msgs::JointTrajectory& message,
                         const InputBlock& input) {
  const std::size_t joints = input.components.size();
  Values sample(input.values(), 0.0);
  const std::size_t points = message.points._length;
  if (points == 0) return sample;
  if (points > input.options.most_points) {
    return fail_at("points", fmt::format("{} way-points are too many", points),
                   fmt::format("at most {}", input.options.most_points));
  }
  const auto order = order_of(message, input);
  if (!order) return std::unexpected(order.error());
  const bool moves = message.points._buffer[0].velocities._length > 0;
  sample[0] = static_cast<double>(points);
  sample[1] = moves ? 1.0 : 0.0;
  for (std::size_t p = 0; p < points; ++p) {
    const auto& point = message.points._buffer[p];
    if (point.positions._length != joints || point.velocities._length != (moves ? joints : 0)) {
      return fail_at("points", fmt::format("way-point {} has not a number of each joint", p + 1),
                     "positions of each joint; velocities of each in all points, or in none");
    }
    const std::size_t at = 2 + p * (1 + 2 * joints);
    const auto& after = point.time_from_start;
    sample[at] = static_cast<double>(after.sec) + kPerNs * static_cast<double>(after.nanosec);
    for (std::size_t j = 0; j < joints; ++j) {
      sample[at + 1 + j] = point.positions._buffer[(*order)[j]];
      if (moves) sample[at + 1 + joints + j] = point.velocities._buffer[(*order)[j]];
    }
  }
  return sample;
}

}  // namespace

class InputTopics::Feed {
 public:
  virtual ~Feed() = default;
  /// Offers every sample that waits.
  virtual void take() = 0;
  [[nodiscard]] virtual dds_entity_t reader() const = 0;
};

namespace {

template <class Message>
class TopicFeed final : public InputTopics::Feed {
 public:
  TopicFeed(std::shared_ptr<runtime::InputPort> port, dds::Reader<Message> reader,
            runtime::RunServices& services, ControlRegistry::Gate gate,
            const DdsAdmission& admission)
      : port_(std::move(port)),
        reader_(std::move(reader)),
        services_(&services),
        gate_(std::move(gate)),
        admission_(&admission) {}

  [[nodiscard]] dds_entity_t reader() const override { return reader_.endpoint().get(); }

  void take() override {
    reader_.take([this](const Message& message, const dds_sample_info_t& info) {
      if (const Status may = check_writer(info.publication_handle); !may) {
        return port_->refuse(may.error());
      }
      const auto sample = sample_of(message, port_->input());
      if (!sample) return port_->refuse(sample.error());
      (void)port_->offer(runtime::InputFeeder::kTopic, *sample);
    });
  }

 private:
  /// Who was admitted stays so, as far as the gate lets anybody through.
  Status check_writer(dds_instance_handle_t writer) {
    if (const Status runs = services_->check_runs(*port_); !runs) return runs;
    if (gate_) {
      const Status open = gate_("input.set", ControlEffect::kChanges, Json::object());
      if (!open) return open;
    }
    if (!admission_->admits(dds::participant_of(reader(), writer))) {
      return fail("its writer is a stranger",
                  "[remote] trust = \"domain\", or `tandem ask` with dds.admit: docs/security.md");
    }
    const auto now = SteadyClock::now();
    const std::chrono::duration<double> timeout(port_->input().options.timeout_s);
    const auto silence = std::max<std::chrono::duration<double>>(timeout, kLeastSilence);
    if (writer_ != 0 && writer != writer_ && now - heard_ < silence) {
      return fail("another node feeds it", "one at a time; stop the other one first");
    }
    writer_ = writer;
    heard_ = now;
    return {};
  }

  std::shared_ptr<runtime::InputPort> port_;
  dds::Reader<Message> reader_;
  runtime::RunServices* services_;
  ControlRegistry::Gate gate_;
  const DdsAdmission* admission_;
  dds_instance_handle_t writer_ = 0;  // who feeds; 0: nobody yet
  SteadyClock::time_point heard_;
};

/// The DDS topic of a ROS 2 name: "/cmd_vel" has its namespace already.
std::string dds_topic(const dds::Participant& participant, const std::string& name) {
  return name.starts_with('/') ? "rt" + name : participant.topic_name(name);
}

struct Parts {
  dds::Participant& participant;
  runtime::RunServices& services;
  ControlRegistry::Gate gate;
  const DdsAdmission& admission;
};

template <class Message>
Result<std::unique_ptr<InputTopics::Feed>> feed_of(const std::shared_ptr<runtime::InputPort>& port,
                                                   const Parts& parts) {
  // Best effort: the newest counts, and every writer matches.
  auto reader = dds::Reader<Message>::create(parts.participant,
                                             dds_topic(parts.participant, port->source().topic),
                                             {.reliable = false, .depth = 16});
  if (!reader) return std::unexpected(reader.error());
  return std::make_unique<TopicFeed<Message>>(port, std::move(*reader), parts.services, parts.gate,
                                              parts.admission);
}

Result<std::unique_ptr<InputTopics::Feed>> make_feed(
    const std::shared_ptr<runtime::InputPort>& port, const Parts& parts) {
  using namespace dds;
  const std::string& type = port->source().type;
  if (type == "geometry_msgs/msg/Twist") return feed_of<geometry_msgs::Twist>(port, parts);
  if (type == "geometry_msgs/msg/TwistStamped") {
    return feed_of<geometry_msgs::TwistStamped>(port, parts);
  }
  if (type == "geometry_msgs/msg/WrenchStamped") {
    return feed_of<geometry_msgs::WrenchStamped>(port, parts);
  }
  if (type == "trajectory_msgs/msg/JointTrajectory") {
    return feed_of<trajectory_msgs::JointTrajectory>(port, parts);
  }
  return fail("no reader of the type " + type);
}

}  // namespace

Result<std::unique_ptr<InputTopics>> InputTopics::open(dds::Participant* participant,
                                                       runtime::RunServices& services,
                                                       ControlRegistry::Gate gate,
                                                       const DdsAdmission& admission) {
  const auto ports = services.inputs_of(runtime::InputFeeder::kTopic);
  if (ports.empty()) return nullptr;
  if (participant == nullptr) {
    Error error = ports.front()->source().where;
    error.message = "a topic feeds it, and the run is not on DDS";
    error.hint = "add [dds], or --dds";
    return std::unexpected(std::move(error));
  }
  if (const Status open = gate("input.set", ControlEffect::kChanges, Json::object()); !open) {
    Error error = ports.front()->source().where;
    error.message = "a topic feeds it, and " + open.error().message;
    error.hint = "[remote] command = \"local\", or \"network\"";
    return std::unexpected(std::move(error));
  }
  std::unique_ptr<InputTopics> topics(new InputTopics);
  topics->wake_ = dds::Entity(dds_create_guardcondition(participant->get()));
  topics->waitset_ = dds::Entity(dds_create_waitset(participant->get()));
  if (!topics->wake_.ok() || !topics->waitset_.ok()) {
    return std::unexpected(dds::dds_error("make a waitset", topics->waitset_.get()));
  }
  dds_waitset_attach(topics->waitset_.get(), topics->wake_.get(), 0);
  const Parts parts{*participant, services, std::move(gate), admission};
  for (const auto& port : ports) {
    auto feed = make_feed(port, parts);
    if (!feed) return std::unexpected(feed.error());
    dds_set_status_mask((*feed)->reader(), DDS_DATA_AVAILABLE_STATUS);
    dds_waitset_attach(topics->waitset_.get(), (*feed)->reader(), 0);
    topics->feeds_.push_back(std::move(*feed));
  }
  topics->thread_ = std::thread([&one = *topics] { one.take(); });
  return topics;
}

InputTopics::~InputTopics() {
  ending_ = true;
  if (wake_.ok()) dds_set_guardcondition(wake_.get(), true);
  if (thread_.joinable()) thread_.join();
}

void InputTopics::take() {
  while (!ending_) {
    (void)dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_MSECS(500));
    for (const auto& feed : feeds_) feed->take();
  }
}

}  // namespace tandem::apps
