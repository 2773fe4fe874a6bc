#include "runtime/hand_over.hpp"

#include <algorithm>

namespace tandem::runtime {

HandOver::HandOver(CycleNow& now, const rt::CyclicLoop& loop, const DriveResets& resets,
                   const JointHoming& homing, JointArbiter& arbiter,
                   const hal::CommandLimits& limits, RunServices& services)
    : now_(now),
      loop_(loop),
      resets_(resets),
      homing_(homing),
      arbiter_(arbiter),
      limits_(limits),
      services_(services),
      statistics_(now.robot.joints.size(), now.truth == nullptr ? 0 : now.truth->feet(),
                  now.truth == nullptr ? 0 : now.truth->loops(),
                  now.estimate() == nullptr ? 0 : now.estimate()->wrenches()),
      joints_(now.robot.joints.size()),
      sensors_(now.robot.sensors.size()) {}

void HandOver::take() noexcept TANDEM_RT {
  const hal::CommandImage& told = arbiter_.told();
  if (now_.run.in(RunPhase::kRunning)) {
    statistics_.take(now_.state, told, now_.truth, limits_.counters(), now_.estimate());
  }
  if (!ends(now_.run.phase())) statistics_.take_base(now_.truth);
  now_.log.images(now_.time, now_.state, told, now_.truth, now_.estimate());
  show_progress();
  show_joints();
  show_sensors();
  if (now_.observer != nullptr) show(told);
}

void HandOver::show_progress() noexcept TANDEM_RT {
  Progress& progress = now_.progress;
  progress.dropped.store(now_.log.dropped(), std::memory_order_relaxed);
  progress.phase.store(now_.run.phase(), std::memory_order_relaxed);
  progress.cycles.store(loop_.statistics().cycles, std::memory_order_relaxed);
  progress.time_ns.store(now_.time.time_ns, std::memory_order_relaxed);
  progress.running_cycles.store(arbiter_.running_cycles(), std::memory_order_relaxed);
  progress.latched.store(now_.faults.latched(), std::memory_order_relaxed);
  progress.overruns.store(loop_.statistics().overruns, std::memory_order_relaxed);
}

void HandOver::show(const hal::CommandImage& told) noexcept TANDEM_RT {
  now_.observer->take({.time = now_.time,
                       .phase = now_.run.phase(),
                       .read_code = now_.read_code,
                       .state = now_.state,
                       .command = told,
                       .truth = now_.truth,
                       .estimate = now_.estimate(),
                       .times = {.begin_ns = now_.tick.begin_ns,
                                 .wakeup_ns = now_.tick.wakeup_ns,
                                 .bus_ns = loop_.last_bus_ns(),
                                 .work_ns = loop_.last_work_ns(),
                                 .overruns = loop_.statistics().overruns,
                                 .skipped = loop_.statistics().skipped}});
}

/// What is asked of a joint is what its owner wants, before a delay and a transfer.
void HandOver::show_joints() noexcept TANDEM_RT {
  const hal::CommandImage& wanted = arbiter_.wanted();
  const hal::StateImage& state = now_.state;
  const auto position = state.position_rad(), velocity = state.velocity_rad_s();
  const auto torque = state.torque_Nm(), acceleration = state.acceleration_rad_s2();
  const auto motor_position = state.motor_position_rad();
  const auto motor_velocity = state.motor_velocity_rad_s();
  const auto current = state.current_A(), voltage = state.voltage_V();
  const auto temperature = state.temperature_C();
  const auto commanded = arbiter_.command().position_rad();
  const auto fault = state.fault(), age = state.age_cycles();
  const auto drive_mode = state.mode();
  const auto drive_state = state.drive_state();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto impedance = now_.controllers.wanted_impedance(j, wanted);
    JointStatus& joint = joints_[j];  // all of it, but field by field: g++ clears a whole one first
    joint.cycle = now_.time.cycle;
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
    joint.mode = wanted.mode()[j];
    joint.interaction = wanted.interaction()[j];
    joint.drive_mode = drive_mode[j];
    joint.drive_state = drive_state[j];
    joint.moving = now_.controllers.leads(j) ? std::uint8_t{1} : std::uint8_t{0};
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
