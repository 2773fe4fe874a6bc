#include "apps/bench/engine_page.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>

#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

constexpr const char* kCost = "us per simulated ms";
constexpr const char* kDriftCost = "mm us per simulated ms";
constexpr const char* kAccuracy = "most accurate in the shortest steps";

#ifdef __clang__
constexpr const char* kCompiler = __VERSION__;
#else
constexpr const char* kCompiler = "g++ " __VERSION__;
#endif

std::string number(double value) {
  if (std::isnan(value)) return "diverged";
  return fmt::format("{:.2g}", value);
}

/// Null where there is none.
Json json_number(double value) { return std::isnan(value) ? Json() : Json(value); }

std::string refused(const EngineEntry& entry, std::size_t columns, const std::string& why) {
  std::string row = fmt::format("| {} | {}", entry.label, why);
  for (std::size_t i = 1; i < columns; ++i) row += " |";
  return row + " |\n";
}

std::string header(const std::vector<std::string>& columns) {
  std::string names = "|", rule = "|";
  for (const std::string& column : columns) {
    names += " " + column + " |";
    rule += " --- |";
  }
  return "\n" + names + "\n" + rule + "\n";
}

/// The model of the CPU, as Linux names it.
std::string cpu() {
  constexpr std::string_view kKey = "model name\t: ";
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(kKey)) return line.substr(kKey.size());
  }
  return "unknown";
}

// At which error costs are compared.
constexpr double kFlightTarget_rad = 0.005;
constexpr double kSlopeTarget_mm = 0.1;

double flight_error(const FlightRow& row, std::size_t i) { return row.steps[i].error_rad; }
double slope_error(const SlopeRow& row, std::size_t i) { return row.steps[i].error_mm; }

template <class Row>
double price(const Row& row, double at_most, double (*error)(const Row&, std::size_t)) {
  double least = std::nan("");
  for (std::size_t i = 0; i < row.steps.size(); ++i) {
    const double cost = row.steps[i].cost_us_per_ms;
    if (error(row, i) <= at_most && !(least <= cost)) least = cost;
  }
  return least;
}

template <class Row>
report::Figure curves(const std::string& name, const std::string& title,
                      const std::string& error_label, const std::vector<Row>& rows,
                      double (*error)(const Row&, std::size_t)) {
  report::Figure figure{.name = name,
                        .title = title,
                        .x_label = "processor time of a simulated ms [us]",
                        .y_label = error_label,
                        .log_axes = true};
  for (const Row& row : rows) {
    report::Curve curve{row.entry->label, row.entry->style, {}, {}};
    for (std::size_t i = 0; i < row.steps.size(); ++i) {
      if (std::isnan(error(row, i))) continue;
      curve.x.push_back(row.steps[i].cost_us_per_ms);
      curve.y.push_back(std::max(error(row, i), 1e-16));
    }
    if (!curve.x.empty()) figure.curves.push_back(std::move(curve));
  }
  return figure;
}

/// What rounds to zero has no sign.
std::string percent(double share) {
  constexpr double kHalf = 0.5e-3;  // of the last decimal
  return std::abs(100.0 * share) < kHalf ? "0.000 %" : fmt::format("{:+.3f} %", 100.0 * share);
}

std::string file_name(std::string title) {
  std::ranges::replace_if(
      title, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return title;
}

}  // namespace

std::string EnginePage::most_accurate(const Words& words, const std::vector<Price>& prices) {
  const auto worse = [](const Price& a, const Price& b) {  // NaN is the worst
    return a.error < b.error || (std::isnan(b.error) && !std::isnan(a.error));
  };
  const auto best = std::ranges::min_element(prices, worse);
  if (best == prices.end() || std::isnan(best->error)) return "";
  std::string names;
  for (const Price& price : prices)
    if (price.printed == best->printed)
      names += fmt::format("{}**{}**", names.empty() ? "" : ", ", price.entry->label);
  return fmt::format("; {}: {}, {}{}", words.accuracy, names, best->printed, words.error);
}

