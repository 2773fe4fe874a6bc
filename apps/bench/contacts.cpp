#include "apps/bench/contacts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/bench/flights.hpp"
#include "hal/sim/rotation.hpp"

namespace tandem::apps {
namespace {

constexpr double kGravity = 9.81;
constexpr double kHalf_m = 0.05;  // the block's centre above its sole
constexpr std::int64_t kSlopeSteps_ns[] = {2'000'000, 1'000'000, 500'000, 250'000, 125'000};
constexpr std::int64_t kLook_ns = 4'000'000;

/// The direction down the slope.
std::array<double, 2> down(const Slope& slope) {
  const double both = 1.0 / std::numbers::sqrt2;
  return slope.diagonal ? std::array{both, both} : std::array{1.0, 0.0};
}

std::array<double, 3> leaning(const std::array<double, 2>& to, double tangent) {
  const double normal = kGravity / std::hypot(1.0, tangent);
  return {to[0] * tangent * normal, to[1] * tangent * normal, -normal};
}

void place(sim::Plant& plant, double height_m) {
  std::vector<double> q(plant.kernels().nq, 0.0);
  const std::vector<double> v(plant.kernels().nv, 0.0);
  q[2] = kHalf_m + height_m;
  q[6] = 1.0;
  plant.set_state(q, v);
}

/// Where and how fast along the slope, and how far beside it.
struct Along {
  double way_m = 0.0, speed_m_s = 0.0, beside_m = 0.0;
};
Along along(const Slope& slope, const sim::Plant& plant) {
  const auto [x, y] = down(slope);
  const double* p = plant.q();
  const sim::Vec3 v = sim::rotate(sim::rotation_of(p + 3).data(), plant.v());
  return {p[0] * x + p[1] * y, v[0] * x + v[1] * y, p[1] * x - p[0] * y};
}

/// How far from `start` Coulomb's law takes the block in kSlopeTime_s.
double expected_m(const Slope& slope, const Along& start) {
  if (slope.share <= 1.0) return 0.0;
  const double normal = kGravity / std::hypot(1.0, kSlope);
  const double acceleration = normal * (kSlope - kSlope / slope.share);
  return start.speed_m_s * kSlopeTime_s + 0.5 * acceleration * kSlopeTime_s * kSlopeTime_s;
}

/// Time goes on for `duration_s`. @return false when it diverged
bool advance(sim::Plant& plant, double duration_s) {
  const auto looks = std::lround(duration_s * 1e9 / kLook_ns);
  for (long i = 0; i < looks; ++i)
    if (plant.advance(kLook_ns) != Code::kOk) return false;
  return true;
}

Result<SlopeResult> slide(const Slope& slope, const BenchRobot& block, const EngineEntry& entry,
                          std::int64_t step_ns) {
  Result<sim::Plant> plant = block.plant(entry, step_ns);
  if (!plant) return std::unexpected(plant.error());
  place(*plant, 0.0);
  bool fine = advance(*plant, kSlopeSettle_s);
  const Along start = along(slope, *plant);
  const double before = thread_time_s();
  fine = advance(*plant, kSlopeTime_s) && fine;
  const double cost_s = thread_time_s() - before;
  const Along end = along(slope, *plant);
  const double error_m = std::abs(end.way_m - start.way_m - expected_m(slope, start));
  return SlopeResult{.step_ms = 1e-6 * static_cast<double>(step_ns),
                     .error_mm = fine ? 1e3 * error_m : std::nan(""),
                     .sideways_mm = 1e3 * std::abs(end.beside_m - start.beside_m),
                     .cost_us_per_ms = 1e3 * cost_s / kSlopeTime_s};
}

Result<DropRow> drop(const BenchRobot& block, const EngineEntry& entry, std::int64_t step_ns) {
  Result<sim::Plant> plant = block.plant(entry, step_ns);
  if (!plant) return std::unexpected(plant.error());
  constexpr double kHeight_m = 0.05, kTime_s = 2.0, kAtRest_m_s = 1e-3;
  place(*plant, kHeight_m);
  DropRow row{.entry = &entry, .step_ms = 1e-6 * static_cast<double>(step_ns)};
  const double mass = plant->kernels().mass_kg;
  bool touched = false;
  double moved_s = 0.0;
  for (std::int64_t now = 0; now < static_cast<std::int64_t>(kTime_s * 1e9); now += step_ns) {
    const double before = thread_time_s();
    const bool fine = plant->advance(step_ns) == Code::kOk;
    row.cost_us_per_ms += 1e3 * thread_time_since_s(before) / kTime_s;
    const double height = plant->q()[2] - kHalf_m;
    const double* v = plant->v();
    const double speed2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    touched = touched || height <= 1e-4;
    if (touched) row.rebound_mm = std::max(row.rebound_mm, 1e3 * height);
    row.energy_gain_mJ =
        std::max(row.energy_gain_mJ, 1e3 * mass * (0.5 * speed2 + kGravity * (height - kHeight_m)));
    if (std::sqrt(speed2) > kAtRest_m_s) moved_s = 1e-9 * static_cast<double>(now + step_ns);
    row.depth_mm = -1e3 * height;
    if (!fine) break;
  }
  row.settled_s = moved_s > kTime_s - 0.01 ? -1.0 : moved_s;
  return row;
}

}  // namespace

const std::vector<Slope>& slopes() {
  static const std::vector<Slope> all{
      {"along an axis, holds: 0.98 of the cone", 0.98, false},
      {"along the diagonal, holds: 0.98 of the cone", 0.98, true},
      {"along an axis, slides: 1.02 of the cone", 1.02, false},
      {"along the diagonal, slides: 1.02 of the cone", 1.02, true},
  };
  return all;
}

Result<std::vector<SlopeRow>> measure(const Slope& slope, const std::vector<EngineEntry>& entries) {
  const auto block = make_block(kSlope / slope.share, leaning(down(slope), kSlope));
  if (!block) return std::unexpected(block.error());
  std::vector<SlopeRow> rows;
  for (const EngineEntry& entry : entries) {
    SlopeRow row{.entry = &entry};
    for (const std::int64_t step_ns : kSlopeSteps_ns) {
      const Result<SlopeResult> result = slide(slope, *block, entry, step_ns);
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

Result<std::vector<DropRow>> measure_drop(const std::vector<EngineEntry>& entries) {
  const auto block = make_block(0.5, {0.0, 0.0, -kGravity});
  if (!block) return std::unexpected(block.error());
  std::vector<DropRow> rows;
  for (const EngineEntry& entry : entries) {
    for (const std::int64_t step_ns : {1'000'000, 250'000}) {
      Result<DropRow> row = drop(*block, entry, step_ns);
      if (row) {
        rows.push_back(*row);
      } else {
        rows.push_back({.entry = &entry, .refusal = row.error().message});
        break;
      }
    }
  }
  return rows;
}

}  // namespace tandem::apps
