#include "tests/support/payload_kernels.hpp"

#include "base/own_system_call.hpp"
#include "hal/sim/setup.hpp"
#include "model/mechanism.hpp"
#include "runtime/experiment.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem::test {
namespace {

constexpr double kMass_kg = 1.0;
constexpr double kRadius_m = 0.04;

model::Mechanism mechanism_of(hal::RobotConfig robot, const std::string& name,
                              const Eigen::Vector3d& in_link_m) {
  model::Tree tree = robot::complete_robot(robot)->tree;
  const model::Link& link = tree.links.at(static_cast<std::size_t>(tree.link_index(name)));
  model::Inertia& body = tree.bodies[static_cast<std::size_t>(link.body)].inertia;
  body =
      body + model::Inertia{kMass_kg, link.in_body.R * in_link_m + link.in_body.p,
                            0.4 * kMass_kg * kRadius_m * kRadius_m * Eigen::Matrix3d::Identity()};
  return *model::make_mechanism(tree, sim::model_spec(robot));
}

tandem_kernels own;  // the C interface has no place for `this`

}  // namespace

PayloadKernels::PayloadKernels(const hal::RobotConfig& robot, const std::string& link,
                               const Eigen::Vector3d& in_link_m)
    : interpreted_(mechanism_of(robot, link, in_link_m), robot.name),
      kernels_(*interpreted_.get()) {
  own = kernels_;
  kernels_.forward_dynamics_at = [](auto... arrays) {
    TANDEM_OWN_SYSTEM_CALL;
    own.forward_dynamics_at(arrays...);
  };
  kernels_.site_motion_at = [](auto... arrays) {
    TANDEM_OWN_SYSTEM_CALL;
    own.site_motion_at(arrays...);
  };
  kernels_.site_twists_at = [](auto... arrays) {
    TANDEM_OWN_SYSTEM_CALL;
    own.site_twists_at(arrays...);
  };
  kernels_.sensor_wrenches_at = [](auto... arrays) {
    TANDEM_OWN_SYSTEM_CALL;
    own.sensor_wrenches_at(arrays...);
  };
}

PayloadKernels::~PayloadKernels() { (void)take_rt_violations(); }

}  // namespace tandem::test
