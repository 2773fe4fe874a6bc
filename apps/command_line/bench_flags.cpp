// The flags, arguments and help of `tandem bench`.
#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

const char kBenchEnginesExamples[] = R"(Examples:
  tandem bench engines                               all scenes, every engine that is installed
  tandem bench engines --scenes box,chains --engines mujoco -o runs/two
Engines are installed by scripts/install-dependencies engines, before CMake runs.)";

}  // namespace

void add_flags(CLI::App& app, BenchOptions& o) {
  app.require_subcommand(1);
  app.footer(kBenchEnginesExamples);  // its subcommand's, too
  CLI::App* engines =
      app.add_subcommand("engines", "Multibody engines on the same scenes: error against cost");
  engines
      ->add_option("--engines", o.engines,
                   "Beside Tandem's own: mujoco,dart,bullet,ode,simbody (default: the installed)")
      ->delimiter(',');
  engines
      ->add_option("--scenes", o.scenes,
                   "accelerations,box,chains,flight,fall,slope,drop,stand,squat (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(
          {"accelerations", "box", "chains", "flight", "fall", "slope", "drop", "stand", "squat"}));
  engines->add_option("-o,--output", o.output,
                      "Folder of engines.md and its figures (default: runs/bench)");
  engines->add_flag("--quiet,-q", o.quiet, "Neither progress nor verdicts");
  engines->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
}

}  // namespace tandem::apps
