// Whatever is asked of a running process, over its socket or over DDS: each question has an answer,
// which is one line of JSON that says why where it is no; the run goes on, with finite commands.
//
// The input: a byte that says who asks and how (Way), then questions, one a line; or the fields of
// a typed service's request, one a line; or requests of ROS 2's parameter services, name, type and
// value by turns.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "apps/control/dds_parameter_types.hpp"
#include "apps/control/remote_gate.hpp"
#include "apps/control/run_control.hpp"
#include "apps/control/typed_service.hpp"
#include "apps/text/json_reader.hpp"
#include "controllers/plugin_loader.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/runtime/first_order_robot.hpp"
#include "tests/runtime/test_controllers.hpp"

namespace {

using namespace tandem;
using fuzz::require;
using namespace tandem::apps;

constexpr std::size_t kMostQuestions = 16;

/// Time passes by sleeping for it.
class PatientClock final : public rt::Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_ns_; }
  void sleep_until(std::int64_t deadline_ns) noexcept override {
    now_ns_ = std::max(now_ns_, deadline_ns);
  }

 private:
  std::int64_t now_ns_ = 1;
};

/// Three joints, one of them a controller's, in a run that makes its cycles when somebody waits.
struct Run {
  Run() {
    backend.bring_up_cycles = 1;
    require(host.add("sine", std::make_shared<runtime::test::Sine>(std::vector<std::size_t>{0}),
                     runtime::test::parameters())
                .has_value());
    cycle.emplace(runtime::CycleParts{robot, backend, host, clock},
                  runtime::CycleConfig{.settle_cycles = 1});
    add_run_commands(registry, *cycle, robot);
    for (int i = 0; i < 5; ++i) advance();
    require(cycle->phase() == runtime::RunPhase::kRunning);
  }
  void advance() {
    if (over) return;
    rt::ClockControl& control = cycle->inbox().clock();
    const rt::ClockState state = control.state();
    if (state.paused && state.pending_steps == 0) (void)control.resume();
    over = !cycle->step();
    for (const auto values : {cycle->command().position_rad(), cycle->command().velocity_rad_s(),
                              cycle->command().torque_Nm(), cycle->command().stiffness_Nm_rad(),
                              cycle->command().damping_Nms_rad()}) {
      require(std::ranges::all_of(values, [](double value) { return std::isfinite(value); }));
    }
  }

  const hal::RobotConfig robot = hal::test::fake_robot();
  runtime::test::FirstOrderRobot backend{robot};
  runtime::ControllerHost host{robot, nullptr, 1'000'000};
  PatientClock clock;
  std::optional<runtime::RobotCycle> cycle;
  ControlRegistry registry;
  bool over = false;
};

thread_local Run* waited_for = nullptr;

/// Who asks.
ControlRegistry::Gate gate(unsigned who) {
  runtime::RemoteOptions remote;
  if (who != 1) remote.command = runtime::RemoteAccess::kLocal;
  remote.load = who == 2;
  if (who == 0) return {};
  return remote_gate(remote, [who] { return std::string(who == 3 ? "somebody" : ""); });
}

Json ask(Run& run, const std::string& question, const ControlRegistry::Gate& gate) {
  (void)run.registry.turn_of(question);
  const Json answer = run.registry.answer(question, gate);
  const std::string text = json_text(answer);
  require(text.find('\n') == std::string::npos);
  const Result<Json> read = read_json_object(text);
  require(read && (*read)["ok"].is_boolean());
  if (!answer["ok"].get<bool>()) require(!(*read)["error"].get<std::string>().empty());
  for (int i = 0; i < 2; ++i) run.advance();
  return answer;
}

/// The question that the service `name` makes of `request`.
template <class Request>
std::string question_for(std::string_view name, const Request& request) {
  static const std::vector<TypedService> kTandem = tandem_services(),
                                         kRos = controller_manager_services();
  for (const auto* rows : {&kTandem, &kRos}) {
    const auto row = std::ranges::find(*rows, name, &TypedService::name);
    if (row != rows->end()) return json_text(row->question(&request));
  }
  require(false);
  return {};
}

/// The question that a typed service makes of a request with these fields.
std::string typed_question(unsigned service, std::vector<std::string>& fields) {
  using namespace dds::tandem_msgs;
  fields.resize(8);
  std::vector<double> numbers;
  std::vector<char*> texts;
  for (std::string& field : fields) {
    texts.push_back(field.data());
    numbers.push_back(std::strtod(field.c_str(), nullptr));
  }
  const auto optional = [&](std::size_t i) {
    return dds_sequence_double{1, fields[i].empty() ? 0U : 1U, numbers.data() + i, false};
  };
  switch (service) {
    case 0: {
      SetJoint_Request request{};
      request.joint = texts[0];
      request.mode = texts[1];
      request.interaction = texts[2];
      request.stiffness_nm_rad = optional(3);
      request.damping_nms_rad = optional(4);
      return question_for("tandem/set_joint", request);
    }
    case 1: {
      SetGains_Request request{};
      request.joint = texts[0];
      request.loop = texts[1];
      request.kp = optional(2);
      request.ki = optional(3);
      request.kd = optional(4);
      return question_for("tandem/set_gains", request);
    }
    case 2: {
      LoadController_Request request{};
      request.plugin = texts[0];
      request.name = texts[1];
      request.parameters = texts[2];
      return question_for("tandem/load_controller", request);
    }
    case 3: {
      SwitchControllers_Request request{};
      const auto stop = static_cast<std::uint32_t>(fields[0].size() % 4);
      request.stop = {stop, stop, texts.data() + 1, false};
      request.start = {3, 3, texts.data() + 1 + stop, false};
      return question_for("tandem/switch_controllers", request);
    }
    default: {
      dds::controller_manager_msgs::SwitchController_Request request{};
      const auto stop = static_cast<std::uint32_t>(fields[0].size() % 4);
      request.strictness = static_cast<std::int32_t>(std::strtol(fields[7].c_str(), nullptr, 10));
      request.deactivate_controllers = {stop, stop, texts.data() + 1, false};
      request.activate_controllers = {3, 3, texts.data() + 1 + stop, false};
      return question_for("controller_manager/switch_controller", request);
    }
  }
}

