#include "tests/support/test_robot.hpp"

#include <stdexcept>

#include "hal/sim/setup.hpp"
#include "model/generate.hpp"
#include "model/kernel_build.hpp"
#include "runtime/experiment.hpp"

namespace tandem::test {
namespace {

template <class T>
T take(std::expected<T, Diagnostics> read) {
  if (!read) throw std::runtime_error(read.error().front().to_string());
  return std::move(*read);
}
template <class T>
T take(Result<T> made) {
  if (!made) throw std::runtime_error(made.error().to_string());
  return std::move(*made);
}

}  // namespace

TestRobot load_test_robot(const std::string& name) {
  TestRobot out;
  out.robot = take(
      hal::read_robot_config(std::string(TANDEM_SOURCE_DIR) + "/config/" + name + "/robot.toml"));
  const model::UrdfModel urdf = take(robot::complete_robot(out.robot));
  const std::string folder = std::string(TANDEM_BINARY_DIR) + "/lib/models";
  out.kernels =
      take(model::load_kernels(model::library_path(folder, out.robot.name),
                               model::description_hash(urdf.tree, sim::model_spec(out.robot))));
  out.tree = std::make_shared<const model::Tree>(urdf.tree);
  return out;
}

}  // namespace tandem::test
