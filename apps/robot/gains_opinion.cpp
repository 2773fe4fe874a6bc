#include "apps/robot/gains_opinion.hpp"

#include <cmath>
#include <numbers>

namespace tandem::apps {

Json opinion(const robot::GainsJudge& judge, std::size_t joint, hal::PidLoop loop,
             const robot::GainsJudge::Gains& gains, std::span<const double> position_rad) {
  std::string why = judge.unknown(joint);
  if (why.empty() && loop == hal::PidLoop::kCurrent) why = "current loops are not judged";
  if (!why.empty()) return {{"judged", false}, {"why", why}};
  const auto verdict = judge.judge(joint, loop, gains, position_rad);
  if (!verdict) return {{"judged", false}, {"why", "no loop of this joint has gains"}};
  const auto known = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
  const double rate_1_s = std::log(verdict->growth) / verdict->period_s;
  Json out{
      {"judged", true},
      {"stable", verdict->stable()},
      {"loop", hal::to_string(verdict->loop)},
      {"phase_margin_deg", known(verdict->phase_margin_deg)},
      {"crossover_rad_s", known(verdict->crossover_rad_s)},
      {"inertia_kg_m2", verdict->inertia_kg_m2},
      {"doubles_in_s", verdict->stable() ? Json(nullptr) : Json(std::numbers::ln2 / rate_1_s)}};
  if (!verdict->stable()) out["remedy"] = judge.remedy(joint, loop, gains, position_rad);
  return out;
}

}  // namespace tandem::apps
