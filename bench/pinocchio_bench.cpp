// Pinocchio's dynamics of the same robots, timed as ours are.
#include <benchmark/benchmark.h>

#include <memory>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include "bench/kernels_bench.hpp"

namespace tandem::bench {
namespace {

using Eigen::VectorXd;

struct Robot {
  pinocchio::Model model;
  pinocchio::Data data;
  std::vector<VectorXd> q, v, tau;
};

std::shared_ptr<Robot> read(const std::string& urdf, bool floating_base) {
  auto robot = std::make_shared<Robot>();
  if (floating_base) {
    pinocchio::urdf::buildModel(urdf, pinocchio::JointModelFreeFlyer(), robot->model);
  } else {
    pinocchio::urdf::buildModel(urdf, robot->model);
  }
  robot->data = pinocchio::Data(robot->model);
  const States states = random_states(static_cast<std::size_t>(robot->model.nq),
                                      static_cast<std::size_t>(robot->model.nv), floating_base);
  const auto vectors = [](const std::vector<std::vector<double>>& arrays) {
    std::vector<VectorXd> result;
    for (const std::vector<double>& a : arrays)
      result.emplace_back(
          Eigen::Map<const VectorXd>(a.data(), static_cast<Eigen::Index>(a.size())));
    return result;
  };
  robot->q = vectors(states.q);
  robot->v = vectors(states.v);
  robot->tau = vectors(states.tau);
  return robot;
}

template <class Call>
void add(const std::string& name, const std::shared_ptr<Robot>& robot, Call call) {
  benchmark::RegisterBenchmark(name.c_str(), [robot, call](benchmark::State& state) {
    std::size_t i = 0;
    for (auto _ : state) {
      call(*robot, i);
      i = (i + 1) % States::kCount;
      benchmark::ClobberMemory();
    }
  });
}

}  // namespace

void register_pinocchio(const std::string& robot, const std::string& urdf, bool floating_base) {
  const std::shared_ptr<Robot> r = read(urdf, floating_base);
  const std::string end = "/" + robot + "/pinocchio";
  add("forward_dynamics" + end, r, [](Robot& x, std::size_t i) {
    benchmark::DoNotOptimize(pinocchio::aba(x.model, x.data, x.q[i], x.v[i], x.tau[i]).data());
  });
  add("inverse_dynamics" + end, r, [](Robot& x, std::size_t i) {
    benchmark::DoNotOptimize(pinocchio::rnea(x.model, x.data, x.q[i], x.v[i], x.tau[i]).data());
  });
  add("mass_matrix" + end, r, [](Robot& x, std::size_t i) {
    benchmark::DoNotOptimize(pinocchio::crba(x.model, x.data, x.q[i]).data());
  });
}

}  // namespace tandem::bench