/// Asks as a parameter service does. @return the reply, which is for `memory` to keep
template <class Response, class Request>
Response ask_of_parameters(Run& run, const Request& request, const ControlRegistry::Gate& gate,
                           dds::ReplyMemory& memory) {
  const ParameterQuestion asked = question_of(request);
  Response reply{};
  fill(ask(run, json_text(asked.question), gate), asked, reply, memory);
  return reply;
}

void require_texts(const dds_sequence_string& texts) {
  for (std::uint32_t i = 0; i < texts._length; ++i) require(texts._buffer[i] != nullptr);
}

/// Every parameter service with these names: listed and read, or set to these values.
void ask_parameters(Run& run, bool sets, std::vector<std::string>& fields,
                    const ControlRegistry::Gate& gate) {
  fields.resize((fields.size() + 2) / 3 * 3);
  std::vector<char*> names;
  std::vector<::rcl_interfaces_msg_dds__Parameter_> values;
  for (std::size_t i = 0; i < fields.size(); i += 3) {
    names.push_back(fields[i].data());
    auto& one = values.emplace_back();
    one.name = fields[i].data();
    one.value.string_value = fields[i + 2].data();
    one.value.type = static_cast<std::uint8_t>(std::strtoul(fields[i + 1].c_str(), nullptr, 10));
    one.value.bool_value = !fields[i + 2].empty();
    one.value.integer_value = std::strtoll(fields[i + 2].c_str(), nullptr, 10);
    one.value.double_value = std::strtod(fields[i + 2].c_str(), nullptr);
  }
  const auto count = static_cast<std::uint32_t>(names.size());
  dds::ReplyMemory memory;
  const auto ask_for = [&]<class Request, class Response>(Request request) {
    return ask_of_parameters<Response>(run, request, gate, memory);
  };
  if (sets) {
    ros::SetParameters_Request each{};
    each.parameters = {count, count, values.data(), false};
    const auto set =
        ask_for.operator()<ros::SetParameters_Request, ros::SetParameters_Response>(each);
    require(set.results._length == count);
    ros::SetParametersAtomically_Request all{};
    all.parameters = {count, count, values.data(), false};
    const auto reply = ask_for.operator()<ros::SetParametersAtomically_Request,
                                          ros::SetParametersAtomically_Response>(all);
    require(reply.result.successful == (reply.result.reason[0] == '\0'));
    return;
  }
  const dds_sequence_string asked{count, count, names.data(), false};
  ros::ListParameters_Request list{};
  list.prefixes = asked;
  list.depth = fields.empty() ? 0 : fields[1].size();
  const auto listed =
      ask_for.operator()<ros::ListParameters_Request, ros::ListParameters_Response>(list);
  require_texts(listed.result.names);
  ros::DescribeParameters_Request describe{};
  describe.names = asked;
  require(
      ask_for
          .
          operator()<ros::DescribeParameters_Request, ros::DescribeParameters_Response>(describe)
          .descriptors._length == count);
  ros::GetParameters_Request get{};
  get.names = asked;
  require(ask_for.operator()<ros::GetParameters_Request, ros::GetParameters_Response>(get)
              .values._length == count);
  ros::GetParameterTypes_Request types{};
  types.names = asked;
  require(ask_for.operator()<ros::GetParameterTypes_Request, ros::GetParameterTypes_Response>(types)
              .types._length == count);
}

std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty() && lines.size() < kMostQuestions) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

}  // namespace

/// Who waits for the loop lets it make a cycle instead of sleeping.
extern "C" int nanosleep(const timespec* duration, timespec* left) {
  if (waited_for == nullptr) {
    return clock_nanosleep(CLOCK_MONOTONIC, 0, duration, left) == 0 ? 0 : -1;
  }
  waited_for->advance();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const bool kOpen = [] {  // they stay open
    static std::vector<LoadedController> open;
    for (const char* name : {"hold", "jog", "trajectory_follower"}) {
      auto loaded = load_controller(name, controller_folders());
      require(loaded.has_value());
      open.push_back(std::move(*loaded));
    }
    return true;
  }();
  require(kOpen);
  const unsigned way = data[0];
  std::vector<std::string> lines = lines_of({reinterpret_cast<const char*>(data) + 1, size - 1});
  Run run;
  waited_for = &run;
  if ((way & 4) == 0) {
    for (const std::string& line : lines) ask(run, line, gate(way & 3));
  } else if ((way & 32) == 0) {
    ask(run, typed_question((way & 64) != 0 ? 4 : (way >> 3) & 3, lines), gate(way & 3));
  } else {
    ask(run, R"({"do": "controller.load", "plugin": "hold"})", {});
    ask_parameters(run, (way & 8) != 0, lines, gate(way & 3));
  }
  waited_for = nullptr;
  return 0;
}
