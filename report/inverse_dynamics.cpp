#include "report/inverse_dynamics.hpp"

#include <Eigen/Dense>
#include <algorithm>

namespace tandem::report {
namespace {

constexpr double kWindow_s = 0.05;  // half of the fit's window

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// Which sensor sees which wrench site.
struct Pair {
  std::size_t sensor;
  std::size_t site;
};

/// d(sensor) / d(wrench at site), at q: the sensors are linear in the wrenches.
Matrix6 response(const tandem_kernels& k, const double* q, Pair pair) {
  const std::vector<double> zero(k.nv, 0.0);
  std::vector<double> wrench(6UL * k.wrenches, 0.0);
  std::vector<double> none(6UL * k.sensors);
  std::vector<double> some(6UL * k.sensors);
  k.sensor_wrenches(q, zero.data(), zero.data(), wrench.data(), none.data());
  Matrix6 out;
  for (std::size_t i = 0; i < 6; ++i) {
    wrench[6 * pair.site + i] = 1.0;
    k.sensor_wrenches(q, zero.data(), zero.data(), wrench.data(), some.data());
    wrench[6 * pair.site + i] = 0.0;
    for (std::size_t row = 0; row < 6; ++row) {
      out(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(i)) =
          some[6 * pair.sensor + row] - none[6 * pair.sensor + row];
    }
  }
  return out;
}

/// Pairs of a sensor and the one site whose wrench it measures.
std::vector<Pair> find_pairs(const tandem_kernels& k, const double* q) {
  std::vector<Pair> pairs;
  for (std::size_t sensor = 0; sensor < k.sensors; ++sensor) {
    std::vector<Pair> seen;
    for (std::size_t site = 0; site < k.wrenches; ++site) {
      const Matrix6 x = response(k, q, {sensor, site});
      if (x.norm() > 1e-9) seen.push_back({sensor, site});
    }
    if (seen.size() == 1) pairs.push_back(seen.front());
  }
  return pairs;
}

}  // namespace

std::vector<double> derivative(std::span<const double> values, double step_s, std::size_t half) {
  std::vector<double> out(values.size(), 0.0);
  const auto n = static_cast<std::ptrdiff_t>(values.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const std::ptrdiff_t begin = std::max<std::ptrdiff_t>(0, i - static_cast<std::ptrdiff_t>(half));
    const std::ptrdiff_t end = std::min(n - 1, i + static_cast<std::ptrdiff_t>(half));
    const double middle = 0.5 * static_cast<double>(begin + end);
    double moment = 0.0;
    double spread = 0.0;
    for (std::ptrdiff_t j = begin; j <= end; ++j) {
      const double t = static_cast<double>(j) - middle;
      moment += t * values[static_cast<std::size_t>(j)];
      spread += t * t;
    }
    out[static_cast<std::size_t>(i)] = spread > 0.0 ? moment / (spread * step_s) : 0.0;
  }
  return out;
}

std::vector<std::vector<double>> inverse_dynamics(const tandem_kernels& k, const Motion& motion) {
  const std::size_t rows = motion.q.size();
  std::vector<std::vector<double>> tau(rows, std::vector<double>(k.nv, 0.0));
  if (rows < 2) return tau;
  const auto half = static_cast<std::size_t>(std::max(1.0, kWindow_s / motion.step_s));
  std::vector<std::vector<double>> vdot(rows, std::vector<double>(k.nv, 0.0));
  std::vector<double> column(rows);
  for (std::size_t i = 0; i < k.nv; ++i) {
    for (std::size_t row = 0; row < rows; ++row) column[row] = motion.v[row][i];
    const std::vector<double> rate = derivative(column, motion.step_s, half);
    for (std::size_t row = 0; row < rows; ++row) vdot[row][i] = rate[row];
  }
  const std::vector<Pair> pairs = find_pairs(k, motion.q.front().data());
  std::vector<double> wrench(6UL * k.wrenches, 0.0);
  std::vector<double> unloaded(6UL * k.sensors);
  for (std::size_t row = 0; row < rows; ++row) {
    const double* q = motion.q[row].data();
    const double* v = motion.v[row].data();
    std::ranges::fill(wrench, 0.0);
    k.sensor_wrenches(q, v, vdot[row].data(), wrench.data(), unloaded.data());
    for (const Pair pair : pairs) {
      const Eigen::Map<const Vector6> measured(motion.sensors[row].data() + 6 * pair.sensor);
      const Eigen::Map<const Vector6> own(unloaded.data() + 6 * pair.sensor);
      Eigen::Map<Vector6>(wrench.data() + 6 * pair.site) =
          response(k, q, pair).fullPivLu().solve(measured - own);
    }
    k.inverse_dynamics(q, v, vdot[row].data(), wrench.data(), tau[row].data());
  }
  return tau;
}

}  // namespace tandem::report
