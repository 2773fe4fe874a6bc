#include "apps/run/prediction.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "apps/control/fault_table.hpp"
#include "apps/control/rate_limit.hpp"
#include "base/clock_ns.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kRowsAnswered = 100;        // unless asked otherwise
constexpr std::size_t kNumbersAnswered = 90'000;  // an answer of more is read by no client

/// Every `every`th cycle of `cycles`, and the last one.
std::vector<std::size_t> rows_answered(std::size_t cycles, std::size_t every) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < cycles; i += every) rows.push_back(i);
  if (!rows.empty() && rows.back() != cycles - 1) rows.push_back(cycles - 1);
  return rows;
}

Json column(const hal::Prediction& p, const std::vector<double>& of, std::size_t joint,
            const std::vector<std::size_t>& rows) {
  Json values = Json::array();
  for (const std::size_t i : rows) values.push_back(p.row(of, i)[joint]);
  return values;
}

Json base_rows(const hal::Prediction& p, std::size_t first, std::size_t count,
               const std::vector<std::size_t>& of) {
  Json rows = Json::array();
  for (const std::size_t i : of) {
    const auto begin = p.base.begin() + static_cast<std::ptrdiff_t>(7 * i + first);
    rows.push_back(std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(count)));
  }
  return rows;
}

Json answer_json(const internal_model::Answer& answer, const hal::RobotConfig& robot,
                 std::size_t every) {
  const hal::Prediction& p = answer.prediction;
  const auto period_s = static_cast<double>(p.period_ns) * 1e-9;
  const std::vector<std::size_t> rows = rows_answered(p.cycles, every);
  Json json{{"first_cycle", p.first_cycle},
            {"from_s", static_cast<double>(p.first_cycle) * period_s},
            {"period_ns", p.period_ns},
            {"cycles", p.cycles},
            {"every_cycles", every},
            {"end", hal::to_string(p.end)},
            {"cpu_s", p.cpu_s},
            {"wall_s", p.wall_s},
            {"loop_bytes", answer.loop_bytes},
            {"loop_ns", answer.loop_ns},
            {"faults", figures_json(answer.faults)},
            {"unarchived_controllers", answer.unarchived},
            {"joints", Json::object()},
            {"base", nullptr}};
  for (std::size_t j = 0; j < robot.joints.size(); ++j) {
    json["joints"][robot.joints[j].name] = {{"slides", robot.joints[j].slides},
                                            {"reference_rad", column(p, p.reference_rad, j, rows)},
                                            {"position_rad", column(p, p.position_rad, j, rows)},
                                            {"torque_Nm", column(p, p.torque_Nm, j, rows)}};
  }
  if (robot.model.floating_base) {
    json["base"] = {{"position_m", base_rows(p, 0, 3, rows)},
                    {"quaternion", base_rows(p, 3, 4, rows)}};
  }
  return json;
}

}  // namespace

void add_predict(ControlRegistry& registry, internal_model::PredictionService* service,
                 const hal::RobotConfig& robot, std::function<std::int64_t()> now_ns) {
  if (!now_ns) now_ns = [] { return clock_ns(CLOCK_MONOTONIC); };
  registry.add(
      "predict",
      [service, &robot, now_ns = std::move(now_ns),
       limit = RateLimit(kPredictionsPerSecond)](const Json& request) mutable -> Result<Json> {
        if (service == nullptr) {
          return fail("this run has no model of its robot to predict with",
                      "add [parallel] to the experiment (docs/internal-model.md)");
        }
        const double horizon_s = request.value("horizon_s", 1.0);
        const auto every = request.value("every_cycles", std::int64_t{0});
        constexpr double kMost_s = 1e6;  // what no number of nanoseconds overflows
        if (!std::isfinite(horizon_s) || std::abs(horizon_s) > kMost_s) {
          return fail("predict: \"horizon_s\" is out of range", "from one cycle to 10 s");
        }
        if (!limit.take(now_ns())) {
          return fail(fmt::format("predict: more than {} were asked for in a second",
                                  kPredictionsPerSecond),
                      "each costs the loop a copy: wait 0.1 s, or ask for a longer "
                      "horizon and fewer times");
        }
        const auto answer = service->predict(std::llround(horizon_s * 1e9));
        if (!answer) return std::unexpected(answer.error());
        const std::size_t cycles = answer->prediction.cycles;
        const std::size_t usual = std::max<std::size_t>(1, cycles / kRowsAnswered);
        const std::size_t step = every > 0 ? static_cast<std::size_t>(every) : usual;
        const std::size_t most = kNumbersAnswered / (3 * robot.joints.size() + 7);
        if (cycles / step >= most) {
          return fail(fmt::format("predict: {} rows of {} are too many for an answer",
                                  cycles / step, counted(robot.joints.size(), "joint")),
                      fmt::format("every_cycles from {} on", cycles / most + 1));
        }
        return answer_json(*answer, robot, step);
      });
}

}  // namespace tandem::apps
