// The filter against its own statistics: is the error as large as the covariance says? A motion in
// closed form, with noise of the stated size; TANDEM_SEEDS=100 runs as many.
#include "estimation/contact_filter.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

namespace tandem::estimation {
namespace {

constexpr double kStep_s = 0.001;
const Vec3 kGravity(0.0, 0.0, -9.81);
constexpr FilterNoise kNoise{0.01, 0.1, 1e-3, 1e-2, 0.002, 0.002};
constexpr ContactFilter::Uncertainty kStart{0.02, 0.05, 0.01, 0.02, 0.1};

int seeds() {
  const char* text = std::getenv("TANDEM_SEEDS");
  return text == nullptr ? 20 : std::atoi(text);
}

// A torso that squats, sways and turns above two feet: position, orientation and their derivatives.
struct Motion {
  static Vec3 position(double t) {
    return {0.02 * std::sin(2.0 * t), 0.03 * std::sin(3.0 * t), 0.5 + 0.05 * std::sin(4.0 * t)};
  }
  static Vec3 acceleration(double t) {
    return {-0.08 * std::sin(2.0 * t), -0.27 * std::sin(3.0 * t), -0.8 * std::sin(4.0 * t)};
  }
  static Vec3 velocity(double t) {
    return {0.04 * std::cos(2.0 * t), 0.09 * std::cos(3.0 * t), 0.2 * std::cos(4.0 * t)};
  }
  static Vec3 rate(double t) {  // in the body's frame
    return {0.3 * std::sin(2.5 * t), 0.4 * std::cos(3.5 * t), 0.2 * std::sin(t)};
  }
};

// The truth, and a filter that measures it.
class Rig {
 public:
  explicit Rig(unsigned seed) : random_(seed), filter(2, kNoise, kGravity, kStep_s) {
    // The estimate starts off by as much as it says.
    const Vec3 tilt(normal(kStart.tilt_rad), normal(kStart.tilt_rad), normal(1e-6));
    const Mat3 E = rotation_by(tilt);
    const Vec3 p_error(normal(1e-6), normal(1e-6), normal(kStart.height_m));
    gyro_bias = noise(0.05);
    v = E.transpose() * -noise(kStart.velocity_m_s);  // 0 = E v + xi_v
    p = Motion::position(0.0);
    velocity_offset_ = v - Motion::velocity(0.0);
    accelerometer_bias = -noise(kStart.accelerometer_bias_m_s2);
    filter.start(E * R, E * p + p_error, gyro_bias + noise(kStart.gyro_bias_rad_s), kStart);
    feet = {Vec3(0.0, 0.1, 0.0), Vec3(0.0, -0.1, 0.0)};
    for (std::size_t i = 0; i < 2; ++i) filter.touch(i, seen(i));
  }

  void step() {
    const Vec3 w = Motion::rate(t + 0.5 * kStep_s);
    const Vec3 a = Motion::acceleration(t + 0.5 * kStep_s);
    const Mat3 middle = R * rotation_by(0.5 * kStep_s * w);
    const Vec3 force = middle.transpose() * (a - kGravity);
    filter.predict(w + gyro_bias + noise(kNoise.gyro_rad_s),
                   force + accelerometer_bias + noise(kNoise.accelerometer_m_s2));
    R = R * rotation_by(kStep_s * w);
    t += kStep_s;
    p += (v + 0.5 * kStep_s * a) * kStep_s;
    v += a * kStep_s;
    const double walk = std::sqrt(kStep_s);
    gyro_bias += noise(kNoise.gyro_drift_rad_s2 * walk);
    accelerometer_bias += noise(kNoise.accelerometer_drift_m_s3 * walk);
    for (Vec3& foot : feet) foot += noise(kNoise.foot_slip_m_s * walk);
    const std::vector<Vec3> h{seen(0), seen(1)};
    filter.correct(h, standing);
  }

  /// The right-invariant error and the biases', as covariance() has them.
  Eigen::VectorXd error() const {
    Eigen::VectorXd e(15);
    const Mat3 E = filter.R() * R.transpose();
    e.head<3>() = Vec3(E(2, 1) - E(1, 2), E(0, 2) - E(2, 0), E(1, 0) - E(0, 1)) / 2.0;
    e.segment<3>(3) = filter.v() - E * v;
    e.segment<3>(6) = filter.p() - E * p;
    e.segment<3>(9) = filter.gyro_bias() - gyro_bias;
    e.segment<3>(12) = filter.accelerometer_bias() - accelerometer_bias;
    return e;
  }
  double nees() const {
    const Eigen::MatrixXd P = filter.covariance().topLeftCorner(15, 15);
    const Eigen::VectorXd e = error();
    return e.dot(P.ldlt().solve(e));
  }

 private:
  double normal(double deviation) { return deviation * gauss_(random_); }
  Vec3 noise(double deviation) { return {normal(deviation), normal(deviation), normal(deviation)}; }
  Vec3 seen(std::size_t i) { return R.transpose() * (feet[i] - p) + noise(kNoise.foot_m); }

