// What a multibody engine of somebody else does for the plant: joints, bodies and the ground under
// the soles. Actuators, hoist, end stops, sensors, boards and frames stay the plant's own.
// docs/engines.md compares them. Layer: hal/sim.  Thread: not RT: engines allocate as they like.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/archive.hpp"
#include "base/result.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// What an engine is made from. The ground is the plane z = ground_m; what touches it are the
/// soles' points, and nothing else touches anything.
struct EngineModel {
  /// A point of a sole. To engines that need a shape it is a ball of kRadius_m about it, and the
  /// ground lies as much lower.
  struct Point {
    int body = 0;
    Eigen::Vector3d in_body_m = Eigen::Vector3d::Zero();
  };
  static constexpr double kRadius_m = 1e-3;

  model::Tree tree;                    ///< without followers
  std::vector<double> armature_kg_m2;  ///< of every joint; all 0 where the engine has none
  std::array<double, 3> gravity_m_s2{0.0, 0.0, -9.81};
  std::vector<Point> points;
  double ground_m = 0.0;
  double friction = 0.0;  ///< Coulomb's coefficient
  double step_s = 0.0;    ///< the longest that is asked for
  bool rk4 = false;       ///< the engine's Runge-Kutta of order 4 instead of its usual integrator
};

/// One robot in somebody's engine. It keeps the state; q and v are the kernels' (model/kernels.h).
class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;

  /// Puts the robot where `q` (nq) and `v` (nv) say, and forgets what was kept between steps.
  virtual void set_state(const double* q, const double* v) = 0;

  /// Advances by `step_s` with the engine's own integrator and contact. One that lost its way
  /// answers NaN, or throws, and the plant ends the run.
  /// @param tau  (nv) generalised forces, held; of a floating base a wrench in its own frame
  /// @param q, v  (nq), (nv) out: the state after it
  /// @param forces_W  (3 per point) out: the ground's force on every point in the step, mean, in W
  virtual void step(double step_s, const double* tau, double* q, double* v, double* forces_W) = 0;

  /// The accelerations (nv) of the robot without the ground; the state is `q`, `v` then.
  virtual void accelerations(const double* q, const double* v, const double* tau, double* vdot) = 0;

  /// All that the next step depends on.
  virtual void archive(Archive& ar) = 0;
};

/// To be raised with every change of what an engine's library and the program share.
inline constexpr std::uint32_t kEngineInterface = 1;

/// What an engine's library says of itself, by its only symbol
/// `extern "C" const EnginePlugin* tandem_engine_plugin()`.
struct EnginePlugin {
  std::uint32_t interface;  ///< kEngineInterface
  const char* compiler;     ///< __VERSION__: both sides share C++ types
  const char* name;         ///< "mujoco"
  const char* version;      ///< of the engine
  const char* integrator;   ///< its usual one, in words
  const char* settings;     ///< every setting that is not the engine's own default, in words
  bool armature;            ///< it can do rotors of rigid drives
  bool rk4;                 ///< it has a Runge-Kutta integrator of order 4 as well
  /// Errors: what the engine says of a model that it does not take.
  Result<std::unique_ptr<Engine>> (*create)(const EngineModel& model);
};

}  // namespace tandem::sim

/// Ends the source of an engine: `TANDEM_ENGINE({…})` with the initialiser of its EnginePlugin.
#define TANDEM_ENGINE(...)                                                           \
  extern "C" __attribute__((visibility("default"))) const tandem::sim::EnginePlugin* \
  tandem_engine_plugin() {                                                           \
    static const tandem::sim::EnginePlugin plugin = __VA_ARGS__;                     \
    return &plugin;                                                                  \
  }