void EnginePage::judge(const std::string& title, const Words& words, std::vector<Price> prices) {
  const std::string accurate = most_accurate(words, prices);
  std::string missing;
  for (const Price& price : prices)
    if (std::isnan(price.cost)) missing += (missing.empty() ? "" : ", ") + price.entry->label;
  std::erase_if(prices, [](const Price& price) { return std::isnan(price.cost); });
  if (prices.empty()) return;
  std::ranges::sort(prices, {}, &Price::cost);
  std::string line = fmt::format("{}, {}: **{}** needs least, {} {}", title, words.target,
                                 prices[0].entry->label, number(prices[0].cost), words.unit);
  for (std::size_t i = 1; i < prices.size(); ++i)
    line += fmt::format("{} {} {:.1f}", i == 1 ? "; times as much:" : ",", prices[i].entry->label,
                        prices[i].cost / prices[0].cost);
  if (!missing.empty()) line += "; not reached by " + missing;
  verdicts_.push_back(line + accurate);
}

void EnginePage::add(const std::string& title, const std::vector<AccelerationRow>& rows) {
  sections_ += fmt::format(
      "\n## {}\nForward dynamics at 1,000 random states and torques, without ground. The "
      "difference is that to the generated kernels, over the state's largest acceleration. ODE "
      "has no function for it: three of its steps are extrapolated.\n",
      title);
  sections_ += header({"engine", "worst difference", "one evaluation [us]"});
  std::vector<Price> prices;
  for (const AccelerationRow& row : rows) {
    if (!row.refusal.empty()) {
      sections_ += refused(*row.entry, 2, row.refusal);
      continue;
    }
    sections_ += fmt::format("| {} | {} | {} |\n", row.entry->label,
                             row.entry->ours() ? "0" : fmt::format("{:.1e}", row.worst),
                             fmt::format("{:.3g}", row.cost_us));
    const double error = row.entry->ours() ? std::nan("") : row.worst;  // the kernels are ours
    prices.push_back({row.entry, row.cost_us, error, fmt::format("{:.1e}", error)});
    json_.push_back({{"scene", "accelerations"},
                     {"engine", row.entry->label},
                     {"worst_difference", row.worst},
                     {"evaluation_us", row.cost_us}});
  }
  judge(title, {"one evaluation", "us", "nearest to the kernels", ""}, std::move(prices));
}

void EnginePage::add(const Flight& flight, const std::vector<FlightRow>& rows,
                     double truth_error_rad) {
  sections_ += fmt::format("\n## {}\n{} The truth's own error is about {} rad.\n", flight.title,
                           flight.text, number(truth_error_rad / 15.0));
  sections_ += fmt::format("\n![{}]({{folder}}/{}.png)\n", flight.title, flight.name);
  std::vector<std::string> columns{"engine"};
  for (const FlightResult& step : rows.front().steps)
    columns.push_back(
        fmt::format("error at {:g} ms [rad]", 1e-6 * static_cast<double>(step.step_ns)));
  if (flight.keeps_energy) columns.emplace_back("energy drift at 1 ms");
  if (flight.keeps_momentum) columns.emplace_back("angular momentum's drift at 1 ms");
  if (flight.subject->floats()) columns.emplace_back("base out of place at 1 ms [mm]");
  columns.emplace_back("cost at 1 ms [us per ms]");
  sections_ += header(columns);
  std::vector<Price> prices;
  for (const FlightRow& row : rows) {
    if (row.steps.empty()) {
      sections_ += refused(*row.entry, columns.size() - 1, row.refusal);
      continue;
    }
    std::string line = "| " + row.entry->label;
    for (const FlightResult& step : row.steps) {
      line += " | " + number(step.error_rad);
      note(flight.name, *row.entry, 1e-6 * static_cast<double>(step.step_ns), "error_rad",
           step.error_rad, step.cost_us_per_ms);
      if (flight.subject->floats()) json_.back()["base_error_mm"] = json_number(step.base_error_mm);
    }
    const FlightResult& at_1ms = row.steps[std::min<std::size_t>(2, row.steps.size() - 1)];
    if (flight.keeps_energy) line += " | " + fmt::format("{:.1e}", at_1ms.energy_drift);
    if (flight.keeps_momentum) line += " | " + fmt::format("{:.1e}", at_1ms.momentum_drift);
    if (flight.subject->floats()) line += " | " + number(at_1ms.base_error_mm);
    sections_ += line + fmt::format(" | {:.3g} |\n", at_1ms.cost_us_per_ms);
    const double shortest = row.steps.back().error_rad;
    prices.push_back(
        {row.entry, price(row, kFlightTarget_rad, flight_error), shortest, number(shortest)});
  }
  figures_.push_back(
      curves(flight.name, flight.title, "error at the end [rad]", rows, flight_error));
  judge(flight.title,
        {fmt::format("for an error of {} rad", kFlightTarget_rad), kCost, kAccuracy, " rad"},
        std::move(prices));
}

