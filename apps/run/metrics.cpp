#include "apps/run/metrics.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "apps/control/clock_commands.hpp"
#include "hal/config/capabilities.hpp"
#include "log/disk_limits.hpp"
#include "rt/histogram.hpp"
#include "runtime/condition/fault_names.hpp"

namespace tandem::apps {
namespace {

using runtime::RunPhase;

constexpr RunPhase kPhases[] = {RunPhase::kBringUp,    RunPhase::kSettling,  RunPhase::kRunning,
                                RunPhase::kFaulted,    RunPhase::kResetting, RunPhase::kHeld,
                                RunPhase::kRetreating, RunPhase::kShutDown,  RunPhase::kDone};

double number(const std::atomic<std::uint64_t>& count) { return static_cast<double>(count.load()); }

/// Upper ends of buckets, 1 us to 1 s, three in a decade.
std::vector<std::int64_t> bucket_ends_ns() {
  std::vector<std::int64_t> ends;
  for (std::int64_t decade = 1'000; decade < 1'000'000'000; decade *= 10)
    for (const std::int64_t step : {1, 2, 5}) ends.push_back(step * decade);
  ends.push_back(1'000'000'000);
  return ends;
}

/// The loop goes on writing it: only what may be read beside that is taken.
void add_histogram(const rt::Histogram& of, MetricSamples& to) {
  const std::vector<rt::HistogramBin> bins = of.bins();
  double below = 0.0, sum_s = 0.0;
  auto bin = bins.begin();
  for (const std::int64_t end_ns : bucket_ends_ns()) {
    for (; bin != bins.end() && bin->upper_ns <= end_ns; ++bin) {
      below += static_cast<double>(bin->count);
      sum_s += 1e-9 * static_cast<double>(bin->upper_ns) * static_cast<double>(bin->count);
    }
    to.add(below, {"le", fmt::format("{:g}", 1e-9 * static_cast<double>(end_ns))}, "_bucket");
  }
  for (; bin != bins.end(); ++bin) {
    below += static_cast<double>(bin->count);
    sum_s += 1e-9 * static_cast<double>(bin->upper_ns) * static_cast<double>(bin->count);
  }
  to.add(below, {"le", "+Inf"}, "_bucket");
  to.add(sum_s, {}, "_sum");
  to.add(below, {}, "_count");
}

void add_faults(const MetricSource& from, MetricSamples& to) {
  std::map<hal::FaultCause, std::uint64_t> counts;
  for (const runtime::FaultReport& one : from.cycle.faults()) ++counts[one.cause];
  for (const runtime::NamedCauses& named : runtime::named_causes()) {
    if (std::popcount(named.causes) != 1) continue;  // of several, and "any"
    const auto cause = static_cast<hal::FaultCause>(std::countr_zero(named.causes));
    const auto found = counts.find(cause);
    if (found == counts.end()) continue;
    to.add(static_cast<double>(found->second), {"cause", named.name});
    counts.erase(found);  // an event with one cause is that cause's second name
  }
}

void add_loads(const MetricSource& from, MetricSamples& to) {
  const auto buses = from.run.open_buses();
  for (std::size_t b = 0; from.run.can != nullptr && b < buses.size(); ++b) {
    const float mean = from.run.can->wire_load(b).mean;
    if (std::isnan(mean)) continue;
    to.add(mean, {"interface", buses[b].interface, "bus", from.run.experiment.robot.buses[b].name});
  }
}

void add_nodes(const MetricSource& from, MetricSamples& to,
               std::uint64_t hal::can::NodeFigures::*count) {
  if (from.run.can == nullptr) return;
  for (const hal::can::NodeFigures& node : from.run.can->master().node_figures()) {
    to.add(static_cast<double>(node.*count),
           {"bus", from.run.experiment.robot.buses[node.bus].name, "node", node.node});
  }
}

void add_temperatures(const MetricSource& from, MetricSamples& to) {
  const std::vector<hal::MotorFeedback> tells = hal::motor_feedback(from.run.experiment.robot);
  const std::vector<runtime::JointInfo> joints = from.cycle.services().joints();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const runtime::JointStatus& look = joints[j].look;
    if (j >= tells.size() || !tells[j].temperature || look.age_cycles > look.cycle) continue;
    to.add(look.temperature_C, {"joint", joints[j].name});
  }
}

std::optional<log::DiskRoom> log_disk(const MetricSource& from) {
  if (from.recorder == nullptr) return std::nullopt;
  const std::filesystem::path folder = std::filesystem::path(from.recorder->path()).parent_path();
  return log::disk_room(folder.empty() ? "." : folder.string());
}

using From = const MetricSource&;
using To = MetricSamples&;

// clang-format off
constexpr MetricRow kRows[] = {
    {"tandem_info", "gauge", "1", "Version, robot and experiment, as labels",
     [](From f, To to) {
       const runtime::Experiment& e = f.run.experiment;
       to.add(1, {"version", TANDEM_VERSION, "robot", e.robot.name, "experiment",
                  std::filesystem::path(e.file).filename().string(), "hal", hal_name(e)});
     }},
    {"tandem_phase", "gauge", "0 or 1", "1 for the phase that the run is in",
     [](From f, To to) {
       const RunPhase now = f.cycle.progress().phase.load();
       for (const RunPhase one : kPhases)
         to.add(one == now ? 1 : 0, {"phase", runtime::to_string(one)});
     }},
    {"tandem_paused", "gauge", "0 or 1", "Simulated time is paused",
     [](From f, To to) { to.add(time_stands(f.cycle) ? 1 : 0); }},
    {"tandem_run_time_seconds", "gauge", "s", "Time of the newest cycle, from the first SYNC",
     [](From f, To to) { to.add(1e-9 * static_cast<double>(f.cycle.progress().time_ns.load())); }},
    {"tandem_period_seconds", "gauge", "s", "Length of a cycle",
     [](From f, To to) { to.add(1e-9 * static_cast<double>(f.run.experiment.loop.period_ns)); }},
    {"tandem_cycles_total", "counter", "cycles", "Cycles of all phases",
     [](From f, To to) { to.add(number(f.cycle.progress().cycles)); }},
    {"tandem_running_cycles_total", "counter", "cycles", "Cycles in which controllers ran",
     [](From f, To to) { to.add(number(f.cycle.progress().running_cycles)); }},
    {"tandem_overruns_total", "counter", "cycles", "Cycles whose work ended too late",
     [](From f, To to) { to.add(number(f.cycle.progress().overruns)); }},
    {"tandem_cycle_seconds", "histogram", "s", "Work of a cycle; its sum is within 3 %",
     [](From f, To to) { add_histogram(f.cycle.loop().work, to); }},
    {"tandem_wakeup_seconds", "histogram", "s", "How late a cycle began: the latency of the machine",
     [](From f, To to) { add_histogram(f.cycle.loop().wakeup, to); }},
    {"tandem_bus_wait_seconds", "histogram", "s", "Wait of a cycle for its buses' answers",
     [](From f, To to) { add_histogram(f.cycle.loop().bus, to); }},
    {"tandem_faults_total", "counter", "faults", "Faults since the start, by cause; of the first 256",
     add_faults},
    {"tandem_faults_unlisted_total", "counter", "faults", "Faults beyond the first 256",
     [](From f, To to) { to.add(static_cast<double>(f.cycle.fault_log().lost())); }},
    {"tandem_faults_latched", "gauge", "faults", "Faults that no reset has cleared",
     [](From f, To to) { to.add(number(f.cycle.progress().latched)); }},
    {"tandem_resets_total", "counter", "resets", "Resets that were carried out",
     [](From f, To to) { to.add(number(f.cycle.progress().resets)); }},
    {"tandem_failed_resets_total", "counter", "resets", "Resets with a cause that was still there",
     [](From f, To to) { to.add(number(f.cycle.progress().failed_resets)); }},
    {"tandem_bus_load_ratio", "gauge", "of 1", "Load of a bus in the last second; not in lockstep",
     add_loads},
    {"tandem_node_missed_total", "counter", "cycles", "Cycles without the whole sample of a node",
     [](From f, To to) { add_nodes(f, to, &hal::can::NodeFigures::missed); }},
    {"tandem_node_late_total", "counter", "answers", "Answers of a node a cycle late, or more",
     [](From f, To to) { add_nodes(f, to, &hal::can::NodeFigures::late); }},
    {"tandem_winding_celsius", "gauge", "degC", "Temperature of a joint's motor, of drives that tell it",
     add_temperatures},
    {"tandem_controller_active", "gauge", "0 or 1", "Of each loaded controller, whether it leads its joints",
     [](From f, To to) {
       for (const runtime::ControllerStatus& one : f.cycle.services().controllers())
         to.add(one.active ? 1 : 0, {"controller", one.name});
     }},
    {"tandem_controller_overruns_total", "counter", "cycles", "Late cycles that a controller was the reason for",
     [](From f, To to) {
       for (const runtime::ControllerStatus& one : f.cycle.services().controllers())
         to.add(static_cast<double>(one.overruns), {"controller", one.name});
     }},
    {"tandem_log_dropped_total", "counter", "messages", "Messages that the log lost, as the disk was too slow",
     [](From f, To to) { to.add(number(f.cycle.progress().dropped)); }},
    {"tandem_log_failed", "gauge", "0 or 1", "Nothing is logged any more; none without a log",
     [](From f, To to) { if (f.recorder != nullptr) to.add(f.recorder->failed() ? 1 : 0); }},
    {"tandem_disk_free_bytes", "gauge", "bytes", "Room on the log's disk; none without a log",
     [](From f, To to) { if (const auto d = log_disk(f)) to.add(static_cast<double>(d->free_bytes)); }},
    {"tandem_disk_size_bytes", "gauge", "bytes", "Size of the log's disk; none without a log",
     [](From f, To to) { if (const auto d = log_disk(f)) to.add(static_cast<double>(d->all_bytes)); }},
};
// clang-format on

/// As a label's value.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\' || c == '"') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else {
      out += c;
    }
  }
  return out;
}

}  // namespace

void MetricSamples::add(double value, std::initializer_list<std::string_view> labels,
                        std::string_view ending) {
  out_ += fmt::format("{}{}", name_, ending);
  const char* before = "{";
  for (auto label = labels.begin(); label != labels.end(); label += 2) {
    out_ += fmt::format("{}{}=\"{}\"", before, *label, escaped(label[1]));
    before = ",";
  }
  out_ += fmt::format("{} {}\n", labels.size() > 0 ? "}" : "",
                      std::isnan(value) ? "NaN" : fmt::format("{}", value));
}

std::span<const MetricRow> metric_rows() { return kRows; }

std::string metrics_text(const MetricSource& from) {
  std::string text;
  for (const MetricRow& row : kRows) {
    std::string samples;
    MetricSamples to(row.name, samples);
    row.samples(from, to);
    if (samples.empty()) continue;
    text += fmt::format("# HELP {} {}\n# TYPE {} {}\n", row.name, row.help, row.name, row.type);
    text += samples;
  }
  return text;
}

}  // namespace tandem::apps
