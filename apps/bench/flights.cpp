#include "apps/bench/flights.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <random>

#include "hal/sim/rotation.hpp"

namespace tandem::apps {
namespace {

constexpr std::int64_t kFlightSteps_ns[] = {4'000'000, 2'000'000, 1'000'000,
                                            500'000,   250'000,   125'000};
constexpr std::int64_t kTruthStep_ns = 15'625;
constexpr int kRepeats = 3;  // the cost is the least of them: others only ever add to it

struct End {
  std::vector<double> q;
  double energy_drift = 0.0, momentum_drift = 0.0, cost_s = 0.0;
  bool diverged = false;
};

// Energy and angular momentum as they change, over the hold's moments.
class Watch {
 public:
  explicit Watch(const tandem_kernels& kernels) : kernels_(kernels) {}

  void look(const sim::Plant& plant) {
    double energy[2], momentum[6];
    kernels_.energy(plant.q(), plant.v(), energy);
    kernels_.centroidal_momentum(plant.q(), plant.v(), momentum);
    if (first_) {
      first_ = false;
      energy0_ = energy[0] + energy[1];
      std::copy_n(momentum + 3, 3, momentum0_);
    }
    kinetic_ = std::max(kinetic_, energy[0]);
    energy_drift_ = std::max(energy_drift_, std::abs(energy[0] + energy[1] - energy0_));
    double size = 0.0;
    for (int i = 0; i < 3; ++i) {
      momentum_drift_ = std::max(momentum_drift_, std::abs(momentum[3 + i] - momentum0_[i]));
      size = std::max(size, std::abs(momentum0_[i]));
    }
    momentum_ = size;
  }
  [[nodiscard]] double energy_drift() const { return energy_drift_ / kinetic_; }
  [[nodiscard]] double momentum_drift() const { return momentum_drift_ / momentum_; }

 private:
  const tandem_kernels& kernels_;
  bool first_ = true;
  double energy0_ = 0.0, momentum0_[3]{};
  double kinetic_ = 0.0, momentum_ = 0.0, energy_drift_ = 0.0, momentum_drift_ = 0.0;
};

Result<End> fly(const Flight& flight, const EngineEntry& entry, std::int64_t step_ns) {
  Result<sim::Plant> plant = flight.subject->plant(entry, step_ns);
  if (!plant) return std::unexpected(plant.error());
  const tandem_kernels& k = *flight.subject->kernels;
  std::vector<double> q(k.nq, 0.0), v(k.nv, 0.0), torque(k.joints, 0.0);
  if (k.floating_base != 0) q[6] = 1.0;
  flight.start(q, v);
  plant->set_state(q, v);
  Watch watch(k);
  watch.look(*plant);
  End end;
  const auto holds = std::lround(flight.duration_s * 1e9 / Flight::kHold_ns);
  for (long i = 0; i < holds && !end.diverged; ++i) {
    if (flight.torques) {
      flight.torques(static_cast<double>(i * Flight::kHold_ns) * 1e-9, torque);
      for (std::size_t j = 0; j < torque.size(); ++j) plant->set_drive(j, torque[j], true);
    }
    const double before = thread_time_s();
    end.diverged = plant->advance(Flight::kHold_ns) != Code::kOk;
    end.cost_s += thread_time_since_s(before);
    watch.look(*plant);
  }
  end.q.assign(plant->q(), plant->q() + k.nq);
  end.energy_drift = watch.energy_drift();
  end.momentum_drift = watch.momentum_drift();
  return end;
}

double distance_rad(const tandem_kernels& k, const End& a, const End& b) {
  if (a.diverged) return std::numeric_limits<double>::quiet_NaN();
  double most = 0.0;
  const std::size_t base = k.nq - k.joints;
  if (base != 0) {
    const double back[4] = {-b.q[3], -b.q[4], -b.q[5], b.q[6]};
    const auto turn = sim::quaternion_product(back, a.q.data() + 3);
    const double half = std::hypot(turn[0], turn[1], turn[2]);
    most = 2.0 * std::atan2(half, std::abs(turn[3]));
  }
  for (std::size_t i = base; i < k.nq; ++i) most = std::max(most, std::abs(a.q[i] - b.q[i]));
  return most;
}

/// Between the places of the floating base.
double distance_mm(const End& a, const End& b) {
  if (a.diverged) return std::numeric_limits<double>::quiet_NaN();
  return 1e3 * std::hypot(a.q[0] - b.q[0], a.q[1] - b.q[1], a.q[2] - b.q[2]);
}

Result<FlightResult> best_of_repeats(const Flight& flight, const EngineEntry& entry,
                                     std::int64_t step_ns, const End& truth) {
  FlightResult result{.step_ns = step_ns};
  result.cost_us_per_ms = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRepeats; ++i) {
    const Result<End> end = fly(flight, entry, step_ns);
    if (!end) return std::unexpected(end.error());
    result.error_rad = distance_rad(*flight.subject->kernels, *end, truth);
    if (flight.subject->floats()) result.base_error_mm = distance_mm(*end, truth);
    result.energy_drift = end->energy_drift;
    result.momentum_drift = end->momentum_drift;
    result.cost_us_per_ms = std::min(result.cost_us_per_ms, 1e3 * end->cost_s / flight.duration_s);
  }
  return result;
}

struct RandomState {
  std::vector<double> q, v, tau;
};

std::vector<RandomState> random_states(const tandem_kernels& k) {
  constexpr int kStates = 1000;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  std::vector<RandomState> states(kStates);
  for (RandomState& state : states) {
    state = {std::vector<double>(k.nq), std::vector<double>(k.nv), std::vector<double>(k.nv)};
    for (auto* list : {&state.q, &state.v, &state.tau})
      for (double& value : *list) value = number(random);
    if (k.floating_base != 0) sim::normalise_quaternion(state.q.data() + 3);
  }
  return states;
}

using Accelerate = std::function<void(const RandomState&, double* vdot)>;

Result<Accelerate> accelerate_by(const BenchRobot& subject, const EngineEntry& entry) {
  if (entry.ours()) {
    const tandem_kernels& k = *subject.kernels;
    const std::vector<double> none(6 * k.wrenches + 1, 0.0);
    return [&k, none](const RandomState& s, double* vdot) {
      k.forward_dynamics(s.q.data(), s.v.data(), s.tau.data(), none.data(), vdot);
    };
  }
  auto made = sim::make_engine(entry.engine, subject.robot.config, subject.robot.tree, 1e-3);
  if (!made) return std::unexpected(made.error());
  return [engine = std::shared_ptr(std::move(*made))](const RandomState& s, double* vdot) {
    engine->accelerations(s.q.data(), s.v.data(), s.tau.data(), vdot);
  };
}

/// @return processor time of one [us]
double evaluate(const Accelerate& accelerate, const std::vector<RandomState>& states,
                std::vector<std::vector<double>>& vdot) {
  vdot.assign(states.size(), std::vector<double>(states.front().v.size()));
  double least_s = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRepeats; ++i) {
    const double before = thread_time_s();
    for (std::size_t s = 0; s < states.size(); ++s) accelerate(states[s], vdot[s].data());
    least_s = std::min(least_s, thread_time_s() - before);
  }
  return 1e6 * least_s / static_cast<double>(states.size());
}

/// Over the largest of its state.
double worst_difference(const std::vector<std::vector<double>>& a,
                        const std::vector<std::vector<double>>& b) {
  double worst = 0.0;
  for (std::size_t s = 0; s < a.size(); ++s) {
    double difference = 0.0, scale = 0.0;
    for (std::size_t i = 0; i < a[s].size(); ++i) {
      difference = std::max(difference, std::abs(a[s][i] - b[s][i]));
      scale = std::max(scale, std::abs(b[s][i]));
    }
    worst = std::max(worst, difference / scale);
  }
  return worst;
}

}  // namespace

