// Clients of services as rmw_fastrtps_cpp makes them, and topics. It shares nothing with Tandem.
//   fastdds_caller DOMAIN [SERVICE TYPE]… [hear|latched|tell TOPIC TYPE]…
// SERVICE: "/tandem/ask", TYPE: "tandem_msgs/srv/Ask". Each has one client, in the arguments'
// order. A service may be named more than once. Input, a line each:
//   I HEX    client I sends this payload, the encoding's four bytes in front
//   drop I   client I goes away
//   T HEX    says this on the topic T, which begins with a slash
// Output, a line each:
//   participant HEX   GUID prefix
//   I ready           both ends are connected, as rmw_service_server_is_available() wants
//   I sent N          the request's sequence number
//   I reply N HEX     that is client I's own
//   I other           a reply to somebody else, which rmw_fastrtps_cpp ignores
//   T heard HEX       T: the topic
// It ends when its input does.
#include <poll.h>
#include <unistd.h>

#include <fastdds/rtps/common/WriteParams.h>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = std::vector<std::uint8_t>;

std::mutex printing;

template <class... T>
void print(const char* format, T... values) {
  const std::scoped_lock lock(printing);
  std::printf(format, values...);
  std::putchar('\n');
  std::fflush(stdout);
}

std::string hex(const std::uint8_t* bytes, std::size_t count) {
  std::string out;
  char two[3];
  for (std::size_t i = 0; i < count; ++i) {
    std::snprintf(two, sizeof two, "%02x", bytes[i]);
    out += two;
  }
  return out;
}

Bytes from_hex(const std::string& text) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    out.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return out;
}

/// "std_srvs/srv/Trigger" and "_Request": "std_srvs::srv::dds_::Trigger_Request_"
std::string dds_name(const std::string& type, const std::string& part) {
  const std::size_t one = type.find('/'), two = type.rfind('/');
  return type.substr(0, one) + "::" + type.substr(one + 1, two - one - 1) +
         "::dds_::" + type.substr(two + 1) + part + "_";
}

/// A type whose samples are their own bytes, as rmw_fastrtps_cpp serialises by itself.
class RawType : public fdds::TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 64;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

fdds::Topic* topic_of(fdds::DomainParticipant& participant, const std::string& name,
                      const std::string& type_name) {
  if (auto* known = participant.lookup_topicdescription(name)) {
    return static_cast<fdds::Topic*>(known);
  }
  const fdds::TypeSupport type(new RawType(type_name));
  type.register_type(&participant);
  return participant.create_topic(name, type_name, fdds::TOPIC_QOS_DEFAULT);
}

template <class Qos>
Qos of_services(Qos qos) {
  qos.reliability().kind = fdds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = fdds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fdds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = 10;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  return qos;
}

struct Client : fdds::DataReaderListener {
  Client(int index, fdds::DomainParticipant& participant, const std::string& service,
         const std::string& type)
      : index_(index), participant_(&participant) {
    publisher_ = participant.create_publisher(fdds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant.create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT);
    auto* replies = topic_of(participant, "rr" + service + "Reply", dds_name(type, "_Response"));
    auto* requests = topic_of(participant, "rq" + service + "Request", dds_name(type, "_Request"));
    reader_ =
        subscriber_->create_datareader(replies, of_services(fdds::DATAREADER_QOS_DEFAULT), this);
    writer_ = publisher_->create_datawriter(requests, of_services(fdds::DATAWRITER_QOS_DEFAULT));
  }
  void drop() {
    publisher_->delete_datawriter(writer_);
    subscriber_->delete_datareader(reader_);
    writer_ = nullptr;
  }
  void look() {
    if (ready_ || writer_ == nullptr) return;
    fdds::PublicationMatchedStatus servers;
    fdds::SubscriptionMatchedStatus repliers;
    writer_->get_publication_matched_status(servers);
    reader_->get_subscription_matched_status(repliers);
    ready_ = servers.current_count > 0 && servers.current_count == repliers.current_count;
    if (ready_) print("%d ready", index_);
  }
  /// __rmw_send_request()
  void send(Bytes payload) {
    if (writer_ == nullptr) return;
    rtps::WriteParams params;
    params.related_sample_identity().writer_guid() = reader_->guid();
    writer_->write(&payload, params);
    print("%d sent %llu", index_,
          static_cast<unsigned long long>(params.sample_identity().sequence_number().to64long()));
  }
  /// __rmw_take_response()
  void on_data_available(fdds::DataReader* reader) override {
    Bytes payload;
    fdds::SampleInfo info;
    while (reader->take_next_sample(&payload, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      const auto& who = info.related_sample_identity.writer_guid();
      if (who != reader->guid() && (writer_ == nullptr || who != writer_->guid())) {
        print("%d other", index_);
        continue;
      }
      print("%d reply %llu %s", index_,
            static_cast<unsigned long long>(
                info.related_sample_identity.sequence_number().to64long()),
            hex(payload.data(), payload.size()).c_str());
    }
  }

 private:
  int index_;
  fdds::DomainParticipant* participant_;
  fdds::Publisher* publisher_;
  fdds::Subscriber* subscriber_;
  fdds::DataReader* reader_ = nullptr;
  fdds::DataWriter* writer_ = nullptr;
  bool ready_ = false;
};

struct Teller {
  Teller(fdds::DomainParticipant& participant, const std::string& topic, const std::string& type)
      : writer_(participant.create_publisher(fdds::PUBLISHER_QOS_DEFAULT)
                    ->create_datawriter(topic_of(participant, "rt" + topic, dds_name(type, "")),
                                        of_services(fdds::DATAWRITER_QOS_DEFAULT))) {}
  void send(Bytes payload) { writer_->write(&payload); }

