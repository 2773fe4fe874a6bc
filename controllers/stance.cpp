// Newton's method on a square system that make() selects from the feet's and the centre of
// mass' equations; docs/controllers.md has the choice.
#include "controllers/stance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <ranges>

#include "base/archive.hpp"

namespace tandem {
namespace {

/// Rows that are linearly independent and span what all do, in ascending order. Those of a lower
/// priority number are taken first; among equals always the one that stands out most from the
/// taken ones (Gram and Schmidt with pivoting).
///
/// @param priorities  one per row; empty: all alike
std::vector<Eigen::Index> independent_rows(Eigen::MatrixXd rows, std::vector<int> priorities) {
  constexpr double kDependent = 1e-4;  // of the longest row: what is left is rounding, or nearly
  priorities.resize(static_cast<std::size_t>(rows.rows()), 0);
  std::vector<Eigen::Index> taken;
  if (rows.size() == 0) return taken;
  const double least = kDependent * rows.rowwise().norm().maxCoeff();
  std::vector<int> levels = priorities;
  std::ranges::sort(levels);
  for (std::size_t i = 0; i < levels.size(); ++i) {
    Eigen::Index best = -1;
    double length = least;
    for (Eigen::Index row = 0; row < rows.rows(); ++row) {
      if (priorities[static_cast<std::size_t>(row)] != levels[i]) continue;
      if (rows.row(row).norm() <= length) continue;
      best = row;
      length = rows.row(row).norm();
    }
    if (best < 0) continue;  // the rest of this level depends on what is taken
    taken.push_back(best);
    const Eigen::RowVectorXd along = rows.row(best) / length;
    rows -= (rows * along.transpose()) * along;
    rows.row(best).setZero();
  }
  std::ranges::sort(taken);
  return taken;
}

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr double kConverged = 1e-5;   // a step below it leaves an error of its square
constexpr double kLongestStep = 0.2;  // [rad or m] in one Newton step

Matrix3d rotation(const std::vector<double>& pose, std::size_t site) noexcept {
  return Map<const RowMajor3>(&pose[12 * site]);
}
Vector3d origin(const std::vector<double>& pose, std::size_t site) noexcept {
  return Map<const Vector3d>(&pose[12 * site + 9]);
}

/// Largest magnitude; NaN when one is not a number.
template <class Values>
double largest(const Values& values) noexcept {
  double most = 0.0;
  for (const double value : values) {
    if (std::abs(value) > most || std::isnan(value)) most = std::abs(value);
  }
  return most;
}

/// The least rotation from one direction to another that is not its opposite. Eigen's
/// FromTwoVectors gives the same bits, but compiles a singular value decomposition for opposites.
Matrix3d shortest_turn(const Vector3d& from, const Vector3d& to) noexcept TANDEM_RT {
  const Vector3d a = from.normalized(), b = to.normalized();
  const double twice_cos_half = std::sqrt((1.0 + b.dot(a)) * 2.0);
  const Vector3d axis = a.cross(b) * (1.0 / twice_cos_half);
  return Eigen::Quaterniond(twice_cos_half * 0.5, axis.x(), axis.y(), axis.z()).toRotationMatrix();
}

}  // namespace

Stance::Stance(const tandem_kernels& kernels, ModelMap map, std::vector<FootContact> feet)
    : kernels_(&kernels),
      sines_(kernels),
      map_(std::move(map)),
      feet_(std::move(feet)),
      support_(feet_),
      placed_(feet_.size()),
      q_(kernels.nq, 0.0),
      v_(kernels.nv, 0.0),
      tau_(kernels.nv, 0.0),
      zero_(kernels.nv, 0.0),
      pose_(12 * kernels.sites, 0.0),
      twist_(6 * kernels.sites, 0.0),
      site_J_(6 * kernels.nv * kernels.sites, 0.0),
      com_J_(3 * kernels.nv, 0.0),
      wrench_(6 * kernels.wrenches, 0.0) {}

Result<Stance> Stance::make(const hal::Robot& robot, const tandem_kernels* kernels,
                            std::span<const std::string> feet) {
  Result<ModelMap> map = ModelMap::make(robot, kernels);
  if (!map) return std::unexpected(map.error());
  if (kernels->floating_base == 0) {
    return fail("only a robot with a floating base stands on feet", "choose another controller");
  }
  Result<std::vector<FootContact>> found = find_feet(robot, *kernels, feet);
  if (!found) return std::unexpected(found.error());
  Stance stance(*kernels, std::move(*map), std::move(*found));
  if (const Status legs = stance.find_legs(robot); !legs) return std::unexpected(legs.error());
  return stance;
}

Status Stance::find_legs(const hal::Robot& robot) {
  // Near where it will stand, but without symmetry: what depends on what here, does so always.
  std::vector<double> near(robot.joints.size(), 0.0);
  if (!robot.postures.empty()) near = robot.postures[0].position_rad;
  for (std::size_t j = 0; j < near.size(); ++j) near[j] += 0.1 + 0.01 * static_cast<double>(j);
  place(near);
  evaluate();
  std::vector<bool> in_legs(kernels_->nv, false);
  for (std::size_t foot = 0; foot < feet_.size(); ++foot) {
    bool any = false;
    for (std::size_t i = 6; i < kernels_->nv; ++i) {
      if (moves(foot, i)) in_legs[i] = any = true;
    }
    if (any) continue;
    return fail("the foot '" + feet_[foot].name + "' is moved by no joint",
                "leave it out of `feet`, or correct its site's link in " + robot.file);
  }
  std::vector<std::size_t> columns;
  for (std::size_t j = 0; j < map_.joints(); ++j) {
    if (!in_legs[map_.v_index(j)]) continue;
    columns.push_back(map_.v_index(j));
    legs_.push_back(map_.v_index(j));
  }
  columns.insert(columns.end(), {0, 1});  // last: they join the equations of all legs
  choose(columns);
  return {};
}

/// Whether a foot moves with this element of v, where evaluate() was.
bool Stance::moves(std::size_t foot, std::size_t column) const {
  double most = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    most = std::max(most, std::abs(site_J_[(6 * feet_[foot].site + k) * kernels_->nv + column]));
  }
  return most >= 1e-9;
}

