// Accelerations as slopes of least-squares lines through neighbouring rows; wrenches from sensors
// or truth; then the kernel row by row.
#include "report/inverse_dynamics.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <string_view>

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

/// The motion's wrenches at a row, turned into their sites' frames.
class Acting {
 public:
  explicit Acting(const tandem_kernels& k)
      : k_(k), pose_(12UL * k.sites), twist_(6UL * k.sites), acceleration_(6UL * k.sites) {
    for (std::uint32_t w = 0; w < k.wrenches; ++w) {
      for (std::uint32_t site = 0; site < k.sites; ++site) {
        if (std::string_view(k.site_names[site]) == k.wrench_names[w]) sites_.push_back(site);
      }
    }
  }
  void turn(const double* q, const std::vector<double>& in_W, std::vector<double>& wrench) {
    const std::vector<double> rest(k_.nv, 0.0);
    k_.site_motion(q, rest.data(), rest.data(), pose_.data(), twist_.data(), acceleration_.data());
    for (std::size_t w = 0; w < sites_.size(); ++w) {
      using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
      const Eigen::Map<const RowMajor3> R(&pose_[12 * sites_[w]]);
      for (const std::size_t part : {6 * w, 6 * w + 3}) {
        Eigen::Map<Eigen::Vector3d>(wrench.data() + part) =
            R.transpose() * Eigen::Map<const Eigen::Vector3d>(&in_W[part]);
      }
    }
  }

 private:
  const tandem_kernels& k_;
  std::vector<std::size_t> sites_;
  std::vector<double> pose_, twist_, acceleration_;
};

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

bool wrenches_known(const tandem_kernels& k, const SampledMotion& motion) {
  if (k.wrenches == 0 || !motion.wrenches.empty()) return true;
  std::vector<bool> seen(k.wrenches, false);
  for (const Pair pair : find_pairs(k, motion.q.front().data())) seen[pair.site] = true;
  return std::ranges::all_of(seen, [](bool one) { return one; });
}

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

std::vector<std::vector<double>> inverse_dynamics(const tandem_kernels& k,
                                                  const SampledMotion& motion) {
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
  Acting acting(k);
  const std::vector<double> none(6UL * k.wrenches, 0.0);
  std::vector<double> wrench = none;
  std::vector<double> unloaded(6UL * k.sensors);
  for (std::size_t row = 0; row < rows; ++row) {
    const double* q = motion.q[row].data();
    const double* v = motion.v[row].data();
    if (!motion.wrenches.empty()) acting.turn(q, motion.wrenches[row], wrench);
    k.sensor_wrenches(q, v, vdot[row].data(), none.data(), unloaded.data());
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