 private:
  fdds::DataWriter* writer_;
};

struct Hearer : fdds::DataReaderListener {
  Hearer(fdds::DomainParticipant& participant, std::string topic, const std::string& type,
         bool latched)
      : name_(std::move(topic)) {
    fdds::DataReaderQos qos = of_services(fdds::DATAREADER_QOS_DEFAULT);
    if (latched) qos.durability().kind = fdds::TRANSIENT_LOCAL_DURABILITY_QOS;
    participant.create_subscriber(fdds::SUBSCRIBER_QOS_DEFAULT)
        ->create_datareader(topic_of(participant, "rt" + name_, dds_name(type, "")), qos, this);
  }
  void on_data_available(fdds::DataReader* reader) override {
    Bytes payload;
    fdds::SampleInfo info;
    while (reader->take_next_sample(&payload, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) {
        print("%s heard %s", name_.c_str(), hex(payload.data(), payload.size()).c_str());
      }
    }
  }

 private:
  std::string name_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  auto* factory = fdds::DomainParticipantFactory::get_instance();
  factory->load_profiles();
  auto* participant = factory->create_participant(static_cast<unsigned>(std::stoul(argv[1])),
                                                  fdds::PARTICIPANT_QOS_DEFAULT);
  if (participant == nullptr) return 1;
  print("participant %s", hex(participant->guid().guidPrefix.value, 12).c_str());
  std::vector<std::unique_ptr<Client>> clients;
  std::vector<std::unique_ptr<Hearer>> hearers;
  std::map<std::string, Teller> tellers;
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string word = argv[i];
    if (word == "tell") {
      if (++i + 1 >= argc) return 2;
      tellers.emplace(argv[i], Teller(*participant, argv[i], argv[i + 1]));
    } else if (word == "hear" || word == "latched") {
      if (++i + 1 >= argc) return 2;
      hearers.push_back(
          std::make_unique<Hearer>(*participant, argv[i], argv[i + 1], word == "latched"));
    } else {
      clients.push_back(std::make_unique<Client>(static_cast<int>(clients.size()), *participant,
                                                 word, argv[i + 1]));
    }
  }
  std::string pending;
  for (;;) {
    for (const auto& one : clients) one->look();
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    if (poll(&input, 1, 5) <= 0) continue;
    char some[4096];
    const ssize_t size = read(STDIN_FILENO, some, sizeof some);
    if (size <= 0) break;
    pending.append(some, static_cast<std::size_t>(size));
    for (std::size_t end; (end = pending.find('\n')) != std::string::npos;) {
      const std::string line = pending.substr(0, end);
      pending.erase(0, end + 1);
      const std::size_t blank = line.find(' ');
      const std::string first = line.substr(0, blank), rest = line.substr(blank + 1);
      if (first == "drop") {
        clients.at(std::stoul(rest))->drop();
      } else if (first.front() == '/') {
        tellers.at(first).send(from_hex(rest));
      } else {
        clients.at(std::stoul(first))->send(from_hex(rest));
      }
    }
  }
  participant->delete_contained_entities();
  factory->delete_participant(participant);
}
