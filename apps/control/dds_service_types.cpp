// The services "tandem/…".
#include "apps/control/typed_service.hpp"

#include <fmt/core.h>

#include <cstring>
#include <span>

#include "apps/control/dds_reply.hpp"
#include "apps/control/fault_table.hpp"

namespace tandem::apps {
namespace {

using namespace dds::tandem_msgs;
using dds::ReplyMemory;

/// An empty text says nothing.
void add_text(Json& question, const char* key, const char* text) {
  if (*text != '\0') question[key] = text;
}

/// So does an empty sequence.
void add_number(Json& question, const char* key, const dds_sequence_double& value) {
  if (value._length > 0) question[key] = value._buffer[0];
}

/// What is asked of a loop whose time stands waits.
const char* when(const Json& answer) {
  return answer.value("paused", false) ? ", in the next cycle: simulated time stands" : "";
}

void fill_controller(const Json& from, tandem_msgs_msg_dds__Controller_& to, ReplyMemory& memory) {
  to.name = text_of(from, "name", memory);
  to.plugin = text_of(from, "plugin", memory);
  to.active = from.value("active", false);
  to.finished = from.value("finished", false);
  to.of_experiment = from.value("of_experiment", false);
  const Json& claims = list_of(from, "claims");
  const auto room_for = room(to.claims, claims.size(), memory);
  for (std::size_t i = 0; i < claims.size(); ++i) {
    room_for[i].joint = text_of(claims[i], "joint", memory);
    room_for[i].mode = text_of(claims[i], "mode", memory);
    room_for[i].interaction = text_of(claims[i], "interaction", memory);
  }
}

Json load_controller_question(const LoadController_Request& request) {
  Json question{{"do", "controller.load"}, {"plugin", request.plugin}};
  add_text(question, "name", request.name);
  add_text(question, "parameters", request.parameters);
  return question;
}

Json unload_controller_question(const UnloadController_Request& request) {
  return {{"do", "controller.unload"}, {"name", request.name}};
}

Json switch_controllers_question(const SwitchControllers_Request& request) {
  return {{"do", "controller.switch"},
          {"stop", texts_of(request.stop)},
          {"start", texts_of(request.start)}};
}

Json set_joint_question(const SetJoint_Request& request) {
  Json question{{"do", "joint.set"}, {"joint", request.joint}};
  add_text(question, "mode", request.mode);
  add_text(question, "interaction", request.interaction);
  add_number(question, "stiffness_Nm_rad", request.stiffness_nm_rad);
  add_number(question, "damping_Nms_rad", request.damping_nms_rad);
  return question;
}

Json set_gains_question(const SetGains_Request& request) {
  Json question{{"do", "joint.gains"}, {"joint", request.joint}, {"loop", request.loop}};
  add_number(question, "kp", request.kp);
  add_number(question, "ki", request.ki);
  add_number(question, "kd", request.kd);
  return question;
}

Json clock_question(const Clock_Request& request) {
  constexpr std::size_t kLongest = 64;  // of what is shown of an unknown one; all are shorter
  const std::string action(request.action, ::strnlen(request.action, kLongest));
  Json question{{"do", "clock." + (action.empty() ? "show" : action)}};
  if (action == "step") question["cycles"] = request.cycles;
  if (action == "rate") question["rate"] = request.rate;
  return question;
}

void fill_emergency_stop(const Json& answer, dds::std_srvs::Trigger_Response& reply,
                         ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  const std::string category = answer.value("category", std::string());
  reply.message =
      memory.text(reply.success ? "emergency stop, " + category_words(category) + when(answer)
                                : message_of(answer));
}

void fill_clear_faults(const Json& answer, dds::std_srvs::Trigger_Response& reply,
                       ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  const int latched = answer.value("latched", 0);
  reply.message = memory.text(
      !reply.success ? message_of(answer)
      : latched == 0 ? "nothing is latched"
                     : fmt::format("the reset of {} is asked for{}; tandem/faults shows when it is "
                                   "through, which takes seconds. Controllers that are held back "
                                   "then continue with tandem/start_controllers",
                                   latched, when(answer)));
}

void fill_start_controllers(const Json& answer, dds::std_srvs::Trigger_Response& reply,
                            ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  std::string names;
  for (const Json& name : list_of(answer, "active")) {
    names += (names.empty() ? "active: " : ", ") + name.get<std::string>();
  }
  const std::string note = message_of(answer);
  reply.message = memory.text(note.empty() ? names : note);
}

void fill_controllers(const Json& answer, ListControllers_Response& reply, ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  reply.message = memory.text(message_of(answer));
  const Json& controllers = list_of(answer, "controllers");
  const auto room_for = room(reply.controllers, controllers.size(), memory);
  for (std::size_t i = 0; i < controllers.size(); ++i) {
    fill_controller(controllers[i], room_for[i], memory);
  }
}

/// Common to all replies that say whether something was done.
template <class Response>
void fill_done(const Json& answer, Response& reply, ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  reply.message = memory.text(message_of(answer));
  reply.done = answer.value("done", false);
  reply.cycle = answer.value("cycle", std::uint64_t{0});
}

/// And to those that say who is active then.
template <class Response>
void fill_switched(const Json& answer, Response& reply, ReplyMemory& memory) {
  fill_done(answer, reply, memory);
  fill_texts(list_of(answer, "active"), reply.active, memory);
}

void fill_clock(const Json& answer, Clock_Response& reply, ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  reply.message = memory.text(message_of(answer));
  reply.time_s = answer.value("time_s", 0.0);
  reply.cycles = answer.value("cycles", std::uint64_t{0});
  reply.paused = answer.value("paused", false);
  reply.standing = answer.value("standing", false);
  reply.pending_steps = answer.value("pending_steps", std::uint64_t{0});
  reply.rate = answer.value("rate", 0.0);
}

}  // namespace

std::string message_of(const Json& answer) {
  if (answer.value("ok", false)) return answer.value("note", std::string());
  const std::string hint = answer.value("hint", std::string());
  return answer.value("error", std::string()) + (hint.empty() ? "" : " (" + hint + ")");
}

char* text_of(const Json& object, const char* key, ReplyMemory& memory) {
  return memory.text(object.value(key, std::string()));
}

const Json& list_of(const Json& answer, const char* key) {
  static const Json kEmpty = Json::array();
  const auto found = answer.find(key);
  return found != answer.end() && found->is_array() ? *found : kEmpty;
}

Json texts_of(const dds_sequence_string& sequence) {
  Json list = Json::array();
  for (const char* text : std::span(sequence._buffer, sequence._length)) list.push_back(text);
  return list;
}

std::vector<TypedService> tandem_services() {
  constexpr Json (*kNoKeys)(const dds::std_srvs::Trigger_Request&) = nullptr;
  constexpr Json (*kNothing)(const ListControllers_Request&) = nullptr;
  return {
      typed_service("tandem/emergency_stop", "estop", kNoKeys, &fill_emergency_stop),
      typed_service("tandem/clear_faults", "fault.reset", kNoKeys, &fill_clear_faults),
      // Those that a reset holds back.
      typed_service("tandem/start_controllers", "controller.start", kNoKeys,
                    &fill_start_controllers),
      typed_service("tandem/list_controllers", "controller.list", kNothing, &fill_controllers),
      typed_service("tandem/load_controller", "controller.load", &load_controller_question,
                    &fill_switched<LoadController_Response>),
      typed_service("tandem/unload_controller", "controller.unload", &unload_controller_question,
                    &fill_switched<UnloadController_Response>),
      typed_service("tandem/switch_controllers", "controller.switch", &switch_controllers_question,
                    &fill_switched<SwitchControllers_Response>),
      typed_service("tandem/set_joint", "joint.set", &set_joint_question,
                    &fill_done<SetJoint_Response>),
      typed_service("tandem/set_gains", "joint.gains", &set_gains_question,
                    &fill_done<SetGains_Response>),
      typed_service("tandem/clock", "clock.show", &clock_question, &fill_clock),
  };
}

}  // namespace tandem::apps