void EnginePage::add(const Slope& slope, const std::vector<SlopeRow>& rows) {
  const std::string title = "Block on a slope, " + slope.title;
  const std::string name = "slope_" + file_name(slope.title);
  sections_ += fmt::format(
      "\n## {}\nA cube of 1 kg on four points. {:g} s after it was put down its way along the "
      "slope is measured for {:g} s more, against Coulomb's law from the speed that it has "
      "then.\n\n![{}]({{folder}}/{}.png)\n",
      title, kSlopeSettle_s, kSlopeTime_s, title, name);
  std::vector<std::string> columns{"engine"};
  for (const SlopeResult& step : rows.front().steps)
    columns.push_back(fmt::format("error at {:g} ms [mm]", step.step_ms));
  columns.emplace_back("sideways at 1 ms [mm]");
  columns.emplace_back("cost at 1 ms [us per ms]");
  sections_ += header(columns);
  std::vector<Price> prices;
  for (const SlopeRow& row : rows) {
    if (row.steps.empty()) {
      sections_ += refused(*row.entry, columns.size() - 1, row.refusal);
      continue;
    }
    std::string line = "| " + row.entry->label;
    for (const SlopeResult& step : row.steps) {
      line += " | " + number(step.error_mm);
      note(name, *row.entry, step.step_ms, "error_mm", step.error_mm, step.cost_us_per_ms);
    }
    const SlopeResult& at_1ms = row.steps[std::min<std::size_t>(1, row.steps.size() - 1)];
    sections_ +=
        line + fmt::format(" | {} | {:.3g} |\n", number(at_1ms.sideways_mm), at_1ms.cost_us_per_ms);
    const double shortest = row.steps.back().error_mm;
    prices.push_back(
        {row.entry, price(row, kSlopeTarget_mm, slope_error), shortest, number(shortest)});
  }
  figures_.push_back(curves(name, title, "error after 1 s [mm]", rows, slope_error));
  judge(title, {fmt::format("for an error of {} mm", kSlopeTarget_mm), kCost, kAccuracy, " mm"},
        std::move(prices));
}

void EnginePage::add(const std::vector<DropRow>& rows) {
  sections_ +=
      "\n## A block is dropped\nThe cube falls 50 mm onto its four points; nothing bounces by "
      "intent. It is settled when it stays slower than 1 mm/s. 1 ms is longer than this ground's "
      "stiffness and damping allow Tandem's leapfrog: from some heights it settles, from others "
      "the block is thrown. (The bench sets sub-steps itself; a run refuses those that are too "
      "long.)\n";
  sections_ += header({"engine", "step [ms]", "rebound [mm]", "settled after [s]",
                       "in the ground at the end [mm]", "energy gained [mJ]", "cost [us per ms]"});
  for (const DropRow& row : rows) {
    if (!row.refusal.empty()) {
      sections_ += refused(*row.entry, 6, row.refusal);
      continue;
    }
    note("drop", *row.entry, row.step_ms, "rebound_mm", row.rebound_mm, row.cost_us_per_ms);
    sections_ += fmt::format("| {} | {:g} | {} | {} | {} | {} | {:.3g} |\n", row.entry->label,
                             row.step_ms, number(row.rebound_mm),
                             row.settled_s < 0.0 ? "never" : fmt::format("{:.3f}", row.settled_s),
                             number(row.depth_mm), number(row.energy_gain_mJ), row.cost_us_per_ms);
  }
}

