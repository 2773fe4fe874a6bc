#include "apps/search/search_methods.hpp"

#include "apps/search/cma_es.hpp"
#include "base/split_mix.hpp"

namespace tandem::apps {
namespace {

Eigen::VectorXd random_point(Eigen::Index keys, std::uint64_t& state) {
  Eigen::VectorXd point(keys);
  for (double& one : point) one = static_cast<double>(split_mix(state) >> 11) * 0x1p-53;
  return point;
}

/// Begins in the middle; once a descent has converged the next one begins anywhere, with twice as
/// many points a generation (Auger and Hansen, "A Restart CMA Evolution Strategy With Increasing
/// Population Size", 2005).
void search_cma_es(const SearchSpace& space, const Evaluate& evaluate) {
  constexpr double kSigma = 0.3, kResolution = 1e-3;
  std::uint64_t random = space.seed;
  Eigen::VectorXd mean = Eigen::VectorXd::Constant(space.keys, 0.5);
  for (std::size_t population = 0;; population *= 2) {
    CmaEs descent(mean, kSigma, split_mix(random), population);
    population = descent.population();
    while (!descent.has_converged(kResolution)) {
      const std::vector<Eigen::VectorXd> points = descent.ask();
      const std::vector<double> values = evaluate(points);
      if (values.size() < points.size()) return;
      descent.tell(values);
    }
    mean = random_point(space.keys, random);
  }
}

void search_phase(const SearchSpace& space, const Evaluate& evaluate) {
  std::vector<Eigen::VectorXd> points(space.runs, Eigen::VectorXd::Constant(space.keys, 0.5));
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i][space.along] = (static_cast<double>(i) + 0.5) / static_cast<double>(points.size());
  }
  (void)evaluate(points);
}

void search_random(const SearchSpace& space, const Evaluate& evaluate) {
  std::uint64_t random = space.seed;
  std::vector<Eigen::VectorXd> points;
  for (std::size_t i = 0; i < space.runs; ++i) points.push_back(random_point(space.keys, random));
  (void)evaluate(points);
}

constexpr SearchMethod kMethods[] = {
    {"cma_es", "descends from the middle, then from anywhere", search_cma_es},
    {"phase", "evenly along one key, the others in their middle", search_phase},
    {"random", "anywhere: what the others are measured against", search_random},
};

}  // namespace

std::span<const SearchMethod> search_methods() { return kMethods; }

}  // namespace tandem::apps
