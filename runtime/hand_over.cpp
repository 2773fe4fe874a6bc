#include "runtime/hand_over.hpp"

#include <algorithm>

#include "log/robot_view.hpp"

namespace tandem::runtime {

HandOver::HandOver(CycleNow& now, const DriveResets& resets, const JointHoming& homing,
                   JointArbiter& arbiter, RunServices& services)
    : now_(now),
      resets_(resets),
      homing_(homing),
      arbiter_(arbiter),
      services_(services),
      statistics_(now.robot.joints.size(), now.truth == nullptr ? 0 : now.truth->feet(),
                  now.truth == nullptr ? 0 : now.truth->loops(),
                  now.estimate() == nullptr ? 0 : now.estimate()->wrenches()),
      joints_(now.robot.joints.size()),
      sensors_(now.robot.sensors.size()) {}

void HandOver::take() noexcept TANDEM_RT {
  noted_ = now_.faults.take_noted();
  const hal::CommandImage& told = arbiter_.told();
  if (now_.run.in(RunPhase::kRunning)) {
    statistics_.take(now_.state, told, now_.truth, now_.limits.counters(), now_.estimate());
  }
  if (!ends(now_.run.phase())) statistics_.take_base(now_.truth);
  now_.log.images(now_.time, now_.state, told, now_.truth, now_.estimate());
  show_controllers();
  tell_ended_shadows();
  if (muted_) return;
  show_progress();
  show_joints(told);
  show_sensors();
  if (now_.observer != nullptr) now_.observer->take(view());
}

void HandOver::show() noexcept TANDEM_RT {
  show_progress();
  show_joints(arbiter_.told());
  show_sensors();
}

/// What the controllers tell beside their command.
void HandOver::show_controllers() noexcept TANDEM_RT {
  const double period_s = 1e-9 * static_cast<double>(now_.time.period_ns);
  const ControllerSet updated = now_.controllers.take_updated();
  const ControllerSet shadows = now_.controllers.shadows().set();
  const ControllerSet calls = now_.controllers.shown().active | shadows;
  const bool views = log::RobotView::begins_period(now_.time);
  const ControllerHost::Table& loaded = now_.controllers.loaded();
  for (std::size_t slot = 0; slot < loaded.size(); ++slot) {
    if (loaded[slot] == nullptr) continue;
    ControllerIo& io = *loaded[slot]->io;
    if ((updated & only(slot)) != 0) {
      if (io.signals.numbers() > 0) {
        io.signals.publish(now_.time.cycle, now_.time.time_ns);
        now_.log.signals(now_.time, *loaded[slot]);
        if (now_.observer != nullptr && !muted_) now_.observer->take_signals(now_.time, io.signals);
      }
    }
    if (views && io.marks.show_to_viewers(now_.time.time_ns, (calls & only(slot)) != 0))
      now_.log.marks(now_.time, *loaded[slot]);
    const auto said = io.texts.take(period_s);
    statistics_.take_texts({.said = said.size(), .left_out = io.texts.take_left_out()});
    for (hal::TextEvent& event : said) {
      event.cycle = now_.time.cycle;
      event.time_ns = now_.time.time_ns;
      event.set_controller(loaded[slot]->name);
      now_.log.text(event);
      if (!muted_) services_.show(event);
    }
  }
}

/// Shadows that ended by themselves say why.
void HandOver::tell_ended_shadows() noexcept TANDEM_RT {
  const ControllerSet ended = now_.controllers.shadows().take_ended();
  for (std::size_t slot = 0; ended != 0 && slot < kMostControllers; ++slot) {
    const HostedController* const one = now_.controllers.at(slot);
    if ((ended & only(slot)) == 0 || one == nullptr) continue;
    const ShadowLook& look = one->shadow->look;
    hal::TextEvent event{.cycle = now_.time.cycle, .time_ns = now_.time.time_ns};
    if (is_trouble(look.end)) event.level = hal::TextLevel::kWarn;
    event.set_controller(one->name);
    append_end(event, look,
               look.joint < 0 ? std::string_view()
                              : now_.robot.joints[static_cast<std::size_t>(look.joint)].name);
    now_.log.text(event);
    if (!muted_) services_.show(event);
  }
}

void HandOver::show_progress() noexcept TANDEM_RT {
  Progress& progress = now_.progress;
  progress.dropped.store(now_.log.dropped(), std::memory_order_relaxed);
  progress.phase.store(now_.run.phase(), std::memory_order_relaxed);
  progress.cycles.store(now_.loop.statistics().cycles, std::memory_order_relaxed);
  progress.time_ns.store(now_.time.time_ns, std::memory_order_relaxed);
  progress.running_cycles.store(arbiter_.running_cycles(), std::memory_order_relaxed);
  progress.latched.store(now_.faults.latched(), std::memory_order_relaxed);
  progress.overruns.store(now_.loop.statistics().overruns, std::memory_order_relaxed);
}

bool HandOver::show_to(hal::CycleObserver& observer) const {
  if (now_.progress.cycles.load() == 0) return false;
  for (const auto& one : now_.controllers.loaded()) {
    const bool told = one != nullptr && one->io->signals.numbers() > 0 &&
                      one->io->signals.look().cycle == now_.time.cycle;
    if (told) observer.take_signals(now_.time, one->io->signals);
  }
  observer.take(view());
  return true;
}

hal::CycleView HandOver::view() const noexcept TANDEM_RT {
  return {.time = now_.time,
          .phase = now_.run.phase(),
          .read_code = now_.read_code,
          .state = now_.state,
          .command = arbiter_.told(),
          .truth = now_.truth,
          .estimate = now_.estimate(),
          .times = {.begin_ns = now_.tick.begin_ns,
                    .wakeup_ns = now_.tick.wakeup_ns,
                    .bus_ns = now_.loop.last_bus_ns(),
                    .work_ns = now_.loop.last_work_ns(),
                    .overruns = now_.loop.statistics().overruns,
                    .skipped = now_.loop.statistics().skipped},
          .faults = noted_};
}

/// What is asked of a joint is what its owner wants, before a delay and a transfer.
void HandOver::show_joints(const hal::CommandImage& told) noexcept TANDEM_RT {
  const hal::CommandImage& wanted = arbiter_.wanted();
  const hal::StateImage& state = now_.state;
  JointReferences& references = now_.controllers.references();
  // Where the fields are is looked up once, not for every joint.
  const auto position = state.position_rad(), velocity = state.velocity_rad_s();
  const auto torque = state.torque_Nm(), acceleration = state.acceleration_rad_s2();
  const auto motor_position = state.motor_position_rad();
  const auto motor_velocity = state.motor_velocity_rad_s();
  const auto current = state.current_A(), voltage = state.voltage_V();
  const auto temperature = state.temperature_C(), commanded = told.position_rad();
  const auto fault = state.fault(), age = state.age_cycles();
  const auto mode = wanted.mode(), drive_mode = state.mode();
  const auto interaction = wanted.interaction(), drive_state = state.drive_state();
  const std::uint64_t cycle = now_.time.cycle;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto impedance = references.transfer().written(j, wanted);
    JointStatus& joint = joints_[j];  // all of it, but field by field: g++ clears a whole one first
    joint.cycle = cycle;
    joint.position_rad = position[j];
    joint.velocity_rad_s = velocity[j];
    joint.torque_Nm = torque[j];
    joint.acceleration_rad_s2 = acceleration[j];
    joint.motor_position_rad = motor_position[j];
    joint.motor_velocity_rad_s = motor_velocity[j];
    joint.current_A = current[j];
    joint.voltage_V = voltage[j];
    joint.temperature_C = temperature[j];
    joint.commanded_rad = commanded[j];
    joint.stiffness_Nm_rad = impedance.stiffness_Nm_rad;
    joint.damping_Nms_rad = impedance.damping_Nms_rad;
    joint.fault = fault[j];
    joint.age_cycles = age[j];
    joint.owner = now_.controllers.owner(j);
    joint.mode = mode[j];
    joint.interaction = interaction[j];
    joint.drive_mode = drive_mode[j];
    joint.drive_state = drive_state[j];
    joint.moving = references.leads(j) ? std::uint8_t{1} : std::uint8_t{0};
    joint.resetting = resets_.is_on(j) ? std::uint8_t{1} : std::uint8_t{0};
    joint.homing = homing_.of(j);
  }
  services_.show(joints_);
  if (now_.controllers.gains().revision() != shown_gains_) show_gains();
}

void HandOver::show_gains() noexcept TANDEM_RT {
  services_.show(now_.controllers.gains());
  shown_gains_ = now_.controllers.gains().revision();
}

void HandOver::show_sensors() noexcept TANDEM_RT {
  for (std::size_t s = 0; s < sensors_.size(); ++s) {
    SensorStatus& sensor = sensors_[s];
    sensor.cycle = now_.time.cycle;
    sensor.age_cycles = now_.state.sensor_age_cycles()[s];
    // One that was never heard is older than the run.
    sensor.valid = sensor.age_cycles <=
                   std::min<std::uint64_t>(now_.config.lost_after_cycles, now_.time.cycle);
    std::ranges::copy(now_.state.sensor_values(s), sensor.values.begin());
  }
  services_.show(sensors_);
}

}  // namespace tandem::runtime
