// What the engines are compared with: a box, chains of links, a block with a sole, COMAN.
// Layer: apps/bench.  Thread: main.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "apps/bench/engine_entries.hpp"
#include "base/result.hpp"
#include "hal/sim/plant.hpp"
#include "model/kernel_library.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {

/// A robot, its kernels, and what its plants are made from.
struct BenchRobot {
  robot::RobotFiles robot;
  model::KernelLibrary kernels;
  std::array<double, 3> gravity_m_s2{0.0, 0.0, -9.81};

  [[nodiscard]] bool floats() const noexcept { return kernels->floating_base != 0; }
  /// In an engine, at q = 0, in sub-steps of `step_ns`. Its joints' motors turn volts into as many
  /// Nm, and have no inertia, friction or limit.
  /// Errors: those of Plant::create().
  [[nodiscard]] Result<sim::Plant> plant(const EngineEntry& entry, std::int64_t step_ns) const;
};

/// A free box of 1 kg, 0.1 x 0.2 x 0.4 m, without gravity.
[[nodiscard]] Result<BenchRobot> make_box();
/// A chain of rods of 1 kg and 1 m in all, hung from the world at its end; they lie along x at
/// q = 0 and turn about y and z in turns.
[[nodiscard]] Result<BenchRobot> make_chain(int links);
/// A cube of 1 kg and 0.1 m on four points of the friction `friction`. Gravity that leans makes a
/// slope of the ground.
[[nodiscard]] Result<BenchRobot> make_block(double friction, std::array<double, 3> gravity_m_s2);
/// COMAN in the air: its 29 joints driven by torques, no ground.
/// @param gravity_m_s2  0 or 9.81, downwards
[[nodiscard]] Result<BenchRobot> make_flyer(double gravity_m_s2);

/// The bundled robot's folder.
/// Errors: it is not there.
[[nodiscard]] Result<std::string> bundled_folder(const std::string& robot);

}  // namespace tandem::apps
