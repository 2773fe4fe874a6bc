// Finds the one server of a service, sends a request with a number, and waits for its reply among
// those of other clients.
#include "dds/service_client.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <thread>

namespace tandem::dds {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// How often a server is looked for, or after.
constexpr std::chrono::milliseconds kLookAgain{5};
/// How long a request to every server waits for the others, once one is connected.
constexpr std::chrono::milliseconds kOthers{300};
/// A request to every server is sent again so often: others may have pushed it out.
constexpr std::chrono::milliseconds kAgain{500};

/// "left" of the topic "rq/left/tandem/askRequest" of `service`; false: it is another's.
bool is_topic_of(std::string_view topic, const std::string& service, std::string& name_space) {
  const std::string end = service + "Request";
  if (!topic.starts_with("rq/") || !topic.ends_with(end)) return false;
  topic.remove_prefix(3);
  topic.remove_suffix(end.size());
  if (!topic.empty() && !topic.ends_with('/')) return false;
  name_space = topic.substr(0, topic.empty() ? 0 : topic.size() - 1);
  return true;
}

std::string user_data_of(const dds_builtintopic_endpoint_t& endpoint) {
  void* bytes = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint.qos, &bytes, &size) || bytes == nullptr) return {};
  std::string text(static_cast<const char*>(bytes), size);
  dds_free(bytes);
  return text;
}

/// Without its namespace.
FoundService service_of(const Peer& server) {
  ParticipantId participant{};
  std::copy_n(server.participant.v, participant.size(), participant.begin());
  return {.name_space = {},
          .node = user_data_value(server.user_data, "node"),
          .pid = user_data_value(server.user_data, "pid"),
          .participant = participant};
}

}  // namespace

Result<ServiceFinder> ServiceFinder::create(Participant& participant) {
  Entity reader(
      dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr));
  if (!reader.ok()) return std::unexpected(dds_error("look for services", reader.get()));
  return ServiceFinder(std::move(reader));
}

std::vector<FoundService> ServiceFinder::find(const std::string& service) const {
  constexpr std::size_t kMost = 4096;  // endpoints in a domain
  std::vector<void*> samples(kMost, nullptr);
  std::vector<dds_sample_info_t> infos(kMost);
  const dds_return_t count = dds_read(reader_.get(), samples.data(), infos.data(), kMost, kMost);
  std::vector<FoundService> found;
  for (std::size_t i = 0; count > 0 && i < static_cast<std::size_t>(count); ++i) {
    const auto* endpoint = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    if (!infos[i].valid_data || infos[i].instance_state != DDS_IST_ALIVE) continue;
    FoundService one;
    if (!is_topic_of(endpoint->topic_name, service, one.name_space)) continue;
    const std::string user_data = user_data_of(*endpoint);
    one.node = user_data_value(user_data, "node");
    one.pid = user_data_value(user_data, "pid");
    found.push_back(std::move(one));
  }
  if (count > 0) dds_return_loan(reader_.get(), samples.data(), count);
  return found;
}

ServiceClientBase::ServiceClientBase(std::string name, Endpoint requests, Endpoint replies,
                                     Entity waiting, Entity waitset)
    : name_(std::move(name)),
      requests_(std::move(requests)),
      replies_(std::move(replies)),
      waiting_(std::move(waiting)),
      waitset_(std::move(waitset)) {
  dds_instance_handle_t handle = 0;
  dds_get_instance_handle(requests_.get(), &handle);
  guid_ = handle;
  dds_waitset_attach(waitset_.get(), waiting_.get(), 0);
}

Result<ServiceClientBase> ServiceClientBase::create(Participant& participant,
                                                    const std::string& service, const Type& request,
                                                    const Type& response) {
  // Replies to all clients of a service come to each of them: with ROS 2's 10, those to others push
  // ours out when this thread is slow.
  constexpr std::int32_t kDepth = 256;
  const Qos qos = service_qos(kDepth, fmt::format("clientid={};", new_service_id(participant)));
  auto replies = Endpoint::create(Endpoint::Kind::kReader, participant, response,
                                  reply_topic(participant, service), qos);
  if (!replies) return std::unexpected(replies.error());
  auto requests = Endpoint::create(Endpoint::Kind::kWriter, participant, request,
                                   request_topic(participant, service), qos);
  if (!requests) return std::unexpected(requests.error());
  Entity waiting(dds_create_readcondition(replies->get(), DDS_ANY_STATE));
  Entity waitset(dds_create_waitset(participant.get()));
  if (!waiting.ok() || !waitset.ok()) {
    return std::unexpected(dds_error("wait for replies", waitset.get()));
  }
  const std::string name = fmt::format("{} in the DDS domain {}", full_name(participant, service),
                                       participant.config().domain);
  return ServiceClientBase(name, std::move(*requests), std::move(*replies), std::move(waiting),
                           std::move(waitset));
}

std::size_t ServiceClientBase::servers() const { return requests_.matched(); }

