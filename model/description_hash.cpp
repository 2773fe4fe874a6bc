// SHA-256 over generator version, kernel ABI, tree and specification, with numbers in hexadecimal:
// any change of a bit gives another hash.
#include <fmt/format.h>

#include "base/sha256.hpp"
#include "model/generate.hpp"
#include "model/kernels.h"

namespace tandem::model {
namespace {

// Raised whenever the same description would give kernels that compute something else.
constexpr int kGeneratorVersion = 5;

std::string text_of(const Eigen::MatrixXd& m) {
  std::string text;
  for (const double value : m.reshaped()) text += fmt::format(" {:a}", value);
  return text;
}

std::string text_of(const Placement& p) { return text_of(p.R) + text_of(p.p); }

std::string text_of(const Inertia& i) {
  return fmt::format(" {:a}", i.mass_kg) + text_of(i.com_m) + text_of(i.about_com_kg_m2);
}

std::string text_of(const Tree& tree) {
  std::string text = fmt::format("floating {}\n", tree.floating_base);
  for (const Joint& j : tree.joints)
    text += fmt::format("joint '{}' {} {}{}{}\n", j.name, j.parent,
                        j.type == JointType::kPrismatic ? "prismatic" : "revolute", text_of(j.axis),
                        text_of(j.in_parent));
  for (const Joint& j : tree.joints)
    if (j.follows())
      text +=
          fmt::format("'{}' follows '{}' {:a} {:a}\n", j.name,
                      tree.joints[static_cast<std::size_t>(j.leader)].name, j.multiplier, j.offset);
  for (const Link& l : tree.links)
    text += fmt::format("link '{}' {} {} '{}' {}{}{}\n", l.name, l.body, l.parent, l.joint,
                        l.moving, text_of(l.in_body), text_of(l.inertia));
  return text;
}

std::string text_of(const ModelSpec& spec) {
  std::string text = fmt::format("robot '{}'\ngravity {:a} {:a} {:a}\n", spec.robot,
                                 spec.gravity_m_s2[0], spec.gravity_m_s2[1], spec.gravity_m_s2[2]);
  for (const SiteSpec& s : spec.sites) {
    text += fmt::format("site '{}' '{}' {}", s.name, s.link, s.wrench);
    for (const double value : s.xyz_m) text += fmt::format(" {:a}", value);
    for (const double value : s.rpy_rad) text += fmt::format(" {:a}", value);
    text += "\n";
  }
  for (const SensorSpec& s : spec.sensors)
    text += fmt::format("sensor '{}' '{}' '{}'\n", s.name, s.joint, s.frame_link);
  if (spec.derivatives) text += "derivatives\n";
  for (const auto& [joint, value] : spec.armature)
    text += fmt::format("armature '{}' {:a}\n", joint, value);
  return text;
}

}  // namespace

std::string description_hash(const Tree& tree, const ModelSpec& spec) {
  return sha256(fmt::format("generator {} abi {}\n", kGeneratorVersion, TANDEM_KERNELS_ABI) +
                text_of(tree) + text_of(spec));
}

}  // namespace tandem::model
