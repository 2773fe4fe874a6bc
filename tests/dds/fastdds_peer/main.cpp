// A peer that shares nothing with Tandem but the IDL: Fast DDS, with types of fastddsgen.
//   fastdds_peer DOMAIN [hear|say|flood|huge QOS TYPE TOPIC]…
// QOS: reliable, best_effort, latched (reliable, transient local). It says its pattern on each
// `say` topic ten times a second, and prints a line for each sample of a `hear` topic: its name,
// "pattern" or "other", and the number of values. On a `flood` topic it says texts of 60 kB, which
// begin with their number, as fast as it can; on a `huge` one texts of 32 MB at times. It ends when
// its standard input does.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pattern.hpp"
#include "ros2PubSubTypes.h"

namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// As the profile says that FASTRTPS_DEFAULT_PROFILES_FILE names.
fdds::DomainParticipant* join(unsigned domain) {
  auto* factory = fdds::DomainParticipantFactory::get_instance();
  factory->load_profiles();
  return factory->create_participant(domain, fdds::PARTICIPANT_QOS_DEFAULT);
}

template <class Qos>
Qos with(Qos qos, const std::string& name) {
  qos.reliability().kind =
      name == "best_effort" ? fdds::BEST_EFFORT_RELIABILITY_QOS : fdds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind =
      name == "latched" ? fdds::TRANSIENT_LOCAL_DURABILITY_QOS : fdds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fdds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 10;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return qos;
}

/// What the peer does with one topic.
struct Part {
  virtual ~Part() = default;
  virtual void say() {}
  [[nodiscard]] virtual bool pauses() const { return true; }
};

template <class T>
class Speaker : public Part {
 public:
  explicit Speaker(fdds::DataWriter* writer) : writer_(writer) {
    peer::Fill fill;
    peer::visit(sample_, fill);
  }
  void say() override { writer_->write(&sample_); }

 private:
  fdds::DataWriter* writer_;
  T sample_;
};

class Flooder : public Part {
 public:
  Flooder(fdds::DataWriter* writer, std::size_t characters, int at_once)
      : writer_(writer), filler_(characters, ' '), at_once_(at_once) {}
  void say() override {
    for (int i = 0; i < at_once_; ++i) {
      sample_.data(std::to_string(++number_) + filler_);
      writer_->write(&sample_);
    }
  }
  [[nodiscard]] bool pauses() const override { return at_once_ == 1; }

 private:
  fdds::DataWriter* writer_;
  std::string filler_;
  int at_once_;
  std_msgs::msg::dds_::String_ sample_;
  unsigned number_ = 0;
};

template <class T>
class Hearer : public Part, public fdds::DataReaderListener {
 public:
  explicit Hearer(std::string topic) : topic_(std::move(topic)) {}

  void on_data_available(fdds::DataReader* reader) override {
    fdds::SampleInfo info;
    while (reader->take_next_sample(&sample_, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      peer::Check check;
      peer::visit(sample_, check);
      std::printf("%s %s %llu\n", topic_.c_str(), check.same() ? "pattern" : "other",
                  static_cast<unsigned long long>(check.leaves()));
      std::fflush(stdout);
    }
  }

 private:
  std::string topic_;
  T sample_;
};

using Make = std::function<std::unique_ptr<Part>(fdds::DomainParticipant&, const std::string& verb,
                                                 const std::string& qos, const std::string& topic)>;

template <class T, class Support>
std::unique_ptr<Part> make(fdds::DomainParticipant& participant, const std::string& verb,
                           const std::string& qos, const std::string& topic) {
  const fdds::TypeSupport type(new Support);
  type.register_type(&participant);
  auto* description = participant.lookup_topicdescription(topic);
  if (description == nullptr) {
    description = participant.create_topic(topic, type.get_type_name(), fdds::TOPIC_QOS_DEFAULT);
  }
  if (verb != "hear") {
    auto* writer = participant.create_publisher(fdds::PUBLISHER_QOS_DEFAULT)
                       ->create_datawriter(static_cast<fdds::Topic*>(description),
                                           with(fdds::DATAWRITER_QOS_DEFAULT, qos));
    if (verb == "flood") return std::make_unique<Flooder>(writer, 60'000, 100);
    if (verb == "huge") return std::make_unique<Flooder>(writer, 32'000'000, 1);
    return std::make_unique<Speaker<T>>(writer);
  }
  auto hearer = std::make_unique<Hearer<T>>(topic);
  participant.create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT)
      ->create_datareader(description, with(fdds::DATAREADER_QOS_DEFAULT, qos), hearer.get());
  return hearer;
}

// A structure of fastddsgen with the name of its support class.
#define KIND(package, kind, Name)     \
  std::pair<const std::string, Make>( \
      #package "/" #kind "/" #Name,   \
      &make<package::kind::dds_::Name##_, package::kind::dds_::Name##_##PubSubType>)
#define TYPE(package, Name) KIND(package, msg, Name)

const std::map<std::string, Make>& types() {
  static const std::map<std::string, Make> table{
      TYPE(std_msgs, String),
      TYPE(std_msgs, Float64MultiArray),
      TYPE(rosgraph_msgs, Clock),
      TYPE(rcl_interfaces, Log),
      TYPE(rcl_interfaces, ParameterEvent),
      TYPE(geometry_msgs, PoseStamped),
      TYPE(geometry_msgs, Twist),
      TYPE(geometry_msgs, TwistStamped),
      TYPE(trajectory_msgs, JointTrajectory),
      TYPE(geometry_msgs, WrenchStamped),
      TYPE(sensor_msgs, JointState),
      TYPE(sensor_msgs, Imu),
      TYPE(sensor_msgs, Joy),
      TYPE(tf2_msgs, TFMessage),
      TYPE(visualization_msgs, MarkerArray),
      TYPE(nav_msgs, Odometry),
      TYPE(diagnostic_msgs, DiagnosticArray),
      TYPE(control_msgs, DynamicJointState),
      TYPE(action_msgs, GoalStatusArray),
      KIND(control_msgs, action, FollowJointTrajectory_FeedbackMessage),
      TYPE(pal_statistics_msgs, Statistics),
      TYPE(pal_statistics_msgs, StatisticsNames),
      TYPE(pal_statistics_msgs, StatisticsValues),
      TYPE(rmw_dds_common, ParticipantEntitiesInfo),
      KIND(std_srvs, srv, Trigger_Request),
      KIND(std_srvs, srv, Trigger_Response),
  };
  return table;
}

/// @return whether the standard input has ended
bool ended(int wait_ms) {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  char byte;
  return poll(&input, 1, wait_ms) > 0 && read(STDIN_FILENO, &byte, 1) <= 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  auto* participant = join(static_cast<unsigned>(std::stoul(argv[1])));
  if (participant == nullptr) return 1;
  std::vector<std::unique_ptr<Part>> parts;
  for (int i = 2; i + 3 < argc; i += 4) {
    const auto type = types().find(argv[i + 2]);
    if (type == types().end()) {
      std::fprintf(stderr, "no type %s\n", argv[i + 2]);
      return 2;
    }
    parts.push_back(type->second(*participant, argv[i], argv[i + 1], argv[i + 3]));
  }
  const bool pauses =
      std::all_of(parts.begin(), parts.end(), [](const auto& part) { return part->pauses(); });
  while (!ended(pauses ? 100 : 0)) {
    for (const auto& part : parts) part->say();
  }
  participant->delete_contained_entities();  // before the parts: their listeners
  fdds::DomainParticipantFactory::get_instance()->delete_participant(participant);
}
