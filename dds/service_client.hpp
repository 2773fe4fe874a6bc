// Asks a ROS 2 service.
// Layer: dds.  Thread: any, non-RT; one at a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "dds/service.hpp"

namespace tandem::dds {

/// A service of a Tandem process, wherever it is.
struct FoundService {
  std::string name_space;                      ///< "left"; empty: none
  std::string node;                            ///< of its participant; empty: it is no Tandem
  std::string pid;                             ///< on its machine
  std::optional<ParticipantId> participant{};  ///< of whose writer a reply is; else empty
};
/// Every service of this name and any namespace in the participant's domain, as far as they have
/// been found until now. `finder` is new in the domain for some tens of milliseconds.
class ServiceFinder {
 public:
  [[nodiscard]] static Result<ServiceFinder> create(Participant& participant);
  /// @param service  ROS 2's name, without the namespace: "tandem/ask"
  [[nodiscard]] std::vector<FoundService> find(const std::string& service) const;

 private:
  explicit ServiceFinder(Entity reader) : reader_(std::move(reader)) {}
  Entity reader_;
};

/// The part of a client that does not know its types.
class ServiceClientBase {
 public:
  /// How many processes serve it.
  [[nodiscard]] std::size_t servers() const;
  /// Replies that were nobody's here: to another client, or too late.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }

 protected:
  using Patience = std::chrono::milliseconds;
  using Use = std::function<void(const void* reply)>;
  using UseOfEach = std::function<void(const void* reply, const FoundService& from)>;

  [[nodiscard]] static Result<ServiceClientBase> create(Participant& participant,
                                                        const std::string& service,
                                                        const Type& request, const Type& response);
  [[nodiscard]] Status call(void* request, Patience patience, const Use& use);
  [[nodiscard]] Result<std::vector<FoundService>> call_each(void* request, Patience patience,
                                                            const UseOfEach& use);

 private:
  using Deadline = std::chrono::steady_clock::time_point;
  ServiceClientBase(std::string name, Endpoint requests, Endpoint replies, Entity waiting,
                    Entity waitset);
  using UseSample = std::function<void(const void* reply, dds_instance_handle_t writer)>;
  [[nodiscard]] std::vector<Peer> connected() const;
  [[nodiscard]] Status find_server(Deadline deadline) const;
  [[nodiscard]] Result<ServiceHeader> send(void* request);
  [[nodiscard]] Error no_answer(Patience patience) const;
  void take(const ServiceHeader& header, const UseSample& use);

  std::string name_;  // for errors
  Endpoint requests_, replies_;
  Entity waiting_, waitset_;
  std::uint64_t guid_ = 0;
  std::int64_t sequence_ = 0;
  std::uint64_t ignored_ = 0;
};

template <ServiceSample Request, ServiceSample Response>
class ServiceClient : public ServiceClientBase {
 public:
  /// @param service  ROS 2's name, without the namespace: "tandem/ask". The participant outlives
  ///                 the client.
  [[nodiscard]] static Result<ServiceClient> create(Participant& participant,
                                                    const std::string& service) {
    auto base = ServiceClientBase::create(participant, service, type<Request>(), type<Response>());
    if (!base) return std::unexpected(base.error());
    return ServiceClient(std::move(*base));
  }

  /// Waits for the service to be there, asks, waits for the reply and shows it to `use`.
  /// @param patience  for all of it.  @param request  its header is filled in
  /// Errors: nobody serves it; several do; no reply in time; the server went away.
  [[nodiscard]] Status call(Request request, Patience patience,
                            const std::function<void(const Response&)>& use) {
    return ServiceClientBase::call(&request, patience, [&use](const void* reply) {
      use(*static_cast<const Response*>(reply));
    });
  }

  /// The same to every process that serves it, with one request: `use` sees the first reply of
  /// each, and whose it is, as it comes. The request is repeated until all have replied: it must do
  /// no harm twice.
  /// @param patience  for all of them
  /// @return those that have not replied in time. Errors: nobody serves it.
  [[nodiscard]] Result<std::vector<FoundService>> call_each(
      Request request, Patience patience,
      const std::function<void(const Response&, const FoundService&)>& use) {
    return ServiceClientBase::call_each(&request, patience,
                                        [&use](const void* reply, const FoundService& from) {
                                          use(*static_cast<const Response*>(reply), from);
                                        });
  }

 private:
  explicit ServiceClient(ServiceClientBase&& base) : ServiceClientBase(std::move(base)) {}
};

}  // namespace tandem::dds