/// The servers that both topics lead to, who can so answer: their replies' writers.
std::vector<Peer> ServiceClientBase::connected() const {
  const std::vector<Peer> readers = matched_readers(requests_.get());
  std::vector<Peer> servers = matched_writers(replies_.get());
  std::erase_if(servers, [&readers](const Peer& writer) {
    return std::ranges::none_of(readers, [&writer](const Peer& reader) {
      return belong_together(reader, writer, "serviceid");
    });
  });
  return servers;
}

Status ServiceClientBase::find_server(Deadline deadline) const {
  while (connected().empty()) {
    if (SteadyClock::now() > deadline) {
      return fail("no process serves " + name_,
                  "start one: tandem run EXPERIMENT --dds; is it in this domain and namespace?");
    }
    std::this_thread::sleep_for(kLookAgain);
  }
  return {};
}

Result<ServiceHeader> ServiceClientBase::send(void* request) {
  const ServiceHeader header{guid_, ++sequence_};
  std::memcpy(request, &header, sizeof header);
  const dds_return_t sent = dds_write(requests_.get(), request);
  if (sent != DDS_RETCODE_OK) return std::unexpected(dds_error("ask " + name_, sent));
  return header;
}

Error ServiceClientBase::no_answer(Patience patience) const {
  return {.message = fmt::format("no answer within {:g} s from {}",
                                 std::chrono::duration<double>(patience).count(), name_),
          .hint = "is the process stopped, or very busy?",
          .file = {},
          .key = {}};
}

Status ServiceClientBase::call(void* request, Patience patience, const Use& use) {
  const Deadline deadline = SteadyClock::now() + patience;
  if (Status found = find_server(deadline); !found) return found;
  if (servers() != 1) {
    return fail(fmt::format("{} processes serve {}", servers(), name_),
                "give each its own domain or namespace: [dds] of the experiment");
  }
  const Result<ServiceHeader> header = send(request);
  if (!header) return std::unexpected(header.error());
  for (;;) {
    bool found = false;
    take(*header, [&](const void* reply, dds_instance_handle_t) {
      if (!found) use(reply);
      found = true;
    });
    if (found) return {};
    if (SteadyClock::now() > deadline) return std::unexpected(no_answer(patience));
    if (servers() == 0) {
      return fail("who serves " + name_ + " went away before it answered",
                  "look at what it printed");
    }
    dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_MSECS(20));
  }
}

Result<std::vector<FoundService>> ServiceClientBase::call_each(void* request, Patience patience,
                                                               const UseOfEach& use) {
  const Deadline deadline = SteadyClock::now() + patience;
  if (Status found = find_server(deadline); !found) return std::unexpected(found.error());
  // The other servers of the same name are connected by themselves, but not at the same moment. One
  // that cannot reply must not hold up the request to those that can.
  const Deadline all = std::min(deadline, SteadyClock::now() + kOthers);
  while (connected().size() < servers() && SteadyClock::now() < all) {
    std::this_thread::sleep_for(kLookAgain);
  }
  const auto same = [](const Peer& one, const Peer& other) {
    return belong_together(one, other, "serviceid");
  };
  std::vector<Peer> silent = matched_readers(requests_.get());
  const Result<ServiceHeader> header = send(request);
  if (!header) return std::unexpected(header.error());
  Deadline again = SteadyClock::now() + kAgain;
  std::vector<dds_instance_handle_t> heard;  // each once, however often it was asked
  for (;;) {
    take(*header, [&](const void* reply, dds_instance_handle_t writer) {
      if (std::ranges::find(heard, writer) != heard.end()) return;
      heard.push_back(writer);
      const std::optional<Peer> from = matched_writer(replies_.get(), writer);
      if (!from) return use(reply, {});
      std::erase_if(silent, [&](const Peer& one) { return same(one, *from); });
      use(reply, service_of(*from));
    });
    if (silent.empty() || SteadyClock::now() > deadline) break;
    if (SteadyClock::now() > again) {
      (void)dds_write(requests_.get(), request);
      again += kAgain;
    }
    dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_MSECS(20));
  }
  std::vector<FoundService> left;
  for (const Peer& one : silent) left.push_back(service_of(one));
  return left;
}

void ServiceClientBase::take(const ServiceHeader& header, const UseSample& use) {
  for (;;) {
    std::array<void*, 1> sample{};
    std::array<dds_sample_info_t, 1> info{};
    const dds_return_t taken = dds_take(replies_.get(), sample.data(), info.data(), 1, 1);
    if (taken <= 0) return;
    ServiceHeader got{};
    if (info[0].valid_data) std::memcpy(&got, sample[0], sizeof got);
    if (info[0].valid_data && got.guid == header.guid && got.sequence == header.sequence) {
      use(sample[0], info[0].publication_handle);
    } else if (info[0].valid_data) {
      ++ignored_;
    }
    dds_return_loan(replies_.get(), sample.data(), taken);
  }
}

}  // namespace tandem::dds
