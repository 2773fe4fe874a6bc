#include "apps/tools/controller_files.hpp"

#include <fmt/format.h>

#include <cctype>

#include "apps/text/console.hpp"
#include "base/quoting.hpp"

namespace tandem::apps {
namespace {

const char kSource[] =
    R"(// @NAME@: leads one joint to and fro between two places. A PD law pulls the joint's reference to the
// place, so the joint moves smoothly although the place jumps.
//   cmake --workflow --preset run         configures, builds, tests, and runs @NAME@.toml
//   tandem controller set @NAME@ kp_1_s2=40      while a run goes on
//   tandem controller reload @NAME@       the same: after a change and `cmake --build build`
#include <cmath>
#include <string>

#include "controllers/controller.hpp"

class @CLASS@ : public tandem::Controller {
 public:
  // Before anything moves: reads [controller.parameters], claims joints, allocates what it needs.
  tandem::Status configure(tandem::ControllerSetup& setup) override {
    const std::string name = setup.parameters.text("joint");
    const int joint = setup.robot.joint_index(name);
    if (joint < 0) return std::unexpected(setup.robot.no_joint(name));
    joint_ = static_cast<std::size_t>(joint);
    // One without `otherwise` has to be given. A live one may be set while it runs: so update()
    // reads it anew, and no value of its range may let the reference jump.
    amplitude_rad_ = setup.parameter("amplitude_rad", {.unit = "rad",
                                                       .min = 0.0,
                                                       .max = 10.0,
                                                       .live = true,
                                                       .doc = "from the middle to a place"});
    period_s_ = setup.parameter("period_s", {.unit = "s",
                                             .min = 0.1,
                                             .max = 1e3,
                                             .otherwise = 4.0,
                                             .live = true,
                                             .doc = "of a way to and fro"});
    kp_1_s2_ = setup.parameter("kp_1_s2", {.unit = "1/s2",
                                           .min = 0.01,
                                           .max = 1e3,
                                           .otherwise = 16.0,
                                           .live = true,
                                           .doc = "pull to the place"});
    cycle_s_ = 1e-9 * static_cast<double>(setup.period_ns);
    setup.claim(joint_, tandem::hal::ControlMode::kPosition);
    return {};
  }

  // In its first cycle: begins where the joint is, so that nothing jumps.
  void start(const tandem::hal::CycleTime& time, const tandem::hal::StateImage& state,
             tandem::hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    middle_rad_ = reference_rad_ = state.position_rad()[joint_];
    velocity_rad_s_ = 0.0;
  }

  // In every cycle, on the real-time thread: no heap, no lock, no file, no exception.
  tandem::Code update(const tandem::hal::CycleTime& time, const tandem::hal::StateImage&,
                      tandem::hal::CommandImage& command) noexcept TANDEM_RT override {
    const double t_s = 1e-9 * static_cast<double>(time.time_ns - start_ns_);
    const bool above = std::fmod(t_s, period_s_) < period_s_ / 2.0;
    const double target_rad = middle_rad_ + (above ? amplitude_rad_ : -amplitude_rad_);
    const double kd_1_s = 2.0 * std::sqrt(kp_1_s2_);  // critical damping: it does not overshoot
    const double acceleration_rad_s2 =
        kp_1_s2_ * (target_rad - reference_rad_) - kd_1_s * velocity_rad_s_;
    velocity_rad_s_ += acceleration_rad_s2 * cycle_s_;
    reference_rad_ += velocity_rad_s_ * cycle_s_;
    command.position_rad()[joint_] = reference_rad_;
    command.velocity_rad_s()[joint_] = velocity_rad_s_;
    return tandem::Code::kOk;
  }

  // All that update() changes: predictions need it, and a reload carries it over.
  void archive(tandem::Archive& ar) override {
    ar(start_ns_, middle_rad_, reference_rad_, velocity_rad_s_);
  }

