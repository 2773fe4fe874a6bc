#include "apps/run/run_summary.hpp"

#include <fmt/core.h>
#include <signal.h>

#include "apps/control/fault_table.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "apps/can/bus_watch.hpp"
#include "apps/can/round_trips.hpp"
#include "apps/run/parallel_summary.hpp"
#include "apps/run/remote_link.hpp"
#include "base/counted.hpp"
#include "hal/sim/engine_loader.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kMillimetres = 1e3;
constexpr std::size_t kJointsShown = 5;

double weight_N(const tandem_kernels& k) {
  const double* g = k.gravity_m_s2;
  return k.mass_kg * std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
}

/// Whether what touches the base was estimated: on a floating base, once its estimate had started.
bool has_base_wrench(const hal::EstimateImage& image, const runtime::EstimateFigures& figures) {
  return !image.external_base_wrench().empty() && figures.base_cycles > 0;
}

struct JointFigures {
  runtime::TrackingError error;
  std::uint64_t limited_cycles = 0;
};

Named<JointFigures> joints_of(const RunSummary& s) {
  Named<JointFigures> joints;
  const auto tracking = s.cycle.statistics().tracking();
  const auto limited = s.cycle.statistics().limited_cycles();
  for (std::size_t j = 0; j < tracking.size(); ++j) {
    joints.emplace_back(s.composition.experiment.robot.joints[j].name,
                        JointFigures{tracking[j], limited[j]});
  }
  return joints;
}

Named<runtime::LoopFigures> loops_of(const RunSummary& s) {
  Named<runtime::LoopFigures> loops;
  for (const runtime::LoopFigures& one : s.cycle.statistics().loops())
    loops.emplace_back(s.composition.experiment.robot.loops[loops.size()].name, one);
  return loops;
}

/// What was estimated.
struct EstimateSummary {
  std::optional<runtime::EstimateFigures> base{};
  std::optional<Named<double>> external_torque_Nm{};
  std::optional<runtime::WrenchFigures> external_base_wrench{};
  Named<std::optional<runtime::WrenchFigures>> wrenches{};
  std::optional<double> unexplained_torque_Nm{};
};

/// Nothing without [estimation].
std::optional<EstimateSummary> estimate_of(const RunSummary& s) {
  const Composition& c = s.composition;
  if (c.estimator == nullptr) return std::nullopt;
  const hal::EstimateImage& image = c.estimator->image();
  const runtime::EstimateFigures figures = s.cycle.statistics().estimate();
  // Without an estimate of the base nothing was looked for.
  const bool looked =
      image.estimates_base() ? figures.base_cycles > 0 : s.cycle.running_cycles() > 0;
  EstimateSummary summary{
      .base = known(image.estimates_base(), figures),
      .external_torque_Nm = known(looked && image.joints() > 0, Named<double>()),
      .external_base_wrench = known(has_base_wrench(image, figures), figures.base_wrench),
      .unexplained_torque_Nm =
          known(looked && !figures.wrenches.empty(), figures.unexplained_Nm.value)};
  for (std::size_t j = 0; summary.external_torque_Nm && j < image.joints(); ++j) {
    summary.external_torque_Nm->emplace_back(c.experiment.robot.joints[j].name,
                                             figures.max_external_Nm[j]);
  }
  for (std::size_t i = 0; i < figures.wrenches.size(); ++i) {
    summary.wrenches.emplace_back(c.experiment.estimation.wrenches[i].site,
                                  known(looked, figures.wrenches[i]));
  }
  return summary;
}

std::optional<hal::can::StartUp> start_of(const hal::can::DriveMaster* master) {
  if (master == nullptr || master->start_up().duration_ns == 0) return std::nullopt;
  return master->start_up();
}

constexpr char kStart[] =
    "{axes|axis|axes} enabled after {seconds:.3f s}, {frames_sent} frames sent and "
    "{frames_received} received";

std::vector<std::string> wire_of(const hal::can::DriveMaster* master) {
  return master == nullptr ? std::vector<std::string>() : master->wire_texts();
}

}  // namespace

static void figures(Figures& f, const log::RecordingResult& log) {
  f("path", log.path);
  f("messages", "in the file", log.messages);
  f("dropped", "the ring was full", log.dropped);
  f("data_sha256", "of the messages' data, in order", log.data_sha256);
}

