// The figures of a run, each declared once: docs/json.md, `tandem run`.
#include <fmt/core.h>

#include <algorithm>

#include "apps/can/bus_watch.hpp"
#include "apps/can/round_trips.hpp"
#include "apps/control/fault_table.hpp"
#include "apps/run/remote_link.hpp"
#include "apps/run/run_summary.hpp"
#include "runtime/run/plant_weight.hpp"

namespace tandem::apps {
namespace {

/// Whether what touches the base was estimated: on a floating base, once its estimate had started.
bool has_base_wrench(const hal::EstimateImage& image, const runtime::EstimateFigures& figures) {
  return !image.external_base_wrench().empty() && figures.base_cycles > 0;
}

struct ControllerFigures {
  rt::Percentiles call_ns{};
  std::uint64_t calls = 0, overruns = 0;
};

/// Also of those that are unloaded; of all builds that had the name.
Named<std::optional<ControllerFigures>> controllers_of(const RunSummary& s) {
  Named<std::optional<ControllerFigures>> all;
  for (const auto& one : s.composition.controllers->names()->all()) {
    all.emplace_back(one->name, known(one->calls.count() > 0,
                                      ControllerFigures{one->calls.percentiles(),
                                                        one->calls.count(), one->overruns.load()}));
  }
  return all;
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
  const WiredComposition& c = s.composition;
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

std::vector<std::string> wire_of(const hal::can::DriveMaster* master) {
  return master == nullptr ? std::vector<std::string>() : master->wire_texts();
}

}  // namespace

static void figures(Figures& f, const log::RecordingResult& log) {
  f("path", "of several files that of the first: it opens all of them, also when that one is gone",
    log.path);
  f("branches",
    "logs of the run, which [went back in time](time.md#branches) where it is not 1; "
    "`path` and `data_sha256` are the last one's",
    log.branches);
  f("files", "that were written", log.parts);
  f("files_removed", "of them, to keep to the limits of `[log]`", log.removed);
  f("earlier_files_removed", "the same of runs before (`[log] budget`)", log.earlier_removed);
  f("messages", "written", log.messages);
  f("dropped", "the ring was full", log.dropped);
  f("data_sha256", "of the messages' data, in order, in however many files", log.data_sha256);
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
  f("requests_malformed", "none of their type: not read, not answered", dds.services.malformed);
  f("replies", dds.services.replies);
  f("replies_unclaimed", "the client was gone", dds.services.unclaimed);
}

static void figures(Figures& f, const ControllerFigures& one) {
  f("call_ns", "of its calls in the cycle: `start`, `update`, `retreat`, `stop`", one.call_ns);
  f("calls", one.calls);
  f("overruns", "of which it is the reason: [realtime.md](realtime.md#who-was-slow)", one.overruns);
}

static void figures(Figures& f, const runtime::TextFigures& texts) {
  f("said", "that are in the log, on `/rosout` and in the output", texts.said);
  f("left_out", "beside them, as too many: [controllers.md](controllers.md#signals)",
    texts.left_out);
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
  const auto loop = [s]() -> const rt::CycleStatistics& { return s->cycle.loop(); };
  const auto master = [s] { return s->composition.master; };
  const RunFigures run = s == nullptr ? RunFigures() : s->run();
  figures(f, s == nullptr ? nullptr : &run);
  f("hal", "backend: `sim`, `can`, `ethercat`, `dds`, …", [&] { return hal_name(e()); });
  f("ended",
    "`as planned`; `interrupted by SIGINT` (or another signal), in a run without an end `stopped "
    "by SIGINT`; `on request` (`run.stop`); `its controllers were done` before the planned end; "
    "`by a fault`; `nobody reads its output any more`",
    [&] { return s->ended(); });
  f("begins_s", "the run's time from which it went on, as with `--from`; 0: from its beginning",
    [&] { return s->begins_s; });
  f("wall_seconds", "of those cycles on the wall clock", [&] { return s->times.running_s; });
  f("stopped_seconds", "on the wall clock: in fault, in a reset, or held after it",
    [&] { return s->times.stopped_s; });
  f("stood_seconds",
    "on the wall clock, of simulated time: paused, or the process suspended, for half a second or "
    "more",
    [&] { return s->times.stood_s; });
  f("simulated_seconds",
    "of `sim_seconds`, by this run: with `--from` the others are of the run that it goes on from",
    [&] { return s->simulated_s(); });
  f("realtime_factor", "`simulated_seconds / wall_seconds`",
    [&] { return known(s->times.running_s > 0.0, s->realtime_factor()); });
  f("overruns", "cycles that ended after the next one's start (paced runs)",
    [&] { return loop().overruns; });
  f("skipped", "cycles, because of that (wall clock)", [&] { return loop().skipped; });
  f("wakeup_ns", "wake-up latency; null in a free run", [&] { return loop().wakeup; });
  f("bus_ns", "waiting for the answers on the bus; null without one",
    [&] { return known(s->composition.backend->waits_for_bus(), loop().bus); });
  f("cycle_ns", "of a cycle's own work; null: no cycle was made", [&] { return loop().work; });
  f("controllers", "by name, over all builds that had it; null: it was never called",
    [&] { return controllers_of(*s); });
  f("texts", "lines of text that controllers said; null: none", [&] {
    const runtime::TextFigures& texts = s->cycle.statistics().texts();
    return known(texts.said + texts.left_out > 0, texts);
  });
  f("log", "null: nothing was logged", [&] { return s->log; });
  f("frames", "of `--record-frames`", [&] { return s->frames; });
  f("dds", "with `[dds]`", [&] { return s->dds; });
  f("buses", "of a CAN backend", [&] { return s->composition.open_buses(); });
  f("parallel", "of `[parallel]`", [&] { return s->parallel_summary(); });
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
  f("never_injected", "faults, pushes and payloads of its scenario that were due after its end",
    [&] { return s->never_injected(); });
  f("gate", "with `--gate`: as `rules` of `tandem controller check`", [&] { return s->gate; });
  figures(f, s == nullptr ? nullptr : &e());
}

Json RunSummary::json() const { return figures_json(this); }

log::StringMap result_of(const WiredComposition& c, const runtime::RobotCycle& cycle) {
  const hal::can::DriveMaster* const master = c.master;
  log::StringMap result;
  if (const auto ground = runtime::ground_of(c, cycle); ground && c.sim != nullptr) {
    const bool carries = std::ranges::any_of(c.sim->robot().faults(), [](const auto& slot) {
      return slot.fault.kind == hal::FaultKind::kPayload && slot.acted != 0;
    });
    if (carries || c.experiment.plant != nullptr)
      result.emplace_back("weight_N", fmt::format("{:.6g}", ground->weight_N));
  }
  if (c.expectations != nullptr) {
    for (const runtime::ExpectationResult& one : c.expectations->results())
      result.emplace_back(log::kExpectedKey, one.name + ": " + runtime::in_words(one));
  }
  const std::string start = start_text(master);
  if (!start.empty()) result.emplace_back("start", start);
  for (const std::string& text : wire_of(master)) result.emplace_back("wire", text);
  return result;
}

std::string start_text(const hal::can::DriveMaster* master) {
  return figures_text(
             "{axes|axis|axes} enabled after {seconds:.3f s}, {frames_sent} frames sent and "
             "{frames_received} received",
             figures_json(start_of(master)))
      .value_or("");
}

}  // namespace tandem::apps
