// What a robot's motion can show at all: base parameters from random states, and columns' names.
#include <algorithm>
#include <cstdint>

#include "identification/base_parameters.hpp"
#include "identification/identify.hpp"

namespace tandem::identification {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr const char* kJointNames[] = {"viscous_Nms_rad", "coulomb_Nm", "offset_Nm",
                                       "rotor_inertia_kg_m2", "delay_s"};

}  // namespace

std::string column_name(const IdentifiedRobot& robot, const model::Tree& tree, Index column) {
  const Index links = robot.regressor.columns();
  if (column < links) {
    const Piece& piece = robot.regressor.pieces()[static_cast<std::size_t>(column / 10)];
    return tree.links[static_cast<std::size_t>(piece.link)].name + "." +
           kParameterNames[static_cast<std::size_t>(column % 10)];
  }
  const Index c = (column - links) / kJointColumns;
  return robot.regressor.coordinates()[static_cast<std::size_t>(c)] + "." +
         kJointNames[(column - links) % kJointColumns];
}

BaseParameters structural_base(IdentifiedRobot& robot, const model::Tree& tree, bool hung) {
  const Index links = robot.regressor.columns();
  const auto joints = static_cast<Index>(robot.facts.joint.size());
  const auto channels = static_cast<Index>(robot.regressor.channels().size());
  const Index columns = links + kJointColumns * joints;
  const Index instants = std::max<Index>(20, 3 * columns / std::max<Index>(1, channels));
  MatrixXd X = MatrixXd::Zero(channels * instants, columns);
  MatrixXd Y;
  VectorXd known;
  std::uint64_t seed = 1;
  for (Index i = 0; i < instants; ++i) {
    Instant at = random_instant(robot.regressor, tree, robot.regressor.sensor_count(), seed);
    if (hung) {
      at.w.setZero();
      at.al.setZero();
      at.a = -robot.facts.gravity_m_s2;
    }
    robot.regressor.evaluate(at, Y, known);
    if (hung) Y.topRows(6).setZero();  // the hoist's force is not known
    X.block(channels * i, 0, channels, links) = Y;
    for (Index c = 0; c < channels; ++c) {
      const Channel& channel = robot.regressor.channels()[static_cast<std::size_t>(c)];
      if (channel.kind != Channel::Kind::kJoint) continue;
      const Index first = links + kJointColumns * channel.index;
      X(channels * i + c, first) = at.v[channel.index];
      X(channels * i + c, first + 1) = at.v[channel.index] > 0.0 ? 1.0 : -1.0;
      X(channels * i + c, first + 2) = 1.0;
      if (robot.facts.rigid[static_cast<std::size_t>(channel.index)])
        X(channels * i + c, first + 3) = at.vdot[channel.index];
    }
  }
  // Angles that a description rounds make tiny differences, which no log shows.
  return base_parameters_of(X, 1e-5);
}

}  // namespace tandem::identification
