// The path of an operator's hand from a file, and a controller that follows it with an arm by
// inverse kinematics.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "controllers/controller.hpp"
#include "model/tree.hpp"
#include "model/urdf.hpp"

namespace tandem::remote::test {

/// Where a hand was, from its first place [m], in equal steps.
struct HandPath {
  double step_s = 0.0;
  std::vector<Eigen::Vector3d> place_m;
};

/// config/panda/hand.csv: time_s,x_m,y_m,z_m.
inline HandPath read_hand_path(double scale) {
  std::ifstream in(TANDEM_SOURCE_DIR "/config/panda/hand.csv");
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "time_s,x_m,y_m,z_m");
  HandPath path;
  double t = 0.0, x = 0.0, y = 0.0, z = 0.0;
  while (std::getline(in, line)) {
    EXPECT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &t, &x, &y, &z), 4) << line;
    path.place_m.emplace_back(scale * x, scale * y, scale * z);
  }
  path.step_s = t / static_cast<double>(path.place_m.size() - 1);
  return path;
}

/// An arm whose hand is led: joints of the tree that move, and the link that follows.
class Arm {
 public:
  Arm(const std::string& urdf, bool floating, const std::string& hand,
      const std::vector<std::string>& joints)
      : tree_(model::read_urdf(urdf, {.floating_base = floating})->tree) {
    for (const std::string& joint : joints) joints_.push_back(tree_.joint_index(joint));
    const int link = tree_.link_index(hand);
    EXPECT_GE(link, 0) << hand;
    in_body_ = tree_.links[static_cast<std::size_t>(link)].in_body;
    for (int body = tree_.links[static_cast<std::size_t>(link)].body; body > 0;) {
      chain_.push_back(body - 1);  // the joint that moves it
      body = tree_.joints[static_cast<std::size_t>(body - 1)].parent;
    }
    std::ranges::reverse(chain_);
  }
  [[nodiscard]] const model::Tree& tree() const { return tree_; }

  /// Of the hand, in the base's frame. @param q  of all joints of the tree
  /// @param J  null, or its Jacobian for all of them
  [[nodiscard]] Eigen::Vector3d hand_m(const std::vector<double>& q,
                                       Eigen::Matrix3Xd* J = nullptr) const {
    model::Placement at;
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> axes;  // direction, place
    for (const int j : chain_) {
      const model::Joint& joint = tree_.joints[static_cast<std::size_t>(j)];
      at = at * joint.in_parent;
      axes.emplace_back(at.R * joint.axis, at.p);
      at.R *= Eigen::AngleAxisd(q[static_cast<std::size_t>(j)], joint.axis).toRotationMatrix();
    }
    const Eigen::Vector3d hand = (at * in_body_).p;
    if (J != nullptr) {
      J->setZero(3, static_cast<Eigen::Index>(q.size()));
      for (std::size_t i = 0; i < chain_.size(); ++i)
        J->col(chain_[i]) = axes[i].first.cross(hand - axes[i].second);
    }
    return hand;
  }

  /// Positions of the arm's joints along the path, from `q` on: damped least squares, and what is
  /// free of it back to where it began.
  [[nodiscard]] std::vector<std::vector<double>> follow(const HandPath& path,
                                                        std::vector<double> q) const {
    const std::vector<double> rest = q;
    const Eigen::Vector3d first = hand_m(q);
    const auto n = static_cast<Eigen::Index>(joints_.size());
    std::vector<std::vector<double>> all;
    Eigen::Matrix3Xd whole, J(3, n);
    Eigen::VectorXd home(n);
    for (const Eigen::Vector3d& place : path.place_m) {
      for (int step = 0; step < 3; ++step) {
        const Eigen::Vector3d error = first + place - hand_m(q, &whole);
        for (Eigen::Index k = 0; k < n; ++k) {
          const int j = joints_[static_cast<std::size_t>(k)];
          J.col(k) = whole.col(j);
          home[k] = 0.05 * (rest[static_cast<std::size_t>(j)] - q[static_cast<std::size_t>(j)]);
        }
        const Eigen::Matrix3d A = J * J.transpose() + 1e-6 * Eigen::Matrix3d::Identity();
        const Eigen::VectorXd move = home + J.transpose() * A.llt().solve(error - J * home);
        for (Eigen::Index k = 0; k < n; ++k)
          q[static_cast<std::size_t>(joints_[static_cast<std::size_t>(k)])] += move[k];
      }
      EXPECT_LT((hand_m(q) - first - place).norm(), 1e-3) << all.size();
      all.emplace_back();
      for (const int j : joints_) all.back().push_back(q[static_cast<std::size_t>(j)]);
    }
    return all;
  }

 private:
  model::Tree tree_;
  std::vector<int> joints_;  // that are led
  std::vector<int> chain_;   // all joints from the base to the hand
  model::Placement in_body_;
};

/// Plays positions of some joints, by cubics through them. From where they are it goes to the first
/// within a second.
class PlaysJoints final : public Controller {
 public:
  /// @param joints  indices in the image
  PlaysJoints(std::vector<std::size_t> joints, std::vector<std::vector<double>> path, double step_s)
      : joints_(std::move(joints)),
        path_(std::move(path)),
        step_s_(step_s),
        offset_(joints_.size()) {}
  Status configure(ControllerSetup& setup) override {
    for (const std::size_t joint : joints_) setup.claim(joint, hal::ControlMode::kPosition);
    return {};
  }
  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage& /*command*/) noexcept override {
    began_ns_ = time.time_ns;
    for (std::size_t i = 0; i < joints_.size(); ++i)
      offset_[i] = state.position_rad()[joints_[i]] - path_[0][i];
  }
  Code update(const hal::CycleTime& time, const hal::StateImage& /*state*/,
              hal::CommandImage& command) noexcept override {
    const double t = 1e-9 * static_cast<double>(time.time_ns - began_ns_);
    constexpr double kStep_s = 1e-3;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const double now = position(t, i);
      command.position_rad()[joints_[i]] = now;
      command.velocity_rad_s()[joints_[i]] = (position(t + kStep_s, i) - now) / kStep_s;
    }
    return Code::kOk;
  }
  void archive(Archive& ar) override { ar(began_ns_, offset_); }

 private:
  [[nodiscard]] double position(double t_s, std::size_t i) const noexcept {
    const double s = std::min(1.0, t_s / 0.9);
    const double left = 1.0 - s * s * s * (10.0 + s * (6.0 * s - 15.0));
    return at(t_s / step_s_, i) + left * offset_[i];
  }
  [[nodiscard]] double at(double place, std::size_t i) const noexcept {
    const double last = static_cast<double>(path_.size() - 1);
    const double whole = std::min(std::floor(place), last - 1.0), u = std::min(place, last) - whole;
    const auto p = [&](double k) {
      return path_[static_cast<std::size_t>(std::clamp(whole + k, 0.0, last))][i];
    };
    const double a = p(-1), b = p(0), c = p(1), d = p(2);  // Catmull and Rom
    return b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)));
  }

  std::vector<std::size_t> joints_;
  std::vector<std::vector<double>> path_;
  double step_s_;
  std::vector<double> offset_;
  std::int64_t began_ns_ = 0;
};

}  // namespace tandem::remote::test
