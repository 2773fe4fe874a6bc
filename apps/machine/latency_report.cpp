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

/// What one program measured.
struct ProgramFigures {
  rt::Percentiles latency_ns;
  std::uint64_t wakeups = 0;
  std::vector<int> cpus;
  Bins bins;
};
struct OwnFigures : ProgramFigures {
  std::uint64_t skipped = 0;
};

OwnFigures ours(const LatencySample& s) {
  return {{s.tandem.percentiles(), s.tandem.count(), s.tandem_cpus, s.tandem.bins()}, s.skipped};
}

std::optional<ProgramFigures> theirs(const LatencySample& s) {
  if (!s.cyclictest) return std::nullopt;
  return ProgramFigures{s.cyclictest->percentiles(), s.cyclictest->cycles, s.cyclictest_cpus,
                        s.cyclictest->bins};
}

std::optional<LatencyRatio> ratio(const LatencySample& s) {
  if (!s.cyclictest) return std::nullopt;
  return ratio_of(s.tandem.percentiles(), s.cyclictest->percentiles());
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

static void figures(Figures& f, const ProgramFigures& one) {
  std::vector<std::pair<std::int64_t, std::uint64_t>> histogram;
  for (const rt::HistogramBin& bin : one.bins) histogram.emplace_back(bin.upper_ns, bin.count);
  f("latency_ns", one.latency_ns);
  f("wakeups", one.wakeups);
  f("cpus", "slice by slice", one.cpus);
  f("histogram_ns", "list of upper end of a bucket and count", Json(histogram));
}

static void figures(Figures& f, const OwnFigures& one) {
  figures(f, static_cast<const ProgramFigures&>(one));
  f("skipped", "grid points that our loop missed completely", one.skipped);
}

static void figures(Figures& f, const LatencyRatio& ratio) {
  const auto finite = [](double value) { return known(std::isfinite(value), value); };
  f("p50", finite(ratio.p50));
  f("p99", finite(ratio.p99));
  f("p999", finite(ratio.p999));
  f("max", finite(ratio.max));
}

static void figures(Figures& f, const LatencySample& sample) {
  f("load", "`idle` or `stress`", sample.load);
  f("tandem", ours(sample));
  f("cyclictest", "null when it is not installed or may not run", theirs(sample));
  f("ratio", "tandem to cyclictest", ratio(sample));
}

void figures(Figures& f, const LatencyResult& result) {
  f("kernel", "of this machine", kernel());
  f("period_ns", "of both programs", result.plan.period_us * 1000);
  f("scheduling", "policy and priority of both", policy_text(result.plan));
  f("mode", "`swap`, `together` or `turns`", to_string(result.plan.mode));
  f("slices", "parts of each measurement", result.plan.slices);
  f("loads", result.samples);
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
