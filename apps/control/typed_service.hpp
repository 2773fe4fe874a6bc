// The services over DDS that have types of their own, as rows: what each asks of the registry, and
// how the answer becomes its reply.
// Layer: apps/control.  Thread: any.
#pragma once

#include <functional>
#include <vector>

#include "apps/text/console.hpp"
#include "dds/service_server.hpp"
#include "dds/types.hpp"

namespace tandem::apps {

/// One service. It is there when the registry has `needs`, and may be called by who may ask that.
struct TypedService {
  const char* name;                 ///< without the namespace: "tandem/set_joint"
  const char* needs;                ///< the command that it asks for
  const dds::Type* request;         ///< its samples
  const dds::Type* response;        ///< the same
  std::vector<const char*> also{};  ///< commands that only read, asked for after it
  /// A request as question; empty: `needs` without keys.
  std::function<Json(const void* request)> question{};
  /// What of a request only the reply needs; empty: nothing.
  std::function<Json(const void* request)> kept{};
  /// @param answer  to the question; beneath the name of each of `also` the answer to that, and
  ///                beneath "kept" what was kept
  std::function<void(const Json& answer, void* reply, dds::ReplyMemory& memory)> fill;
};

/// A row, from functions of the samples' own types. A null one is left out.
template <class Request, class Response>
[[nodiscard]] TypedService typed_service(
    const char* name, const char* needs, Json (*question)(const Request&),
    void (*fill)(const Json& answer, Response& reply, dds::ReplyMemory& memory),
    std::vector<const char*> also = {}, Json (*kept)(const Request&) = nullptr) {
  TypedService row{.name = name,
                   .needs = needs,
                   .request = &dds::type<Request>(),
                   .response = &dds::type<Response>(),
                   .also = std::move(also),
                   .fill = [fill](const Json& answer, void* reply, dds::ReplyMemory& memory) {
                     fill(answer, *static_cast<Response*>(reply), memory);
                   }};
  const auto of_request = [](Json (*function)(const Request&)) {
    return
        [function](const void* request) { return function(*static_cast<const Request*>(request)); };
  };
  if (question != nullptr) row.question = of_request(question);
  if (kept != nullptr) row.kept = of_request(kept);
  return row;
}

/// "tandem/list_controllers" and so on.
[[nodiscard]] std::vector<TypedService> tandem_services();
/// "controller_manager/list_controllers" and so on, by which `ros2 control` asks.
[[nodiscard]] std::vector<TypedService> controller_manager_services();

}  // namespace tandem::apps
