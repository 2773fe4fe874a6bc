#include "apps/bench/humanoid_runs.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "apps/bench/flights.hpp"
#include "apps/bench/subjects.hpp"
#include "apps/robot/kernel_build.hpp"
#include "apps/text/console.hpp"
#include "base/process.hpp"
#include "hal/sim/held_robot.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kDegrees = 180.0 / std::numbers::pi;

class Scratch {
 public:
  Scratch() {
    std::string name = fs::temp_directory_path() / "tandem-bench-XXXXXX";
    if (::mkdtemp(name.data()) != nullptr) folder_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] std::string file(const char* name) const { return (folder_ / name).string(); }

 private:
  fs::path folder_;
};

/// The experiment with its robot by an absolute path and with the entry's [sim].
std::string experiment_text(const std::string& folder, const std::string& name,
                            const EngineEntry& entry) {
  std::string text = robot::text_of(folder + "/" + name);
  const std::string robot = "robot = \"";
  text.insert(text.find(robot) + robot.size(), fs::absolute(folder).string() + "/");
  text += fmt::format("\n[sim]\nengine = \"{}\"\n", entry.engine);
  if (entry.integrator == sim::Integrator::kRungeKutta4) text += "integrator = \"rk4\"\n";
  return text;
}

HumanoidRow row_of(const EngineEntry& entry, const Json& run) {
  HumanoidRow row{.entry = &entry};
  if (run.contains("errors")) {
    row.refusal = run["errors"].empty() ? "refused" : run["errors"][0].value("message", "refused");
    return row;
  }
  if (!run["faults"].empty()) row.refusal = run["faults"][0].get<std::string>();
  const Json& base = run["base"];
  const Json& ground = run["ground"];
  row.height_mm = 1e3 * (base.value("max_height_m", 0.0) - base.value("min_height_m", 0.0));
  row.tilt_deg = kDegrees * base.value("final_tilt_rad", 0.0);
  row.slip_mm = 1e3 * ground.value("max_foot_slip_m", 0.0);
  const double weight = ground.value("weight_N", 1.0);
  row.force_error = ground.value("mean_vertical_force_N", 0.0) / weight - 1.0;
  for (const auto& [name, joint] : run["joints"].items())
    row.tracking_deg =
        std::max(row.tracking_deg, kDegrees * joint.value("max_tracking_error_rad", 0.0));
  row.cost_us_per_ms =
      1e3 * run.value("wall_seconds", 0.0) / std::max(1e-9, run.value("sim_seconds", 0.0));
  return row;
}

double most_moved_mm(std::span<const double> from, std::span<const double> to) {
  double most = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) most = std::max(most, std::abs(to[i] - from[i]));
  return 1e3 * most;
}

double turned_deg(std::span<const double> from, std::span<const double> to) {
  const double back[4] = {-from[0], -from[1], -from[2], from[3]};
  const auto turn = sim::quaternion_product(back, to.data());
  return 2.0 * kDegrees * std::hypot(turn[0], turn[1], turn[2]);
}

/// One cycle; a row that has no refusal yet gets one when the simulation or a drive gave up.
void step(sim::HeldRobot& coman, StandRow& row) {
  const bool fine = coman.step() == Code::kOk && coman.robot->phase() != hal::Phase::kFault;
  if (!fine) row.refusal = coman.robot->status_text();
}

StandRow stand(const EngineEntry& entry, sim::HeldRobot coman, double weight_N) {
  StandRow row{.entry = &entry};
  const auto cycles = std::lround(1e3 * kStandTime_s);
  for (long i = 0; i < cycles; ++i) {
    step(coman, row);
    if (!row.refusal.empty()) return row;
  }
  const hal::TruthImage start = coman.robot->truth();
  const hal::TruthImage& now = coman.robot->truth();
  double force_N = 0.0;
  const double before = thread_time_s();
  for (long i = 0; i < cycles && row.refusal.empty(); ++i) {
    step(coman, row);
    force_N += (now.foot_force_N()[2] + now.foot_force_N()[5]) / static_cast<double>(cycles);
    row.foot_mm =
        std::max(row.foot_mm, most_moved_mm(start.foot_position_m(), now.foot_position_m()));
    row.base_mm =
        std::max(row.base_mm, most_moved_mm(start.base_position_m(), now.base_position_m()));
    row.turn_deg =
        std::max(row.turn_deg, turned_deg(start.base_quaternion(), now.base_quaternion()));
  }
  row.cost_us_per_ms = 1e3 * (thread_time_s() - before) / kStandTime_s;
  row.force_error = force_N / weight_N - 1.0;
  return row;
}

}  // namespace

Result<std::vector<StandRow>> measure_stand(const std::vector<EngineEntry>& entries) {
  const auto folder = bundled_folder("coman");
  if (!folder) return std::unexpected(folder.error());
  const auto coman = robot::read_robot(*folder + "/robot.toml");
  if (!coman) return std::unexpected(coman.error().front());
  const auto kernels = robot::supply_kernels(*coman, {}, robot::MissingKernels::kBuild, build_once);
  if (!kernels) return std::unexpected(kernels.error());
  std::vector<StandRow> rows;
  for (const EngineEntry& entry : entries) {
    auto robot = sim::SimRobot::create(coman->config, kernels->get(),
                                       {.engine = entry.engine,
                                        .integrator = entry.integrator,
                                        .posture = "stand",
                                        .tree = std::make_shared<model::Tree>(coman->tree)});
    if (!robot) {
      rows.push_back({.entry = &entry, .refusal = robot.error().message});
      continue;
    }
    rows.push_back(
        stand(entry, {coman->config, std::move(*robot), "stand"}, (*kernels)->mass_kg * 9.81));
  }
  return rows;
}

Result<std::vector<HumanoidRow>> measure_humanoid(const std::string& experiment, double duration_s,
                                                  const std::vector<EngineEntry>& entries) {
  const auto folder = bundled_folder("coman");
  if (!folder) return std::unexpected(folder.error());
  const Scratch scratch;
  const std::string file = scratch.file("run.toml"), json = scratch.file("run.json");
  std::vector<HumanoidRow> rows;
  for (const EngineEntry& entry : entries) {
    if (Status written = write_file(file, experiment_text(*folder, experiment, entry)); !written)
      return std::unexpected(written.error());
    const Result<pid_t> child = spawn(
        {.command = {program_beside("tandem"), "run", file, "--no-log", "--no-dds", "--no-socket",
                     "--quiet", "--duration", fmt::format("{}", duration_s), "--json", json},
         .output = scratch.file("said")});
    if (!child) return std::unexpected(child.error());
    (void)wait_for(*child);  // the JSON says how it went
    const Json run = Json::parse(robot::text_of(json), nullptr, false);
    if (run.is_discarded()) {
      rows.push_back({.entry = &entry, .refusal = robot::text_of(scratch.file("said"))});
    } else {
      rows.push_back(row_of(entry, run));
    }
    std::error_code ignored;
    fs::remove(json, ignored);
  }
  return rows;
}

}  // namespace tandem::apps
