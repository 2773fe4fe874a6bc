// Flags of `tandem sweep`.
#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

const char kSweepExamples[] = R"(Examples:
  tandem sweep config/studies/coman_push.toml        into sweeps/coman_push, on all cores
  tandem sweep study.toml -j 2 -o /tmp/study         two points at once
  tandem sweep study.toml --at-least 0.99            in CI: status 1 when fewer pass
  tandem sweep study.toml --slurm --sbatch partition=long   on a cluster, from a shared folder
  tandem sweep status sweeps/study                   how far it is
  tandem sweep collect sweeps/study                  the tables and the page, when it is done

Stopped or killed, the same command goes on where it was. The exit status is 0 when every point has a
result, whatever that is: points that fail are what a sweep looks for. docs/sweep.md)";

const char kFolderExamples[] = R"(Example:
  tandem sweep {} sweeps/coman_push)";

CLI::App* add_of_folder(CLI::App& app, SweepOptions& o, const char* name, const char* doc,
                        SweepOptions::Action action) {
  CLI::App* command = app.add_subcommand(name, doc);
  command->add_option("folder", o.folder, "Of the sweep")->required();
  std::string examples = kFolderExamples;
  command->footer(examples.replace(examples.find("{}"), 2, name));
  command->callback([&o, action] { o.action = action; });
  return command;
}

void add_summary(CLI::App& app, SweepOptions& o) {
  app.add_option("--at-least", o.at_least,
                 "Exit status 1 when a smaller share of points passes [0 to 1, 0]")
      ->check(CLI::Range(0.0, 1.0));
  app.add_flag("--quiet,-q", o.quiet, "Neither progress nor table");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
}

}  // namespace

void add_flags(CLI::App& app, SweepOptions& o) {
  using Action = SweepOptions::Action;
  CLI::Option* study =
      app.add_option("study", o.study,
                     "TOML that says what varies (docs/sweep.md), or a bundled name")
          ->transform(a_bundled(Bundled::kStudy));
  app.add_option("--jobs,-j", o.jobs,
                 "Points at once (default: one for each core; with --slurm 1, its cores)")
      ->check(is_count());
  app.add_option("-o,--output", o.folder, "Folder of the results (default: sweeps/STUDY)")
      ->check(is_given("name a folder, or leave it out"));
  app.add_option("--kernel-variant", o.kernel_variant,
                 "Of every point, on any CPU (default: as the folder's, else this CPU's best)");
  app.add_flag("!--no-branches", o.branches,
               "Run every point from its beginning, for the same result");
  add_summary(app, o);
  CLI::Option* slurm = app.add_flag(
      "--slurm", o.slurm, "Submit the points that have no result, as arrays of jobs of Slurm");
  app.add_flag("--dry-run", o.dry_run, "Of --slurm: print the job's script, submit nothing")
      ->needs(slurm);
  app.add_option("--sbatch", o.sbatch,
                 "Of --slurm: an option of sbatch, without dashes: time=2:00:00; repeatable")
      ->allow_extra_args(false)
      ->needs(slurm);
  app.add_option("--chunk-points", o.chunk_points,
                 "Of --slurm: points of an element of an array (default: a hundredth, to 1000)")
      ->check(is_count());
  app.add_option("--chunk", o.chunk, "Run this chunk alone: what an element of an array does")
      ->excludes(slurm);
  app.footer(kSweepExamples);
  CLI::App* status =
      add_of_folder(app, o, "status", "How far a sweep is", Action::kStatus)->excludes(study);
  status->add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
  CLI::App* collect =
      add_of_folder(app, o, "collect", "Tables and page of a sweep on a cluster", Action::kCollect);
  add_summary(*collect, o);
  collect->excludes(study);
  add_of_folder(app, o, "cancel", "Take a sweep out of the cluster's queue", Action::kCancel)
      ->excludes(study);
  // A positional that is required would take the word `status`.
  app.callback([&app, study] {
    if (app.get_subcommands().empty() && study->empty())
      throw CLI::RequiredError(study->get_name());
  });
}

}  // namespace tandem::apps
