#include "apps/control/run_figures.hpp"

#include <string>

#include "apps/control/fault_table.hpp"

namespace tandem::apps {
namespace {

struct JointFigures {
  runtime::TrackingError error;
  std::uint64_t limited_cycles = 0;
  std::optional<std::string> limited_controller{}, limited_command{};
};

Named<JointFigures> joints_of(const RunFigures& s) {
  Named<JointFigures> joints;
  const auto tracking = s.cycle->statistics().tracking();
  const auto limited = s.cycle->statistics().limited_cycles();
  for (std::size_t j = 0; j < tracking.size(); ++j) {
    const std::int32_t who = s.cycle->limited(j);
    const hal::LimitMet& met = s.cycle->first_limited(j);
    joints.emplace_back(
        s.experiment->robot.joints[j].name,
        JointFigures{tracking[j], limited[j],
                     known(who >= 0, who < 0 ? std::string()
                                             : s.controllers->name(static_cast<std::size_t>(who))),
                     known(met.kind != hal::LimitKind::kNone, hal::in_words(met))});
  }
  return joints;
}

Named<runtime::ClosureFigures> loops_of(const RunFigures& s) {
  Named<runtime::ClosureFigures> loops;
  for (const runtime::ClosureFigures& one : s.cycle->statistics().loops())
    loops.emplace_back(s.experiment->robot.loops[loops.size()].name, one);
  return loops;
}

}  // namespace

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
  f("limited_controller", "whose command was the first that a limit changed; null: none was",
    joint.limited_controller);
  f("limited_command", "that command's field, its value and the limit, in words; null: none",
    joint.limited_command);
}

static void figures(Figures& f, const runtime::WorkFigures& work) {
  f("done_J", "of the joints that drove", work.done_J);
  f("taken_J", "of those that braked", work.taken_J);
  f("max_power_W", "of all together; braking ones count negative", work.max_power_W);
}

static void figures(Figures& f, const runtime::GroundFigures& ground) {
  f("weight_N",
    "mass times gravity, of the plant as it is, payloads included; the average where that changes",
    ground.weight_N);
  f("mean_vertical_force_N", "of all feet together", ground.mean_vertical_force_N);
  f("max_foot_slip_m", "way of a foot since it touched down", ground.max_foot_slip_m);
}

static void figures(Figures& f, const runtime::ClosureFigures& loop) {
  f("max_position_error_m", "over all cycles", loop.max_position_error_m);
  f("max_velocity_error_m_s", loop.max_velocity_error_m_s);
}

static void figures(Figures& f, const runtime::BaseFigures& base) {
  f("min_height_m", base.min_height_m);
  f("max_height_m", base.max_height_m);
  f("final_tilt_rad", "between the base's z axis and the world's", base.final_tilt_rad);
  f("max_tilt_rad", base.max_tilt_rad);
}

double RunFigures::sim_s() const {
  const auto cycles = static_cast<std::int64_t>(cycle->running_cycles());
  return static_cast<double>(cycles * experiment->loop.period_ns) / 1e9;
}

void figures(Figures& f, const runtime::ExpectationResult& one) {
  f("name", one.name);
  f("passed", one.passed);
  f("margin",
    "signed distance to failing, in `unit`; null: nothing was measured, or a phase, a fault or the "
    "run's end decided",
    one.margin);
  f("unit", "empty: a plain number", one.unit);
  f("at_s", "when that was, as in the log: the worst cycle", one.at_s);
  f("reason",
    "why it failed; of an event that passed: that it did not come, and is optional; else empty",
    one.reason);
  f("joint", "of a signal with a `*`: the worst; empty: it has none", one.joint);
  f("awaits",
    "what may still come to one that has not passed, while the run goes on; empty: nothing",
    one.awaits);
  f("holds_so_far", "of one that awaits something: nothing speaks against it yet",
    one.holds_so_far);
}

void figures(Figures& f, const RunFigures* s) {
  f("robot", "`name` of the robot.toml", [&] { return s->experiment->robot.name; });
  f("seed", "of every random generator", [&] { return s->experiment->seed; });
  f("planned_cycles", "of the whole run; null: it has no planned end",
    [&] { return known(s->experiment->cycles() > 0, s->experiment->cycles()); });
  f("cycles", "of the loop while controllers ran", [&] { return s->cycle->running_cycles(); });
  f("period_ns", "nominal", [&] { return s->experiment->loop.period_ns; });
  f("sim_seconds", "`cycles * period_ns`", [&] { return s->sim_s(); });
  f("joints", [&] { return joints_of(*s); });
  f("work", "torque times velocity, as measured; null: no drive tells them", [&] {
    return s->cycle->statistics().work(static_cast<double>(s->experiment->loop.period_ns) * 1e-9);
  });
  f("ground", "by the plant's truth, of a floating base with feet", [&] { return s->ground; });
  f("loops", "of a robot with closed loops in simulation", [&] { return loops_of(*s); });
  f("base",
    "until the drives are disabled at the end, so a fall after a fault counts; floating base with "
    "known truth",
    [&] { return s->cycle->statistics().base(); });
  f("fault_log", "every fault", [&] { return s->cycle->faults(); });
  f("expectations",
    "of `[[expect]]`, in its order, then of events; null without: "
    "[expectations.md](expectations.md)",
    [&] {
      return known(s->expectations != nullptr, s->expectations == nullptr
                                                   ? std::vector<runtime::ExpectationResult>()
                                                   : s->expectations->results());
    });
  f("kernel_variant", "of the generated kernels that ran",
    [&] { return std::string(s->kernel_variant); });
}

}  // namespace tandem::apps
