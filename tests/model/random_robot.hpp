// Random URDFs, as odd as those that strangers bring: seeded, the same text on every machine.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <string>

namespace tandem::model {

/// How its numbers are written and its axes lie.
struct RandomRobotOptions {
  int joints = 6;  ///< that move
  bool floating_base = false;
  double branching = 0.3;      ///< probability that a link does not hang on the last one
  double near_parallel = 0.3;  ///< probability that an axis is nearly its parent's
  double right_angles = 0.4;   ///< probability that an angle of rpy is a right one, rounded
  int digits = 0;              ///< of every angle, 4 to 17; 0: another for each
  double mass_decades = 6.0;
};

/// A tree of revolute, continuous, prismatic and fixed joints. Its last link is named "tip".
class RandomRobot {
 public:
  RandomRobot(std::uint64_t seed, const RandomRobotOptions& options);
  [[nodiscard]] const std::string& urdf() const { return urdf_; }
  [[nodiscard]] const RandomRobotOptions& options() const { return options_; }
  [[nodiscard]] int links() const { return links_; }

 private:
  [[nodiscard]] double uniform(double low, double high);
  [[nodiscard]] bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  [[nodiscard]] int pick(int count);
  [[nodiscard]] double angle();
  [[nodiscard]] std::string rounded(double value);
  [[nodiscard]] Eigen::Vector3d direction();
  [[nodiscard]] std::string origin();  ///< the element
  [[nodiscard]] std::string axis();
  [[nodiscard]] std::string offset();
  void add_link(const std::string& name, bool massless);
  void add_joint(int index, const std::string& type, const std::string& parent,
                 const std::string& child);

  std::mt19937_64 generator_;
  RandomRobotOptions options_;
  std::string urdf_;
  int links_ = 0;
};

/// The options of the n-th of many: base, size, axes and digits all vary.
[[nodiscard]] RandomRobotOptions options_of(std::uint64_t seed, int most_joints);

}  // namespace tandem::model
