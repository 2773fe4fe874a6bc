#include "apps/robot/kernel_supply.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "apps/robot/kernel_store.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "model/generate.hpp"

namespace tandem::apps {
namespace {

class BuildProgress {
 public:
  void show(int done, int total, const std::string& file) {
    if (terminal_) {
      restart_line(stderr);
      fmt::print(stderr, "  [{}/{}] {}{}", done, total, file, done < total ? "" : "\n");
      return;
    }
    const int quarter = 4 * done / total;
    if (quarter == quarter_) return;
    quarter_ = quarter;
    fmt::print(stderr, "  {:3d} %  {} of {} steps\n", 25 * quarter, done, total);
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  int quarter_ = 0;
};

}  // namespace

Result<model::BuildReport> build_shown(const robot::RobotFiles& robot,
                                       model::BuildOptions options) {
  BuildProgress progress;
  options.progress = [&progress](int done, int total, const std::string& file) {
    progress.show(done, total, file);
  };
  options.waiting = [&robot] {
    fmt::print(stderr, "{}: another process compiles this robot's dynamics; waiting for it\n",
               robot.config.name);
  };
  return model::build_kernels(robot.tree, robot.spec, options);
}

Result<model::KernelLibrary> supply_kernels(const robot::RobotFiles& robot,
                                            const std::string& variant, MissingKernels missing) {
  auto found = find_kernels(robot, variant);
  if (found || missing == MissingKernels::kRefuse) return found;
  if (!variant.empty() && find_kernels(robot, {})) return found;
  if (missing == MissingKernels::kTolerate) return model::KernelLibrary();

  const std::string& name = robot.config.name;
  const std::string hash = model::description_hash(robot.tree, robot.spec);
  const auto path = user_library(name, hash);
  if (!path) return std::unexpected(path.error());
  model::BuildOptions options;
  options.library = *path;
  if (missing == MissingKernels::kQuiet) {
    const auto report = model::build_kernels(robot.tree, robot.spec, options);
    if (!report) return std::unexpected(report.error());
    return model::load_kernels(*path, hash, variant);
  }
  fmt::print(stderr, "{}: compiling the robot's dynamics, once: later runs reuse them\n", name);
  const auto report = build_shown(robot, options);
  if (!report) return std::unexpected(report.error());
  if (!report->was_up_to_date) {
    fmt::print(stderr, "{}: {} compiled in {:.1f} s: {}\n", name, counted(report->compiled, "file"),
               report->seconds, report->library);
  }
  return model::load_kernels(*path, hash, variant);
}

}  // namespace tandem::apps
