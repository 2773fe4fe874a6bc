#include "apps/transport/dds_services.hpp"

#include <cstring>

#include "apps/control/dds_parameter_types.hpp"

namespace tandem::apps {
namespace {

Json only_stops_here() {
  return {{"ok", false},
          {"error", "tandem/stop takes emergency stops only"},
          {"hint", R"({"do": "estop"}; all else is asked of tandem/ask)"}};
}

}  // namespace

Result<std::unique_ptr<DdsServices>> DdsServices::open(dds::Participant& participant,
                                                       const ControlRegistry& registry,
                                                       ControlRegistry::Gate gate,
                                                       const DdsAdmission& admission) {
  std::unique_ptr<DdsServices> services(new DdsServices(registry, std::move(gate), admission));
  for (auto* one : {&services->stops_, &services->server_}) {
    auto server = dds::ServiceServer::open(participant);
    if (!server) return std::unexpected(server.error());
    *one = std::move(*server);
  }
  services->node_ = participant.node();
  if (Status added = services->add_all(); !added) return std::unexpected(added.error());
  if (Status started = services->stops_->start(true); !started) {
    return std::unexpected(started.error());
  }
  if (Status started = services->server_->start(); !started) {
    return std::unexpected(started.error());
  }
  return services;
}

dds::ServiceServer::Counts DdsServices::counts() const {
  dds::ServiceServer::Counts all = server_->counts();
  const dds::ServiceServer::Counts stops = stops_->counts();
  all.requests += stops.requests;
  all.replies += stops.replies;
  all.dropped += stops.dropped;
  all.unclaimed += stops.unclaimed;
  all.malformed += stops.malformed;
  return all;
}

Status DdsServices::add_all() {
  if (registry_->effect("estop")) {
    if (Status added = add_ask(*stops_, "tandem/stop", true); !added) return added;
  }
  if (Status added = add_ask(*server_, "tandem/ask", false); !added) return added;
  for (const auto& rows : {tandem_services(), controller_manager_services()}) {
    for (const TypedService& row : rows) {
      if (Status added = add(row); !added) return added;
    }
  }
  return add_parameters();
}

/// Those that ROS 2 expects of every node, beneath the node's name.
Status DdsServices::add_parameters() {
  using namespace dds::rcl_interfaces;
  const Status added[]{
      add_parameters<ListParameters_Request, ListParameters_Response>("list_parameters"),
      add_parameters<DescribeParameters_Request, DescribeParameters_Response>(
          "describe_parameters"),
      add_parameters<GetParameters_Request, GetParameters_Response>("get_parameters"),
      add_parameters<GetParameterTypes_Request, GetParameterTypes_Response>("get_parameter_types"),
      add_parameters<SetParameters_Request, SetParameters_Response>("set_parameters"),
      add_parameters<SetParametersAtomically_Request, SetParametersAtomically_Response>(
          "set_parameters_atomically"),
  };
  for (const Status& one : added) {
    if (!one) return one;
  }
  return {};
}

template <class Request, class Response>
Status DdsServices::add_parameters(const char* name) {
  if (!registry_->effect("controller.set")) return {};
  return server_->add<Request, Response>(
      node_ + "/" + name, [this](const Request& request, const dds::Asker& asker) {
        ParameterQuestion asked = question_of(request);
        const std::string text = json_text(asked.question);
        return dds::ServiceWork<Response>{.answer = [this, text, asked = std::move(asked), asker,
                                                     after_stop = registry_->last_stop()](
                                                        Response& reply, dds::ReplyMemory& memory) {
          const bool asks = asked.refusal.is_null();
          fill(asks ? ask(text, asker, after_stop) : asked.refusal, asked, reply, memory);
        }};
      });
}

Json DdsServices::ask(const std::string& question, const dds::Asker& asker,
                      std::uint64_t after_stop) const {
  const bool known = admission_->admits(asker);
  const auto gate = [&](const std::string& name, ControlEffect effect,
                        const Json& request) -> Status {
    if (gate_) {
      if (const Status open = gate_(name, effect, request); !open) return open;
    }
    if (!is_guarded(effect) || known) return {};
    return fail(
        name + ": this process takes no commands from a stranger",
        "a `tandem` command is taken from the user who runs this process, on its machine; from "
        "others with [remote] trust = \"domain\" in its experiment, or with [dds.security]. A "
        "program that stays in the domain, as a ROS 2 node does, can be admitted by that "
        "user: tandem ask '{\"do\": \"dds.admit\", \"participant\": \"" +
            (asker ? dds::to_text(*asker) : "…") + "\"}' (docs/security.md)");
  };
  return registry_->answer(question, {.after_stop = after_stop, .known = known, .gate = gate});
}

Status DdsServices::add_ask(dds::ServiceServer& server, const char* name, bool only_stops) {
  using Request = dds::tandem_msgs::Ask_Request;
  using Response = dds::tandem_msgs::Ask_Response;
  return server.add<Request, Response>(
      name, [this, only_stops](const Request& request, const dds::Asker& asker) {
        const std::size_t most = only_stops                  ? kMaxUrgentQuestion
                                 : admission_->admits(asker) ? kMaxQuestion
                                                             : kMaxStrangersQuestion;
        // One byte more is too long, too, and all that is kept of it.
        const std::string question(request.request, ::strnlen(request.request, most + 1));
        const bool refused = only_stops && registry_->effect_of(question) != ControlEffect::kStops;
        const ControlTurn turn = only_stops ? ControlTurn::kUrgent : registry_->turn_of(question);
        return dds::ServiceWork<Response>{
            .at_once = turn == ControlTurn::kUrgent,
            .takes_long = turn == ControlTurn::kLong,
            .answer = [this, question, asker, refused, after_stop = registry_->last_stop()](
                          Response& reply, dds::ReplyMemory& memory) {
              const Json answer = refused ? only_stops_here() : ask(question, asker, after_stop);
              reply.answer = memory.text(json_text(answer));
            }};
      });
}

/// The questions of whoever may not ask are not read.
Status DdsServices::add(const TypedService& row) {
  const auto effect = registry_->effect(row.needs);
  if (!effect) return {};
  dds::ServiceServer& server = *effect == ControlEffect::kStops ? *stops_ : *server_;
  return server.add(
      row.name, *row.request, *row.response,
      [this, row, guarded = is_guarded(*effect)](
          const void* request, const dds::Asker& asker) -> dds::ServiceServer::Work {
        const bool read = !guarded || admission_->admits(asker);
        const std::string text =
            json_text(read && row.question ? row.question(request) : Json{{"do", row.needs}});
        return {
            .at_once = registry_->turn_of(text) == ControlTurn::kUrgent,
            .answer = [this, row, text, asker, kept = row.kept ? row.kept(request) : Json(),
                       after_stop = registry_->last_stop()](void* reply, dds::ReplyMemory& memory) {
              Json answer = ask(text, asker, after_stop);
              for (const char* also : row.also)
                answer[also] = ask(json_text({{"do", also}}), asker, after_stop);
              answer["kept"] = kept;
              row.fill(answer, reply, memory);
            }};
      });
}

}  // namespace tandem::apps
