// What the page says of a run, beside its figures.
#include "report/report.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "report/log_head.hpp"
#include "report/run_facts.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::report {
namespace {

std::string page_text(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(Report, SaysWhichRunItShows) {
  const log::ScratchFolder folder;
  const auto files = make_report(TANDEM_SOURCE_DIR "/tests/fuzz/seeds/mcap/plain", {},
                                 folder / "report", [](const RunData&) { return nullptr; });
  ASSERT_TRUE(files) << files.error().to_string();
  const std::string page = page_text(files->page);
  for (const std::string fact :
       {"<dt>backend</dt><dd>sim</dd>", "<dt>seed</dt><dd>1</dd>",
        "<dt>period</dt><dd>1000 us</dd>", "<dt>tandem</dt><dd>0.1.0</dd>"}) {
    EXPECT_NE(page.find(fact), std::string::npos) << fact << "\n"
                                                  << page.substr(page.find("<h2>Run</h2>"));
  }
}

// The head of two logs named files alone: when, how long and in what they differ was far below.
TEST(Report, OfTwoLogsHasBothInItsHead) {
  Page page;
  page.title = "two runs";
  RunData a, b;
  a.path = "a.mcap";
  b.path = "b.mcap";
  a.info.seed = b.info.seed = 1;
  a.info.started = "2026-11-28T05:03:05Z";
  a.time_s = b.time_s = {1.0, 3.0};
  a.info.parameters = {"squat.depth_m = 0.1", "squat.cycles = 4"};
  b.info.parameters = {"squat.depth_m = 0.2", "squat.cycles = 4"};
  a.info.configuration = {{"here/arm.toml", "robot = 1"}, {"here/robot.toml", "kd = 1"}};
  b.info.configuration = {{"there/arm.toml", "robot = 1"}, {"there/robot.toml", "kd = 2"}};
  a.info.controllers = {"squat abc /one/squat.so"};
  b.info.controllers = {"squat abc /other/squat.so"};
  page.heads = {head_facts(a, a), head_facts(b, a)};
  const auto html = page_content(page, {}, {});
  ASSERT_TRUE(html);
  for (const std::string part :
       {"<tr class=\"differs\"><th scope=\"row\">log</th><td>a.mcap</td><td>b.mcap</td></tr>",
        "<th scope=\"row\">experiment</th><td colspan=\"2\">arm.toml</td>",
        "<th scope=\"row\">seed</th><td colspan=\"2\">1</td>", "<td>2026-11-28T05:03:05Z</td>",
        "<td colspan=\"2\">2.000 s</td>", "data-log=\"B/\"",
        "<td>files: robot.toml; parameters: squat.depth_m = 0.2</td>"}) {
    EXPECT_NE(html->find(part), std::string::npos) << part << "\n" << *html;
  }
  EXPECT_LT(html->find("b.mcap"), html->find("class=\"figures\""));
}

// It said that it covers everything from its first time to its last one.
TEST(Report, OfADamagedLogSaysWhichTimesItLacks) {
  RunData run;
  run.time_s = {0.0, 10.0};
  run.last_s = 10.0;
  run.remarks = {"a chunk is damaged"};
  const auto covers = [&run] {
    Facts facts;
    add_facts(run, "", facts);
    const auto found = std::ranges::find(facts, "covers", &Facts::value_type::first);
    return found == facts.end() ? "" : found->second;
  };
  EXPECT_EQ(covers(), "0.000 to 10.000 s");
  run.gaps_s = {{5.0, 5.2}, {6.0, 6.2}};
  EXPECT_EQ(covers(), "0.000 to 10.000 s, without 5.000 to 5.200 s, 6.000 to 6.200 s");
  run.gaps_s.assign(5, {5.0, 5.2});
  EXPECT_TRUE(covers().ends_with(", 2 more"));
}

}  // namespace
}  // namespace tandem::report
