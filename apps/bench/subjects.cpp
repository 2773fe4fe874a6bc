#include "apps/bench/subjects.hpp"

#include <fmt/format.h>

#include "apps/robot/kernel_build.hpp"
#include "base/bundled_files.hpp"
#include "hal/sim/setup.hpp"
#include "model/urdf.hpp"

namespace tandem::apps {
namespace {

constexpr double kBlockEdge_m = 0.1;

std::string link(const std::string& name, double mass, const std::array<double, 3>& com,
                 const std::array<double, 3>& inertia) {
  return fmt::format(
      R"(<link name="{}"><inertial><origin xyz="{} {} {}"/><mass value="{}"/>)"
      R"(<inertia ixx="{}" ixy="0" ixz="0" iyy="{}" iyz="0" izz="{}"/></inertial></link>)",
      name, com[0], com[1], com[2], mass, inertia[0], inertia[1], inertia[2]);
}

std::array<double, 3> box_inertia(double mass, double x, double y, double z) {
  return {mass / 12.0 * (y * y + z * z), mass / 12.0 * (z * z + x * x),
          mass / 12.0 * (x * x + y * y)};
}

Result<BenchRobot> finish(robot::RobotFiles robot) {
  auto kernels = robot::supply_kernels(robot, {}, robot::MissingKernels::kBuild, build_once);
  if (!kernels) return std::unexpected(kernels.error());
  BenchRobot subject{std::move(robot), std::move(*kernels)};
  subject.gravity_m_s2 = subject.robot.config.model.gravity_m_s2;
  return subject;
}

Result<BenchRobot> from_urdf(const std::string& name, const std::string& body, bool floating,
                             const hal::RobotConfig& config) {
  robot::RobotFiles robot;
  robot.config = config;
  robot.config.name = name;
  robot.config.model.floating_base = floating;
  auto urdf = model::parse_urdf("<robot name=\"" + name + "\">" + body + "</robot>", name + ".urdf",
                                {.floating_base = floating});
  if (!urdf) return std::unexpected(urdf.error().front());
  robot.tree = std::move(urdf->tree);
  robot.spec = sim::model_spec(robot.config);
  return finish(std::move(robot));
}

hal::ActuatorConfig torque_source() {
  return {.name = "torque",
          .order = 0,
          .resistance_ohm = 1.0,
          .torque_constant_Nm_A = 1.0,
          .gear_ratio = 1.0,
          .inertia_kg_m2 = 1e-9,  // not used: the description has no armature
          .thermal_time_constant_s = 1.0};
}

}  // namespace

Result<sim::Plant> BenchRobot::plant(const EngineEntry& entry, std::int64_t step_ns) const {
  sim::PlantConfig config;
  config.kernels = kernels.get();
  config.engine = entry.engine;
  config.integrator = entry.integrator;
  config.substep_ns = step_ns;
  config.contact = robot.config.contact;
  config.rate_limit = 1e6;
  if (!entry.ours()) {
    config.robot = &robot.config;
    config.tree = &robot.tree;
  }
  for (const model::Joint& joint : robot.tree.joints)
    config.joints.push_back({joint.name, torque_source()});
  return sim::Plant::create(config);
}

Result<BenchRobot> make_box() {
  hal::RobotConfig config;
  config.model.gravity_m_s2 = {0.0, 0.0, 0.0};
  return from_urdf("bench_box", link("box", 1.0, {}, box_inertia(1.0, 0.1, 0.2, 0.4)), true,
                   config);
}

Result<BenchRobot> make_chain(int links) {
  const double mass = 1.0 / links, length = 1.0 / links, thick = 0.05;
  std::string body = R"(<link name="world"/>)";
  for (int i = 1; i <= links; ++i) {
    body += link(fmt::format("rod{}", i), mass, {0.5 * length, 0.0, 0.0},
                 box_inertia(mass, length, thick, thick));
    body += fmt::format(
        R"(<joint name="joint{0}" type="continuous"><parent link="{1}"/><child link="rod{0}"/>)"
        R"(<origin xyz="{2} 0 0"/><axis xyz="{3}"/></joint>)",
        i, i == 1 ? "world" : fmt::format("rod{}", i - 1), i == 1 ? 0.0 : length,
        i % 2 == 1 ? "0 1 0" : "0 0 1");
  }
  return from_urdf(fmt::format("bench_chain{}", links), body, false, {});
}

Result<BenchRobot> make_block(double friction, std::array<double, 3> gravity_m_s2) {
  constexpr double kHalf = 0.5 * kBlockEdge_m;
  hal::RobotConfig config;
  config.model.gravity_m_s2 = gravity_m_s2;
  hal::SiteConfig sole;
  sole.name = "sole";
  sole.link = "block";
  sole.xyz_m = {0.0, 0.0, -kHalf};
  sole.wrench = true;
  config.model.sites.push_back(sole);
  hal::ContactConfig& contact = config.contact;
  contact.stiffness_N_m = 2e4;  // 0.12 mm under its weight
  contact.damping_s_m = 40.0;   // 0.7 of critical under it
  contact.tangential_stiffness_N_m = 2e4;
  contact.tangential_damping_Ns_m = 100.0;  // 0.7 of critical
  contact.static_friction = contact.sliding_friction = friction;
  contact.feet.push_back({.site = "sole", .points_m = {}});
  for (const double x : {-kHalf, kHalf})
    for (const double y : {-kHalf, kHalf}) contact.feet[0].points_m.push_back({x, y, 0.0});
  return from_urdf(
      "bench_block",
      link("block", 1.0, {}, box_inertia(1.0, kBlockEdge_m, kBlockEdge_m, kBlockEdge_m)), true,
      config);
}

Result<BenchRobot> make_flyer(double gravity_m_s2) {
  const auto folder = bundled_folder("coman");
  if (!folder) return std::unexpected(folder.error());
  auto robot = robot::read_robot(*folder + "/robot.toml");
  if (!robot) return std::unexpected(robot.error().front());
  robot->config.contact = {};
  robot->config.joints.clear();
  if (gravity_m_s2 == 0.0) {
    robot->config.name = "bench_weightless_coman";
    robot->config.model.gravity_m_s2 = robot->spec.gravity_m_s2 = {0.0, 0.0, 0.0};
    robot->spec.robot = robot->config.name;
  }
  return finish(std::move(*robot));
}

Result<std::string> bundled_folder(const std::string& robot) {
  const auto file = named_file(robot, Bundled::kRobot);
  if (file) return std::filesystem::path(*file).parent_path().string();
  return fail("the bundled robot '" + robot + "' is not found",
              "run it in the project's folder, or install Tandem whole");
}

}  // namespace tandem::apps
