#include "robot/kernel_supply.hpp"

#include "model/generate.hpp"
#include "robot/kernel_store.hpp"

namespace tandem::robot {

Result<model::KernelLibrary> supply_kernels(const RobotFiles& robot, const std::string& variant,
                                            MissingKernels missing, const BuildKernels& build) {
  auto found = find_kernels(robot, variant);
  if (found || missing == MissingKernels::kRefuse) return found;
  if (!variant.empty() && find_kernels(robot, {})) return found;
  if (missing == MissingKernels::kTolerate) return model::KernelLibrary();

  const std::string hash = model::description_hash(robot.tree, robot.spec);
  const auto path = user_library(robot.config.name, hash);
  if (!path) return std::unexpected(path.error());
  model::BuildOptions options;
  options.library = *path;
  const auto report =
      build ? build(robot, options) : model::build_kernels(robot.tree, robot.spec, options);
  if (!report) return std::unexpected(report.error());
  return model::load_kernels(*path, hash, variant);
}

}  // namespace tandem::robot