std::vector<Stance::Row> Stance::all_rows() const {
  std::vector<Row> rows;
  for (std::size_t foot = 0; foot < feet_.size(); ++foot) {
    for (const Eigen::Index k : {0, 1, 2}) rows.push_back({What::kPlace, foot, k, 0});
    if (feet_[foot].shape == FootShape::kPoint) continue;
    rows.push_back({What::kTurn, foot, 0, 1});
    if (feet_[foot].shape == FootShape::kSurface) rows.push_back({What::kTurn, foot, 1, 1});
    rows.push_back({What::kTurn, foot, 2, 3});  // about the vertical
  }
  for (const Eigen::Index k : {0, 1}) rows.push_back({What::kMass, 0, k, 2});
  return rows;
}

/// Keeps independent equations, and as many of the unknowns `columns`.
void Stance::choose(const std::vector<std::size_t>& columns) {
  const std::vector<Row> all = all_rows();
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor J(all.size(), columns.size());
  std::vector<int> priorities;
  std::vector<std::size_t> every(columns.size());
  std::iota(every.begin(), every.end(), std::size_t{0});
  for (std::size_t row = 0; row < all.size(); ++row) {
    priorities.push_back(all[row].priority);
    jacobian(all[row], columns, every, {&J(static_cast<Eigen::Index>(row), 0), columns.size()});
  }
  const std::vector<Eigen::Index> rows = independent_rows(J, priorities);
  Eigen::MatrixXd kept(static_cast<Eigen::Index>(rows.size()), J.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    kept.row(static_cast<Eigen::Index>(i)) = J.row(rows[i]);
    rows_.push_back(all[static_cast<std::size_t>(rows[i])]);
  }
  for (const Eigen::Index i : independent_rows(kept.transpose(), {})) {
    columns_.push_back(columns[static_cast<std::size_t>(i)]);
  }
  reach_.resize(feet_.size());
  for (std::size_t foot = 0; foot < feet_.size(); ++foot) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (moves(foot, columns_[i])) reach_[foot].push_back(i);
    }
  }
  system_ = SquareSystem(rows_.size());
  error_.assign(rows_.size(), 0.0);
  step_.assign(rows_.size(), {});
}