  std::mt19937 random_;
  std::normal_distribution<double> gauss_;
  Vec3 velocity_offset_;

 public:
  ContactFilter filter;
  double t = 0.0;
  Mat3 R = Mat3::Identity();
  Vec3 v, p, gyro_bias, accelerometer_bias;
  std::vector<Vec3> feet;
  std::vector<std::uint8_t> standing{1, 1};
};

// The mean of n squares of so many normal errors lies within 4 of its own deviations.
void expect_mean(double mean, double dof, double n) {
  EXPECT_NEAR(mean / dof, 1.0, 4.0 * std::sqrt(2.0 / (dof * n)) + 0.02);
}

TEST(ContactFilter, ErrsAsItsCovarianceSays) {
  const int n = seeds();
  double early = 0.0, late = 0.0, innovation = 0.0;
  int innovations = 0;
  for (int seed = 1; seed <= n; ++seed) {
    Rig rig(static_cast<unsigned>(seed));
    for (int i = 0; i < 2000; ++i) {
      rig.step();
      innovation += rig.filter.nis();
      innovations += rig.filter.nis_dof();
      if (i == 200) early += rig.nees() / n;
    }
    late += rig.nees() / n;
  }
  std::printf("NEES after 0.2 s %.2f, after 2 s %.2f of 15; NIS %.4f of 1, %d seeds\n", early, late,
              innovation / innovations, n);
  // Early on the acceleration is known better than second order in a tilt of a degree: the filter
  // is a little too sure of one combination until gyro and feet have told tilt and bias apart.
  EXPECT_LT(early / 15.0, 1.45);
  expect_mean(late, 15.0, n);
  EXPECT_NEAR(innovation / innovations, 1.0, 0.02);
}

TEST(ContactFilter, LeavesYawAndLevelPositionUnobservable) {
  Rig rig(7);
  double yaw = rig.filter.covariance()(2, 2), x = rig.filter.covariance()(6, 6);
  for (int i = 0; i < 3000; ++i) {
    rig.step();
    const auto& P = rig.filter.covariance();
    EXPECT_GE(P(2, 2), 0.999 * yaw) << "nothing measures yaw";
    yaw = P(2, 2);
  }
  EXPECT_GT(rig.filter.covariance()(6, 6), x);
  EXPECT_LT(rig.filter.covariance()(0, 0), 1e-4 * 0.5) << "tilt is known";
}

TEST(ContactFilter, AFootThatTouchesDownAgainIsWhereItIsSeen) {
  Rig rig(3);
  for (int i = 0; i < 200; ++i) rig.step();
  rig.standing[1] = 0;
  rig.feet[1] += Vec3(0.2, 0.0, 0.05);
  for (int i = 0; i < 200; ++i) rig.step();
  const Vec3 h = rig.R.transpose() * (rig.feet[1] - rig.p);
  rig.filter.touch(1, h);
  EXPECT_LT((rig.filter.foot(1) - rig.feet[1]).norm(), 0.05);
  rig.standing[1] = 1;
  for (int i = 0; i < 500; ++i) rig.step();
  EXPECT_LT(std::abs(rig.filter.p().z() - rig.p.z()), 0.03) << "it was not pulled to the old place";
}

TEST(ContactFilter, ContinuesFromItsArchiveWithTheSameBits) {
  Rig rig(5);
  for (int i = 0; i < 100; ++i) rig.step();
  Archive out;
  rig.filter.archive(out);
  ContactFilter copy(2, kNoise, kGravity, kStep_s);
  Archive in(out.bytes());
  copy.archive(in);
  ASSERT_TRUE(in.ok() && in.at_end());
  for (ContactFilter* one : {&copy, &rig.filter}) one->predict({0.1, 0.2, 0.3}, {0.0, 0.1, 9.8});
  EXPECT_EQ(copy.p(), rig.filter.p());
  EXPECT_EQ(copy.covariance(), rig.filter.covariance());
}

/// Turns between opposites, too, as where a sensor hangs head down: there is one, and it is a turn.
TEST(ShortestTurn, LeadsFromOneDirectionToTheOther) {
  const Vec3 up = Vec3::UnitZ();
  for (const Vec3& from : {Vec3(0.3, -0.4, 9.7), Vec3(0.0, 0.0, 2.0), Vec3(7.0, 1.0, -3.0),
                           Vec3(0.0, 0.0, -9.81), Vec3(1e-8, 0.0, -1.0), Vec3(3e-6, 1e-7, -1.0)}) {
    const Mat3 R = shortest_turn(from, up);
    EXPECT_LT((R * from.normalized() - up).norm(), 1e-9) << from.transpose();
    EXPECT_LT((R * R.transpose() - Mat3::Identity()).norm(), 1e-14) << from.transpose();
    EXPECT_NEAR(R.determinant(), 1.0, 1e-14) << from.transpose();
    const double angle = std::atan2(from.cross(up).norm(), from.dot(up));
    EXPECT_NEAR(std::acos(0.5 * (R.trace() - 1.0)), angle, 1e-6)
        << "none is less: " << from.transpose();
  }
}

}  // namespace
}  // namespace tandem::estimation
