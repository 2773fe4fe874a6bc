// The tables and rows of a run, for people: of the figures that its JSON has.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/can/bus_watch.hpp"
#include "apps/can/round_trips.hpp"
#include "apps/control/fault_table.hpp"
#include "apps/run/remote_link.hpp"
#include "apps/run/run_summary.hpp"
#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "hal/sim/engine_loader.hpp"
#include "runtime/run/run_log.hpp"

namespace tandem::apps {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kMillimetres = 1e3;
constexpr std::size_t kJointsShown = 5;

void print_worst_joints(const RunSummary& s, std::FILE* out) {
  struct Row {
    std::string joint;
    bool slides = false;
    runtime::TrackingError error;
  };
  std::vector<Row> rows;
  const auto tracking = s.cycle.statistics().tracking();
  for (std::size_t i = 0; i < tracking.size(); ++i) {
    if (tracking[i].cycles == 0) continue;  // it had no reference
    const hal::JointConfig& joint = s.composition.experiment.robot.joints[i];
    rows.push_back({joint.name, joint.slides, tracking[i]});
  }
  if (rows.empty()) return;
  std::ranges::stable_sort(rows, std::ranges::greater{},
                           [](const Row& r) { return r.error.rms_rad; });
  rows.resize(std::min(kJointsShown, rows.size()));
  const bool any_slides = std::ranges::any_of(rows, &Row::slides);
  const bool mixed = any_slides && !std::ranges::all_of(rows, &Row::slides);
  const char* unit = mixed ? "" : (any_slides ? " [mm]" : " [deg]");
  Table table({"worst joints", fmt::format("rms{}", unit), fmt::format("max{}", unit)});
  for (const Row& row : rows) {
    const double factor = row.slides ? kMillimetres : kDegrees;
    const char* own = !mixed ? "" : (row.slides ? " mm" : " deg");
    table.add({row.joint, fmt::format("{:.3f}{}", row.error.rms_rad * factor, own),
               fmt::format("{:.3f}{}", row.error.max_rad * factor, own)});
  }
  table.print(out);
}

/// A motion that was not the one that was asked for looks like one that was followed well.
void add_limited(const RunSummary& s, Facts& facts) {
  const std::vector<std::uint64_t> limited = s.cycle.statistics().limited_cycles();
  const auto most = std::ranges::max_element(limited);
  if (most == limited.end() || *most == 0) return;
  const auto joints = limited.size() - static_cast<std::size_t>(std::ranges::count(limited, 0U));
  const auto joint = static_cast<std::size_t>(most - limited.begin());
  const std::int32_t who = s.cycle.limited(joint);
  const std::string whose =
      who < 0 ? ""
              : ", by '" + s.composition.controllers->name(static_cast<std::size_t>(who)) + "'";
  facts.add(
      "commands limited",
      fmt::format("{} in {} of {}{}{}; first {}", s.composition.experiment.robot.joints[joint].name,
                  *most, counted(s.cycle.running_cycles(), "cycle"), whose,
                  joints > 1 ? ", " + counted(joints - 1, "more joint") : "",
                  hal::in_words(s.cycle.first_limited(joint))));
}

/// What the robot did on the ground, and its floating base.
void add_motion_facts(const Json& run, Facts& facts) {
  if (const Json& ground = run["ground"]; !ground.is_null()) {
    const double share =
        ground["mean_vertical_force_N"].get<double>() / ground["weight_N"].get<double>() - 1.0;
    add_figures(facts, run, "force on the ground",
                "{ground.mean_vertical_force_N:.2f N} on average, weight {ground.weight_N:.2f N}" +
                    fmt::format(" ({:+.3f} %)", 100.0 * share));
  }
  add_figures(
      facts, run,
      {{"work of the joints",
        "{work.done_J:.1f J}, {work.taken_J:.1f J} taken back, {work.max_power_W:.0f W} at most"},
       {"feet slip", "{ground.max_foot_slip_m:.3f mm} at most"}});
  if (run["base"].is_null()) return;
  constexpr double kStands_rad = 20.0 / kDegrees;  // more says that it fell, or nearly did
  const bool stood = run["base"]["max_tilt_rad"].get<double>() < kStands_rad;
  add_figures(facts, run, "base height",
              "{base.min_height_m:.4f} to {base.max_height_m:.4f m}, tilted "
              "{base.final_tilt_rad:.3f deg} at the end" +
                  std::string(stood ? "" : ", {base.max_tilt_rad:.0f deg} at most"));
}

/// What the loop estimated: against the truth, where there is one.
void add_estimate_facts(const RunSummary& summary, const Json& run, Facts& facts) {
  const WiredComposition& c = summary.composition;
  if (c.estimator == nullptr) return;
  const runtime::EstimateFigures figures = summary.cycle.statistics().estimate();
  const hal::EstimateImage& image = c.estimator->image();
  add_figures(facts, run, "base estimate",
              "off by {estimate.base.max_tilt_error_rad:.3f deg} of tilt and "
              "{estimate.base.max_height_error_m:.1f mm} of height at most");
  if (figures.compared == 0 && image.has_base()) {
    const auto deviation = image.base_deviation();
    facts.add("base estimate",
              fmt::format("standard deviation {:.3f} deg of tilt, {:.1f} mm of height at the end",
                          std::hypot(deviation[0], deviation[1]) * kDegrees, deviation[8] * 1e3));
  }
  if (image.joints() == 0) return;
  const auto most = std::ranges::max_element(figures.max_external_Nm);
  const auto j = static_cast<std::size_t>(most - figures.max_external_Nm.begin());
  const hal::JointConfig& joint = c.experiment.robot.joints[j];
  facts.add("external torque",
            fmt::format("{:.2f} {} at most ({})", *most, joint.slides ? "N" : "Nm", joint.name));
  constexpr char kWrench[] =
      "{max_force_N:.1f N} at most at {max_force_s:.3f s}, {max_moment_Nm:.2f Nm} at "
      "{max_moment_s:.3f s}";
  const Json& estimate = run["estimate"];
  add_figures(facts, estimate["external_base_wrench"], "external wrench on base", kWrench);
  for (const auto& [site, one] : estimate["wrenches"].items())
    add_figures(facts, one, "wrench at " + site, kWrench);
  add_figures(facts, run, "not explained by them",
              "{estimate.unexplained_torque_Nm:.2f Nm} at most");
}

/// How long cycles took, and whether they were in time.
void add_timing_facts(const RunSummary& summary, const Json& run, Facts& facts) {
  const auto row = [&](const char* name, const char* text) { add_figures(facts, run, name, text); };
  if (const std::string start = start_text(summary.composition.master); !start.empty())
    facts.add("start", start);
  for (const Json& text : run["wire"]) facts.add("wire", text.get<std::string>());
  const bool wall_clock = summary.composition.experiment.loop.pacing != rt::Pacing::kSimulated;
  if (wall_clock) {
    row("ran", "{wall_seconds:.3f s}, {cycles|cycle}, {skipped} skipped");
  } else {
    row("simulated",
        "{simulated_seconds:.3f s} in {wall_seconds:.2f s}: {realtime_factor:.1f} x real time");
    if (summary.cycles_before > 0)
      facts.add("taken over", fmt::format("{} of the run that it goes on from; the figures but for "
                                          "times count them, too",
                                          counted(summary.cycles_before, "cycle")));
  }
  // The time that is not in the line above: nothing has run then.
  if (summary.times.stopped_s > 0.0)
    row("not running", "{stopped_seconds:.2f s} of the clock in fault or held");
  if (summary.times.stood_s > 0.0) row("not running", "{stood_seconds:.2f s} paused or suspended");
  row("cycle p50/p99/p99.9/max", "{cycle_ns:.1f us}");
  for (const auto& [name, figures] : run["controllers"].items()) {
    if (figures.is_null()) continue;
    add_figures(facts, figures, "  " + name,
                figures.value("overruns", 0) > 0 ? "{call_ns:.1f us}, {overruns|overrun}"
                                                 : "{call_ns:.1f us}");
  }
  row("bus p50/p99/p99.9/max", "{bus_ns:.1f us}");
  row("wake-up p50/p99/p99.9/max", "{wakeup_ns:.1f us}");  // not of a server's cycles
  if (wall_clock || !run["wakeup_ns"].is_null()) row("overruns", "{overruns}");
}

/// The link to the robot, and what both ends made of it.
void add_link_facts(const Json& run, Facts& facts) {
  const Json& link = run["teleoperation"];
  if (link.is_null()) return;
  constexpr char kCounts[] =
      "{sent} messages, {lost} lost, {dropped} dropped, {reordered} reordered, {delivered} "
      "delivered";
  add_figures(facts, link["up"], "commands over the link", kCounts);
  add_figures(facts, link["down"], "states over the link", kCounts);
  const auto seconds = [&](const char* cycles) {
    return fmt::format("{:.3f} s",
                       link[cycles].get<double>() * run["period_ns"].get<double>() * 1e-9);
  };
  if (!link["holds"].is_null())
    add_figures(facts, link, "without commands", seconds("starved_cycles") + ", {holds|time}");
  facts.add("without a state", seconds("most_silent_cycles") + " at most");
  facts.add("without a newer command in force", seconds("most_unanswered_cycles") + " at most");
}

/// What the run wrote and published.
void add_output_facts(const RunSummary& summary, const Json& run, Facts& facts) {
  const bool too_many = summary.cycle.statistics().texts().left_out > 0;
  add_figures(facts, run, "controllers said",
              too_many ? "{texts.said|line}, {texts.left_out} more left out" : "{texts.said|line}");
  if (summary.log) {
    add_figures(
        facts, run, "log",
        "{log.path} ({log.messages} messages, {log.dropped} dropped, " +
            fmt::format("{:.1f} MB", static_cast<double>(summary.log->bytes) * 1e-6) +
            (summary.log->branches > 1 ? ", in {log.branches} logs of one run that went back)"
             : summary.log->parts == 1 ? ")"
                                       : ", {log.files} files, {log.files_removed} removed)"));
  }
  add_figures(facts, run, "DDS",
              "domain {dds.domain}: {dds.samples} samples, {dds.refused} refused; {dds.dropped} "
              "cycles dropped");
  if (summary.dds && summary.dds->services.requests + summary.dds->services.malformed > 0)
    add_figures(
        facts, run, "requests over DDS",
        "{dds.requests}, {dds.requests_dropped} dropped, {dds.requests_malformed} malformed");
}

/// What was expected, and how far it was from failing.
void print_expectations(const Json& expectations, std::FILE* out) {
  Table table({"expected", "", "margin", "at", "why"});
  table.align_left();
  for (const Json& one : expectations) {
    const auto row = figures_text("{margin:.4g}", one);
    const std::string unit = one.value("unit", "");
    table.add({shown(one.value("name", ""), 60), one.value("passed", false) ? "passed" : "FAILED",
               row ? *row + (unit.empty() ? "" : " " + unit) : "",
               one["at_s"].is_null() ? "" : fmt::format("{:.3f} s", one["at_s"].get<double>()),
               one.value("reason", "")});
  }
  fmt::print(out, "\n");
  table.print(out);
}

}  // namespace