static void figures(Figures& f, const hal::can::FrameRecord::Result& frames) {
  f("path", frames.path);
  f("frames", "in the file", frames.frames);
  f("lost", "the file was too slow for them", frames.lost);
}

static void figures(Figures& f, const DdsResult& dds) {
  f("domain", dds.domain);
  f("samples", "sent, of all topics", dds.counts.sent);
  f("refused", "by DDS: a reader was too far behind", dds.counts.refused);
  f("dropped", "cycles that were due but found no room in the ring", dds.counts.dropped);
  f("requests", "to its services", dds.services.requests);
  f("requests_dropped", "the queue was full", dds.services.dropped);
  f("replies", dds.services.replies);
  f("replies_unclaimed", "the client was gone", dds.services.unclaimed);
}

static void figures(Figures& f, const JointFigures& joint) {
  const bool tracked = joint.error.cycles > 0;
  f("rms_tracking_error_rad",
    "against the position reference, also one that a controller writes in another mode than "
    "position control; null: there was none",
    known(tracked, joint.error.rms_rad));
  f("max_tracking_error_rad", "of the absolute value", known(tracked, joint.error.max_rad));
  f("limited_cycles",
    "in which a limit changed the controller's command: [controllers.md](controllers.md#limits)",
    joint.limited_cycles);
}

static void figures(Figures& f, const runtime::WorkFigures& work) {
  f("done_J", "of the joints that drove", work.done_J);
  f("taken_J", "of those that braked", work.taken_J);
  f("max_power_W", "of all together; braking ones count negative", work.max_power_W);
}

static void figures(Figures& f, const runtime::GroundFigures& ground) {
  f("weight_N", "mass times gravity", ground.weight_N);
  f("mean_vertical_force_N", "of all feet together", ground.mean_vertical_force_N);
  f("max_foot_slip_m", "way of a foot since it touched down", ground.max_foot_slip_m);
}

static void figures(Figures& f, const runtime::LoopFigures& loop) {
  f("max_position_error_m", "over all cycles", loop.max_position_error_m);
  f("max_velocity_error_m_s", loop.max_velocity_error_m_s);
}

static void figures(Figures& f, const runtime::BaseFigures& base) {
  f("min_height_m", base.min_height_m);
  f("max_height_m", base.max_height_m);
  f("final_tilt_rad", "between the base's z axis and the world's", base.final_tilt_rad);
  f("max_tilt_rad", base.max_tilt_rad);
}

static void figures(Figures& f, const runtime::WrenchFigures& one) {
  const auto seconds = [](const runtime::Peak& p) { return static_cast<double>(p.time_ns) * 1e-9; };
  f("max_force_N", "norm", one.force_N.value);
  f("max_force_s", "when: the cycle's nominal time", seconds(one.force_N));
  f("max_moment_Nm", "norm", one.moment_Nm.value);
  f("max_moment_s", "when", seconds(one.moment_Nm));
}

static void figures(Figures& f, const runtime::EstimateFigures& base) {
  f("cycles", "with an estimate", base.base_cycles);
  f("max_tilt_error_rad", "against the truth; null without one",
    known(base.compared > 0, base.max_tilt_error_rad));
  f("max_height_error_m", "the same", known(base.compared > 0, base.max_height_error_m));
}

static void figures(Figures& f, const EstimateSummary& estimate) {
  f("base", "null: it estimates none", estimate.base);
  f("external_torque_Nm",
    "by joint the largest; null without an observer, and where nothing was estimated",
    estimate.external_torque_Nm);
  f("external_base_wrench",
    "on the floating base beside its feet, about its origin; null on a fixed base, without an "
    "observer, and when the base's estimate never started",
    estimate.external_base_wrench);
  f("wrenches", "by site of each `[[estimation.wrench]]`", estimate.wrenches);
  f("unexplained_torque_Nm", "the largest that the wrenches do not explain; null without a wrench",
    estimate.unexplained_torque_Nm);
}

