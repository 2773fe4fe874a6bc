// Time to detection against false alarms: both counted, over hours of motion and hundreds of
// pushes. TANDEM_FREE_HOURS: hours of free motion of each robot; prints docs/estimation.md's table.
// TANDEM_COLLISION_FIGURES: a folder for its pictures.
#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>

#include "estimation/alarm_curve.hpp"
#include "report/alarm_figures.hpp"
#include "report/gnuplot.hpp"
#include "tests/runtime/collision_subjects.hpp"

namespace tandem::runtime {
namespace {

constexpr std::uint64_t kPushes = 20;
constexpr double kForces_N[] = {5.0, 10.0, 20.0, 50.0, 100.0};

/// On the thresholds that were learned for one alarm an hour: 0.5 to 1, which is the last.
std::vector<double> ladder() {
  std::vector<double> factors;
  for (int i = 32; i >= 0; --i) factors.push_back(std::pow(0.5, i / 32.0));
  return factors;
}

class CollisionCurve : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const char* text = std::getenv("TANDEM_FREE_HOURS");
    if (text == nullptr)
      GTEST_SKIP() << "in make test-all: TANDEM_FREE_HOURS says how many hours of motion";
    hours_ = std::atof(text);
  }
  /// Runs with a seed of their own each, until there are so many hours.
  [[nodiscard]] estimation::FalseAlarms count(const Subject& s,
                                              const std::vector<double>& thresholds) const {
    estimation::FalseAlarms alarms(thresholds, 200);
    for (std::uint64_t seed = 1000;
         static_cast<double>(alarms.cycles()) < 3.6e6 * hours_ && !HasFailure(); ++seed) {
      alarms.begin_run();
      free_motion(s, seed, [&](std::span<const double> torque) { alarms.look(torque); });
    }
    return alarms;
  }
  [[nodiscard]] std::vector<estimation::DetectionTimes> push(
      const Subject& s, std::size_t place, const std::vector<double>& thresholds) const {
    std::vector<estimation::DetectionTimes> all;
    for (const double force : kForces_N) {
      estimation::DetectionTimes times(thresholds, factors_);
      for (std::uint64_t seed = 1; seed <= kPushes; ++seed) {
        times.begin_push();
        pushed(s, place, force, seed, [&](std::span<const double> torque) { times.look(torque); });
      }
      all.push_back(std::move(times));
    }
    return all;
  }

  double hours_ = 0.0;
  const std::vector<double> factors_ = ladder();
};
INSTANTIATE_TEST_SUITE_P(Robots, CollisionCurve, testing::Values("panda", "ur5e", "coman"),
                         [](const auto& test) { return std::string(test.param); });

std::string in_words(const estimation::DetectionTimes::Summary& one) {
  const auto ms = [](double t) { return std::isfinite(t) ? fmt::format("{:.0f}", t) : "–"; };
  const std::string missed =
      one.found == one.pushes ? "" : fmt::format(" ({} of {})", one.found, one.pushes);
  return fmt::format("{} / {}{}", ms(one.median), ms(one.worst), missed);
}

TEST_P(CollisionCurve, OfPushesAgainstFalseAlarmsInHours) {
  const Subject& s = subject(GetParam());
  const std::vector<double> thresholds = learned(s, {1, 2, 3});
  const auto [least, most] = std::ranges::minmax(thresholds);
  fmt::print("{}: thresholds for one an hour: {:.3f} to {:.3f} Nm\n", s.robot, least, most);
  const estimation::FalseAlarms alarms = count(s, thresholds);
  const double hours = static_cast<double>(alarms.cycles()) / 3.6e6;
  std::vector<double> per_hour;
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    per_hour.push_back(static_cast<double>(alarms.alarms(factors_[f])) / hours);
    fmt::print("  {:.2f} of them: {} in {:.2f} h\n", factors_[f], alarms.alarms(factors_[f]),
               hours);
  }
  EXPECT_LE(per_hour.back(), 1.0) << "thresholds for one an hour";
  const std::size_t last = factors_.size() - 1;
  const auto rare = static_cast<std::size_t>(
      std::ranges::find_if(per_hour, [](double rate) { return rate <= 60.0; }) - per_hour.begin());
  fmt::print("  columns: {:.2f} and {:.2f} an hour, counted\n", per_hour[last], per_hour[rare]);
  std::vector<report::Figure> figures;
  for (std::size_t place = 0; place < s.places.size(); ++place) {
    std::vector<report::AlarmCurve> curves;
    const auto times = push(s, place, thresholds);
    for (std::size_t k = 0; k < times.size(); ++k) {
      report::AlarmCurve curve{fmt::format("{:.0f} N", kForces_N[k]), per_hour, {}, {}};
      for (std::size_t f = 0; f < factors_.size(); ++f) {
        curve.median_ms.push_back(times[k].with(f).median);
        curve.worst_ms.push_back(times[k].with(f).worst);
      }
      curves.push_back(std::move(curve));
      fmt::print("| {} | {} | {:.0f} N | {} | {} |\n", s.robot, s.places[place].first, kForces_N[k],
                 in_words(times[k].with(last)), in_words(times[k].with(rare)));
      if (kForces_N[k] >= 50.0) {
        EXPECT_LE(times[k].with(last).worst, 20.0) << s.places[place].first;
      }
    }
    for (report::Figure& figure : report::alarm_figures(
             s.places[place].first, fmt::format("{}, {}", s.robot, s.places[place].first), curves))
      figures.push_back(std::move(figure));
  }
  if (const char* folder = std::getenv("TANDEM_COLLISION_FIGURES")) {
    const std::string own = std::string(folder) + "/" + s.robot;
    std::filesystem::create_directories(own);
    const Status drawn = report::draw(figures, own);
    EXPECT_TRUE(drawn) << drawn.error().to_string();
  }
}

}  // namespace
}  // namespace tandem::runtime
