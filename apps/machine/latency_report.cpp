#include "apps/machine/latency_report.hpp"

#include <fmt/core.h>
#include <sys/utsname.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

#include "report/gnuplot.hpp"
#include "report/page.hpp"

namespace tandem::apps {
namespace {

using Bins = std::vector<rt::HistogramBin>;
using Row = std::vector<std::string>;

double us(std::int64_t ns) { return static_cast<double>(ns) * 1e-3; }

std::string kernel() {
  utsname system{};
  uname(&system);
  return fmt::format("{} {} {}", system.sysname, system.release, system.version);
}

std::string policy_text(const LatencyPlan& plan) {
  switch (plan.policy) {
    case rt::SchedulingPolicy::kFifo: return fmt::format("SCHED_FIFO {}", plan.priority);
    case rt::SchedulingPolicy::kRoundRobin: return fmt::format("SCHED_RR {}", plan.priority);
    case rt::SchedulingPolicy::kOther: return "SCHED_OTHER";
  }
  return "?";
}

/// "1, 0": in the order in which they were used, each once.
std::string cpus_text(const std::vector<int>& cpus) {
  std::vector<int> order;
  for (const int cpu : cpus) {
    if (std::ranges::find(order, cpu) == order.end()) order.push_back(cpu);
  }
  std::string text;
  for (const int cpu : order) text += (text.empty() ? "" : ", ") + std::to_string(cpu);
  return text;
}

Row figures_row(const std::string& load, const std::string& program, const std::string& cpus,
                const rt::Percentiles& p, std::uint64_t cycles) {
  Row row{load, program, cpus};
  for (const std::int64_t ns : {p.p50, p.p99, p.p999, p.max}) {
    row.push_back(fmt::format("{:.1f}", us(ns)));
  }
  row.push_back(std::to_string(cycles));
  return row;
}

std::string ratio_text(double ratio) {
  return std::isfinite(ratio) ? fmt::format("{:.2f}", ratio) : "-";
}

std::vector<Row> rows_of(const LatencySample& sample) {
  const rt::Percentiles ours = sample.tandem.percentiles();
  std::vector<Row> rows{figures_row(sample.load, "tandem", cpus_text(sample.tandem_cpus), ours,
                                    sample.tandem.count())};
  if (!sample.cyclictest) return rows;
  const rt::Percentiles theirs = sample.cyclictest->percentiles();
  rows.push_back(figures_row(sample.load, "cyclictest", cpus_text(sample.cyclictest_cpus), theirs,
                             sample.cyclictest->cycles));
  const LatencyRatio r = ratio_of(ours, theirs);
  rows.push_back({sample.load, "ratio", "", ratio_text(r.p50), ratio_text(r.p99),
                  ratio_text(r.p999), ratio_text(r.max), ""});
  return rows;
}

const Row kHeader{"load",     "program",    "CPU",      "p50 [us]",
                  "p99 [us]", "p99.9 [us]", "max [us]", "wake-ups"};

Json program_json(const rt::Percentiles& p, std::uint64_t wakeups, const std::vector<int>& cpus,
                  const Bins& bins) {
  Json histogram = Json::array();
  for (const rt::HistogramBin& bin : bins) histogram.push_back({bin.upper_ns, bin.count});
  return {{"latency_ns", percentiles_json(p)},
          {"wakeups", wakeups},
          {"cpus", cpus},
          {"histogram_ns", std::move(histogram)}};
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json sample_json(const LatencySample& sample) {
  const rt::Percentiles ours = sample.tandem.percentiles();
  Json json;
  json["load"] = sample.load;
  json["tandem"] =
      program_json(ours, sample.tandem.count(), sample.tandem_cpus, sample.tandem.bins());
  json["tandem"]["skipped"] = sample.skipped;
  json["cyclictest"] = nullptr;
  json["ratio"] = nullptr;
  if (!sample.cyclictest) return json;
  const CyclictestResult& other = *sample.cyclictest;
  json["cyclictest"] =
      program_json(other.percentiles(), other.cycles, sample.cyclictest_cpus, other.bins);
  const LatencyRatio r = ratio_of(ours, other.percentiles());
  json["ratio"] = {{"p50", number_or_null(r.p50)},
                   {"p99", number_or_null(r.p99)},
                   {"p999", number_or_null(r.p999)},
                   {"max", number_or_null(r.max)}};
  return json;
}

/// Both programs' latencies in the same bins: whole microseconds, 10 % wide from 10 us on.
report::Curve histogram_curve(const Bins& bins, const std::string& label,
                              report::CurveStyle style) {
  report::Curve curve{label, style, {}, {}};
  double total = 0.0;
  for (const rt::HistogramBin& bin : bins) total += static_cast<double>(bin.count);
  double low = bins.empty() ? 0.0 : std::floor(us(bins.front().upper_ns));
  std::size_t next = 0;
  while (next < bins.size()) {
    const double high = std::max(low + 1.0, std::ceil(low * 1.1));
    double count = 0.0;
    for (; next < bins.size() && std::floor(us(bins[next].upper_ns)) < high; ++next) {
      count += static_cast<double>(bins[next].count);
    }
    const double share = count > 0.0 ? count / total / (high - low) : std::nan("");
    curve.x.insert(curve.x.end(), {std::max(low, 0.5), high});
    curve.y.insert(curve.y.end(), {share, share});
    low = high;
  }
  return curve;
}

/// The share of wake-ups later than x.
report::Curve tail_curve(const Bins& bins, const std::string& label, report::CurveStyle style) {
  report::Curve curve{label, style, {}, {}};
  double total = 0.0;
  for (const rt::HistogramBin& bin : bins) total += static_cast<double>(bin.count);
  double later = total;
  for (const rt::HistogramBin& bin : bins) {
    const double x = std::max(us(bin.upper_ns), 0.5);
    curve.x.insert(curve.x.end(), {x, x});
    curve.y.push_back(later / total);
    later -= static_cast<double>(bin.count);
    curve.y.push_back(later > 0.0 ? later / total : 1.0 / total);
  }
  return curve;
}

void add_figures(const LatencySample& sample, std::vector<report::Figure>& figures) {
  using report::CurveStyle;
  report::Figure histogram;
  histogram.name = "histogram_" + sample.load;
  histogram.title = "Wake-up latency, " + sample.load;
  histogram.x_label = "latency [us]";
  histogram.y_label = "share of wake-ups per us";
  histogram.log_axes = true;
  report::Figure tail;
  tail.name = "tail_" + sample.load;
  tail.title = "Wake-ups later than, " + sample.load;
  tail.x_label = "latency [us]";
  tail.y_label = "share of wake-ups";
  tail.log_axes = true;
  tail.levels = {{"p99", 1e-2}, {"p99.9", 1e-3}};
  const auto add = [&](const Bins& bins, const char* label, CurveStyle style) {
    histogram.curves.push_back(histogram_curve(bins, label, style));
    tail.curves.push_back(tail_curve(bins, label, style));
  };
  add(sample.tandem.bins(), "tandem", CurveStyle::kMeasured);
  if (sample.cyclictest) add(sample.cyclictest->bins, "cyclictest", CurveStyle::kReference);
  figures.push_back(std::move(histogram));
  figures.push_back(std::move(tail));
}

report::Page page_of(const LatencyPlan& plan, std::span<const LatencySample> samples) {
  report::Page page;
  page.title = "Wake-up latency";
  page.lead =
      "From the time at which a cycle should start to the first clock read after the sleep. Our "
      "values are rounded up by at most 3 %, cyclictest's down to whole microseconds.";
  page.facts = {{"kernel", kernel()},
                {"period", fmt::format("{} us", plan.period_us)},
                {"scheduling", policy_text(plan)},
                {"mode", to_string(plan.mode)},
                {"slices", std::to_string(plan.slices)}};
  report::PageTable table{
      "Percentiles", "Times in microseconds; ratio: tandem to cyclictest.", kHeader, {}};
  for (const LatencySample& sample : samples) {
    for (Row& row : rows_of(sample)) table.rows.push_back(std::move(row));
  }
  page.tables.push_back(std::move(table));
  return page;
}

}  // namespace

LatencyRatio ratio_of(const rt::Percentiles& ours, const rt::Percentiles& theirs) {
  const auto ratio = [](std::int64_t a, std::int64_t b) {
    return b > 0 ? static_cast<double>(a) / static_cast<double>(b)
                 : std::numeric_limits<double>::quiet_NaN();
  };
  return {ratio(ours.p50, theirs.p50), ratio(ours.p99, theirs.p99), ratio(ours.p999, theirs.p999),
          ratio(ours.max, theirs.max)};
}

void print_latency(const LatencyPlan& plan, std::span<const LatencySample> samples,
                   std::FILE* out) {
  Table table(kHeader);
  for (const LatencySample& sample : samples) {
    for (Row& row : rows_of(sample)) table.add(std::move(row));
  }
  table.print(out);
  fmt::print(out, "\n");
  Facts facts;
  facts.add("kernel", kernel());
  facts.add("scheduling", policy_text(plan));
  facts.print(out);
}

Json latency_json(const LatencyPlan& plan, std::span<const LatencySample> samples) {
  Json json;
  json["kernel"] = kernel();
  json["period_ns"] = plan.period_us * 1000;
  json["scheduling"] = policy_text(plan);
  json["mode"] = to_string(plan.mode);
  json["slices"] = plan.slices;
  json["loads"] = Json::array();
  for (const LatencySample& sample : samples) json["loads"].push_back(sample_json(sample));
  return json;
}

std::vector<report::Figure> latency_figures(std::span<const LatencySample> samples) {
  std::vector<report::Figure> figures;
  for (const LatencySample& sample : samples) add_figures(sample, figures);
  return figures;
}

Result<report::ReportFiles> draw_latency(const LatencyPlan& plan,
                                         std::span<const LatencySample> samples,
                                         const std::string& folder) {
  const std::vector<report::Figure> figures = latency_figures(samples);
  if (const Status s = report::draw(figures, folder); !s) return std::unexpected(s.error());
  if (const Status s = report::write_page(page_of(plan, samples), figures, folder); !s) {
    return std::unexpected(s.error());
  }
  report::ReportFiles files;
  files.page = folder + "/report.html";
  for (const report::Figure& figure : figures) {
    files.images.push_back(folder + "/" + figure.name + ".png");
    std::error_code ignored;  // the drawing stands in the page
    std::filesystem::remove(folder + "/" + figure.name + ".svg", ignored);
  }
  files.images.push_back(folder + "/overview.png");
  return files;
}

}  // namespace tandem::apps
