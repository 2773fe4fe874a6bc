// The services "controller_manager/…" of ros2_control, by which `ros2 control` asks: what a run has
// of them, in their words. docs/ros2.md says what differs.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <set>
#include <string_view>
#include <vector>

#include "apps/control/dds_reply.hpp"
#include "apps/control/typed_service.hpp"
#include "dds/hardware_interfaces.hpp"

namespace tandem::apps {
namespace {

namespace cm = dds::controller_manager_msgs;  // some names are tandem_msgs', too
using dds::ReplyMemory;
using Interfaces = dds_sequence_controller_manager_msgs_msg_dds__HardwareInterface_;

constexpr std::size_t kLongestWord = 256;  // of a name in a request, one character more is kept

std::string name_in(const char* text) { return {text, ::strnlen(text, kLongestWord + 1)}; }

// ---- words of ros2_control ----

/// lifecycle_msgs/msg/State.
struct Lifecycle {
  std::uint8_t id;
  const char* label;
};
constexpr Lifecycle kUnknown{0, "unknown"}, kUnconfigured{1, "unconfigured"},
    kInactiveState{2, "inactive"}, kActiveState{3, "active"}, kFinalized{4, "finalized"};

/// The robot in a phase of the run: active is who follows commands.
struct PhaseRow {
  std::string_view phase;
  Lifecycle state;
};
constexpr PhaseRow kPhaseRows[]{
    {"waiting", kUnconfigured},  {"bring-up", kInactiveState},  {"settling", kActiveState},
    {"running", kActiveState},   {"held", kActiveState},        {"retreating", kActiveState},
    {"faulted", kInactiveState}, {"resetting", kInactiveState}, {"shut-down", kFinalized},
    {"done", kFinalized},
};

/// What a joint in this mode is commanded by. Idle: nothing.
struct ModeRow {
  std::string_view mode;
  const char* interface;
};
constexpr ModeRow kModeRows[]{
    {"position", "position"}, {"velocity", "velocity"}, {"torque", "effort"},
    {"open_loop", "voltage"}, {"current", "current"},
};

/// A joint's measured values, as in `dynamic_joint_states`.
struct StateRow {
  const char* interface;
  const char* key;  ///< of "joint.list"
};
constexpr StateRow kStateRows[]{
    {"position", "position_rad"},
    {"velocity", "velocity_rad_s"},
    {"acceleration", "acceleration_rad_s2"},
    {"effort", "torque_Nm"},
    {"motor_position", "motor_position_rad"},
    {"motor_velocity", "motor_velocity_rad_s"},
    {"current", "current_A"},
    {"voltage", "voltage_V"},
    {"temperature", "temperature_C"},
};

/// SwitchController's strictness. AUTO resolves chains of controllers, which there are none of.
const char* word_of(std::int32_t strictness) {
  constexpr std::array kWords{"strict", "best_effort", "strict", "strict", "force"};
  const auto index = static_cast<std::size_t>(strictness);
  return strictness >= 0 && index < kWords.size() ? kWords[index] : nullptr;
}

// ---- a run in these words ----

/// "joint1/position"; empty: by nothing.
std::string command_interface(const std::string& joint, const std::string& mode) {
  const auto* row = std::ranges::find(kModeRows, mode, &ModeRow::mode);
  return row == std::end(kModeRows) ? "" : joint + "/" + row->interface;
}

std::vector<std::string> claims_of(const Json& controller) {
  std::vector<std::string> all;
  for (const Json& claim : list_of(controller, "claims")) {
    std::string name = command_interface(claim.value("joint", ""), claim.value("mode", ""));
    if (!name.empty()) all.push_back(std::move(name));
  }
  return all;
}

/// "…/lib/controllers/hold.so": "hold". What is part of the program: its own name.
std::string controller_type(const Json& controller) {
  const std::string plugin = controller.value("plugin", "");
  if (plugin.empty()) return controller.value("name", "");
  const std::size_t begin = plugin.rfind('/') + 1;
  return plugin.substr(begin, plugin.rfind('.') - begin);
}

/// @param answer  with one to "loop.show"
std::uint16_t cycles_a_second(const Json& answer) {
  const double period_ns = answer["loop.show"].value("period_ns", 0.0);
  const double rate = period_ns > 0.0 ? std::round(1e9 / period_ns) : 0.0;
  return static_cast<std::uint16_t>(
      std::min(rate, double{std::numeric_limits<std::uint16_t>::max()}));
}

struct Interface {
  std::string name;
  bool available = false, claimed = false;
};

/// @param answer  to "joint.list", with one to "controller.list"
std::vector<Interface> commands_of(const Json& answer) {
  std::set<std::string> claimed;
  for (const Json& controller : list_of(answer["controller.list"], "controllers")) {
    if (!controller.value("active", false)) continue;
    std::ranges::move(claims_of(controller), std::inserter(claimed, claimed.end()));
  }
  std::vector<Interface> all;
  for (const Json& joint : list_of(answer, "joints")) {
    const bool follows = joint.value("drive_state", "") == "operation enabled" &&
                         joint.value("feedback", "") != "lost";
    for (const Json& mode : list_of(joint, "modes")) {
      std::string name = command_interface(joint.value("joint", ""), mode.get<std::string>());
      if (name.empty()) continue;
      const bool taken = claimed.contains(name);
      all.push_back({std::move(name), follows, taken});
    }
  }
  return all;
}

/// @param answer  to "joint.list"
std::vector<Interface> joint_states_of(const Json& answer) {
  std::vector<Interface> all;
  for (const Json& joint : list_of(answer, "joints")) {
    const std::string feedback = joint.value("feedback", "");
    const bool heard = feedback == "fresh" || feedback == "old";
    for (const StateRow& row : kStateRows) {
      all.push_back({joint.value("joint", "") + "/" + row.interface,
                     heard && !joint.value(row.key, Json()).is_null()});
    }
  }
  return all;
}

std::vector<Interface> sensor_states_of(const Json& sensor) {
  const bool imu = sensor.value("type", "") == "imu";
  std::vector<Interface> all;
  for (const char* const channel :
       dds::sensor_interfaces(imu ? hal::SensorType::kImu : hal::SensorType::kForceTorque)) {
    all.push_back({sensor.value("sensor", "") + "/" + channel, sensor.value("valid", false)});
  }
  return all;
}

/// The robot, and each of its sensors.
struct Component {
  std::string name, type;
  Lifecycle state;
  std::vector<Interface> commands, states;
};

/// @param answer  to "joint.list", with those to "controller.list", "sensor.list", "status" and
///                "loop.show"
std::vector<Component> components_of(const Json& answer) {
  const std::string phase = answer["status"].value("phase", "");
  const auto* row = std::ranges::find(kPhaseRows, phase, &PhaseRow::phase);
  const Lifecycle state = row == std::end(kPhaseRows) ? kUnknown : row->state;
  std::vector<Component> all{{.name = answer["loop.show"].value("robot", ""),
                              .type = "system",
                              .state = state,
                              .commands = commands_of(answer),
                              .states = joint_states_of(answer)}};
  for (const Json& sensor : list_of(answer["sensor.list"], "sensors")) {
    const bool gone = state.id == kActiveState.id && !sensor.value("valid", false);
    all.push_back({.name = sensor.value("sensor", ""),
                   .type = "sensor",
                   .state = gone ? kInactiveState : state,
                   .commands = {},
                   .states = sensor_states_of(sensor)});
  }
  return all;
}

const std::vector<const char*> kOfComponents{"controller.list", "sensor.list", "status",
                                             "loop.show"};

// ---- requests and replies ----

void fill_interfaces(const std::vector<Interface>& from, Interfaces& to, ReplyMemory& memory) {
  const auto places = room(to, from.size(), memory);
  for (std::size_t i = 0; i < from.size(); ++i) {
    places[i].name = memory.text(from[i].name);
    places[i].data_type = memory.text("double");
    places[i].is_available = from[i].available;
    places[i].is_claimed = from[i].claimed;
  }
}

void fill_state(const Lifecycle& from, ::lifecycle_msgs_msg_dds__State_& to, ReplyMemory& memory) {
  to.id = from.id;
  to.label = memory.text(from.label);
}

void fill_controller_states(const Json& answer, cm::ListControllers_Response& reply,
                            ReplyMemory& memory) {
  const Json& controllers = list_of(answer, "controllers");
  const auto places = room(reply.controller, controllers.size(), memory);
  for (std::size_t i = 0; i < controllers.size(); ++i) {
    const Json& from = controllers[i];
    const bool active = from.value("active", false);
    const std::vector<std::string> claims = claims_of(from);
    places[i].name = text_of(from, "name", memory);
    places[i].state = memory.text(active ? kActiveState.label : kInactiveState.label);
    places[i].type = memory.text(controller_type(from));
    places[i].update_rate = cycles_a_second(answer);
    fill_texts(active ? claims : std::vector<std::string>(), places[i].claimed_interfaces, memory);
    fill_texts(claims, places[i].required_command_interfaces, memory);
  }
}

void fill_types(const Json& answer, cm::ListControllerTypes_Response& reply, ReplyMemory& memory) {
  const Json& plugins = list_of(answer, "plugins");
  fill_texts(plugins, reply.types, memory);
  fill_texts(std::vector<std::string>(plugins.size(), "tandem::Controller"), reply.base_classes,
             memory);
}

void fill_all_interfaces(const Json& answer, cm::ListHardwareInterfaces_Response& reply,
                         ReplyMemory& memory) {
  std::vector<Interface> states;
  for (const Component& one : components_of(answer))
    states.insert(states.end(), one.states.begin(), one.states.end());
  fill_interfaces(commands_of(answer), reply.command_interfaces, memory);
  fill_interfaces(states, reply.state_interfaces, memory);
}

void fill_components(const Json& answer, cm::ListHardwareComponents_Response& reply,
                     ReplyMemory& memory) {
  const std::vector<Component> components = components_of(answer);
  const std::string plugin = "tandem/" + answer["loop.show"].value("hal", "");
  const auto places = room(reply.component, components.size(), memory);
  for (std::size_t i = 0; i < components.size(); ++i) {
    places[i].name = memory.text(components[i].name);
    places[i].type = memory.text(components[i].type);
    places[i].rw_rate = cycles_a_second(answer);
    places[i].class_type = places[i].plugin_name = memory.text(plugin);
    fill_state(components[i].state, places[i].state, memory);
    fill_interfaces(components[i].commands, places[i].command_interfaces, memory);
    fill_interfaces(components[i].states, places[i].state_interfaces, memory);
  }
}

Json load_by_name(const cm::LoadController_Request& request) {
  const std::string name = name_in(request.name);
  return {{"do", "controller.load"}, {"plugin", name}, {"name", name}};
}

Json unload_by_name(const cm::UnloadController_Request& request) {
  return {{"do", "controller.unload"}, {"name", name_in(request.name)}};
}

Json switch_by_strictness(const cm::SwitchController_Request& request) {
  const char* word = word_of(request.strictness);
  return {{"do", "controller.switch"},
          {"stop", texts_of(request.deactivate_controllers)},
          {"start", texts_of(request.activate_controllers)},
          {"strictness", word == nullptr ? std::to_string(request.strictness) : word}};
}

template <class Response>
void fill_done_or_not(const Json& answer, Response& reply, ReplyMemory&) {
  reply.ok = answer.value("done", false);
}

void fill_switch(const Json& answer, cm::SwitchController_Response& reply, ReplyMemory& memory) {
  reply.ok = answer.value("done", false);
  std::string message = message_of(answer);
  if (message.empty()) {
    message = "active:";
    for (const Json& name : list_of(answer, "active")) message += " " + name.get<std::string>();
  }
  reply.message = memory.text(message);
}

Json configure_question(const cm::ConfigureController_Request& request) {
  return {{"do", "controller.show"}, {"name", name_in(request.name)}};
}

/// Whoever is loaded is configured. ros2_control configures nobody who is active.
void fill_configure(const Json& answer, cm::ConfigureController_Response& reply, ReplyMemory&) {
  const Json& controllers = list_of(answer, "controllers");
  reply.ok = controllers.size() == 1 && !controllers[0].value("active", true);
}

/// Nobody goes back to being unconfigured.
void fill_cleanup(const Json&, cm::CleanupController_Response& reply, ReplyMemory&) {
  reply.ok = false;
}

/// A library is opened when its controller is loaded, as it is then; none is open without one.
void fill_reload(const Json& answer, cm::ReloadControllerLibraries_Response& reply, ReplyMemory&) {
  reply.ok = std::ranges::all_of(list_of(answer, "controllers"),
                                 [](const Json& one) { return one.value("plugin", "").empty(); });
}

Json wished_state(const cm::SetHardwareComponentState_Request& request) {
  return {{"name", name_in(request.name)},
          {"id", request.target_state.id},
          {"label", name_in(request.target_state.label)}};
}

/// A component's state follows from the run's phase; it is as wished, or it is not.
void fill_set_state(const Json& answer, cm::SetHardwareComponentState_Response& reply,
                    ReplyMemory& memory) {
  const Json& wish = answer["kept"];
  Lifecycle state = kUnknown;
  for (const Component& one : components_of(answer)) {
    if (wish["name"] == one.name) state = one.state;
  }
  fill_state(state, reply.state, memory);
  const std::uint8_t id = wish["id"].get<std::uint8_t>();
  reply.ok = state.id != kUnknown.id && (id == 0 ? wish["label"] == state.label : id == state.id);
}

template <class Request>
constexpr Json (*kNoKeys)(const Request&) = nullptr;

}  // namespace

std::vector<TypedService> controller_manager_services() {
  return {
      typed_service("controller_manager/list_controllers", "controller.list",
                    kNoKeys<cm::ListControllers_Request>, &fill_controller_states, {"loop.show"}),
      typed_service("controller_manager/list_controller_types", "controller.available",
                    kNoKeys<cm::ListControllerTypes_Request>, &fill_types),
      typed_service("controller_manager/load_controller", "controller.load", &load_by_name,
                    &fill_done_or_not<cm::LoadController_Response>),
      typed_service("controller_manager/configure_controller", "controller.show",
                    &configure_question, &fill_configure),
      typed_service("controller_manager/switch_controller", "controller.switch",
                    &switch_by_strictness, &fill_switch),
      typed_service("controller_manager/unload_controller", "controller.unload", &unload_by_name,
                    &fill_done_or_not<cm::UnloadController_Response>),
      typed_service("controller_manager/cleanup_controller", "controller.list",
                    kNoKeys<cm::CleanupController_Request>, &fill_cleanup),
      typed_service("controller_manager/reload_controller_libraries", "controller.list",
                    kNoKeys<cm::ReloadControllerLibraries_Request>, &fill_reload),
      typed_service("controller_manager/list_hardware_components", "joint.list",
                    kNoKeys<cm::ListHardwareComponents_Request>, &fill_components, kOfComponents),
      typed_service("controller_manager/list_hardware_interfaces", "joint.list",
                    kNoKeys<cm::ListHardwareInterfaces_Request>, &fill_all_interfaces,
                    kOfComponents),
      typed_service("controller_manager/set_hardware_component_state", "joint.list",
                    kNoKeys<cm::SetHardwareComponentState_Request>, &fill_set_state, kOfComponents,
                    &wished_state),
  };
}

}  // namespace tandem::apps
