// `tandem test`: experiments that expect something, each in a process of its own.
// Layer: apps/run.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/control/run_figures.hpp"
#include "apps/text/figures.hpp"
#include "base/result.hpp"
#include "runtime/condition/expectation.hpp"

namespace tandem::apps {

/// An experiment of a suite, and what became of it.
struct SuiteTest {
  std::string file;
  std::optional<bool> passed{};  ///< empty: it was not run
  /// Why it was not run, or failed beside its expectations: "crashed: …"; empty: neither.
  std::string reason{};
  double seconds = 0.0;  ///< on the wall clock
  std::string command;   ///< that repeats it in a shell
  std::vector<runtime::ExpectationResult> expectations{};
  std::string said{};  ///< the end of what its process printed
};
void figures(Figures& f, const SuiteTest& test);

/// What `tandem test --json` has.
struct SuiteResult {
  std::size_t passed = 0, failed = 0, skipped = 0;
  double seconds = 0.0;
  std::vector<SuiteTest> tests;
};
void figures(Figures& f, const SuiteResult& result);

/// The experiments of files and folders, these with all in them, in the order of their names. One
/// without [[expect]] is not run, and says so; other TOML in a folder is left out. What is no TOML
/// is a test, which fails.
/// Errors: a path that is not there; a file that is no experiment; nothing that expects anything.
[[nodiscard]] Result<std::vector<SuiteTest>> find_tests(const std::vector<std::string>& paths);

/// JUnit's XML: a suite for each experiment with a case for each expectation and one, "run", for
/// the process. One that has not ended yet is an error, "crashed": so a suite that is cut tells it.
[[nodiscard]] std::string junit_text(const std::vector<SuiteTest>& tests);

}  // namespace tandem::apps
