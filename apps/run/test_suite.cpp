// Which experiments are tests, and what is written of them.
#include "apps/run/test_suite.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/quoting.hpp"
#include "base/toml_reader.hpp"
#include "runtime/condition/expectations.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

enum class TomlKind : std::uint8_t { kTest, kWithout, kOther };

/// What a file is, by its first keys. What cannot be read is a test: its run says why.
TomlKind kind_of(const std::string& file) {
  const auto document = TomlDocument::load(file);
  if (!document) return TomlKind::kTest;
  const TomlTable root = document->root();
  if (root.has("expect")) return TomlKind::kTest;
  if (!root.has("duration_s") && !root.has("controller")) return TomlKind::kOther;
  const bool happens = root.has("event") || root.has("push") || root.has("fault");
  return happens ? TomlKind::kTest : TomlKind::kWithout;
}

std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code ignored;
  for (fs::recursive_directory_iterator at(folder, ignored), end; at != end; at.increment(ignored))
    if (at->is_regular_file(ignored) && at->path().extension() == ".toml")
      files.push_back(at->path().lexically_normal().string());
  std::ranges::sort(files);
  return files;
}

/// As text and as an attribute: XML has no control characters.
std::string xml_of(const std::string& text) { return xml_text(harmless(text)); }

void add_case(std::string& xml, const SuiteTest& test, const std::string& name,
              const std::string& inside, double seconds = 0.0) {
  xml += fmt::format("    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3f}\">{}</testcase>\n",
                     xml_of(test.file), xml_of(name), seconds, inside);
}

std::string expectation_case(const runtime::ExpectationResult& one) {
  std::string inside;
  if (const std::string margin = runtime::margin_text(one); !margin.empty())
    inside += fmt::format("<properties><property name=\"margin\" value=\"{}\"/></properties>",
                          xml_of(margin));
  if (!one.passed)
    inside += fmt::format("<failure message=\"{}\"/>", xml_of(runtime::in_words(one)));
  return inside;
}

/// The process itself.
std::string run_case(const SuiteTest& test) {
  if (!test.passed) {
    return test.reason.empty() ? "<error message=\"crashed\"/>"
                               : fmt::format("<skipped message=\"{}\"/>", xml_of(test.reason));
  }
  std::string inside;
  if (!test.reason.empty())
    inside +=
        fmt::format("<error message=\"{}\">{}</error>", xml_of(test.reason), xml_of(test.command));
  if (!test.said.empty()) inside += "<system-out>" + xml_of(test.said) + "</system-out>";
  return inside;
}

}  // namespace

void figures(Figures& f, const SuiteTest& test) {
  f("file", test.file);
  f("passed", "null: it was not run", test.passed);
  f("reason", "why it was not run, or failed beside its expectations; empty: neither", test.reason);
  f("seconds", "on the wall clock", test.seconds);
  f("command", "that repeats it", test.command);
  f("expectations", "as of `tandem run`", test.expectations);
}

void figures(Figures& f, const SuiteResult& result) {
  f("passed", "experiments", result.passed);
  f("failed", result.failed);
  f("skipped", "they expect nothing, or the suite was stopped before", result.skipped);
  f("wall_seconds", "of all of them", result.seconds);
  f("tests", "an experiment each", result.tests);
}

Result<std::vector<SuiteTest>> find_tests(const std::vector<std::string>& paths) {
  std::vector<SuiteTest> tests;
  for (const std::string& path : paths) {
    std::error_code error;
    const bool folder = fs::is_directory(path, error);
    if (!folder && !fs::exists(path, error))
      return fail("'" + path + "' is not there", "give files or folders of experiments");
    for (const std::string& file : folder ? files_in(path) : std::vector<std::string>{path}) {
      const TomlKind kind = kind_of(file);
      if (kind == TomlKind::kOther && folder) continue;
      if (kind == TomlKind::kOther) {
        return std::unexpected(Error{.message = "is no experiment",
                                     .hint = "give one, or a folder of them",
                                     .file = file,
                                     .key = {}});
      }
      if (std::ranges::find(tests, file, &SuiteTest::file) != tests.end()) continue;
      SuiteTest test;
      test.file = file;
      if (kind == TomlKind::kWithout)
        test.reason = "it has no [[expect]], and nothing happens in it";
      tests.push_back(std::move(test));
    }
  }
  if (std::ranges::all_of(tests, [](const SuiteTest& one) { return !one.reason.empty(); })) {
    return fail("no experiment there expects anything, and nothing happens in one",
                "add [[expect]] or [[event]] to one: docs/expectations.md");
  }
  return tests;
}

std::string junit_text(const std::vector<SuiteTest>& tests) {
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"tandem\">\n";
  for (const SuiteTest& test : tests) {
    const bool unended = !test.passed && test.reason.empty();
    const std::size_t errors = unended || (test.passed && !test.reason.empty()) ? 1 : 0;
    xml += fmt::format(
        "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" "
        "time=\"{:.3f}\">\n",
        xml_of(test.file), 1 + test.expectations.size(), runtime::failed(test.expectations), errors,
        !test.passed && !unended ? 1 : 0, test.seconds);
    add_case(xml, test, "run", run_case(test), test.seconds);
    for (const runtime::ExpectationResult& one : test.expectations)
      add_case(xml, test, one.name, expectation_case(one));
    xml += "  </testsuite>\n";
  }
  return xml + "</testsuites>\n";
}

}  // namespace tandem::apps
