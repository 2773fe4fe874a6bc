// Joint names to indices of the kernels, and the passive joints' positions by closing the loops.
#include "controllers/model_map.hpp"

#include <algorithm>

#include "base/nearest.hpp"
#include "base/quoting.hpp"

namespace tandem {
namespace {

std::vector<std::string> names_of(const char* const* names, std::size_t count) {
  return {names, names + count};
}

}  // namespace

Result<ModelMap> ModelMap::make(const hal::Robot& robot, const tandem_kernels* kernels,
                                PassiveJoints passive) {
  if (kernels == nullptr) {
    return fail("this controller needs the robot's generated model",
                "run `tandem model build " + shell_word(robot.file) + "`");
  }
  const std::vector<std::string> model = names_of(kernels->joint_names, kernels->joints);
  ModelMap map;
  map.base_ = kernels->floating_base != 0 ? 6 : 0;
  for (const hal::DrivenJoint& joint : robot.joints) {
    const auto found = std::ranges::find(model, joint.name);
    if (found == model.end()) {
      return fail(
          "the model of " + std::string(kernels->robot) + " has no joint '" + joint.name + "'",
          suggest(joint.name, model));
    }
    map.index_.push_back(static_cast<std::size_t>(found - model.begin()));
  }
  for (const std::string& name : model) {
    if (robot.joint_index(name) < 0 &&
        !(passive == PassiveJoints::kClosed && robot.is_passive(name))) {
      if (robot.is_passive(name)) {
        return fail("the joint '" + name +
                        "' is passive, and this controller needs a motor at "
                        "every joint",
                    "run hold, joint_trajectory or gravity_compensation");
      }
      return fail("joint '" + name + "' of the model is not driven",
                  "give it a [[joint]] in " + robot.file + ", or lock it in [model.lock]");
    }
  }
  if (robot.passive.empty()) return map;
  auto loops = model::ClosedLoops::create(robot.loops, robot.passive_names(), *kernels);
  if (!loops) return std::unexpected(loops.error());
  map.loops_ = std::move(*loops);
  for (const hal::PassiveJoint& joint : robot.passive)
    map.passive_rad_.push_back(joint.position_rad);
  return map;
}

void ModelMap::positions_to_q(std::span<const double> image,
                              std::span<double> q) const noexcept TANDEM_RT {
  for (std::size_t j = 0; j < index_.size(); ++j) q[q_index(j)] = image[j];
}

void ModelMap::passive_to_q(std::span<double> q) const noexcept TANDEM_RT {
  const std::size_t to_q = base_ == 0 ? 0 : 1;
  for (std::size_t j = 0; j < passive_rad_.size(); ++j)
    q[loops_.passive()[j] + to_q] = passive_rad_[j];
}

bool ModelMap::close(std::span<double> q) noexcept TANDEM_RT {
  constexpr int kMostSteps = 20;
  return loops_.loops() == 0 || loops_.close(q.data(), kMostSteps);
}

Result<std::size_t> site_index(const tandem_kernels& kernels, const std::string& name) {
  const std::vector<std::string> sites = names_of(kernels.site_names, kernels.sites);
  const auto found = std::ranges::find(sites, name);
  if (found != sites.end()) return static_cast<std::size_t>(found - sites.begin());
  return fail("the model of " + std::string(kernels.robot) + " has no site '" + name + "'",
              suggest(name, sites));
}

}  // namespace tandem
