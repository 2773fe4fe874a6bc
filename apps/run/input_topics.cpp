#include "apps/run/input_topics.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "apps/run/trajectory_action.hpp"
#include "dds/endpoint.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kKept = 16;  // samples that wait to be looked at

/// The DDS topic of a ROS 2 name: "/cmd_vel" has its namespace already.
std::string dds_topic(const dds::Participant& participant, const std::string& name) {
  return name.starts_with('/') ? "rt" + name : participant.topic_name(name);
}

}  // namespace

class InputTopics::Feed {
 public:
  /// Rings `rung` for each sample that comes.
  static Result<std::unique_ptr<Feed>> open(std::shared_ptr<runtime::InputPort> port,
                                            const FeedParts& parts,
                                            std::shared_ptr<InputLease> lease,
                                            std::atomic<std::uint64_t>& rung) {
    const dds::Type& type = port->messages().type();
    // Best effort: the newest counts, and every writer matches.
    auto reader = dds::Endpoint::create(dds::EndpointKind::kReader, parts.participant, type,
                                        dds_topic(parts.participant, port->source().topic),
                                        {.reliable = false, .depth = kKept});
    if (!reader) return std::unexpected(reader.error());
    std::unique_ptr<Feed> feed(
        new Feed(std::move(port), std::move(*reader), std::move(lease), rung));
    dds_listener_t* listener = dds_create_listener(feed.get());
    dds_lset_data_available(listener,
                            [](dds_entity_t, void* its) { static_cast<Feed*>(its)->hear(); });
    const dds_return_t set = dds_set_listener(feed->reader_.get(), listener);
    dds_delete_listener(listener);
    if (set != DDS_RETCODE_OK) return std::unexpected(dds::dds_error("set a listener", set));
    return feed;
  }
  ~Feed() { dds_set_listener(reader_.get(), nullptr); }
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  /// Offers every sample that waits: as many as a reader keeps, so that a flood holds up no other
  /// feed.
  void take() {
    if (auto heir = port_->heir()) port_ = std::move(heir);  // its controller was reloaded
    const std::uint64_t heard = heard_.load();
    std::array<void*, kKept> samples{};  // null: they are lent
    std::array<dds_sample_info_t, kKept> infos{};
    const dds_return_t taken = dds_take(reader_.get(), samples.data(), infos.data(), kKept, kKept);
    Status may;
    dds_instance_handle_t asked = 0;  // whether this writer may: once for the samples at hand
    for (std::size_t i = 0; taken > 0 && i < static_cast<std::size_t>(taken); ++i) {
      if (!infos[i].valid_data) continue;
      const dds_instance_handle_t writer = infos[i].publication_handle;
      if (writer != std::exchange(asked, writer)) {
        may = lease_->take(*port_, dds::participant_of(reader_.get(), writer), writer);
      }
      if (!may) {
        port_->refuse(may.error());
      } else {
        offer(samples[i]);
      }
    }
    if (taken > 0) {
      dds_return_loan(reader_.get(), samples.data(), taken);
      looked_at_ += static_cast<std::uint64_t>(taken);
    }
    // What was heard before dds_take() and is not here now made room for newer ones.
    if (heard <= looked_at_) return;
    port_->pass_over(heard - looked_at_);
    looked_at_ = heard;
  }

 private:
  Feed(std::shared_ptr<runtime::InputPort> port, dds::Endpoint reader,
       std::shared_ptr<InputLease> lease, std::atomic<std::uint64_t>& rung)
      : port_(std::move(port)),
        lease_(std::move(lease)),
        rung_(&rung),
        reader_(std::move(reader)) {}

  void hear() {
    heard_.fetch_add(1);
    rung_->fetch_add(1);
    rung_->notify_one();
  }

  void offer(const void* message) {
    const auto sample = port_->messages().sample(message, port_->input(), port_->source());
    if (!sample) return port_->refuse(sample.error());
    (void)port_->offer(runtime::InputFeeder::kTopic, *sample);
  }

  std::shared_ptr<runtime::InputPort> port_;
  std::shared_ptr<InputLease> lease_;
  std::atomic<std::uint64_t> heard_{0};  // by the listener
  std::uint64_t looked_at_ = 0;          // or passed over
  std::atomic<std::uint64_t>* rung_;
  dds::Endpoint reader_;
};

Status topics_may_feed(std::span<const std::shared_ptr<runtime::InputPort>> inputs, bool on_dds,
                       const ControlRegistry::Gate& gate) {
  if (inputs.empty()) return {};
  Error error = inputs.front()->source().where;
  if (!on_dds) {
    error.message = "a topic feeds it, and the run is not on DDS";
    error.hint = "add [dds], or --dds";
    return std::unexpected(std::move(error));
  }
  const Status open = gate("input.set", ControlEffect::kChanges, Json::object());
  if (open) return {};
  error.message = "a topic feeds it, and " + open.error().message;
  error.hint = "[remote] command = \"local\", or \"network\"";
  return std::unexpected(std::move(error));
}

Result<std::unique_ptr<InputTopics>> InputTopics::open(dds::Participant* participant,
                                                       runtime::RunServices& services,
                                                       ControlRegistry::Gate gate,
                                                       const DdsAdmission& admission,
                                                       bool simulated_time) {
  const auto ports = services.inputs_of(runtime::InputFeeder::kTopic);
  if (ports.empty()) return nullptr;
  if (const Status may = topics_may_feed(ports, participant != nullptr, gate); !may)
    return std::unexpected(may.error());
  std::unique_ptr<InputTopics> topics(new InputTopics);
  const FeedParts parts{*participant, services, std::move(gate), admission, simulated_time};
  for (const auto& port : ports) {
    const auto lease = std::make_shared<InputLease>(parts);
    auto feed = Feed::open(port, parts, lease, topics->rung_);
    if (!feed) return std::unexpected(feed.error());
    topics->feeds_.push_back(std::move(*feed));
    if (port->source().action.empty()) continue;
    auto action = TrajectoryAction::open(port, parts, lease);
    if (!action) return std::unexpected(action.error());
    topics->actions_.push_back(std::move(*action));
  }
  topics->thread_ = std::thread([&one = *topics] { one.take(); });
  return topics;
}

InputTopics::~InputTopics() {
  ending_ = true;
  rung_.fetch_add(1);
  rung_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void InputTopics::take() {
  while (!ending_) {
    const std::uint64_t rung = rung_.load();
    for (const auto& feed : feeds_) feed->take();
    rung_.wait(rung);
  }
}

}  // namespace tandem::apps