static void figures(Figures& f, const hal::can::StartUp& start) {
  f("axes", start.axes);
  f("seconds", static_cast<double>(start.duration_ns) * 1e-9);
  f("frames_sent", "on all buses; Ethernet frames on EtherCAT", start.sent);
  f("frames_received", "the same", start.received);
}

void figures(Figures& f, const RunSummary* s) {
  const auto e = [s]() -> const runtime::Experiment& { return s->composition.experiment; };
  const auto loop = [s]() -> const rt::LoopStatistics& { return s->cycle.loop(); };
  const auto master = [s] { return s->composition.master; };
  f("robot", "`name` of the robot.toml", [&] { return e().robot.name; });
  f("hal", "backend: `sim`, `can`, `ethercat`, `dds`, …", [&] { return hal_name(e()); });
  f("seed", "of every random generator", [&] { return e().seed; });
  f("ended",
    "`as planned`; `interrupted by SIGINT` (or another signal); `on request` (`run.stop`); `by a "
    "fault`; `nobody reads its output any more`",
    [&] { return s->ended(); });
  f("planned_cycles", "of the whole run; null: it has no planned end",
    [&] { return known(s->planned_cycles() > 0, s->planned_cycles()); });
  f("cycles", "of the loop while controllers ran", [&] { return s->cycle.running_cycles(); });
  f("period_ns", "nominal", [&] { return e().loop.period_ns; });
  f("sim_seconds", "`cycles * period_ns`", [&] { return s->sim_s(); });
  f("wall_seconds", "of those cycles on the wall clock", [&] { return s->times.running_s; });
  f("stopped_seconds", "on the wall clock: in fault, in a reset, or held after it",
    [&] { return s->times.stopped_s; });
  f("stood_seconds",
    "on the wall clock, of simulated time: paused, or the process suspended, for half a second or "
    "more",
    [&] { return s->times.stood_s; });
  f("realtime_factor", "`sim_seconds / wall_seconds`",
    [&] { return known(s->times.running_s > 0.0, s->realtime_factor()); });
  f("overruns", "cycles that ended after the next one's start (paced runs)",
    [&] { return loop().overruns; });
  f("skipped", "cycles, because of that (wall clock)", [&] { return loop().skipped; });
  f("wakeup_ns", "wake-up latency; null in a free run", [&] { return loop().wakeup; });
  f("bus_ns", "waiting for the answers on the bus; null without one",
    [&] { return known(s->composition.backend->waits_for_bus(), loop().bus); });
  f("cycle_ns", "of a cycle's own work; null: no cycle was made", [&] { return loop().work; });
  f("log", "null: nothing was logged", [&] { return s->log; });
  f("frames", "of `--record-frames`", [&] { return s->frames; });
  f("dds", "with `[dds]`", [&] { return s->dds; });
  f("buses", "of a CAN backend", [&] { return s->composition.open_buses(); });
  f("joints", [&] { return joints_of(*s); });
  f("work", "torque times velocity, as measured; null: no drive tells them",
    [&] { return s->cycle.statistics().work(static_cast<double>(e().loop.period_ns) * 1e-9); });
  f("ground", "by the plant's truth, of a floating base with feet",
    [&] { return s->cycle.statistics().ground(weight_N(*s->composition.kernels)); });
  f("loops", "of a robot with closed loops in simulation", [&] { return loops_of(*s); });
  f("parallel", "of `[parallel]`", [&] { return s->parallel_summary(); });
  f("base",
    "until the drives are disabled at the end, so a fall after a fault counts; floating base with "
    "known truth",
    [&] { return s->cycle.statistics().base(); });
  f("estimate", "with `[estimation]`, while controllers ran", [&] { return estimate_of(*s); });
  f("round_trips", "per board", [&] {
    return master() == nullptr ? std::vector<hal::can::RoundTrip>() : master()->round_trips();
  });
  f("start",
    "what the first start took, power-on to every axis enabled; null before that, and where the "
    "drive master is another process'",
    [&] { return start_of(master()); });
  f("wire", "what EtherCAT buses tell of cycles and clocks", [&] { return wire_of(master()); });
  f("remote", "of `run --hal dds`",
    [&] { return static_cast<const remote::RemoteBackend*>(s->composition.remote); });
  f("remote", "of `serve`, and of a `run` that others may own", [&] { return s->server; });
  f("teleoperation", "with `[teleoperation]`", [&] {
    return s->composition.tele == nullptr ? std::optional<remote::TeleFigures>()
                                          : s->composition.tele->figures();
  });
  f("faults", "that are still latched, and of a log that failed; empty when the run ended well",
    [&] { return s->faults; });
  f("warnings",
    "tolerated anomalies: missing feedback, counted by node; commands that a bus did not accept; a "
    "refused value",
    [&] { return s->warnings(); });
  f("fault_log", "every fault", [&] { return s->cycle.faults(); });
  f("kernel_variant", "of the generated kernels that ran",
    [&] { return std::string(s->composition.kernels->variant); });
  figures(f, s == nullptr ? nullptr : &e());
}

