#include "apps/transport/dds_services.hpp"

#include "apps/control/dds_service_types.hpp"

namespace tandem::apps {
Result<std::unique_ptr<DdsServices>> DdsServices::open(dds::Participant& participant,
                                                       const ControlRegistry& registry,
                                                       ControlRegistry::Gate gate,
                                                       const DdsAdmission& admission) {
  std::unique_ptr<DdsServices> services(new DdsServices(registry, std::move(gate), admission));
  auto server = dds::ServiceServer::open(participant);
  if (!server) return std::unexpected(server.error());
  services->server_ = std::move(*server);
  if (Status added = services->add_all(); !added) return std::unexpected(added.error());
  if (Status started = services->server_->start(); !started) {
    return std::unexpected(started.error());
  }
  return services;
}

Status DdsServices::add_all() {
  using namespace dds::tandem_msgs;
  const Status added[]{
      add_ask(),
      add("tandem/emergency_stop", "estop", &emergency_stop_question, &fill_emergency_stop),
      add("tandem/clear_faults", "fault.reset", &clear_faults_question, &fill_clear_faults),
      add("tandem/start_controllers", "controller.start", &start_controllers_question,
          &fill_start_controllers),
      add("tandem/list_controllers", "controller.list", &list_controllers_question,
          &fill_controllers),
      add("tandem/load_controller", "controller.load", &load_controller_question,
          &fill_switched<LoadController_Response>),
      add("tandem/unload_controller", "controller.unload", &unload_controller_question,
          &fill_switched<UnloadController_Response>),
      add("tandem/switch_controllers", "controller.switch", &switch_controllers_question,
          &fill_switched<SwitchControllers_Response>),
      add("tandem/set_joint", "joint.set", &set_joint_question, &fill_done<SetJoint_Response>),
      add("tandem/set_gains", "joint.gains", &set_gains_question, &fill_done<SetGains_Response>),
      add("tandem/clock", "clock.show", &clock_question, &fill_clock),
  };
  for (const Status& one : added) {
    if (!one) return one;
  }
  return {};
}

Json DdsServices::ask(const std::string& question, const dds::Asker& asker) const {
  const auto gate = [&](const std::string& name, ControlEffect effect,
                        const Json& request) -> Status {
    if (gate_) {
      if (const Status open = gate_(name, effect, request); !open) return open;
    }
    if (effect != ControlEffect::kChanges || admission_->admits(asker)) return {};
    return fail(
        name + ": this process takes no commands from a stranger",
        "a `tandem` command is taken from the user who runs this process, on its machine; from "
        "others with [remote] trust = \"domain\" in its experiment, or with [dds.security]. A "
        "program that stays in the domain, as a ROS 2 node does, can be admitted by that "
        "user: tandem ask '{\"do\": \"dds.admit\", \"participant\": \"" +
            (asker ? dds::to_text(*asker) : "…") + "\"}' (docs/security.md)");
  };
  return registry_->answer(question, gate);
}

Status DdsServices::add_ask() {
  using Request = dds::tandem_msgs::Ask_Request;
  using Response = dds::tandem_msgs::Ask_Response;
  return server_->add<Request, Response>(
      "tandem/ask", [this](const Request& request, const dds::Asker& asker) {
        const std::string question = request.request;
        return dds::ServiceWork<Response>{
            .at_once = registry_->stops(question),
            .answer = [this, question, asker](Response& reply, dds::ReplyMemory& memory) {
              reply.answer = memory.text(json_text(ask(question, asker)));
            }};
      });
}

template <class Request, class Response>
Status DdsServices::add(const char* name, const char* needs, Json (*question)(const Request&),
                        void (*fill)(const Json&, Response&, dds::ReplyMemory&)) {
  if (!registry_->effect(needs)) return {};
  return server_->add<Request, Response>(
      name, [this, question, fill](const Request& request, const dds::Asker& asker) {
        const std::string text = json_text(question(request));
        return dds::ServiceWork<Response>{
            .at_once = registry_->stops(text),
            .answer = [this, text, fill, asker](Response& reply, dds::ReplyMemory& memory) {
              fill(ask(text, asker), reply, memory);
            }};
      });
}

}  // namespace tandem::apps
