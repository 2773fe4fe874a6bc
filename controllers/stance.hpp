// A robot that stands on two feet: inverse kinematics for a height of its base, and the torques
// that carry it there.
// Layer: controllers.  Thread: make() non-RT; the rest any, RT-safe.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "controllers/model_map.hpp"
#include "controllers/support.hpp"
#include "hal/robot_config.hpp"
#include "model/kernels.h"

namespace tandem {

class Archive;

/// Eighteen unknowns, the base's pose and six joints of each leg, and eighteen equations: both
/// feet stay where they are (12), the centre of mass stays over the middle of the feet (2), the
/// base is level and looks ahead (3) at a given height (1). The last four say four unknowns at
/// once; Newton's method solves the other fourteen. All other joints stay as they were placed.
///
/// Frame G (ground): origin between the soles, z up, x ahead. The kernels' W is taken as G.
class Stance {
 public:
  /// @param left, right  names of the sites at the soles: z up, x ahead, when the robot stands
  /// Errors: no kernels, no floating base, no such site, not six joints from the base to a sole.
  [[nodiscard]] static Result<Stance> make(const hal::RobotConfig& robot,
                                           const tandem_kernels* kernels, const std::string& left,
                                           const std::string& right);

  /// Puts the feet where joint positions (the image's order) have them, flat on the ground, and
  /// starts from there.
  /// @return the height of the base above the soles [m]
  double place(std::span<const double> position_rad) noexcept TANDEM_RT;

  /// What solve() did.
  struct Solution {
    bool converged = false;
    int steps = 0;          ///< of Newton; each costs three kernel calls and one 14 x 14 solution
    double residual = 0.0;  ///< largest before the last step [m or rad]
  };
  /// Solves for a height of the base, from the configuration at hand.
  [[nodiscard]] Solution solve(double height_m, int max_steps) noexcept TANDEM_RT;
  /// Moves the configuration on by `dt_s` with the velocity at hand: the next solve() starts near.
  void predict(double dt_s) noexcept TANDEM_RT;
  /// The velocity for a rate of the base's height. @pre solve() at this configuration.
  void move(double rate_m_s) noexcept TANDEM_RT;
  /// The joints' torques for the velocity at hand and an acceleration (nv).
  void carry(std::span<const double> vdot) noexcept TANDEM_RT;

  /// Whether the image's joint `j` is one of the legs' twelve.
  [[nodiscard]] bool in_leg(std::size_t j) const noexcept;
  [[nodiscard]] const ModelMap& map() const noexcept { return map_; }
  [[nodiscard]] std::span<const double> q() const noexcept { return q_; }
  [[nodiscard]] std::span<const double> v() const noexcept { return v_; }
  [[nodiscard]] std::span<const double> tau() const noexcept { return tau_; }
  /// Largest error of the fourteen equations at the configuration at hand [m or rad].
  [[nodiscard]] double residual() noexcept TANDEM_RT;

  void archive(Archive& ar);

 private:
  static constexpr int kUnknowns = 14;  // x and y of the base, 12 joints
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  struct Foot {
    std::size_t site = 0;
    std::array<double, 3> middle_m{};    // of its contact points, in the site's frame
    std::array<double, 3> position_m{};  // of the site, in G
    double yaw_rad = 0.0;
  };

  explicit Stance(const tandem_kernels& kernels);
  [[nodiscard]] Status find_legs(const hal::RobotConfig& robot);
  void evaluate() noexcept TANDEM_RT;
  [[nodiscard]] Vector error() const noexcept TANDEM_RT;
  [[nodiscard]] double jacobian(int row, std::size_t v_column) const noexcept TANDEM_RT;

  const tandem_kernels* kernels_;
  ModelMap map_;
  std::array<Foot, 2> feet_;
  std::array<std::size_t, kUnknowns> columns_{};  // of v: where each unknown stands
  std::array<double, 2> com_m_{};                 // where the centre of mass belongs, in G
  std::vector<double> q_, v_, tau_, zero_;
  std::vector<double> pose_, twist_, acceleration_, site_J_, com_J_, wrench_;
  std::array<double, 3> com_{}, com_velocity_{};
  Eigen::PartialPivLU<Matrix> lu_;
};

}  // namespace tandem