namespace {

void print_loops(const Json& loops, std::FILE* out) {
  if (loops.empty()) return;
  Table table({"closed loops", "open at most [m]", "opening at most [m/s]"});
  for (const auto& [name, one] : loops.items()) {
    table.add({name, *figures_text("{max_position_error_m:.1e}", one),
               *figures_text("{max_velocity_error_m_s:.1e}", one)});
  }
  fmt::print(out, "\n");
  table.print(out);
}

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
  facts.add("commands limited",
            fmt::format("{} in {} of {}{}",
                        s.composition.experiment.robot
                            .joints[static_cast<std::size_t>(most - limited.begin())]
                            .name,
                        *most, counted(s.cycle.running_cycles(), "cycle"),
                        joints > 1 ? ", " + counted(joints - 1, "more joint") : ""));
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
      facts, run, "work of the joints",
      "{work.done_J:.1f J}, {work.taken_J:.1f J} taken back, {work.max_power_W:.0f W} at most");
  add_figures(facts, run, "feet slip", "{ground.max_foot_slip_m:.3f mm} at most");
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
  const Composition& c = summary.composition;
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
  add_figures(facts, run["start"], "start", kStart);
  for (const Json& text : run["wire"]) facts.add("wire", text.get<std::string>());
  const bool wall_clock = summary.composition.experiment.loop.pacing != rt::Pacing::kSimulated;
  if (wall_clock) {
    row("ran", "{wall_seconds:.3f s}, {cycles|cycle}, {skipped} skipped");
  } else {
    row("simulated",
        "{sim_seconds:.3f s} in {wall_seconds:.2f s}: {realtime_factor:.1f} x real time");
  }
  // The time that is not in the line above: nothing has run then.
  if (summary.times.stopped_s > 0.0)
    row("not running", "{stopped_seconds:.2f s} of the clock in fault or held");
  if (summary.times.stood_s > 0.0) row("not running", "{stood_seconds:.2f s} paused or suspended");
  row("cycle p50/p99/p99.9/max", "{cycle_ns:.1f us}");
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
  if (summary.log) {
    add_figures(facts, run, "log",
                "{log.path} ({log.messages} messages, {log.dropped} dropped, " +
                    fmt::format("{:.1f} MB)", static_cast<double>(summary.log->bytes) * 1e-6));
  }
  add_figures(facts, run, "DDS",
              "domain {dds.domain}: {dds.samples} samples, {dds.refused} refused; {dds.dropped} "
              "cycles dropped");
  if (summary.dds && summary.dds->services.requests > 0)
    add_figures(facts, run, "requests over DDS", "{dds.requests}, {dds.requests_dropped} dropped");
}

}  // namespace

log::StringMap result_of(const hal::can::DriveMaster* master) {
  log::StringMap result;
  const std::string start = start_text(master);
  if (!start.empty()) result.emplace_back("start", start);
  for (const std::string& text : wire_of(master)) result.emplace_back("wire", text);
  return result;
}

std::string start_text(const hal::can::DriveMaster* master) {
  return figures_text(kStart, figures_json(start_of(master))).value_or("");
}

std::uint64_t RunSummary::planned_cycles() const { return composition.experiment.cycles(); }

bool RunSummary::cut_short() const {
  return interrupted_by != 0 && cycle.running_cycles() < planned_cycles();
}

