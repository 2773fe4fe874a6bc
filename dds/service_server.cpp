// One thread receives requests into bounded queues and does emergency stops at once, others work
// the queues off in order; replies wait for their reader to be discovered.
#include "dds/service_server.hpp"

#include <dds/ddsi/ddsi_serdata.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>

#include <fmt/core.h>

namespace tandem::dds {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Requests and replies that DDS keeps: more than ROS 2's 10, since all clients share them.
constexpr std::int32_t kDepth = 64;
/// How often the reader of a client that has just come is looked for.
constexpr dds_duration_t kTryAgain = DDS_MSECS(5);

}  // namespace

void* ReplyMemory::zeroed(std::size_t bytes) {
  constexpr std::size_t kBlock = sizeof(std::max_align_t);
  blocks_.push_back(std::make_unique<std::max_align_t[]>((bytes + kBlock - 1) / kBlock));
  return std::memset(blocks_.back().get(), 0, bytes);
}

char* ReplyMemory::text(std::string_view text) {
  char* copy = static_cast<char*>(zeroed(text.size() + 1));
  std::memcpy(copy, text.data(), text.size());
  return copy;
}

Result<std::unique_ptr<ServiceServer>> ServiceServer::open(Participant& participant) {
  std::unique_ptr<ServiceServer> server(new ServiceServer(participant));
  server->wake_ = Entity(dds_create_guardcondition(participant.get()));
  server->waitset_ = Entity(dds_create_waitset(participant.get()));
  if (!server->wake_.ok() || !server->waitset_.ok()) {
    return std::unexpected(dds_error("make a waitset", server->waitset_.get()));
  }
  dds_waitset_attach(server->waitset_.get(), server->wake_.get(), 0);
  return server;
}

Status ServiceServer::add(const std::string& name, const Type& request, const Type& response,
                          Read read) {
  const std::string id = new_service_id(*participant_);
  const Qos qos = service_qos(
      kDepth, fmt::format("serviceid={};node={};pid={};", id, participant_->node(), ::getpid()));
  const ddsi_sertype* layout = nullptr;
  const MakeTopic make = [&layout](dds_entity_t participant, const Type& type, const char* topic) {
    return create_service_topic(participant, type, topic, &layout);
  };
  // Replies first: who finds the service by its requests may ask at once.
  auto replies = Endpoint::create(Endpoint::Kind::kWriter, *participant_, response,
                                  reply_topic(*participant_, name), qos, make);
  if (!replies) return std::unexpected(replies.error());
  const ddsi_sertype* reply_layout = layout;
  auto requests = Endpoint::create(Endpoint::Kind::kReader, *participant_, request,
                                   request_topic(*participant_, name), qos, make);
  if (!requests) return std::unexpected(requests.error());
  Entity waiting(dds_create_readcondition(requests->get(), DDS_ANY_STATE));
  if (!waiting.ok()) return std::unexpected(dds_error("wait for requests", waiting.get()));
  services_.push_back(std::make_unique<Service>(
      Service{id, std::move(*requests), std::move(*replies), std::move(waiting), &request,
              &response, reply_layout, std::move(read)}));
  dds_waitset_attach(waitset_.get(), services_.back()->waiting.get(), 0);
  return {};
}

Status ServiceServer::start(bool only_at_once) {
  receiver_ = std::thread([this] { receive(); });
  if (only_at_once) return {};
  for (Turn& turn : turns_) turn.thread = std::thread([this, &turn] { work(turn); });
  return {};
}

ServiceServer::~ServiceServer() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  for (Turn& turn : turns_) turn.more.notify_all();
  dds_set_guardcondition(wake_.get(), true);
  if (receiver_.joinable()) receiver_.join();
  for (Turn& turn : turns_) {
    if (turn.thread.joinable()) turn.thread.join();
  }
}

ServiceServer::Counts ServiceServer::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

void ServiceServer::receive() {
  bool holding = false;
  for (;;) {
    dds_waitset_wait(waitset_.get(), nullptr, 0, holding ? kTryAgain : DDS_INFINITY);
    bool woken = false;
    dds_take_guardcondition(wake_.get(), &woken);
    const bool ending = ends();  // what has come by then is taken
    for (const auto& service : services_) take(*service);
    do_ready();
    holding = send_held();
    if (ending && !holding) return;
  }
}

bool ServiceServer::ends() const {
  const std::scoped_lock lock(mutex_);
  return ending_;
}

/// Some of a service's requests, so that the others get their turn.
void ServiceServer::take(Service& service) {
  constexpr std::uint32_t kBatch = 8;
  std::array<ddsi_serdata*, kBatch> requests{};
  std::array<dds_sample_info_t, kBatch> infos{};
  const dds_return_t taken =
      dds_takecdr(service.requests.get(), requests.data(), kBatch, infos.data(), DDS_ANY_STATE);
  for (std::size_t i = 0; i < static_cast<std::size_t>(std::max(taken, 0)); ++i) {
    if (infos[i].valid_data) take(service, requests[i], infos[i].publication_handle);
    ddsi_serdata_unref(requests[i]);
  }
}

