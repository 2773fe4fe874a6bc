// The flags of `tandem shrink` and `tandem search`.
#include <charconv>

#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

constexpr char kShrinkExamples[] = R"(Examples:
  tandem shrink fall.toml -o small.toml              which of its pushes, and how hard at least?
  tandem shrink fall.toml --expect "stays_up" -j 4   the same expectation has to fail, four at once

Every candidate is run. What happens are its rows [[push]], [[fault]], [[event]], [[sim.payload]],
[[sim.patch]], [[sim.ground]] and [[sim.shake]]. Ctrl-C keeps the smallest so far. The exit status is 0 when small.toml is
written, 2 when the scenario does not fail. docs/search.md)";

constexpr char kSearchExamples[] = R"(Examples:
  tandem search push.toml -o worst.toml              the least margin of any expectation
  tandem search push.toml --expect "stays up" --runs 500
  tandem search push.toml --method phase --along 'push[0].after_s'   evenly along one key
  tandem search map.toml --limit 'push[0].impulse_Ns' --up-to 12 -o map.csv   how hard a push, where

A study is the file of `tandem sweep`: an experiment, and a [[vary]] for each value that changes.
The same study and seed give the same result, however many run at once. The exit status is 0 when
the worst point passes, 1 when it fails, 2 when nothing could be run. docs/search.md)";

CLI::Validator is_a_factor() {
  const auto check = [](const std::string& text) -> std::string {
    double factor = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), factor);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    if (whole && factor >= 1e-9 && factor <= 1e9) return "";
    return "'" + text + "' is no factor from 1e-9 to 1e9 (to push the other way, turn the values)";
  };
  return {check, "above 0"};
}

/// What both have.
template <class Options>
void add_runs(CLI::App& app, Options& o, const std::string& which) {
  app.add_option("--expect", o.expect, "Name of the expectation (default: " + which + ")")
      ->check(is_given("name an expectation, or leave it out"));
  app.add_option("--jobs,-j", o.jobs, "Runs at once (default: one for each core)")
      ->check(is_count());
  app.add_flag("!--no-branches", o.branches,
               "Run every candidate from its beginning, for the same result");
  app.add_flag("--quiet,-q", o.quiet, "Neither progress nor result");
  app.add_option("--json", o.json, kJsonHelp)->check(is_given(kNameAFile));
}

}  // namespace

void add_flags(CLI::App& app, ShrinkOptions& o) {
  app.add_option("scenario", o.scenario, "Experiment that fails an expectation")
      ->required()
      ->transform(a_bundled(Bundled::kExperiment));
  app.add_option("-o,--output", o.output, "The smaller one (default: NAME.small.toml, here)")
      ->check(is_given(kNameAFile));
  app.add_option("--timeout", o.timeout_s, "End a run that takes longer [s, 300]")
      ->check(a_duration());
  add_runs(app, o, "the first that fails");
  app.footer(kShrinkExamples);
}

void add_flags(CLI::App& app, SearchOptions& o) {
  app.add_option("study", o.study, "Study: what varies, and of which experiment")
      ->required()
      ->transform(a_bundled(Bundled::kStudy));
  app.add_option("-o,--output", o.output, "Write the worst point as a scenario")
      ->check(is_given(kNameAFile));
  CLI::Option* method = app.add_option("--method", o.method, "cma_es (default), phase, random")
                            ->check(CLI::IsMember({"cma_es", "phase", "random"}));
  CLI::Option* along =
      app.add_option("--along", o.along, "Key of a phase sweep (default: the only one)")
          ->check(is_given("name the key of a [[vary]], or leave it out"));
  CLI::Option* up_to = app.add_option("--up-to", o.up_to, "Greatest factor of --limit");
  up_to->check(is_a_factor());
  CLI::Option* limit =
      app.add_option("--limit", o.limit,
                     "Instead: at each point of a grid, by how much this key's numbers can be "
                     "multiplied until it fails; -o is CSV")
          ->check(is_given("name the key of a [[vary]], or leave it out"))
          ->needs(up_to)
          ->excludes(method, along);
  up_to->needs(limit);
  app.add_option("--svg", o.svg, "Draw the limits by direction, a panel for each other value")
      ->check(is_given(kNameAFile))
      ->needs(limit);
  app.add_option("--halvings", o.halvings, "Of the interval from 0 to --up-to (default: 5)")
      ->check(CLI::Range(0, 30))
      ->needs(limit);
  app.add_option("--runs", o.runs, "Runs at most (default: 200)")->check(is_count());
  app.add_option("--seed", o.seed, "Seed of the method (default: 1)")->check(is_seed());
  add_runs(app, o, "the least margin of all");
  app.footer(kSearchExamples);
}

}  // namespace tandem::apps