double Stance::place(std::span<const double> position_rad) noexcept TANDEM_RT {
  std::ranges::fill(q_, 0.0);
  std::ranges::fill(v_, 0.0);
  q_[6] = 1.0;
  map_.positions_to_q(position_rad, q_);
  evaluate();
  const GroundFrame ground = ground_under(feet_, pose_);
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    const Vector3d at = ground.R.transpose() * (middle(i) - ground.origin_m);
    placed_[i].position_m = {at.x(), at.y(), 0.0};
    level(i, ground.R);
  }
  const Vector3d base = -(ground.R.transpose() * ground.origin_m);
  q_[0] = base.x();
  q_[1] = base.y();
  q_[2] = base.z();
  return base.z();
}

/// Where foot `i` is turned to on the ground: as it is, but level.
void Stance::level(std::size_t i, const Matrix3d& base_G) noexcept TANDEM_RT {
  const FootContact& foot = feet_[i];
  Matrix3d turn = base_G.transpose() * rotation(pose_, foot.site);
  Vector3d across = Vector3d::UnitX();
  if (foot.shape != FootShape::kPoint) {
    const Vector3d axis = turn * Map<const Vector3d>(foot.axis.data());
    Vector3d wanted(0.0, 0.0, axis.z() < 0.0 ? -1.0 : 1.0);
    if (foot.shape == FootShape::kLine) {
      wanted = Vector3d(axis.x(), axis.y(), 0.0).normalized();
      across = Vector3d::UnitZ().cross(wanted);
    }
    turn = shortest_turn(axis, wanted) * turn;
  }
  Map<Matrix3d>(placed_[i].turn.data()) = turn;
  Map<Vector3d>(placed_[i].across.data()) = across;
}

void Stance::evaluate() noexcept TANDEM_RT {
  sines_.take(q_.data());
  const double* s = sines_.data();
  kernels_->site_twists_at(s, q_.data(), zero_.data(), pose_.data(), twist_.data());
  kernels_->site_jacobians_at(s, q_.data(), site_J_.data());
  kernels_->center_of_mass_at(s, q_.data(), zero_.data(), com_.data(), com_velocity_.data(),
                              com_J_.data());
}

Vector3d Stance::middle(std::size_t foot) const noexcept TANDEM_RT {
  const std::size_t site = feet_[foot].site;
  return origin(pose_, site) +
         rotation(pose_, site) * Map<const Vector3d>(feet_[foot].middle_m.data());
}

Vector3d Stance::axis(const Row& row) const noexcept TANDEM_RT {
  const bool across =
      row.what == What::kTurn && row.axis == 0 && feet_[row.foot].shape == FootShape::kLine;
  return across ? Vector3d(Map<const Vector3d>(placed_[row.foot].across.data()))
                : Vector3d(Vector3d::Unit(row.axis));
}

double Stance::error(const Row& row) const noexcept TANDEM_RT {
  // G's origin is the middle of the feet.
  if (row.what == What::kMass) return -com_[static_cast<std::size_t>(row.axis)];
  const Placed& placed = placed_[row.foot];
  if (row.what == What::kPlace) {
    return (Map<const Vector3d>(placed.position_m.data()) - middle(row.foot))[row.axis];
  }
  const Matrix3d turn =
      Map<const Matrix3d>(placed.turn.data()) * rotation(pose_, feet_[row.foot].site).transpose();
  return 0.5 * axis(row).dot(Vector3d(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0),
                                      turn(1, 0) - turn(0, 1)));
}