void EnginePage::add(const std::vector<StandRow>& rows) {
  const std::string title = "COMAN stands";
  sections_ += fmt::format(
      "\n## {0}\nIts boards and drives hold the posture, in sub-steps of 0.25 ms. After {1:g} s to "
      "settle, what drifts within {1:g} s more.\n",
      title, kStandTime_s);
  sections_ += header({"engine", "a foot drifts [mm]", "the base drifts [mm]", "it turns [deg]",
                       "mean force on the ground", "cost [us per ms]", ""});
  std::vector<Price> prices;
  for (const StandRow& row : rows) {
    if (row.cost_us_per_ms == 0.0) {
      sections_ += refused(*row.entry, 6, row.refusal);
      continue;
    }
    sections_ += fmt::format("| {} | {} | {} | {} | {} | {:.3g} | {} |\n", row.entry->label,
                             number(row.foot_mm), number(row.base_mm), number(row.turn_deg),
                             percent(row.force_error), row.cost_us_per_ms, row.refusal);
    if (row.refusal.empty())
      prices.push_back(
          {row.entry, row.cost_us_per_ms * row.foot_mm, row.foot_mm, number(row.foot_mm)});
    note("stand", *row.entry, 0.25, "error_mm", row.foot_mm, row.cost_us_per_ms);
  }
  judge(title, {"foot's drift times cost", kDriftCost, "least drift", " mm"}, std::move(prices));
}

void EnginePage::add(const std::string& title, const std::vector<HumanoidRow>& rows) {
  sections_ += "\n## " + title + "\n";
  sections_ +=
      header({"engine", "foot slips [mm]", "base, lowest to highest [mm]", "tilt at the end [deg]",
              "mean force on the ground", "worst tracking error [deg]", "a simulated ms [us]", ""});
  std::vector<Price> prices;
  for (const HumanoidRow& row : rows) {
    if (row.cost_us_per_ms == 0.0) {
      sections_ += refused(*row.entry, 7, row.refusal);
      continue;
    }
    sections_ +=
        fmt::format("| {} | {:.3f} | {:.2f} | {:.3f} | {} | {:.2f} | {:.3g} | {} |\n",
                    row.entry->label, row.slip_mm, row.height_mm, row.tilt_deg,
                    percent(row.force_error), row.tracking_deg, row.cost_us_per_ms, row.refusal);
    if (row.refusal.empty())
      prices.push_back({row.entry, row.cost_us_per_ms * row.slip_mm, row.slip_mm,
                        fmt::format("{:.3f}", row.slip_mm)});
    note("squat", *row.entry, 0.25, "error_mm", row.slip_mm, row.cost_us_per_ms);
  }
  judge(title, {"foot's slip times cost", kDriftCost, "least slip", " mm"}, std::move(prices));
}

void EnginePage::note(const std::string& scene, const EngineEntry& entry, double step_ms,
                      const std::string& error_key, double error, double cost_us_per_ms) {
  Json row{{"scene", scene}, {"engine", entry.label}, {"step_ms", step_ms}};
  row[error_key] = json_number(error);
  row["cost_us_per_ms"] = cost_us_per_ms;
  json_.push_back(row);
}

std::string EnginePage::text(const std::string& folder) const {
  std::string page = "# Engines compared\n";
  page += fmt::format(
      "Written by `tandem bench engines` on {:%Y-%m-%d}; write it anew with that command on your "
      "own machine. One core of: {}; compiler of Tandem: {}. The other engines are Debian's "
      "packages, built as Debian builds them.\n\n",
      fmt::gmtime(std::time(nullptr)), cpu(), kCompiler);
  page +=
      "All engines get the same bodies and joints, from Tandem's reader of the description, behind "
      "the same interface (\"Engines of others\" of docs/simulation.md), and are asked for the "
      "same steps; a cost is the processor time of the whole plant. What is compared is these "
      "engines as adapted here: a user who tunes one of them for one scene may do better, and so "
      "may a newer version. The settings of Bullet, DART, ODE and Simbody were chosen on COMAN's "
      "squat, which flatters them there; MuJoCo's and Tandem's were not. MuJoCo's friction creeps "
      "by design; impratio and noslip_iterations, which make it creep less, are left at 1 and "
      "0.\n";
  page += header({"engine", "version", "integrator", "settings that are not its defaults"});
  for (const EngineEntry& entry : entries_)
    page += fmt::format("| {} | {} | {} | {} |\n", entry.label, entry.version, entry.method,
                        entry.settings);
  page +=
      "\n## In short\nWhat it costs to come within an error: of the steps that do, the "
      "cheapest. Then who is the most accurate, whatever the cost; several are, where the table "
      "shows the same.\n\n";
  for (const std::string& verdict : verdicts_) page += "- " + verdict + ".\n";
  std::string sections = sections_;
  for (const std::string mark = "{folder}"; sections.find(mark) != std::string::npos;)
    sections.replace(sections.find(mark), mark.size(), folder);
  return page + sections;
}

}  // namespace tandem::apps
