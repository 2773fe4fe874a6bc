// docs/json.md against the declarations of figures: its tables are written from them.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "apps/can/bus_table.hpp"
#include "apps/clients/topic_rate.hpp"
#include "apps/machine/doctor.hpp"
#include "apps/machine/latency_report.hpp"
#include "apps/robot/scale_facts.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/metrics.hpp"
#include "apps/run/replay_figures.hpp"
#include "apps/run/run_summary.hpp"
#include "apps/run/slurm_sweep.hpp"
#include "apps/run/test_suite.hpp"
#include "apps/search/commands.hpp"
#include "apps/tools/commands.hpp"
#include "sweep/summary.hpp"

namespace tandem::apps {
namespace {

const std::string kPage = std::string(TANDEM_SOURCE_DIR) + "/docs/json.md";

std::string file_text(const std::string& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// What docs/json.md documents by tables: the name in the comment before each, and its figures.
const Named<std::vector<Figures::Row>> kTables{
    {"run", Figures::rows_of<const RunSummary*>()},
    {"replay", Figures::rows_of<runtime::ReplayResult>()},
    {"test", Figures::rows_of<SuiteResult>()},
    {"sweep", Figures::rows_of<sweep::SweepSummary>()},
    {"sweep status", Figures::rows_of<SweepStatus>()},
    {"shrink", Figures::rows_of<ShrinkResult>()},
    {"search", Figures::rows_of<SearchResult>()},
    {"search limit", Figures::rows_of<LimitResult>()},
    {"controller check", Figures::rows_of<ControllerCheckResult>()},
    {"bus", Figures::rows_of<hal::can::BusLoad>()},
    {"scales", scale_figures()},
    {"doctor", Figures::rows_of<DoctorResult>()},
    {"latency", Figures::rows_of<LatencyResult>()},
    {"topic hz", Figures::rows_of<RateFigures>()},
    {"emulate", emulate_figures()},
    {"eds show", eds_figures()},
    {"excite", excite_figures()},
    {"identify", identify_figures()},
    {"log info", log_figures()},
    {"log import", import_figures()},
    {"log replay", replay_figures()},
};

std::string table_text(const std::vector<Figures::Row>& rows) {
  std::string text = "| key | type | meaning |\n|---|---|---|\n";
  for (const Figures::Row& row : rows)
    text += fmt::format("| `{}` | {} | {} |\n", row.path, row.type, row.words);
  return std::regex_replace(text, std::regex("  \\|"), " |");
}

/// The page with every table as the declarations have it.
std::string page_as_declared(std::string page) {
  for (const auto& [name, rows] : kTables) {
    const std::string begin = "<!-- figures: " + name + " -->\n";
    const std::size_t at = page.find(begin);
    const std::size_t end = page.find("<!-- end -->", at);
    if (end == std::string::npos) {
      ADD_FAILURE() << kPage << " has no place for the figures of " << name << ": " << begin;
      continue;
    }
    page.replace(at + begin.size(), end - at - begin.size(), table_text(rows));
  }
  return page;
}

TEST(Documentation, OfTheJsonIsWhatTheFiguresDeclare) {
  const std::string page = file_text(kPage);
  const std::string declared = page_as_declared(page);
  if (std::getenv("TANDEM_WRITE_DOCS") != nullptr) {
    std::ofstream(kPage) << declared;
    GTEST_SKIP() << "docs/json.md is written";
  }
  EXPECT_TRUE(page == declared)
      << "docs/json.md is not what the figures declare: scripts/json-docs writes it";
}

TEST(Documentation, OfTheMetricsIsWhatTheRowsDeclare) {
  const std::string file = std::string(TANDEM_SOURCE_DIR) + "/docs/service.md";
  const std::string page = file_text(file);
  std::string table = "| metric | type | unit | meaning |\n|---|---|---|---|\n";
  for (const MetricRow& row : metric_rows())
    table += fmt::format("| `{}` | {} | {} | {} |\n", row.name, row.type, row.unit, row.help);
  const std::string begin = "<!-- metrics -->\n";
  const std::size_t at = page.find(begin), end = page.find("<!-- end -->", at);
  ASSERT_NE(end, std::string::npos);
  std::string declared = page;
  declared.replace(at + begin.size(), end - at - begin.size(), table);
  if (std::getenv("TANDEM_WRITE_DOCS") != nullptr) {
    std::ofstream(file) << declared;
    GTEST_SKIP() << "docs/service.md is written";
  }
  EXPECT_TRUE(page == declared)
      << "docs/service.md is not what the rows declare: scripts/json-docs writes it";
}

/// As Prometheus wants names: of ours, in base units, a counter by its ending.
TEST(Documentation, OfTheMetricsHasRowsAsPrometheusWantsThem) {
  std::set<std::string> names;
  for (const MetricRow& row : metric_rows()) {
    const std::string name = row.name, type = row.type;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_TRUE(std::regex_match(name, std::regex("tandem(_[a-z]+)+"))) << name;
    EXPECT_TRUE(type == "counter" || type == "gauge" || type == "histogram") << name;
    EXPECT_EQ(name.ends_with("_total"), type == "counter") << name;
    EXPECT_FALSE(std::string(row.help).ends_with('.') || *row.help == 0) << name;
  }
  EXPECT_GT(names.size(), 20U);
}

TEST(Documentation, OfTheJsonHasNoKeyTwice) {
  for (const auto& [name, rows] : kTables) {
    std::set<std::string> paths;
    EXPECT_GT(rows.size(), 3U);
    for (const Figures::Row& row : rows) {
      const bool again = row.path == "remote";  // of two alternatives
      EXPECT_TRUE(paths.insert(row.path).second || again) << name << ": " << row.path;
    }
  }
}

/// A row with a figure that nobody declares would never be shown.
TEST(Documentation, OfTheJsonHasEveryFigureThatRowsShow) {
  std::set<std::string> declared;
  for (const auto& [name, rows] : kTables) {
    for (const Figures::Row& row : rows) {
      declared.insert(row.path);
      for (std::size_t dot = row.path.find('.'); dot != std::string::npos;
           dot = row.path.find('.', dot + 1))
        declared.insert(row.path.substr(dot + 1));  // of rows of a part
    }
  }
  const std::regex place("\\{([a-z][\\w.]*)(?:[:|][^}\"]*)?\\}");
  for (const char* file :
       {"run/run_summary_print.cpp", "run/remote_link.cpp", "can/bus_watch.cpp",
        "run/parallel_summary.cpp", "can/round_trips.cpp", "clients/topic_rate.cpp",
        "run/emulate_command.cpp", "tools/excite_command.cpp", "tools/identify_command.cpp",
        "tools/log_command.cpp", "tools/log_import.cpp", "tools/log_replay.cpp"}) {
    std::size_t seen = 0;
    std::istringstream lines(file_text(std::string(TANDEM_SOURCE_DIR) + "/apps/" + file));
    for (std::string line; std::getline(lines, line);) {
      std::string text = line.substr(std::min(line.size(), line.find('"')));
      for (std::smatch found; std::regex_search(text, found, place); text = found.suffix()) {
        EXPECT_TRUE(declared.contains(found[1])) << file << " shows {" << found[1] << "}";
        ++seen;
      }
    }
    EXPECT_GT(seen, 1U) << file;
  }
}

TEST(FiguresText, ConvertsIntoTheUnitThatIsShown) {
  const Json json{{"slip_m", 0.0123},
                  {"tilt_rad", 0.5},
                  {"axes", 1},
                  {"none", nullptr},
                  {"cycle_ns", {{"p50", 1500}, {"p99", 2000}, {"p999", 2500}, {"max", 9000}}},
                  {"log", {{"path", "a.mcap"}, {"share", 0.5}}}};
  EXPECT_EQ(figures_text("{slip_m:.1f mm}, {slip_m:.4f m}, {tilt_rad:.2f deg}", json),
            "12.3 mm, 0.0123 m, 28.65 deg");
  EXPECT_EQ(figures_text("{axes|axis|axes} of {log.path}: {log.share:.0f %}", json),
            "1 axis of a.mcap: 50 %");
  EXPECT_EQ(figures_text("{cycle_ns:.1f us}", json), "1.5 / 2.0 / 2.5 / 9.0 us");
  EXPECT_EQ(figures_text("{cycle_ns}", json), "1500 / 2000 / 2500 / 9000");
  EXPECT_EQ(figures_text("{slip_m:.1f} of {log.share:.1f m}, {slip_m:.4f}", json),
            "0.0 of 0.5 m, 0.0123")
      << "of the next that has a unit";
  EXPECT_EQ(figures_text("{slip_m:.1f} and {slip_m:.2f mm}", json), "12.3 and 12.30 mm");
  EXPECT_EQ(figures_text("{names}", {{"names", {"a", "b"}}}), "a, b");
  EXPECT_EQ(figures_text("{names}", {{"names", Json::array()}}), std::nullopt);
  EXPECT_EQ(figures_text("in {none:.1f mm}", json), std::nullopt);
  EXPECT_EQ(figures_text("in {log.nothing}", json), std::nullopt);
}

TEST(FiguresTable, HasItsHeadersUnitsAndADashWhereNothingIsKnown) {
  const Json joints{{"hip", {{"error_rad", 0.5}, {"share", 0.25}}},
                    {"knee", {{"error_rad", nullptr}}}};
  char* text = nullptr;
  std::size_t size = 0;
  std::FILE* out = ::open_memstream(&text, &size);
  figures_table({{"joint", ""}, {"error [deg]", "{error_rad:.2f}"}, {"left [%]", "{share:.0f}"}},
                joints)
      .print(out);
  std::fclose(out);
  const std::string shown(text, size);
  std::free(text);
  EXPECT_TRUE(std::regex_search(shown, std::regex("hip +28\\.65 +25\n"))) << shown;
  EXPECT_TRUE(std::regex_search(shown, std::regex("knee +- +-\n"))) << shown;
}

struct Weighed {
  double mass_kg = 0.0, ci95 = 0.0;
};
void figures(Figures& f, const Weighed& one) {
  f("mass", "of all", [&](Figures& mass) {
    mass("value_kg", one.mass_kg);
    mass("ci95", "by the data", one.ci95);
  });
  f("after", 1);
}

TEST(Figures, DeclareAnObjectAndNoNumberThatIsNotFinite) {
  EXPECT_EQ(figures_json(Weighed{2.0, NAN}).dump(),
            R"({"mass":{"value_kg":2.0,"ci95":null},"after":1})");
  std::vector<std::string> rows;
  for (const Figures::Row& row : Figures::rows_of<Weighed>())
    rows.push_back(row.path + ", " + row.type + ", " + row.words);
  EXPECT_EQ(rows, (std::vector<std::string>{"mass, object, of all", "mass.value_kg, number, ",
                                            "mass.ci95, number, by the data", "after, integer, "}));
}

}  // namespace
}  // namespace tandem::apps
