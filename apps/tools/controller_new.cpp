// `tandem controller new`: the folder of a controller that moves a robot, with its tests.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string_view>

#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/controller_files.hpp"
#include "base/bundled_files.hpp"
#include "base/file_name.hpp"
#include "base/open_file.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "hal/config/capabilities.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

/// Words of C++ that nothing can be called, and that a name may well be.
constexpr std::array<std::string_view, 30> kReserved{
    "auto",   "break", "case",   "class",  "concept",  "const",    "continue", "default",
    "delete", "do",    "double", "else",   "export",   "float",    "for",      "friend",
    "goto",   "if",    "int",    "long",   "new",      "operator", "private",  "public",
    "return", "short", "static", "switch", "template", "while"};

Diagnostics one(std::string message, std::string hint, std::string what) {
  return {Error{std::move(message), std::move(hint), {}, 0, std::move(what)}};
}

Diagnostics check_name(const std::string& name) {
  std::string problem = topic_name_problem(name);
  if (problem.empty() && std::ranges::find(kReserved, name) != kReserved.end())
    problem = "is a word of C++";
  if (problem.empty()) return {};
  return one("the controller's name '" + name + "' " + problem,
             "letters, digits and _, no digit first: it names a class and files", "name");
}

/// Where find_package(tandem) finds this program: its installation or its build folder.
Result<std::string> package_folder() {
  const fs::path prefix = fs::path(program_beside("tandem")).parent_path().parent_path();
  for (const char* folder : {"lib/cmake/tandem", "package"}) {
    std::error_code ignored;
    const fs::path found = prefix / folder;
    if (fs::is_regular_file(found / "tandemConfig.cmake", ignored)) return found.string();
  }
  return fail("what it takes to build a controller is not beside this program, in " +
                  (prefix / "lib/cmake/tandem").string(),
              "install it: cmake --install BUILD_FOLDER --prefix PREFIX");
}

/// Links on the way to a foot.
std::vector<bool> legs_of(const robot::RobotFiles& robot) {
  std::vector<bool> in_leg(robot.tree.joints.size());
  const hal::Robot its = hal::robot_of(robot.config);
  for (const hal::Foot& foot : its.feet) {
    const auto site = std::ranges::find(its.sites, foot.site, &hal::Site::name);
    int link = site == its.sites.end() ? -1 : robot.tree.link_index(site->link);
    while (link >= 0) {
      const model::Link& at = robot.tree.links[static_cast<std::size_t>(link)];
      if (at.moving >= 0) in_leg[static_cast<std::size_t>(at.moving)] = true;
      link = at.parent;
    }
  }
  return in_leg;
}

/// The last joint that turns, has room about the posture, and carries no robot; else one of a leg,
/// which moves little.
void choose_joint(const robot::RobotFiles& robot, ControllerProject& project) {
  const hal::RobotConfig& config = robot.config;
  const std::vector<bool> in_leg = legs_of(robot);
  for (std::size_t j = 0; j < config.joints.size(); ++j) {
    const hal::JointConfig& joint = config.joints[j];
    const int index = robot.tree.joint_index(joint.name);
    const bool leg = index >= 0 && in_leg[static_cast<std::size_t>(index)];
    const double at = config.postures.empty() ? 0.0 : config.postures[0].position_rad[j];
    const double room = std::min(joint.max_position_rad - at, at - joint.min_position_rad);
    const double most = joint.slides ? 0.02 : leg ? 0.03 : 0.2;
    const double amplitude = std::min({most, 0.5 * room, 0.2 * joint.max_velocity_rad_s});
    if (!(amplitude > 0.0) || amplitude < project.amplitude_rad) continue;
    project.joint = joint.name;
    project.amplitude_rad = amplitude;
  }
}

Diagnostics run(const ControllerNewOptions& options) {
  if (Diagnostics wrong = check_name(options.name); !wrong.empty()) return wrong;
  const std::string folder = options.output.empty() ? options.name : options.output;
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(folder, ignored))) {
    return {Error{
        "this exists already", "give another name, or another folder with -o", folder, 0, {}}};
  }
  const Result<std::string> file =
      named_file(options.robot, Bundled::kRobot);  // the default's, too
  if (!file) return {file.error()};
  const auto robot = robot::read_robot(*file);
  if (!robot) return robot.error();
  const Result<std::string> package = package_folder();
  if (!package) return {package.error()};

  ControllerProject project;
  project.name = options.name;
  project.robot_file = fs::canonical(*file, ignored).string();
  project.robot = robot->config.name;
  project.package = *package;
  if (!robot->config.postures.empty()) project.posture = robot->config.postures[0].name;
  choose_joint(*robot, project);
  if (project.joint.empty()) {
    return one("no joint of this robot can move about its first posture", "name another robot",
               "robot");
  }
  Result<Draft> draft = Draft::folder(folder);
  if (!draft) return {draft.error()};
  for (const auto& [name, text] : controller_files(project)) {
    if (Status written = write_file(fs::path(draft->path()) / name, text); !written)
      return {draft->placed(written.error())};
  }
  if (Status done = draft->place(); !done) return {done.error()};
  Facts facts;
  facts.add("controller",
            fmt::format("{0}/{1}.cpp: moves {2} of {3} by {4:.2g} rad to and fro", folder,
                        project.name, project.joint, project.robot, project.amplitude_rad));
  facts.add("tests",
            fmt::format("{}/{}_test.cpp, {}/run_test.cmake", folder, project.name, folder));
  facts.print(stdout);
  fmt::print("\nNext, to build, test and run it:\n  cd {} && cmake --workflow --preset run\n",
             shell_word(folder));
  return {};
}

}  // namespace

Exit controller_new_command(const ControllerNewOptions& options) {
  const Diagnostics errors = run(options);
  print_errors(errors);
  return errors.empty() ? Exit::kDone : Exit::kUsage;
}

}  // namespace tandem::apps
