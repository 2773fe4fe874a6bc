// `tandem test`: starts a process for each experiment, a few at once, and gathers what they say.
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include "apps/run/child_run.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/test_suite.hpp"
#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "base/counted.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "base/temporary_folder.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/condition/expectations.hpp"

namespace tandem::apps {
namespace {

using SuiteClock = std::chrono::steady_clock;

/// A test whose process goes on.
struct Going {
  std::size_t test = 0;  // its number
  pid_t child = 0;
  SuiteClock::time_point begin;
  bool late = false;  // it was ended for that
};

std::string command_of(const std::string& file) {
  std::string command = "tandem";
  for (const std::string& word : child_words(file)) command += " " + shell_word(word);
  return command;
}

class Suite {
 public:
  Suite(std::vector<SuiteTest> tests, const TestOptions& options)
      : tests_(std::move(tests)), options_(options), out_(human_output(options.json)) {
    for (SuiteTest& test : tests_) test.command = command_of(test.file);
  }

  Exit run() {
    if (const Status made = folder_.made(); !made) return refuse(made.error());
    const auto begin = SuiteClock::now();
    if (const Status written = write_junit(); !written) return refuse(written.error());
    rt::install_stop_signals();
    Status written;
    while ((written = start_some()) && !going_.empty() && !rt::stop_requested()) {
      if (const Status ended = end_some(); !ended) {
        written = ended;
        break;
      }
    }
    for (Going& one : going_) end(one);
    if (!written) return refuse(written.error());
    if (rt::stop_requested()) {
      for (SuiteTest& test : tests_) {
        if (!test.passed && test.reason.empty()) test.reason = "it was not run";
      }
      if (written = write_junit(); !written) return refuse(written.error());
    }
    return finish(std::chrono::duration<double>(SuiteClock::now() - begin).count());
  }

 private:
  [[nodiscard]] std::string file_of(std::size_t test, const char* ending) const {
    return fmt::format("{}/{}{}", folder_.path(), test, ending);
  }

  Status write_junit() const {
    if (options_.junit.empty()) return {};
    Draft draft = Draft::file(options_.junit);
    if (const Status done = write_file(draft.path(), junit_text(tests_)); !done)
      return std::unexpected(draft.placed(done.error()));
    return draft.place();
  }

  Status start_some() {
    while (next_ < tests_.size() && going_.size() < options_.jobs) {
      const std::size_t test = next_++;
      if (!tests_[test].reason.empty()) continue;
      std::vector<std::string> words = child_words(tests_[test].file);
      words.insert(words.begin(), program_file());
      for (const char* word : {"--quiet", "--json"}) words.emplace_back(word);
      words.push_back(file_of(test, ".json"));
      const auto child = spawn({.command = std::move(words),
                                .output = file_of(test, ".txt"),
                                .own_group = true,
                                .ends_with_us = true});
      if (!child) return std::unexpected(child.error());
      going_.push_back({.test = test, .child = *child, .begin = SuiteClock::now()});
    }
    return {};
  }

  /// Waits a little; takes those that have ended, and ends those that are too slow.
  Status end_some() {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (std::size_t i = 0; i < going_.size();) {
      Going& one = going_[i];
      int raw = 0;
      if (::waitpid(one.child, &raw, WNOHANG) == one.child) {
        take(one, exit_status(raw));
        going_.erase(going_.begin() + static_cast<std::ptrdiff_t>(i));
        if (const Status written = write_junit(); !written) return written;
        continue;
      }
      const std::chrono::duration<double> took = SuiteClock::now() - one.begin;
      if (!one.late && took.count() > options_.timeout_s) {
        one.late = true;
        (void)::kill(-one.child, SIGKILL);
      }
      ++i;
    }
    return {};
  }

  static void end(const Going& one) {
    (void)::kill(-one.child, SIGKILL);
    (void)wait_for(one.child);
  }

  void take(const Going& one, int status) {
    SuiteTest& test = tests_[one.test];
    test.seconds = std::chrono::duration<double>(SuiteClock::now() - one.begin).count();
    ChildRun run = child_run(file_of(one.test, ".json"), file_of(one.test, ".txt"), status,
                             one.late ? options_.timeout_s : 0.0);
    test.passed = run.passed;
    test.expectations = std::move(run.expectations);
    test.reason = std::move(run.reason);
    test.said = std::move(run.said);
    tell(test);
  }

  void tell(const SuiteTest& test) {
    ++ended_;
    if (options_.quiet) return;
    fmt::print(out_, "{} {} ({:.1f} s)\n", *test.passed ? "passed" : "FAILED",
               shown(test.file, 4'096), test.seconds);
    std::fflush(out_);
  }

  Exit finish(double seconds) {
    SuiteResult result{.seconds = seconds, .tests = std::move(tests_)};
    for (const SuiteTest& test : result.tests) {
      std::size_t& count = !test.passed   ? result.skipped
                           : *test.passed ? result.passed
                                          : result.failed;
      ++count;
    }
    print(result);
    const Status written = write_json(options_.json, figures_json(result));
    if (!written) return refuse(written.error());
    if (rt::stop_requested() && ended_ < result.tests.size()) return interrupted(rt::stop_signal());
    return result.failed > 0 ? Exit::kFault : Exit::kDone;
  }

  void print(const SuiteResult& result) const {
    Table table({"experiment", "expected", "", "margin", "at", "why"});
    table.align_left();
    for (const SuiteTest& test : result.tests) {
      const bool alone = test.expectations.empty() || !test.reason.empty();
      if (alone)
        table.add({shown(test.file, 48), "",
                   !test.passed ? "skipped" : (*test.passed ? "passed" : "FAILED"), "", "",
                   shown(test.reason)});
      for (const runtime::ExpectationResult& one : test.expectations)
        table.add({shown(test.file, 48), shown(one.name, 48), one.passed ? "passed" : "FAILED",
                   runtime::margin_text(one),
                   one.at_s ? fmt::format("{:.3f} s", *one.at_s) : std::string(),
                   shown(one.reason)});
    }
    if (!options_.quiet) {
      fmt::print(out_, "\n");
      table.print(out_);
      fmt::print(out_, "\n{}: {} passed, {} failed, {} skipped, in {:.1f} s\n",
                 counted(result.tests.size(), "experiment"), result.passed, result.failed,
                 result.skipped, result.seconds);
    }
    for (const SuiteTest& test : result.tests) {
      if (test.passed.value_or(true)) continue;
      fmt::print(stderr, "failed: {}{}{}\n  repeat it: {}\n", shown(test.file, 4'096),
                 test.reason.empty() ? "" : ": ", shown(test.reason), test.command);
      if (!test.reason.empty() && !test.said.empty())
        fmt::print(stderr, "{}", test.said.ends_with('\n') ? test.said : test.said + "\n");
    }
  }

  std::vector<SuiteTest> tests_;
  const TestOptions& options_;
  std::FILE* out_;
  TemporaryFolder folder_{"test"};  // for what the processes write
  std::vector<Going> going_;
  std::size_t next_ = 0, ended_ = 0;
};

}  // namespace

Exit test_command(const TestOptions& given) {
  TestOptions options = given;
  if (options.jobs == 0) options.jobs = std::max(1U, std::thread::hardware_concurrency());
  for (const Status& writable :
       {check_writable(options.json), check_writable(options.junit, "<?xml", "XML")}) {
    if (!writable) return refuse(writable.error());
  }
  auto tests = find_tests(options.paths);
  if (!tests) return refuse(tests.error());
  return Suite(std::move(*tests), options).run();
}

}  // namespace tandem::apps
