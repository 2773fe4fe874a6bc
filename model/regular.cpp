// The smallest eigenvalue of the mass matrix, scaled to ones on its diagonal, in given and drawn
// postures; an error names the joints of the motion without energy.
#include "model/regular.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "model/dynamics.hpp"
#include "model/symmetric_eigen.hpp"

namespace tandem::model {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kSingular = 1e-10;  // smallest eigenvalue, of a diagonal of ones
constexpr double kNoEnergy = 1e-14;  // rounding of a motion that has none
constexpr int kDrawn = 4;

/// A joint's position within its limits, or a turn (1 m) either way, from a fixed sequence.
double drawn(const Joint& joint, std::uint64_t& state) {
  state = state * 6364136223846793005U + 1442695040888963407U;
  const double share = static_cast<double>(state >> 11U) * 0x1p-53;
  const double most = joint.type == JointType::kPrismatic ? 1.0 : std::numbers::pi;
  const double lower = std::isfinite(joint.lower) ? joint.lower : -most;
  const double upper = std::isfinite(joint.upper) ? joint.upper : most;
  return lower + share * (upper - lower);
}

std::vector<NamedPosition> all_positions(const Tree& tree, const std::vector<NamedPosition>& more) {
  std::vector<NamedPosition> all{{"when every joint is at 0", {}}};
  for (const Joint& joint : tree.joints) {  // NaN, a limit that is not known, bounds nothing
    const double above = joint.lower > 0.0 ? joint.lower : 0.0;
    all.front().position.push_back(joint.upper < 0.0 ? joint.upper : above);
  }
  all.insert(all.end(), more.begin(), more.end());
  std::uint64_t state = 1;
  for (int i = 0; i < kDrawn; ++i) {
    NamedPosition one{"almost everywhere", {}};
    for (const Joint& joint : tree.joints) one.position.push_back(drawn(joint, state));
    all.push_back(std::move(one));
  }
  return all;
}

// Mass matrix of the coordinates: a follower stands where its leader puts it.
RowMajor mass_matrix(const Tree& tree, const Mechanism& m, const std::vector<double>& position) {
  std::vector<double> q(static_cast<std::size_t>(m.kernel_nq()), 0.0);
  if (m.floating_base) q[6] = 1.0;
  for (std::size_t j = 0; j < position.size(); ++j) {
    if (tree.joints[j].follows()) continue;
    q[static_cast<std::size_t>(m.q_index(m.coordinate_of[j].index))] = position[j];
  }
  const std::vector<double> M = evaluate_kernel(Kernel::kMassMatrix, m, {q})[0];
  return Eigen::Map<const RowMajor>(M.data(), m.kernel_nv(), m.kernel_nv());
}

/// Velocities of a motion without energy, empty when there is none.
/// @param share  out: the motion's energy, of that of its joints one by one
Eigen::VectorXd motion_without_energy(const RowMajor& M, double& share) {
  const Eigen::VectorXd diagonal = M.diagonal();
  for (Eigen::Index i = 0; i < diagonal.size(); ++i) {
    if (diagonal[i] > 0.0) continue;
    share = 0.0;
    return Eigen::VectorXd::Unit(diagonal.size(), i);
  }
  const Eigen::VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * M * scale.asDiagonal();
  const SymmetricEigen eigen = symmetric_eigen(scaled);
  if (eigen.values[0] >= kSingular) return {};
  share = eigen.values[0];
  return eigen.vectors.col(0);
}

/// "joint 'a'", "the joints 'a' and 'b'": those that take part.
/// @param first  the first of them, as a coordinate
std::string joints_text(const Mechanism& m, const Eigen::VectorXd& motion, int& first) {
  std::vector<std::string> names;
  const double most = motion.cwiseAbs().maxCoeff();
  for (int j = 0; j < m.coordinates; ++j) {
    if (std::abs(motion[m.v_index(j)]) < 0.3 * most || names.size() == 4) continue;
    if (names.empty()) first = j;
    names.push_back("'" + m.joint_names[static_cast<std::size_t>(j)] + "'");
  }
  if (names.empty()) return "the floating base";
  if (names.size() == 1) return "joint " + names.front();
  std::string text = "the joints " + names.front();
  for (std::size_t i = 1; i < names.size(); ++i) {
    text += (i + 1 == names.size() ? " and " : ", ") + names[i];
  }
  return text;
}

}  // namespace

Status check_regular(const Tree& tree, const ModelSpec& spec,
                     const std::vector<NamedPosition>& positions) {
  const auto refuse = [&](std::string message, std::string hint, int joint) -> Status {
    const int line = joint < 0 ? 0 : tree.joints[static_cast<std::size_t>(joint)].line;
    const std::string key =
        joint < 0 ? "" : "joint " + tree.joints[static_cast<std::size_t>(joint)].name;
    return std::unexpected(Error{std::move(message), std::move(hint), tree.file, line, key});
  };
  if (tree.joints.empty()) {
    return refuse("the description has no joint that moves, so there are no dynamics to generate",
                  "check the types of its joints and [model.lock]", -1);
  }
  const Result<Mechanism> m = make_mechanism(tree, spec, Frames::kAsDescribed);
  if (!m) return std::unexpected(m.error());
  for (const NamedPosition& one : all_positions(tree, positions)) {
    const RowMajor M = mass_matrix(tree, *m, one.position);
    if (!M.allFinite()) {
      return refuse("the mass matrix is not finite " + one.name,
                    "check masses, inertias and lengths of the description", -1);
    }
    double share = 0.0;
    const Eigen::VectorXd motion = motion_without_energy(M, share);
    if (motion.size() == 0) continue;
    int first = -1;
    const std::string who = joints_text(*m, motion, first);
    const std::string little = share < kNoEnergy
                                   ? " can move without moving any mass"
                                   : fmt::format(
                                         " can move nearly without moving any mass ({:.0e} of what "
                                         "the joints move one by one, at least {:.0e} are needed)",
                                         share, kSingular);
    return refuse(
        "the mass matrix is singular " + one.name + ": " + who + little,
        "give the links that they move mass and inertia, in the description or in "
        "[model.link.NAME], or lock one of them",
        first < 0 ? -1 : tree.joint_index(m->joint_names[static_cast<std::size_t>(first)]));
  }
  return {};
}

}  // namespace tandem::model