std::string RunSummary::ended() const {
  const bool early = planned_cycles() == 0 || cycle.running_cycles() < planned_cycles();
  if (early && interrupted_by != 0) {
    const char* name = ::sigabbrev_np(interrupted_by);
    if (name != nullptr) return fmt::format("interrupted by SIG{}", name);
    return fmt::format("interrupted by SIGRTMIN+{}", interrupted_by - SIGRTMIN);
  }
  if (!faults.empty()) return "by a fault";
  if (early && rt::stop_requested()) return "nobody reads its output any more";
  return early ? "on request" : "as planned";
}

double RunSummary::sim_s() const {
  const auto cycles = static_cast<std::int64_t>(cycle.running_cycles());
  return static_cast<double>(cycles * composition.experiment.loop.period_ns) / 1e9;
}

std::optional<ParallelSummary> RunSummary::parallel_summary() const {
  if (!parallel) return std::nullopt;
  return ParallelSummary{&composition.experiment.parallel->robot, &*parallel, differences};
}

Json RunSummary::json() const { return figures_json(this); }

double RunSummary::realtime_factor() const {
  return times.running_s > 0.0 ? sim_s() / times.running_s : 0.0;
}

namespace {

/// The faults of the scenario that were due after the run's end.
std::vector<std::string> never_injected(const Composition& c, const runtime::RobotCycle& cycle) {
  std::vector<std::string> all;
  if (c.sim == nullptr) return all;
  const double ended_s = static_cast<double>(cycle.state().time_ns()[0]) * 1e-9;
  for (const sim::FaultSlot& slot : c.sim->robot().faults()) {
    if (slot.acted != 0) continue;
    const bool enabled = slot.fault.from == sim::FaultFrom::kEnabled;
    all.push_back(fmt::format(
        "the fault '{}' was never injected: it is due {:.3f} s after {}, and the run ended {:.3f} "
        "s after its first SYNC",
        hal::to_string(slot.fault.kind), static_cast<double>(slot.fault.start_ns) * 1e-9,
        enabled ? "the drives are enabled" : "the first SYNC", ended_s));
  }
  return all;
}

}  // namespace

std::vector<std::string> RunSummary::warnings() const {
  std::vector<std::string> all;
  if (composition.master != nullptr) all = composition.master->warnings();
  const bool estimates =
      composition.estimator != nullptr && composition.estimator->image().estimates_base();
  if (estimates && cycle.running_cycles() > 0 && cycle.statistics().estimate().base_cycles == 0) {
    all.push_back(fmt::format(
        "the base's estimate never started, so no external torque and no collision was looked for: "
        "the robot has to stand still on its feet for {} s ([estimation.base] rest_s)",
        composition.experiment.estimation.base->rest_s));
  }
  for (std::string& one : never_injected(composition, cycle)) all.push_back(std::move(one));
  if (composition.tele == nullptr) return all;
  const remote::TeleConfig& link = composition.experiment.teleoperation->link;
  const double silent_s = static_cast<double>(composition.tele->figures().silent_cycles) *
                          static_cast<double>(composition.experiment.loop.period_ns) * 1e-9;
  if (silent_s > 1.0 + 2.0 * link.down.delay_s) {
    all.push_back(fmt::format(
        "no state of the robot came in the last {:.3f} s: what the operator saw then was {}",
        silent_s, link.predict ? "the prediction alone" : "the last state"));
  }
  return all;
}

void RunSummary::print(std::FILE* out) const {
  const Json run = json();
  print_worst_joints(*this, out);
  print_loops(run["loops"], out);
  if (!cycle.faults().empty()) fmt::print(out, "\n");
  print_faults(run["fault_log"], out);
  if (const auto second = parallel_summary()) print_parallel(*second, out);
  fmt::print(out, "\n");
  if (composition.master != nullptr && composition.backend->waits_for_bus()) {
    print_slowest_nodes(composition.master->round_trips(), out);
    fmt::print(out, "\n");
  }
  Facts facts;
  if (cut_short()) {
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
  add_output_facts(*this, run, facts);
  add_bus_facts(composition.open_buses(), facts);
  add_figures(facts, run, "frames",
              "{frames.path} ({frames.frames} frames, {frames.lost} lost" +
                  std::string(frames && !frames->error.empty() ? "; " + frames->error : "") + ")");
  facts.print(out);
}

}  // namespace tandem::apps
