// A robot that stands on its feet: inverse kinematics for a height of its base, and the torques
// that carry it there.
// Layer: controllers.  Thread: make() non-RT; the rest any, RT-safe.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "controllers/feet.hpp"
#include "controllers/model_map.hpp"
#include "controllers/square_system.hpp"
#include "controllers/support.hpp"
#include "hal/robot.hpp"
#include "model/kernels.h"
#include "model/sines.hpp"

namespace tandem {

class Archive;

/// Equations: every foot stays where it is (3 each) and turned as it is (as far as its shape lets
/// the ground fix it: 2 for a line, 3 for a surface), the centre of mass stays over the middle of
/// the feet (2). The base is level and looks ahead at a given height. Unknown are the base's x and
/// y and the joints between base and feet; Newton's method finds them.
///
/// Not every leg can meet every equation, and some could in many ways. make() keeps the equations
/// that are independent, positions before tilts before the centre of mass before the rest, and as
/// many unknowns as they need, those that act most. The other joints stay as they were placed.
/// A humanoid with six joints a leg keeps 14 of 14, a quadruped with three joints a leg too.
///
/// Frame G (ground): origin between the feet, z up, x where the base looks. The kernels' W is
/// taken as G.
class Stance {
 public:
  /// @param feet  names of [[contact.foot]]s
  /// Errors: no kernels, no floating base, as find_feet(), a foot that no joint moves.
  [[nodiscard]] static Result<Stance> make(const hal::Robot& robot, const tandem_kernels* kernels,
                                           std::span<const std::string> feet);

  /// Puts the feet where joint positions (the image's order) have them, flat on the ground, and
  /// starts from there. Up is across all contact points, or the base's own as far as they leave
  /// it open.
  /// @return the height of the base above the feet [m]
  double place(std::span<const double> position_rad) noexcept TANDEM_RT;

  /// What solve() did.
  struct Solution {
    bool converged = false;
    int steps = 0;          ///< of Newton; each costs three kernel calls and one elimination
    double residual = 0.0;  ///< largest before the last step [m or rad]
  };
  /// Solves for a height of the base, from the configuration at hand.
  [[nodiscard]] Solution solve(double height_m, int max_steps) noexcept TANDEM_RT;
  /// Moves the configuration on by `dt_s` with the velocity at hand: the next solve() starts near.
  void predict(double dt_s) noexcept TANDEM_RT;
  /// The velocity for a rate of the base's height. @pre solve() near this configuration.
  void move(double rate_m_s) noexcept TANDEM_RT;
  /// The joints' torques for the velocity at hand and an acceleration (nv).
  void carry(std::span<const double> vdot) noexcept TANDEM_RT;

  /// Whether the image's joint `j` lies between the base and a foot.
  [[nodiscard]] bool in_leg(std::size_t j) const noexcept;
  [[nodiscard]] const ModelMap& map() const noexcept { return map_; }
  [[nodiscard]] std::span<const double> q() const noexcept { return q_; }
  [[nodiscard]] std::span<const double> v() const noexcept { return v_; }
  [[nodiscard]] std::span<const double> tau() const noexcept { return tau_; }
  /// How many equations are solved, with as many unknowns.
  [[nodiscard]] std::size_t equations() const noexcept { return rows_.size(); }
  /// Largest error of the solved equations at the configuration at hand [m or rad].
  [[nodiscard]] double residual() noexcept TANDEM_RT;
  /// Farthest that a foot is from where it was placed [m], solved for or not.
  [[nodiscard]] double slip_m() noexcept TANDEM_RT;

  void archive(Archive& ar);

 private:
  enum class What : std::uint8_t { kPlace, kTurn, kMass };
  struct Row {
    What what = What::kPlace;
    std::size_t foot = 0;
    Eigen::Index axis = 0;  ///< of G; of a line's turns: 0 across it, 2 upright
    int priority = 0;       ///< 0 is kept first
  };
  struct Placed {
    std::array<double, 3> position_m{};  ///< of the foot's middle, in G
    std::array<double, 9> turn{};        ///< of its site, column by column, in G
    std::array<double, 3> across{};      ///< to a line, level
  };

  Stance(const tandem_kernels& kernels, ModelMap map, std::vector<FootContact> feet);
  [[nodiscard]] Status find_legs(const hal::Robot& robot);
  [[nodiscard]] std::vector<Row> all_rows() const;
  void choose(const std::vector<std::size_t>& columns);
  void evaluate() noexcept TANDEM_RT;
  void level(std::size_t foot, const Eigen::Matrix3d& base_G) noexcept TANDEM_RT;
  [[nodiscard]] Eigen::Vector3d middle(std::size_t foot) const noexcept TANDEM_RT;
  [[nodiscard]] Eigen::Vector3d axis(const Row& row) const noexcept TANDEM_RT;
  [[nodiscard]] double error(const Row& row) const noexcept TANDEM_RT;
  [[nodiscard]] bool moves(std::size_t foot, std::size_t column) const;
  void jacobian(const Row& row, std::span<const std::size_t> columns,
                std::span<const std::size_t> which, std::span<double> out) const noexcept TANDEM_RT;
  void gather() noexcept TANDEM_RT;
  void advance(double factor) noexcept TANDEM_RT;

  const tandem_kernels* kernels_;
  model::Sines sines_;
  ModelMap map_;
  std::vector<FootContact> feet_;
  Support support_;
  std::vector<Placed> placed_;
  std::vector<Row> rows_;                        // that are solved
  std::vector<std::size_t> columns_;             // of v: the unknowns
  std::vector<std::vector<std::size_t>> reach_;  // by foot: those of columns_ that move it
  std::vector<std::size_t> legs_;                // of v: every joint between the base and a foot
  std::vector<double> q_, v_, tau_, zero_;
  std::vector<double> pose_, twist_, site_J_, com_J_, wrench_;
  std::array<double, 3> com_{}, com_velocity_{};
  SquareSystem system_;  // the Jacobian; right sides: the errors, and the base's rise
  std::vector<double> error_;
  std::vector<SquareSystem::Two> step_;  // solutions: of Newton's step, and per rise of the base
};

}  // namespace tandem
