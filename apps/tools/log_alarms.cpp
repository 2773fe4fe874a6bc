#include "apps/tools/log_alarms.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "apps/text/draft.hpp"
#include "report/alarm_figures.hpp"
#include "report/gnuplot.hpp"
#include "report/page.hpp"

namespace tandem::apps {
namespace {

constexpr double kWatched_s = 0.2;
constexpr const char* kBy = "tandem log thresholds";

double period_of(const std::vector<double>& time_s) {
  return time_s.size() < 2
             ? 1e-3
             : (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
}

/// What the runs are called: their logs without folder and ending, or all as given when two of
/// them would be called the same.
std::vector<std::string> names_of(const std::vector<NamedTorques>& runs) {
  std::vector<std::string> names;
  std::set<std::string> different;
  for (const NamedTorques& run : runs) {
    names.push_back(std::filesystem::path(run.path).stem().string());
    different.insert(names.back());
  }
  if (different.size() == names.size()) return names;
  for (std::size_t i = 0; i < runs.size(); ++i) names[i] = runs[i].path;
  return names;
}

/// The pushes of a run; a time is that of the row in which it was found, counted from the push.
AlarmTable::Pushes pushes_of(const NamedTorques& run, const std::string& name,
                             const std::vector<double>& thresholds_Nm,
                             const std::vector<double>& factors) {
  const ExternalTorques& t = run.torques;
  estimation::DetectionTimes times(thresholds_Nm, factors);
  for (std::size_t p = 0; p < t.push_s.size(); ++p) {
    const double next_s = p + 1 < t.push_s.size() ? t.push_s[p + 1] : INFINITY;
    const double end_s = std::min(t.push_s[p] + kWatched_s, next_s);
    auto row = static_cast<std::size_t>(std::ranges::lower_bound(t.time_s, t.push_s[p]) -
                                        t.time_s.begin());
    times.begin_push();
    for (; row < t.time_s.size() && t.time_s[row] < end_s; ++row) times.look(t.at(row));
  }
  AlarmTable::Pushes all{name, {}};
  for (std::size_t f = 0; f < factors.size(); ++f) {
    auto summary = times.with(f);
    summary.median *= 1e3 * period_of(t.time_s);
    summary.worst *= 1e3 * period_of(t.time_s);
    all.by_factor.push_back(summary);
  }
  return all;
}

std::string in_ms(double time) { return std::isfinite(time) ? fmt::format("{:.0f}", time) : "–"; }

std::vector<std::string> header_of(const AlarmTable& table) {
  std::vector<std::string> header{"factor", "false alarms", "an hour"};
  for (const auto& one : table.pushed) header.push_back(one.name + ": median / worst [ms], found");
  return header;
}

std::vector<std::string> row_of(const AlarmTable& table, std::size_t f) {
  std::vector<std::string> row{fmt::format("{:.2f}", table.factors[f]),
                               std::to_string(table.alarms[f]),
                               fmt::format("{:.1f}", table.per_hour(f))};
  for (const auto& one : table.pushed) {
    const auto& s = one.by_factor[f];
    row.push_back(
        fmt::format("{} / {}, {} of {}", in_ms(s.median), in_ms(s.worst), s.found, s.pushes));
  }
  return row;
}

}  // namespace

double AlarmTable::per_hour(std::size_t factor) const {
  return free_s > 0.0 ? 3600.0 * static_cast<double>(alarms[factor]) / free_s : 0.0;
}

AlarmTable alarm_table(const std::vector<NamedTorques>& runs,
                       const std::vector<double>& thresholds_Nm) {
  AlarmTable table;
  for (int i = 10; i <= 25; ++i) table.factors.push_back(0.05 * i);
  table.alarms.resize(table.factors.size());
  const std::vector<std::string> names = names_of(runs);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const NamedTorques& run = runs[i];
    const double period_s = period_of(run.torques.time_s);
    estimation::FalseAlarms alarms(thresholds_Nm, static_cast<std::uint32_t>(std::max(
                                                      1.0, std::round(kWatched_s / period_s))));
    for (std::size_t row = 0; row < run.torques.free_rows(); ++row)
      alarms.look(run.torques.at(row));
    table.free_s += static_cast<double>(alarms.cycles()) * period_s;
    for (std::size_t f = 0; f < table.factors.size(); ++f)
      table.alarms[f] += alarms.alarms(table.factors[f]);
    if (!run.torques.push_s.empty())
      table.pushed.push_back(pushes_of(run, names[i], thresholds_Nm, table.factors));
  }
  return table;
}

void print_alarms(const AlarmTable& table, std::FILE* out) {
  fmt::print(out, "\n# on {:.0f} s of other free motion, and pushes\n", table.free_s);
  Table text(header_of(table));
  for (std::size_t f = 0; f < table.factors.size(); ++f) text.add(row_of(table, f));
  text.print(out);
}

Json alarms_json(const AlarmTable& table) {
  Json json{{"free_s", table.free_s}, {"factors", Json::array()}};
  const auto finite = [](double ms) { return std::isfinite(ms) ? Json(ms) : Json(nullptr); };
  for (std::size_t f = 0; f < table.factors.size(); ++f) {
    Json one{{"factor", table.factors[f]},
             {"alarms", table.alarms[f]},
             {"per_hour", table.per_hour(f)},
             {"pushed", Json::object()}};
    for (const auto& pushed : table.pushed) {
      const auto& s = pushed.by_factor[f];
      one["pushed"][pushed.name] = {{"pushes", s.pushes},
                                    {"found", s.found},
                                    {"median_ms", finite(s.median)},
                                    {"worst_ms", finite(s.worst)}};
    }
    json["factors"].push_back(std::move(one));
  }
  return json;
}

namespace {

std::vector<report::AlarmCurve> curves_of(const AlarmTable& table) {
  std::vector<report::AlarmCurve> curves;
  for (const auto& one : table.pushed) {
    report::AlarmCurve curve{one.name, {}, {}, {}};
    for (std::size_t f = 0; f < table.factors.size(); ++f) {
      curve.alarms_per_hour.push_back(table.per_hour(f));
      curve.median_ms.push_back(one.by_factor[f].median);
      curve.worst_ms.push_back(one.by_factor[f].worst);
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

report::Page page_of(const AlarmTable& table) {
  report::Page page{.title = "Collision thresholds",
                    .lead =
                        "False alarms of motion that touched nothing against the time until a "
                        "push is found, for factors on the thresholds.",
                    .facts = {{"free motion", fmt::format("{:.0f} s", table.free_s)}},
                    .tables = {{"Factors",
                                "Of the learned thresholds. –: fewer than half of the "
                                "pushes were found, or not all of them.",
                                header_of(table),
                                {}}},
                    .by = kBy};
  for (std::size_t f = 0; f < table.factors.size(); ++f)
    page.tables[0].rows.push_back(row_of(table, f));
  return page;
}

}  // namespace

Result<std::string> write_alarm_page(const AlarmTable& table, const std::string& folder) {
  if (table.pushed.empty()) {
    return fail("no log has a push to draw",
                "give --against a log of a run with pushes: --scenario with a [[fault]]");
  }
  if (const Status kept = check_overwrites(folder + "/report.html", report::page_begin(kBy),
                                           std::string("page of `") + kBy + "`");
      !kept) {
    return std::unexpected(kept.error());
  }
  Result<Draft> draft = Draft::folder(folder);
  if (!draft) return std::unexpected(draft.error());
  const auto figures = report::alarm_figures("alarms", "Time to detection", curves_of(table));
  Status made = report::draw(figures, draft->path());
  if (made) made = report::write_page(page_of(table), figures, draft->path());
  if (!made) return std::unexpected(draft->placed(made.error()));
  if (made = draft->place(); !made) return std::unexpected(made.error());
  return folder + "/report.html";
}

}  // namespace tandem::apps
