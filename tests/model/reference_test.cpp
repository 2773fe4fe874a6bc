#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "tests/model/reference.hpp"

namespace tandem::model {
namespace {

constexpr double kReferenceTolerance = 1e-10;

class Reference : public testing::TestWithParam<ReferenceRobot> {};

TEST_P(Reference, AgreesWithPinocchioInEveryQuantity) {
  const Mechanism m = reference_mechanism(GetParam());
  const Runner run = [&](Kernel kernel, const Arrays& in) {
    return evaluate_kernel(kernel, m, in);
  };
  int checks = 0;
  against_reference(GetParam(), m, run,
                    [&](const char* quantity, const Array& actual, const Array& expected) {
                      EXPECT_LE(relative_error(actual, expected), kReferenceTolerance) << quantity;
                      ++checks;
                    });
  EXPECT_GE(checks, 20 * 14);
}

TEST_P(Reference, HasTheMassOfPinocchio) {
  const double expected = read_reference(GetParam().name)["total_mass"];
  EXPECT_NEAR(reference_mechanism(GetParam()).mass_kg, expected, 1e-12 * expected);
}

INSTANTIATE_TEST_SUITE_P(Robots, Reference, testing::ValuesIn(kReferenceRobots),
                         [](const auto& test) { return std::string(test.param.name); });

// Robotran moves the base by T1 T2 T3 R1 R2 R3. Its rates in terms of ours: v = B rates.
struct RobotranBase {
  Eigen::Matrix3d R;  // base to world
  Eigen::Matrix<double, 6, 6> B;
  Eigen::Matrix<double, 6, 1> Bdot_rates;

  RobotranBase(const Array& x, const Array& rates) {
    using Eigen::AngleAxisd;
    using Eigen::Matrix3d;
    using Eigen::Vector3d;
    const Matrix3d Ry = AngleAxisd(x[4], Vector3d::UnitY()).toRotationMatrix();
    const Matrix3d Rz = AngleAxisd(x[5], Vector3d::UnitZ()).toRotationMatrix();
    R = AngleAxisd(x[3], Vector3d::UnitX()).toRotationMatrix() * Ry * Rz;
    const Vector3d u1 = Rz.transpose() * Ry.transpose() * Vector3d::UnitX();
    const Vector3d u2 = Rz.transpose() * Vector3d::UnitY();
    const Vector3d z = Vector3d::UnitZ();
    B.setZero();
    B.topLeftCorner<3, 3>() = R.transpose();
    B.block<3, 1>(3, 3) = u1;
    B.block<3, 1>(3, 4) = u2;
    B.block<3, 1>(3, 5) = z;
    const Vector3d w = u1 * rates[3] + u2 * rates[4] + z * rates[5];
    const Vector3d linear = R.transpose() * Vector3d(rates[0], rates[1], rates[2]);
    const Vector3d u1_dot =
        Rz.transpose() * (-rates[4] * Vector3d::UnitY()).cross(Ry.transpose() * Vector3d::UnitX()) -
        rates[5] * z.cross(u1);
    const Vector3d u2_dot = -rates[5] * z.cross(u2);
    Bdot_rates.head<3>() = -w.cross(linear);
    Bdot_rates.tail<3>() = u1_dot * rates[3] + u2_dot * rates[4];
  }
};

struct RobotranState {
  Array q, v, bdot;   // ours; bdot = Bdot rates, to be added to B accelerations
  Eigen::MatrixXd B;  // of all coordinates, rows in our order
};

RobotranState convert(const nlohmann::json& state, const nlohmann::json& coordinates,
                      const Mechanism& m) {
  const Array x = flat(state["q"]);
  const Array rates = flat(state["qd"]);
  const RobotranBase base(x, rates);
  const Eigen::Quaterniond quaternion(base.R);
  RobotranState result;
  result.q = {x[0], x[1], x[2], quaternion.x(), quaternion.y(), quaternion.z(), quaternion.w()};
  result.B = Eigen::MatrixXd::Zero(m.nv(), m.nv());
  result.B.topLeftCorner<6, 6>() = base.B;
  for (int j = 0; j < m.joint_count(); ++j)
    for (std::size_t k = 6; k < coordinates.size(); ++k)
      if (coordinates[k][0] == m.joint_names[j]) {
        result.B(6 + j, static_cast<int>(k)) = 1.0;
        result.q.push_back(x[k]);
      }
  const Eigen::VectorXd v = result.B * Eigen::Map<const Eigen::VectorXd>(rates.data(), m.nv());
  result.v.assign(v.begin(), v.end());
  result.bdot.assign(static_cast<std::size_t>(m.nv()), 0.0);
  for (int i = 0; i < 6; ++i) result.bdot[i] = base.Bdot_rates[i];
  return result;
}

TEST(Robotran, ItsMassMatrixBiasAndTorquesOfWalkmanAreOurs) {
  const Mechanism m = reference_mechanism(reference_robot("walkman"));
  const Array none(static_cast<std::size_t>(6 * m.wrenches), 0.0);
  const nlohmann::json reference = read_reference("walkman_robotran");
  for (const nlohmann::json& state : reference["states"]) {
    const RobotranState s = convert(state, reference["coordinates"], m);
    ASSERT_EQ(s.q.size(), static_cast<std::size_t>(m.nq()));
    const Array M_ours = evaluate_kernel(Kernel::kMassMatrix, m, {s.q})[0];
    const Eigen::MatrixXd M =
        s.B.transpose() * Eigen::Map<const Eigen::MatrixXd>(M_ours.data(), m.nv(), m.nv()) * s.B;
    const Array expected_M = full_from_lower(state["M_lower"]);
    EXPECT_LE(relative_error(Array(M.data(), M.data() + M.size()), expected_M),
              kReferenceTolerance);

    const auto torques = [&](const Array& accelerations) {
      const Array ours =
          evaluate_kernel(Kernel::kInverseDynamics, m, {s.q, s.v, accelerations, none})[0];
      const Eigen::VectorXd theirs =
          s.B.transpose() * Eigen::Map<const Eigen::VectorXd>(ours.data(), m.nv());
      return Array(theirs.begin(), theirs.end());
    };
    EXPECT_LE(relative_error(torques(s.bdot), flat(state["c"])), kReferenceTolerance);
    const Array qdd = flat(state["qdd"]);
    Array vdot = s.bdot;
    const Eigen::VectorXd B_qdd = s.B * Eigen::Map<const Eigen::VectorXd>(qdd.data(), m.nv());
    for (int i = 0; i < m.nv(); ++i) vdot[i] += B_qdd[i];
    EXPECT_LE(relative_error(torques(vdot), flat(state["tau"])), kReferenceTolerance);
  }
}

}  // namespace
}  // namespace tandem::model
