// Whatever bytes stand for a URDF: errors with a message, or a tree that the dynamics can use.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "model/urdf.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using tandem::model::Tree;

using tandem::fuzz::require;

void check(const Tree& tree) {
  require(tree.bodies.size() == tree.joints.size() + 1);
  require(!tree.links.empty());
  for (std::size_t i = 0; i < tree.joints.size(); ++i) {
    const auto& joint = tree.joints[i];
    require(joint.parent >= 0 && joint.parent <= static_cast<int>(i));
    require(std::abs(joint.axis.norm() - 1.0) < 1e-12);
    require(joint.in_parent.R.allFinite() && joint.in_parent.p.allFinite());
    require(joint.line > 0);
    if (!joint.follows()) continue;
    require(!tree.joints.at(static_cast<std::size_t>(joint.leader)).follows());
    require(std::isfinite(joint.offset) && std::isfinite(joint.multiplier));
    require(joint.multiplier != 0.0);
  }
  for (const auto& body : tree.bodies) {
    require(std::isfinite(body.inertia.mass_kg) && body.inertia.mass_kg >= 0.0);
  }
  for (std::size_t i = 0; i < tree.links.size(); ++i) {
    require(tree.links[i].parent < static_cast<int>(i));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  using tandem::model::UrdfOptions;
  for (const UrdfOptions& options :
       {UrdfOptions{}, UrdfOptions{.floating_base = true, .mimic_independent = true},
        UrdfOptions{.repair_inertia = true},
        UrdfOptions{.floating_base = true,
        .mimic_independent = true,
        .repair_inertia = true,
        .links = {{.link = "upper",
                 .mass_kg = 2.0,
                 .com_m = {{0.1, 0.0, 0.0}},
                 .inertia_kg_m2 = {{1.0, 0.0, 0.0, 1.0, 0.0, 9.0}}}}}}) {
    const auto model = tandem::model::parse_urdf(text, "fuzz.urdf", options);
    if (model.has_value()) {
      check(model->tree);
    } else {
      require(!model.error().empty());
      for (const auto& error : model.error()) require(!error.message.empty());
    }
  }
  return 0;
}