void ServiceServer::take(Service& service, const ddsi_serdata* request,
                         dds_instance_handle_t asker) {
  const auto free = [&service](void* sample) {
    dds_sample_free(sample, service.request->descriptor, DDS_FREE_ALL);
  };
  const std::unique_ptr<void, decltype(free)> sample(
      std::memset(dds_alloc(service.request->descriptor->m_size), 0,
                  service.request->descriptor->m_size),
      free);
  if (!ddsi_serdata_to_sample(request, sample.get(), nullptr, nullptr)) {
    const std::scoped_lock lock(mutex_);
    ++counts_.malformed;
    return;
  }
  Job job{.service = &service,
          .header = {},
          .call = fast_call_of(request),
          .asker = asker,
          .answer = {},
          .ready = {}};
  std::memcpy(&job.header, sample.get(), sizeof job.header);
  Work work = service.read(sample.get(), participant_of(service.requests.get(), asker));
  job.answer = std::move(work.answer);
  job.ready = std::move(work.ready);
  accept(std::move(job), work.at_once, work.takes_long);
}

void ServiceServer::accept(Job job, bool at_once, bool takes_long) {
  {
    const std::scoped_lock lock(mutex_);
    ++counts_.requests;
    Turn* const turn = at_once ? nullptr : &turns_[takes_long ? 1 : 0];
    if (turn != nullptr || job.ready) {
      std::deque<Job>& jobs = turn != nullptr ? turn->jobs : unready_;
      const auto of_this = std::ranges::count(jobs, job.asker, &Job::asker);
      if (jobs.size() == kMostWaiting || of_this == static_cast<std::ptrdiff_t>(kMostOfOne)) {
        ++counts_.dropped;
        return;
      }
      jobs.push_back(std::move(job));
      if (turn != nullptr) turn->more.notify_one();
      return;
    }
  }
  answer(job);
}

/// What has waited long enough, and what nobody waits for any more.
void ServiceServer::do_ready() {
  std::erase_if(unready_, [this](const Job& job) {
    if (!matched_writer(job.service->requests.get(), job.asker)) {
      const std::scoped_lock lock(mutex_);
      ++counts_.unclaimed;
      return true;
    }
    if (!job.ready()) return false;
    answer(job);
    return true;
  });
}

void ServiceServer::work(Turn& turn) {
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      turn.more.wait(lock, [&] { return ending_ || !turn.jobs.empty(); });
      if (ending_) return;
      job = std::move(turn.jobs.front());
      turn.jobs.pop_front();
    }
    answer(job);
  }
}

void ServiceServer::answer(const Job& job) {
  Reply reply{.service = job.service,
              .call = job.call,
              .asker = job.asker,
              .memory = {},
              .sample = nullptr,
              .until = SteadyClock::now() + kReplyPatience};
  reply.sample = reply.memory.zeroed(job.service->reply->descriptor->m_size);
  std::memcpy(reply.sample, &job.header, sizeof job.header);
  job.answer(reply.sample, reply.memory);
  if (send(reply)) return;
  const std::scoped_lock lock(mutex_);
  if (held_.size() == kMostWaiting) {
    ++counts_.unclaimed;
    return;
  }
  held_.push_back(std::move(reply));
  dds_set_guardcondition(wake_.get(), true);
}

/// A client may have found the service before the service has found the client.
ServiceServer::Reach ServiceServer::reach(const Reply& reply) {
  const auto asker = matched_writer(reply.service->requests.get(), reply.asker);
  if (!asker) return Reach::kGone;
  for (const Peer& reader : matched_readers(reply.service->replies.get())) {
    if (reply.call ? std::ranges::equal(reader.endpoint.v, reply.call->client)
                   : belong_together(*asker, reader, "clientid")) {
      return Reach::kConnected;
    }
  }
  return Reach::kNotYet;
}

/// @return false: not yet.
bool ServiceServer::send(const Reply& reply) {
  const Reach found = reach(reply);
  if (found == Reach::kNotYet && SteadyClock::now() < reply.until) return false;
  const bool sent =
      found != Reach::kGone && write_reply(reply.service->replies.get(),
                                           reply.service->reply_layout, reply.sample, reply.call);
  const std::scoped_lock lock(mutex_);
  ++(sent ? counts_.replies : counts_.unclaimed);
  return true;
}

/// @return whether something is still held.
bool ServiceServer::send_held() {
  std::deque<Reply> held;
  {
    const std::scoped_lock lock(mutex_);
    held.swap(held_);
  }
  std::erase_if(held, [this](const Reply& reply) { return send(reply); });
  const std::scoped_lock lock(mutex_);
  for (Reply& reply : held) held_.push_back(std::move(reply));
  return !held_.empty();
}

}  // namespace tandem::dds
