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

Json log_json(const std::optional<log::RecordingResult>& log) {
  if (!log) return nullptr;
  return {{"path", log->path},
          {"messages", log->messages},
          {"dropped", log->dropped},
          {"data_sha256", log->data_sha256}};
}

Json frames_json(const std::optional<hal::can::FrameRecord::Result>& frames) {
  if (!frames) return nullptr;
  return {{"path", frames->path}, {"frames", frames->frames}, {"lost", frames->lost}};
}

Json dds_json(const std::optional<DdsResult>& dds) {
  if (!dds) return nullptr;
  return {{"domain", dds->domain},
          {"samples", dds->counts.sent},
          {"refused", dds->counts.refused},
          {"dropped", dds->counts.dropped},
          {"requests", dds->services.requests},
          {"requests_dropped", dds->services.dropped},
          {"replies", dds->services.replies},
          {"replies_unclaimed", dds->services.unclaimed}};
}

Json ground_json(const std::optional<runtime::GroundFigures>& ground) {
  if (!ground) return nullptr;
  return {{"weight_N", ground->weight_N},
          {"mean_vertical_force_N", ground->mean_vertical_force_N},
          {"max_foot_slip_m", ground->max_foot_slip_m}};
}

Json base_json(const std::optional<runtime::BaseFigures>& base) {
  if (!base) return nullptr;
  return {{"min_height_m", base->min_height_m},
          {"max_height_m", base->max_height_m},
          {"final_tilt_rad", base->final_tilt_rad},
          {"max_tilt_rad", base->max_tilt_rad}};
}

double seconds(const runtime::Peak& peak) { return static_cast<double>(peak.time_ns) * 1e-9; }

Json wrench_json(const runtime::WrenchFigures& one) {
  return {{"max_force_N", one.force_N.value},
          {"max_force_s", seconds(one.force_N)},
          {"max_moment_Nm", one.moment_Nm.value},
          {"max_moment_s", seconds(one.moment_Nm)}};
}

std::string wrench_text(const runtime::WrenchFigures& one) {
  return fmt::format("{:.1f} N at most at {:.3f} s, {:.2f} Nm at {:.3f} s", one.force_N.value,
                     seconds(one.force_N), one.moment_Nm.value, seconds(one.moment_Nm));
}

/// Whether what touches the base was estimated: on a floating base, once its estimate had started.
bool has_base_wrench(const hal::EstimateImage& image, const runtime::EstimateFigures& figures) {
  return !image.external_base_wrench().empty() && figures.base_cycles > 0;
}

/// What was estimated; null without [estimation].
Json estimate_json(const Composition& c, const runtime::EstimateFigures& figures, bool ran) {
  if (c.estimator == nullptr) return nullptr;
  const hal::EstimateImage& image = c.estimator->image();
  Json json{{"base", nullptr},
            {"external_torque_Nm", nullptr},
            {"external_base_wrench", nullptr},
            {"wrenches", Json::object()},
            {"unexplained_torque_Nm", nullptr}};
  if (image.estimates_base()) {
    json["base"] = {{"cycles", figures.base_cycles},
                    {"max_tilt_error_rad", nullptr},
                    {"max_height_error_m", nullptr}};
    if (figures.compared > 0) {
      json["base"]["max_tilt_error_rad"] = figures.max_tilt_error_rad;
      json["base"]["max_height_error_m"] = figures.max_height_error_m;
    }
  }
  // Without an estimate of the base nothing was looked for.
  const bool looked = image.estimates_base() ? figures.base_cycles > 0 : ran;
  for (std::size_t j = 0; looked && j < image.joints(); ++j) {
    json["external_torque_Nm"][c.experiment.robot.joints[j].name] = figures.max_external_Nm[j];
  }
  if (has_base_wrench(image, figures))
    json["external_base_wrench"] = wrench_json(figures.base_wrench);
  for (std::size_t i = 0; i < figures.wrenches.size(); ++i) {
    json["wrenches"][c.experiment.estimation.wrenches[i].site] =
        looked ? wrench_json(figures.wrenches[i]) : Json(nullptr);
  }
  if (looked && !figures.wrenches.empty())
    json["unexplained_torque_Nm"] = figures.unexplained_Nm.value;
  return json;
}

