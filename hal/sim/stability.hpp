// The longest sub-step that the integrator can take without blowing up the stiffest spring.
// Layer: hal/sim.  Thread: non-RT only.
#pragma once

#include <string>

#include "hal/sim/plant.hpp"

namespace tandem::sim {

struct StepLimit {
  double seconds = 0.0;  ///< a longer sub-step is unstable; infinite without springs and dampers
  std::string
      place;  ///< where: "joint RAnkLat", "the motor of joint RAnkLat", "the current of joint …"
};

/// Linearises M x'' + D x' + K x = 0 around the plant's present posture, with the springs and
/// dampers of joints, motors and, every point touching, ground. With u = h / s the sub-step h is
/// stable while every eigenvalue of M^-1 (u^2 K + u D) is below 1. s = 2 for the leapfrog (exact
/// for a single mode); dampers that go by predicted velocities count kPredictedDamper times. s
/// = 2.6 for Runge-Kutta 4 (on the safe side). `place` is where the critical mode moves most.
/// Another posture has another limit: keep a margin.
[[nodiscard]] StepLimit longest_step(const PlantConfig& config, const Plant& plant);

}  // namespace tandem::sim