void RunSummary::print(std::FILE* out) const {
  const Json run = json();
  print_worst_joints(*this, out);
  if (!run["loops"].empty()) {
    fmt::print(out, "\n");
    figures_table({{"closed loops", ""},
                   {"open at most [m]", "{max_position_error_m:.1e}"},
                   {"opening at most [m/s]", "{max_velocity_error_m_s:.1e}"}},
                  run["loops"])
        .print(out);
  }
  if (!cycle.faults().empty()) fmt::print(out, "\n");
  print_faults(run["fault_log"], out);
  if (run["expectations"].is_array()) print_expectations(run["expectations"], out);
  if (const auto second = parallel_summary()) print_parallel(*second, out);
  fmt::print(out, "\n");
  if (composition.master != nullptr && composition.backend->waits_for_bus()) {
    print_slowest_nodes(composition.master->round_trips(), out);
    fmt::print(out, "\n");
  }
  Facts facts;
  if (composition.experiment.endless()) {
    add_figures(facts, run, "ended", "{ended} after {sim_seconds:.3f s}");
  } else if (cut_short()) {
    const auto planned = static_cast<double>(planned_cycles()) *
                         static_cast<double>(composition.experiment.loop.period_ns) * 1e-9;
    add_figures(facts, run, "ended",
                "{ended} after {sim_seconds:.3f} of " + fmt::format("{:.3f} s", planned));
  }
  add_limited(*this, facts);
  add_motion_facts(run, facts);
  add_estimate_facts(*this, run, facts);
  add_timing_facts(*this, run, facts);
  add_remote_facts(run, facts);
  add_link_facts(run, facts);
  add_figures(facts, run, "kernels", "{kernel_variant}");
  const std::string engine = sim::engine_text(composition.experiment.sim.engine);
  if (composition.sim != nullptr && !engine.empty()) facts.add("engine", engine);
  if (composition.sim != nullptr)
    facts.add("integrator", runtime::integrator_text(composition.experiment));
  if (run["plant"].is_array()) {
    std::string all;
    for (const Json& one : run["plant"]) all += (all.empty() ? "" : "; ") + one.get<std::string>();
    facts.add("plant is other in", all);
  }
  add_output_facts(*this, run, facts);
  add_bus_facts(composition.open_buses(), facts);
  add_figures(facts, run, "frames",
              "{frames.path} ({frames.frames} frames, {frames.lost} lost" +
                  std::string(frames && !frames->error.empty() ? "; " + frames->error : "") + ")");
  facts.print(out);
}

}  // namespace tandem::apps