Json loops_json(const hal::RobotConfig& robot, const std::vector<runtime::LoopFigures>& loops) {
  Json json = Json::object();
  for (std::size_t l = 0; l < loops.size(); ++l) {
    json[robot.loops[l].name] = {{"max_position_error_m", loops[l].max_position_error_m},
                                 {"max_velocity_error_m_s", loops[l].max_velocity_error_m_s}};
  }
  return json;
}

void print_loops(const RunSummary& s, std::FILE* out) {
  const std::vector<runtime::LoopFigures>& loops = s.cycle.statistics().loops();
  if (loops.empty()) return;
  Table table({"closed loops", "open at most [m]", "opening at most [m/s]"});
  for (std::size_t l = 0; l < loops.size(); ++l) {
    table.add({s.composition.experiment.robot.loops[l].name,
               fmt::format("{:.1e}", loops[l].max_position_error_m),
               fmt::format("{:.1e}", loops[l].max_velocity_error_m_s)});
  }
  fmt::print(out, "\n");
  table.print(out);
}

std::string microseconds(const rt::Percentiles& p) {
  const auto us = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-3; };
  return fmt::format("{:.1f} / {:.1f} / {:.1f} / {:.1f} us", us(p.p50), us(p.p99), us(p.p999),
                     us(p.max));
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

/// What the robot did: on the ground, and its floating base.
void add_motion_facts(const RunSummary& summary, Facts& facts) {
  if (const auto ground =
          summary.cycle.statistics().ground(weight_N(*summary.composition.kernels))) {
    facts.add("force on the ground",
              fmt::format("{:.2f} N on average, weight {:.2f} N ({:+.3f} %)",
                          ground->mean_vertical_force_N, ground->weight_N,
                          100.0 * (ground->mean_vertical_force_N / ground->weight_N - 1.0)));
    facts.add("feet slip", fmt::format("{:.3f} mm at most", ground->max_foot_slip_m * 1e3));
  }
  if (const auto base = summary.cycle.statistics().base()) {
    constexpr double kStands_deg = 20.0;  // more says that it fell, or nearly did
    const double most_deg = base->max_tilt_rad * kDegrees;
    facts.add("base height",
              fmt::format("{:.4f} to {:.4f} m, tilted {:.3f} deg at the end{}", base->min_height_m,
                          base->max_height_m, base->final_tilt_rad * kDegrees,
                          most_deg < kStands_deg ? std::string()
                                                 : fmt::format(", {:.0f} deg at most", most_deg)));
  }
}