/// One row of the equations' Jacobian, for `columns` of v.
/// @param which  of these move the row's foot: the others are 0
void Stance::jacobian(const Row& row, std::span<const std::size_t> columns,
                      std::span<const std::size_t> which,
                      std::span<double> out) const noexcept TANDEM_RT {
  const std::size_t nv = kernels_->nv;
  const auto axis_of_G = static_cast<std::size_t>(row.axis);
  if (row.what == What::kMass) {
    const double* J = &com_J_[axis_of_G * nv];
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = J[columns[i]];
    return;
  }
  // The site's Jacobian, rows of nv: 3 linear, 3 angular. A place moves with linear[axis] and,
  // the middle being off the site's origin, with e . (w x r) = (r x e) . w.
  const std::size_t site = feet_[row.foot].site;
  const double* J = &site_J_[6 * site * nv];
  const bool place = row.what == What::kPlace;
  const Vector3d turn =
      place ? Vector3d((middle(row.foot) - origin(pose_, site)).cross(Vector3d::Unit(row.axis)))
            : axis(row);
  const double x = turn.x(), y = turn.y(), z = turn.z();
  std::ranges::fill(out, 0.0);
  for (const std::size_t i : which) {
    const double* w = J + 3 * nv + columns[i];
    out[i] = x * w[0] + y * w[nv] + z * w[2 * nv];
  }
  if (!place) return;
  const double* linear = J + axis_of_G * nv;
  for (const std::size_t i : which) out[i] += linear[columns[i]];
}

void Stance::gather() noexcept TANDEM_RT {
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    // As the base is level, its rising lifts places, and neither turns feet nor moves the mass
    // aside.
    const bool height = rows_[row].what == What::kPlace && rows_[row].axis == 2;
    error_[row] = error(rows_[row]);
    system_.set_right(row, {error_[row], height ? -1.0 : 0.0});
    jacobian(rows_[row], columns_, reach_[rows_[row].foot], system_.row(row));
  }
}

/// Moves the unknowns. The base is level, so that its own axes are G's.
void Stance::advance(double factor) noexcept TANDEM_RT {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::size_t column = columns_[i];
    q_[column < 6 ? column : column + 1] += factor * step_[i][0];
  }
}

Stance::Solution Stance::solve(double height_m, int max_steps) noexcept TANDEM_RT {
  q_[2] = height_m;
  Solution solution;
  while (solution.steps < max_steps && !solution.converged) {
    evaluate();
    gather();
    system_.solve(step_);
    const double length = largest(step_ | std::views::elements<0>);
    ++solution.steps;
    solution.residual = largest(error_);
    if (!std::isfinite(length)) return solution;
    advance(length > kLongestStep ? kLongestStep / length : 1.0);
    solution.converged = length < kConverged;
  }
  return solution;
}

void Stance::predict(double dt_s) noexcept TANDEM_RT {
  for (const std::size_t column : columns_) {
    q_[column < 6 ? column : column + 1] += v_[column] * dt_s;
  }
}

void Stance::move(double rate_m_s) noexcept TANDEM_RT {
  v_[2] = rate_m_s;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    v_[columns_[i]] = rate_m_s * step_[i][1];
  }
}

void Stance::carry(std::span<const double> vdot) noexcept TANDEM_RT {
  kernels_->inverse_dynamics(q_.data(), v_.data(), vdot.data(), wrench_.data(), tau_.data());
  support_.carry(*kernels_, q_, pose_, site_J_, tau_);
}

bool Stance::in_leg(std::size_t j) const noexcept {
  return std::ranges::find(legs_, map_.v_index(j)) != legs_.end();
}

double Stance::residual() noexcept TANDEM_RT {
  evaluate();
  gather();
  return largest(error_);
}

double Stance::slip_m() noexcept TANDEM_RT {
  evaluate();
  double most = 0.0;
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    most = std::max(most, (middle(i) - Map<const Vector3d>(placed_[i].position_m.data())).norm());
  }
  return most;
}

void Stance::archive(Archive& ar) { ar(placed_, q_, v_); }

}  // namespace tandem