double thread_time_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double thread_time_since_s(double before_s) {
  static const double own_s = [] {
    double least_s = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 1000; ++i) {
      const double begin_s = thread_time_s();
      least_s = std::min(least_s, thread_time_s() - begin_s);
    }
    return least_s;
  }();
  const double after_s = thread_time_s();
  return std::max(0.0, after_s - before_s - own_s);
}

Result<std::vector<FlightRow>> measure(const Flight& flight,
                                       const std::vector<EngineEntry>& entries,
                                       double& truth_error_rad) {
  EngineEntry finest = entries.front();
  finest.integrator = sim::Integrator::kRungeKutta4;
  const Result<End> truth = fly(flight, finest, kTruthStep_ns);
  if (!truth) return std::unexpected(truth.error());
  const Result<End> half = fly(flight, finest, 2 * kTruthStep_ns);
  if (!half) return std::unexpected(half.error());
  truth_error_rad = distance_rad(*flight.subject->kernels, *half, *truth);
  std::vector<FlightRow> rows;
  for (const EngineEntry& entry : entries) {
    FlightRow row{.entry = &entry};
    for (const std::int64_t step_ns : kFlightSteps_ns) {
      const Result<FlightResult> result = best_of_repeats(flight, entry, step_ns, *truth);
      if (!result) {
        row.refusal = result.error().message;
        break;
      }
      row.steps.push_back(*result);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<AccelerationRow> measure_accelerations(const BenchRobot& subject,
                                                   const std::vector<EngineEntry>& entries) {
  const std::vector<RandomState> states = random_states(*subject.kernels);
  std::vector<std::vector<double>> ours, theirs;
  std::vector<AccelerationRow> rows;
  for (const EngineEntry& entry : entries) {
    if (entry.integrator == sim::Integrator::kRungeKutta4) continue;
    AccelerationRow row{.entry = &entry};
    const Result<Accelerate> accelerate = accelerate_by(subject, entry);
    if (accelerate) {
      row.cost_us = evaluate(*accelerate, states, theirs);
      if (entry.ours()) ours = theirs;
      row.worst = worst_difference(theirs, ours);
    } else {
      row.refusal = accelerate.error().message;
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace tandem::apps