/// What the loop estimated: against the truth, where there is one.
void add_estimate_facts(const RunSummary& summary, Facts& facts) {
  const Composition& c = summary.composition;
  if (c.estimator == nullptr) return;
  const runtime::EstimateFigures figures = summary.cycle.statistics().estimate();
  const hal::EstimateImage& image = c.estimator->image();
  if (figures.compared > 0) {
    facts.add("base estimate",
              fmt::format("off by {:.3f} deg of tilt and {:.1f} mm of height at most",
                          figures.max_tilt_error_rad * kDegrees, figures.max_height_error_m * 1e3));
  } else if (image.has_base()) {
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
  if (has_base_wrench(image, figures))
    facts.add("external wrench on base", wrench_text(figures.base_wrench));
  for (std::size_t i = 0; i < figures.wrenches.size(); ++i) {
    facts.add("wrench at " + c.experiment.estimation.wrenches[i].site,
              wrench_text(figures.wrenches[i]));
  }
  if (!figures.wrenches.empty())
    facts.add("not explained by them",
              fmt::format("{:.2f} Nm at most", figures.unexplained_Nm.value));
}

/// The time that is not in the line above: nothing has run then.
void add_stopped(const LoopTimes& times, Facts& facts) {
  std::string text;
  if (times.stopped_s > 0.0)
    text = fmt::format("{:.2f} s of the clock in fault or held", times.stopped_s);
  if (times.stood_s > 0.0) {
    text += fmt::format("{}{:.2f} s paused or suspended", text.empty() ? "" : ", ", times.stood_s);
  }
  if (!text.empty()) facts.add("not running", text);
}

/// How long cycles took, and whether they were in time.
Json start_json(const hal::can::DriveMaster* master) {
  if (master == nullptr || master->start_up().duration_ns == 0) return nullptr;
  const hal::can::StartUp& start = master->start_up();
  return {{"axes", start.axes},
          {"seconds", static_cast<double>(start.duration_ns) * 1e-9},
          {"frames_sent", start.sent},
          {"frames_received", start.received}};
}

void add_timing_facts(const RunSummary& summary, Facts& facts) {
  const std::string start = start_text(summary.composition.master);
  if (!start.empty()) facts.add("start", start);
  if (summary.composition.master != nullptr) {
    for (const std::string& text : summary.composition.master->wire_texts()) {
      facts.add("wire", text);
    }
  }
  const rt::LoopStatistics& loop = summary.cycle.loop();
  const bool wall_clock = summary.composition.experiment.loop.pacing != rt::Pacing::kSimulated;
  if (wall_clock) {
    facts.add("ran", fmt::format("{:.3f} s, {}, {} skipped", summary.times.running_s,
                                 counted(summary.cycle.running_cycles(), "cycle"), loop.skipped));
  } else {
    facts.add("simulated", fmt::format("{:.3f} s in {:.2f} s: {:.1f} x real time", summary.sim_s(),
                                       summary.times.running_s, summary.realtime_factor()));
  }
  add_stopped(summary.times, facts);
  facts.add("cycle p50/p99/p99.9/max", microseconds(summary.cycle.loop().work.percentiles()));
  if (summary.composition.backend->waits_for_bus()) {
    facts.add("bus p50/p99/p99.9/max", microseconds(summary.cycle.loop().bus.percentiles()));
  }
  const bool woken = loop.wakeup.count() > 0;  // not by a server's cycles
  if (woken) facts.add("wake-up p50/p99/p99.9/max", microseconds(loop.wakeup.percentiles()));
  if (wall_clock || woken) facts.add("overruns", std::to_string(loop.overruns));
}

std::string counts_text(const remote::Network::Counts& counts) {
  return fmt::format("{} messages, {} lost, {} dropped, {} reordered, {} delivered", counts.sent,
                     counts.lost, counts.dropped, counts.reordered, counts.delivered);
}

/// The link to the robot, and what both ends made of it.
void add_link_facts(const remote::OperatorEnd* link, double period_s, Facts& facts) {
  if (link == nullptr) return;
  const remote::TeleFigures figures = link->figures();
  facts.add("commands over the link", counts_text(figures.up));
  facts.add("states over the link", counts_text(figures.down));
  if (figures.robot_end) {
    facts.add("without commands",
              fmt::format("{:.3f} s, {}", static_cast<double>(figures.starved_cycles) * period_s,
                          counted(figures.holds, "time")));
  }
  const auto at_most = [period_s](std::uint64_t cycles) {
    return fmt::format("{:.3f} s at most", static_cast<double>(cycles) * period_s);
  };
  facts.add("without a state", at_most(figures.most_silent_cycles));
  facts.add("without a newer command in force", at_most(figures.most_unanswered_cycles));
}

Json link_json(const remote::OperatorEnd* link) {
  if (link == nullptr) return nullptr;
  const remote::TeleFigures figures = link->figures();
  const auto counts = [](const remote::Network::Counts& one) {
    return Json{{"sent", one.sent},           {"lost", one.lost},
                {"dropped", one.dropped},     {"duplicated", one.duplicated},
                {"reordered", one.reordered}, {"delivered", one.delivered}};
  };
  Json json;
  json["up"] = counts(figures.up);
  json["down"] = counts(figures.down);
  json["starved_cycles"] = figures.robot_end ? Json(figures.starved_cycles) : Json(nullptr);
  json["holds"] = figures.robot_end ? Json(figures.holds) : Json(nullptr);
  json["silent_cycles"] = figures.silent_cycles;
  json["most_silent_cycles"] = figures.most_silent_cycles;
  json["unanswered_cycles"] = figures.unanswered_cycles;
  json["most_unanswered_cycles"] = figures.most_unanswered_cycles;
  json["clock_cycles"] = figures.clock_cycles;
  json["compared"] = figures.compared;
  json["worst_prediction_rad"] = nullptr;
  if (figures.compared > 0) json["worst_prediction_rad"] = figures.worst_prediction_rad;
  return json;
}

/// What the run wrote and published.
void add_output_facts(const RunSummary& summary, Facts& facts) {
  if (summary.log) {
    facts.add("log", fmt::format("{} ({} messages, {} dropped, {:.1f} MB)", summary.log->path,
                                 summary.log->messages, summary.log->dropped,
                                 static_cast<double>(summary.log->bytes) * 1e-6));
  }
  if (summary.dds) {
    facts.add("DDS", fmt::format("domain {}: {} samples, {} refused; {} cycles dropped",
                                 summary.dds->domain, summary.dds->counts.sent,
                                 summary.dds->counts.refused, summary.dds->counts.dropped));
    if (summary.dds->services.requests > 0) {
      facts.add("requests over DDS", fmt::format("{}, {} dropped", summary.dds->services.requests,
                                                 summary.dds->services.dropped));
    }
  }
}

/// The frames that were recorded.
void add_frame_facts(const RunSummary& summary, Facts& facts) {
  if (!summary.frames) return;
  const std::string trouble = summary.frames->error.empty() ? "" : "; " + summary.frames->error;
  facts.add("frames", fmt::format("{} ({} frames, {} lost{})", summary.frames->path,
                                  summary.frames->frames, summary.frames->lost, trouble));
}

}  // namespace

