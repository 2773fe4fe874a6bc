// `tandem model`: builds a robot's kernels, shows what its description amounts to, and writes its
// package for ROS 2.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "apps/robot/kernel_build.hpp"
#include "apps/robot/wrong_kind.hpp"
#include "apps/text/console.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/kernel_sizes.hpp"
#include "apps/tools/right_angles.hpp"
#include "base/counted.hpp"
#include "robot/kernel_store.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

Status build(const robot::RobotFiles& robot, const ModelOptions& options) {
  model::BuildOptions build;
  build.library = options.output;
  std::error_code ignored;
  const bool folder =
      options.output.ends_with('/') || std::filesystem::is_directory(options.output, ignored);
  if (options.output.empty() || folder) {
    const std::string hash = model::description_hash(robot.tree, robot.spec);
    auto path = folder ? robot::library_in(options.output, robot.config.name, hash)
                       : robot::user_library(robot.config.name, hash);
    if (!path) {
      Error error = path.error();
      if (!folder) error.hint += ", or name the library with -o";
      return std::unexpected(std::move(error));
    }
    build.library = std::move(*path);
  }
  if (Status lost = check_overwrites(build.library,
                                     "\x7F"
                                     "ELF",
                                     "library");
      !lost)
    return lost;
  build.force = options.force;
  const Result<model::BuildReport> report = build_shown(robot, build);
  if (!report) return std::unexpected(report.error());
  if (report->was_up_to_date) {
    fmt::print("{}: kernels are up to date ({})\n", robot.config.name, report->library);
  } else {
    fmt::print("{}: {} compiled in {:.1f} s: {}\n", robot.config.name,
               counted(report->compiled, "file"), report->seconds, report->library);
  }
  return {};
}

Json kernel_json(const tandem_kernel_count& count, std::uint64_t text_bytes) {
  return {{"add", count.add},        {"mul", count.mul},       {"div", count.div},
          {"sqrt", count.sqrt},      {"sincos", count.sincos}, {"pairs", count.pairs},
          {"text_bytes", text_bytes}};
}

/// Code size of a kernel with all that it calls, as its operations are counted.
std::uint64_t text_bytes_of(const std::string& kernel,
                            const std::map<std::string, std::uint64_t>& bytes) {
  std::vector<std::string> parts{kernel};
  if (kernel == "forward_dynamics_derivatives")
    parts = {kernel, "forward_dynamics", "inverse_dynamics_derivatives", "mass_factor"};
  std::uint64_t sum = 0;
  for (const std::string& part : parts)
    if (const auto found = bytes.find(part); found != bytes.end()) sum += found->second;
  return sum;
}

Status info(const robot::RobotFiles& robot, const ModelOptions& options) {
  const auto library = robot::find_kernels(robot, options.kernel_variant);
  if (!library) return std::unexpected(library.error());
  const tandem_kernels& k = **library;
  const auto bytes = kernel_text_bytes(library->path(), k.variant);
  if (!bytes) return std::unexpected(bytes.error());

  std::FILE* out = human_output(options.json);
  Facts facts;
  facts.add("robot",
            fmt::format("{}, {} base", k.robot, k.floating_base != 0 ? "floating" : "fixed"));
  facts.add("joints", fmt::format("{} (nv {}, nq {})", k.joints, k.nv, k.nq));
  facts.add("mass", fmt::format("{:.3f} kg", k.mass_kg));
  facts.add("sites, sensors",
            fmt::format("{}, {}", robot.config.model.sites.size(), robot.config.sensors.size()));
  facts.add("kernels", fmt::format("{} ({})", library->path(), k.variant));
  facts.add("made from", fmt::format("{:.16}…", k.description_hash));
  Json json{{"robot", k.robot},
            {"joints", k.joints},
            {"nv", k.nv},
            {"mass_kg", k.mass_kg},
            {"kernel_variant", k.variant},
            {"description_hash", k.description_hash},
            {"library", library->path()},
            {"kernels", Json::object()}};
  if (Status status = add_right_angles(robot, facts, json); !status) return status;
  facts.print(out);
  fmt::print(out, "\n");
  Table table({"kernel", "add", "mul", "div", "sqrt", "sincos", "pairs", "code [bytes]"});
  for (std::uint32_t i = 0; i < k.kernel_count; ++i) {
    const tandem_kernel_count& c = k.counts[i];
    const std::uint64_t text_bytes = text_bytes_of(c.kernel, *bytes);
    table.add({c.kernel, std::to_string(c.add), std::to_string(c.mul), std::to_string(c.div),
               std::to_string(c.sqrt), std::to_string(c.sincos), std::to_string(c.pairs),
               std::to_string(text_bytes)});
    json["kernels"][c.kernel] = kernel_json(c, text_bytes);
  }
  table.print(out);
  return write_json(options.json, json);
}

}  // namespace

Exit model_command(const ModelOptions& options) {
  struct Row {
    ModelOptions::Action action;
    const char* command;
    Status (*perform)(const robot::RobotFiles& robot, const ModelOptions& options);
  };
  static constexpr Row kRows[] = {
      {ModelOptions::Action::kBuild, "tandem model build", build},
      {ModelOptions::Action::kInfo, "tandem model info", info},
      {ModelOptions::Action::kRos2, "tandem model ros2", write_ros2_package},
  };
  const Row& row = *std::ranges::find(kRows, options.action, &Row::action);
  if (const auto wrong = wrong_kind(options.robot, Takes::kRobot, row.command))
    return refuse(*wrong);
  const auto robot = robot::read_robot(options.robot);
  if (!robot) return refuse(robot.error());
  const Status done = row.perform(*robot, options);
  if (done) return Exit::kDone;
  return refuse(done.error());
}

}  // namespace tandem::apps
