// Whatever is asked of a running process, over its socket or over DDS: each question has an answer,
// which is one line of JSON that says why where it is no; the run goes on, with finite commands.
//
// The input: a byte that says who asks and how (Way), then questions, one a line; or the fields of
// a typed service's request, one a line.
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
#include "apps/control/dds_service_types.hpp"
#include "apps/control/remote_gate.hpp"
#include "apps/control/run_control.hpp"
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

void ask(Run& run, const std::string& question, const ControlRegistry::Gate& gate) {
  (void)run.registry.turn_of(question);
  const Json answer = run.registry.answer(question, gate);
  const std::string text = json_text(answer);
  require(text.find('\n') == std::string::npos);
  const Result<Json> read = read_json_object(text);
  require(read && (*read)["ok"].is_boolean());
  if (!answer["ok"].get<bool>()) require(!(*read)["error"].get<std::string>().empty());
  for (int i = 0; i < 2; ++i) run.advance();
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
      return json_text(set_joint_question(request));
    }
    case 1: {
      SetGains_Request request{};
      request.joint = texts[0];
      request.loop = texts[1];
      request.kp = optional(2);
      request.ki = optional(3);
      request.kd = optional(4);
      return json_text(set_gains_question(request));
    }
    case 2: {
      LoadController_Request request{};
      request.plugin = texts[0];
      request.name = texts[1];
      request.parameters = texts[2];
      return json_text(load_controller_question(request));
    }
    default: {
      SwitchControllers_Request request{};
      const auto stop = static_cast<std::uint32_t>(fields[0].size() % 4);
      request.stop = {stop, stop, texts.data() + 1, false};
      request.start = {3, 3, texts.data() + 1 + stop, false};
      return json_text(switch_controllers_question(request));
    }
  }
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
  static const auto kOpen = load_controller("hold", controller_folders());  // stays open
  require(kOpen.has_value());
  const unsigned way = data[0];
  std::vector<std::string> lines = lines_of({reinterpret_cast<const char*>(data) + 1, size - 1});
  Run run;
  waited_for = &run;
  if ((way & 4) == 0) {
    for (const std::string& line : lines) ask(run, line, gate(way & 3));
  } else {
    ask(run, typed_question((way >> 3) & 3, lines), gate(way & 3));
  }
  waited_for = nullptr;
  return 0;
}
