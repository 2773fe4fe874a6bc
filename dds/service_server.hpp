// Serves ROS 2 services on threads of its own: one takes requests, two do what they ask for.
// Layer: dds.  Thread: open and close main; what is served says which.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "dds/service.hpp"
#include "dds/service_layout.hpp"

namespace tandem::dds {

/// What a reply's pointers lead to; it lives until the reply is out.
class ReplyMemory {
 public:
  /// A copy of `text`.
  [[nodiscard]] char* text(std::string_view text);
  /// `count` zeroed elements, aligned for every type; null for none.
  template <class T>
  [[nodiscard]] T* array(std::size_t count) {
    return count == 0 ? nullptr : static_cast<T*>(zeroed(count * sizeof(T)));
  }
  [[nodiscard]] void* zeroed(std::size_t bytes);

 private:
  std::vector<std::unique_ptr<std::max_align_t[]>> blocks_;
};

/// Who wrote a request; empty: he is gone already.
using Asker = std::optional<ParticipantId>;

/// What one request asks for, taken out of its sample.
template <class Response>
struct ServiceWork {
  /// Done by the thread that takes requests, at once: it has to be short, and safe beside other
  /// work. Else it is done in its turn.
  bool at_once = false;
  /// Done in its turn among those that take long, for which no other waits.
  bool takes_long = false;
  /// Fills in the reply, which is zeroed but for its header: every text has to be set.
  std::function<void(Response& reply, ReplyMemory& memory)> answer;
  /// Work that is done at once waits until this says yes, which is asked after each wake(). Empty:
  /// it does not wait.
  std::function<bool()> ready = {};
};

/// Requests are done one after another, whoever asks. Nothing that a client does or leaves undone
/// reaches others: who floods has at most kMostOfOne requests waiting, who does not take replies
/// loses them, who is gone is forgotten. What there is no room for is dropped and counted, as a
/// request that got lost: the client asks again.
class ServiceServer {
 public:
  static constexpr std::size_t kMostWaiting = 64;  ///< requests
  static constexpr std::size_t kMostOfOne = 8;     ///< of one client
  /// A reply waits so long for its client's reader to be found, and is sent then in any case.
  static constexpr std::chrono::milliseconds kReplyPatience{1000};

  struct Counts {
    std::uint64_t requests = 0;
    std::uint64_t replies = 0;
    std::uint64_t dropped = 0;    ///< requests: too many waited
    std::uint64_t unclaimed = 0;  ///< replies: who asked is gone
    std::uint64_t malformed = 0;  ///< requests that are none of their type; not among `requests`
  };

  /// The participant outlives it.
  [[nodiscard]] static Result<std::unique_ptr<ServiceServer>> open(Participant& participant);
  /// Ends the threads. First they finish the request that they have begun, answer the requests
  /// that are carried out at once, and send the replies that wait for their reader.
  ~ServiceServer();
  ServiceServer(const ServiceServer&) = delete;
  ServiceServer& operator=(const ServiceServer&) = delete;

  /// What a request asks for, as ServiceWork has it: `reply` is of the service's own type.
  struct Work {
    bool at_once = false, takes_long = false;
    std::function<void(void* reply, ReplyMemory& memory)> answer;
    std::function<bool()> ready = {};  ///< as ServiceWork's
  };
  using Read = std::function<Work(const void* request, const Asker& asker)>;

  /// Adds a service before start().
  /// @param name  ROS 2's, without the namespace: "tandem/ask"
  /// @param read  called on the taking thread; the request is gone when it returns
  template <ServiceSample Request, ServiceSample Response>
  [[nodiscard]] Status add(
      const std::string& name,
      std::function<ServiceWork<Response>(const Request&, const Asker&)> read) {
    return add(name, type<Request>(), type<Response>(),
               [read = std::move(read)](const void* request, const Asker& asker) -> Work {
                 ServiceWork<Response> work = read(*static_cast<const Request*>(request), asker);
                 return {work.at_once, work.takes_long,
                         [answer = std::move(work.answer)](void* reply, ReplyMemory& memory) {
                           answer(*static_cast<Response*>(reply), memory);
                         },
                         std::move(work.ready)};
               });
  }
  /// The same, of types that are not known before the program runs.
  [[nodiscard]] Status add(const std::string& name, const Type& request, const Type& response,
                           Read read);
  /// @param only_at_once  no request is done in its turn: there are no threads for that
  [[nodiscard]] Status start(bool only_at_once = false);

  /// Work that waits may be ready. Any thread.
  void wake() { dds_set_guardcondition(wake_.get(), true); }

  [[nodiscard]] Counts counts() const;

 private:
  struct Service {
    std::string id;
    Endpoint requests, replies;
    Entity waiting;  // the condition of `requests`
    const Type* request;
    const Type* reply;
    const ddsi_sertype* reply_layout;
    Read read;
  };
  struct Job {
    Service* service;
    ServiceHeader header;
    std::optional<FastCall> call;
    dds_instance_handle_t asker;  // the writer of the request
    std::function<void(void*, ReplyMemory&)> answer;
    std::function<bool()> ready;
  };
  struct Reply {
    Service* service;
    std::optional<FastCall> call;
    dds_instance_handle_t asker;
    ReplyMemory memory;
    void* sample;
    std::chrono::steady_clock::time_point until;
  };
  struct Turn {
    std::condition_variable more;
    std::deque<Job> jobs;
    std::thread thread;
  };
  enum class Reach : std::uint8_t { kConnected, kNotYet, kGone };

  explicit ServiceServer(Participant& participant) : participant_(&participant) {}
  void receive();
  [[nodiscard]] bool ends() const;
  void take(Service& service);
  void take(Service& service, const ddsi_serdata* request, dds_instance_handle_t asker);
  void accept(Job job, bool at_once, bool takes_long);
  void do_ready();
  void work(Turn& turn);
  void answer(const Job& job);
  [[nodiscard]] static Reach reach(const Reply& reply);
  bool send(const Reply& reply);
  bool send_held();

  Participant* participant_;
  std::vector<std::unique_ptr<Service>> services_;
  Entity wake_;     // guard condition: something is held, or the end
  Entity waitset_;  // after what is attached to it, so that it goes first

  mutable std::mutex mutex_;  // of all below, but the threads
  bool ending_ = false;
  Counts counts_;
  std::array<Turn, 2> turns_;  // the usual one, and the long one
  std::deque<Reply> held_;     // until their readers are found
  std::deque<Job> unready_;    // the receiver's

  std::thread receiver_;
};

}  // namespace tandem::dds