 private:
  std::size_t joint_ = 0;
  tandem::Parameter amplitude_rad_, period_s_, kp_1_s2_;
  double cycle_s_ = 0.0;
  std::int64_t start_ns_ = 0;
  double middle_rad_ = 0.0, reference_rad_ = 0.0, velocity_rad_s_ = 0.0;
};

TANDEM_CONTROLLER(@CLASS@, "@NAME@", "Leads one joint to and fro.")
)";

const char kTest[] =
    R"(// Tests the controller without a robot: one joint, which is always where it is commanded to be.
//   @NAME@_test CHECK: one of those in main()
#include <cstdio>
#include <cstring>

@TESTED@

namespace hal = tandem::hal;

// A robot of one joint, and the controller on it.
struct Bench {
  Bench() {
    robot.joints.resize(1);
    robot.joints[0].name = "joint";
    robot.joints[0].min_position_rad = -3.0;
    robot.joints[0].max_position_rad = 3.0;
  }
  // Configured and started with the joint at `position_rad`; then `seconds` of cycles.
  bool run(double position_rad, double seconds) {
    if (!controller.configure(setup)) return false;
    state.position_rad()[0] = position_rad;
    controller.start(time, state, command);
    for (double t_s = 0.0; t_s < seconds; t_s += 1e-9 * static_cast<double>(time.period_ns)) {
      if (controller.update(time, state, command) != tandem::Code::kOk) return false;
      if (first_rad == 0.0) first_rad = command.position_rad()[0];
      state.position_rad()[0] = command.position_rad()[0];
      time.time_ns += time.period_ns;
    }
    return true;
  }

  hal::Robot robot;
  hal::ParameterImage gains{1};
  tandem::Result<tandem::TomlDocument> parameters = tandem::TomlDocument::parse(
      "joint = 'joint'\namplitude_rad = 0.2\nperiod_s = 8.0", "parameters");
  hal::CycleTime time;
  // It stays: what the controller declared points into it.
  tandem::ControllerSetup setup{robot, gains, nullptr, time.period_ns, parameters->root()};
  hal::StateImage state{hal::ImageShape{1, {}}};
  hal::CommandImage command{hal::ImageShape{1, {}}};
  @CLASS@ controller;
  double first_rad = 0.0;
};

bool near(const char* what, double is, double wanted, double tolerance) {
  std::printf("%s: %.4f rad, wanted %.4f\n", what, is, wanted);
  return std::abs(is - wanted) < tolerance;
}

bool starts_where_the_joint_is() {
  Bench bench;
  return bench.run(0.7, 0.01) && near("first reference", bench.first_rad, 0.7, 1e-4);
}

// Fails when a sign in the PD law is wrong: the reference runs away.
bool arrives_at_the_target() {
  Bench bench;
  return bench.run(0.7, 3.5) && near("reference", bench.command.position_rad()[0], 0.9, 1e-3);
}

int main(int argc, char** argv) {
  const char* check = argc > 1 ? argv[1] : "";
  if (std::strcmp(check, "starts_where_the_joint_is") == 0) return starts_where_the_joint_is() ? 0 : 1;
  if (std::strcmp(check, "arrives_at_the_target") == 0) return arrives_at_the_target() ? 0 : 1;
  std::printf("there is no check '%s'\n", check);
  return 2;
}
)";

const char kExperiment[] =
    R"(# @ROBOT@ with the controller @NAME@. Joints that it does not claim are held.
robot = @ROBOT_FILE@
@POSTURE@duration_s = 8.0

[[controller]]
plugin = "./build/lib/controllers/@NAME@.so"
[controller.parameters]
joint = @JOINT@
amplitude_rad = @AMPLITUDE@
period_s = 4.0
kp_1_s2 = 16.0

[report]
position_of = @JOINT@
)";

const char kCmake[] = R"(cmake_minimum_required(VERSION 3.25)
project(@NAME@ LANGUAGES CXX)
find_package(tandem REQUIRED)  # where it is: tandem_DIR in CMakePresets.json
tandem_add_controller(@NAME@ SOURCES @NAME@.cpp)

# Without a robot; then on the whole robot, in simulation.
enable_testing()
add_executable(@NAME@_test @NAME@_test.cpp)
target_link_libraries(@NAME@_test PRIVATE tandem::plugin)
foreach(check starts_where_the_joint_is arrives_at_the_target)
  add_test(NAME ${check} COMMAND @NAME@_test ${check})
