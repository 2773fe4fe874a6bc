#include "apps/robot/kernel_build.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "base/open_file.hpp"

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

Result<model::BuildReport> build_once(const robot::RobotFiles& robot, model::BuildOptions options) {
  const std::string& name = robot.config.name;
  fmt::print(stderr, "{}: compiling the robot's dynamics, once: later runs reuse them\n", name);
  auto report = build_shown(robot, std::move(options));
  if (report && !report->was_up_to_date) {
    fmt::print(stderr, "{}: {} compiled in {:.1f} s: {}\n", name, counted(report->compiled, "file"),
               report->seconds, report->library);
  }
  return report;
}

robot::BuildKernels not_built(const std::string& file) {
  return [file](const robot::RobotFiles& robot,
                const model::BuildOptions&) -> Result<model::BuildReport> {
    (void)open_new(file);
    return fail(robot.config.name + ": no kernels fit", "they are built first");
  };
}

}  // namespace tandem::apps