log::StringMap result_of(const hal::can::DriveMaster* master) {
  log::StringMap result;
  const std::string start = start_text(master);
  if (!start.empty()) result.emplace_back("start", start);
  if (master == nullptr) return result;
  for (const std::string& text : master->wire_texts()) result.emplace_back("wire", text);
  return result;
}

std::string start_text(const hal::can::DriveMaster* master) {
  if (master == nullptr || master->start_up().duration_ns == 0) return "";
  const hal::can::StartUp& start = master->start_up();
  return fmt::format("{} enabled after {:.3f} s, {} frames sent and {} received",
                     counted(start.axes, "axis", "axes"),
                     static_cast<double>(start.duration_ns) * 1e-9, start.sent, start.received);
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

double RunSummary::realtime_factor() const {
  return times.running_s > 0.0 ? sim_s() / times.running_s : 0.0;
}

Json RunSummary::json() const {
  const runtime::Experiment& e = composition.experiment;
  const rt::LoopStatistics& loop = cycle.loop();
  Json json;
  json["robot"] = e.robot.name;
  json["hal"] = hal_name(e);
  json["seed"] = e.seed;
  json["ended"] = ended();
  json["planned_cycles"] = planned_cycles() > 0 ? Json(planned_cycles()) : Json(nullptr);
  json["cycles"] = cycle.running_cycles();
  json["period_ns"] = e.loop.period_ns;
  json["sim_seconds"] = sim_s();
  json["wall_seconds"] = times.running_s;
  json["stopped_seconds"] = times.stopped_s;
  json["stood_seconds"] = times.stood_s;
  json["realtime_factor"] = times.running_s > 0.0 ? Json(realtime_factor()) : Json(nullptr);
  json["overruns"] = loop.overruns;
  json["skipped"] = loop.skipped;
  json["wakeup_ns"] = percentiles_json(loop.wakeup);
  json["bus_ns"] =
      composition.backend->waits_for_bus() ? percentiles_json(loop.bus) : Json(nullptr);
  json["cycle_ns"] = percentiles_json(loop.work);
  json["log"] = log_json(log);
  json["frames"] = frames_json(frames);
  json["dds"] = dds_json(dds);
  json["buses"] = buses_json(composition.open_buses());
  json["joints"] = Json::object();
  const auto tracking = cycle.statistics().tracking();
  const auto limited = cycle.statistics().limited_cycles();
  for (std::size_t i = 0; i < tracking.size(); ++i) {
    const bool tracked = tracking[i].cycles > 0;
    json["joints"][e.robot.joints[i].name] = {
        {"rms_tracking_error_rad", tracked ? Json(tracking[i].rms_rad) : Json()},
        {"max_tracking_error_rad", tracked ? Json(tracking[i].max_rad) : Json()},
        {"limited_cycles", limited[i]}};
  }
  json["ground"] = ground_json(cycle.statistics().ground(weight_N(*composition.kernels)));
  json["loops"] = loops_json(e.robot, cycle.statistics().loops());
  json["parallel"] = parallel ? parallel_json(e.parallel->robot, *parallel, *differences) : Json();
  json["base"] = base_json(cycle.statistics().base());
  json["estimate"] =
      estimate_json(composition, cycle.statistics().estimate(), cycle.running_cycles() > 0);
  const hal::can::DriveMaster* master = composition.master;
  json["round_trips"] = master == nullptr ? Json::array() : round_trips_json(master->round_trips());
  json["start"] = start_json(master);
  json["wire"] = master == nullptr ? std::vector<std::string>() : master->wire_texts();
  json["remote"] = remote_json(server, composition.remote);
  json["teleoperation"] = link_json(composition.tele);
  json["faults"] = faults;
  json["warnings"] = warnings();
  json["fault_log"] = faults_json(cycle.faults());
  json["kernel_variant"] = composition.kernels->variant;
  add_engine_json(e, json);
  return json;
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
  print_worst_joints(*this, out);
  print_loops(*this, out);
  if (!cycle.faults().empty()) fmt::print(out, "\n");
  print_faults(faults_json(cycle.faults()), out);
  if (parallel)
    print_parallel(composition.experiment.parallel->robot, *parallel, *differences, out);
  fmt::print(out, "\n");
  if (composition.master != nullptr && composition.backend->waits_for_bus()) {
    print_slowest_nodes(composition.master->round_trips(), out);
    fmt::print(out, "\n");
  }
  Facts facts;
  if (cut_short()) {
    const auto planned = static_cast<double>(planned_cycles()) *
                         static_cast<double>(composition.experiment.loop.period_ns) * 1e-9;
    facts.add("ended", fmt::format("{} after {:.3f} of {:.3f} s", ended(), sim_s(), planned));
  }
  add_limited(*this, facts);
  add_motion_facts(*this, facts);
  add_estimate_facts(*this, facts);
  add_timing_facts(*this, facts);
  add_remote_facts(server, composition.remote, facts);
  add_link_facts(composition.tele,
                 static_cast<double>(composition.experiment.loop.period_ns) * 1e-9, facts);
  facts.add("kernels", composition.kernels->variant);
  const std::string engine = sim::engine_text(composition.experiment.sim.engine);
  if (composition.sim != nullptr && !engine.empty()) facts.add("engine", engine);
  add_output_facts(*this, facts);
  add_bus_facts(composition.open_buses(), facts);
  add_frame_facts(*this, facts);
  facts.print(out);
}

}  // namespace tandem::apps