endforeach()
add_test(NAME runs_on_the_robot COMMAND ${CMAKE_COMMAND} -D tandem=${tandem_EXECUTABLE}
  -D json=${PROJECT_BINARY_DIR}/run.json -P ${PROJECT_SOURCE_DIR}/run_test.cmake)

add_custom_target(run COMMAND ${tandem_EXECUTABLE} run @NAME@.toml
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} USES_TERMINAL VERBATIM)
add_dependencies(run controller_@NAME@)
)";

const char kRunTest[] =
    R"(# Runs @NAME@.toml in simulation, and looks at what came of it (docs/json.md).
set(joint [==[@RAW_JOINT@]==])
execute_process(COMMAND ${tandem} run ${CMAKE_CURRENT_LIST_DIR}/@NAME@.toml
  --quiet --no-log --no-socket --json ${json} RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "the run ended with status ${status}")
endif()

file(READ ${json} result)
string(JSON limited GET "${result}" joints ${joint} limited_cycles)
string(JSON worst GET "${result}" joints ${joint} max_tracking_error_rad)

message("${joint}: limited in ${limited} cycles, at most ${worst} rad from its reference")
if(limited GREATER 0 OR worst GREATER 0.1)
  message(FATAL_ERROR "a limit changed its reference, or it does not follow")
endif()
)";

const char kPresets[] = R"({
  "version": 6,
  "configurePresets": [
    {
      "name": "default",
      "binaryDir": "${sourceDir}/build",
      "cacheVariables": { "tandem_DIR": @PACKAGE@ }
    }
  ],
  "buildPresets": [
    { "name": "default", "configurePreset": "default" },
    { "name": "run", "configurePreset": "default", "targets": ["run"] }
  ],
  "testPresets": [
    { "name": "default", "configurePreset": "default", "output": { "outputOnFailure": true } }
  ],
  "workflowPresets": [
    {
      "name": "run",
      "steps": [
        { "type": "configure", "name": "default" },
        { "type": "build", "name": "default" },
        { "type": "test", "name": "default" },
        { "type": "build", "name": "run" }
      ]
    }
  ]
}
)";

/// "MyArmController" of "my_arm".
std::string class_of(const std::string& name) {
  std::string made;
  bool begins = true;
  for (const char c : name) {
    if (c == '_') {
      begins = true;
      continue;
    }
    made += begins ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c;
    begins = false;
  }
  return made + "Controller";
}

}  // namespace

std::vector<std::pair<std::string, std::string>> controller_files(
    const ControllerProject& project) {
  const std::string posture =
      project.posture.empty() ? "" : "posture = " + quoted_text(project.posture) + "\n";
  const std::pair<std::string, std::string> words[]{
      {"@NAME@", project.name},
      {"@CLASS@", class_of(project.name)},
      {"@TESTED@", "#include \"" + project.name + ".cpp\""},
      {"@ROBOT@", project.robot},
      {"@ROBOT_FILE@", quoted_text(project.robot_file)},
      {"@POSTURE@", posture},
      {"@JOINT@", quoted_text(project.joint)},
      {"@RAW_JOINT@", project.joint},
      {"@AMPLITUDE@", fmt::format("{:.2g}", project.amplitude_rad)},
      {"@PACKAGE@", Json(project.package).dump(-1, ' ', false, Json::error_handler_t::replace)},
  };
  std::vector<std::pair<std::string, std::string>> files{
      {project.name + ".cpp", kSource},      {project.name + "_test.cpp", kTest},
      {project.name + ".toml", kExperiment}, {"CMakeLists.txt", kCmake},
      {"run_test.cmake", kRunTest},          {"CMakePresets.json", kPresets}};
  for (auto& [name, text] : files) {
    for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@', at)) {
      for (const auto& [word, value] : words) {
        if (text.compare(at, word.size(), word) != 0) continue;
        text.replace(at, word.size(), value);
        at += value.size() - 1;
        break;
      }
      ++at;
    }
  }
  return files;
}

}  // namespace tandem::apps
