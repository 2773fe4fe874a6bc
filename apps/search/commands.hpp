// The commands of `tandem` that run a scenario many times, each time a little different, to learn
// what makes it fail. Layer: apps/search.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "apps/control/run_figures.hpp"
#include "apps/text/figures.hpp"
#include "runtime/condition/expectation.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {

/// "12 of them went on from 1 common beginning, simulated once"
[[nodiscard]] std::string branches_text(std::size_t branched, std::size_t trunks);

/// The fewest and smallest events with which a scenario fails. @return kUsage: it does not fail
[[nodiscard]] Exit shrink_command(const ShrinkOptions& options);
/// What its JSON has.
struct ShrinkResult {
  std::string file;                          ///< the smaller scenario
  runtime::ExpectationResult expectation{};  ///< that fails
  std::size_t events_before = 0, events = 0;
  std::size_t runs = 0, branched = 0, trunks = 0;
  double seconds = 0.0;  ///< on the wall clock
  std::string command;   ///< that repeats it
};
void figures(Figures& f, const ShrinkResult& result);

/// Where the margin of an experiment is least, among the values of a study. @return kFault: it
/// fails there
[[nodiscard]] Exit search_command(const SearchOptions& options);
/// What its JSON has.
struct SearchResult {
  /// After a generation.
  struct Progress {
    std::size_t runs = 0;
    std::optional<double> least{}, least_so_far{};
  };
  std::string method;
  runtime::ExpectationResult expectation{};  ///< at the worst point
  std::vector<std::string> settings{};       ///< of it: KEY=VALUE
  std::size_t runs = 0, failed = 0, refused = 0, branched = 0, trunks = 0;
  double seconds = 0.0;   ///< on the wall clock
  std::string file{};     ///< the worst point as a scenario; empty: none was asked for
  std::string command{};  ///< that repeats it
  std::vector<Progress> progress{};
};
/// How far the list of numbers at a key can be scaled until it fails, at each point of a grid.
[[nodiscard]] Exit find_limits(const SearchOptions& options, const sweep::Study& study);
/// What its JSON has.
struct LimitResult {
  struct Row {
    std::vector<std::string> values{};
    std::optional<double> passed{}, failed{};
    std::string reason{};  ///< why none passed; empty: one did
  };
  std::string key;
  std::size_t runs = 0, branched = 0, trunks = 0;
  double seconds = 0.0;  ///< on the wall clock
  std::vector<Row> points{};
};
void figures(Figures& f, const LimitResult::Row& row);
void figures(Figures& f, const LimitResult& result);
void figures(Figures& f, const SearchResult::Progress& progress);
void figures(Figures& f, const SearchResult& result);

}  // namespace tandem::apps
