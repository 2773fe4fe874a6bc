// A run with an active controller and a candidate that may be its shadow.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "tests/runtime/switch_run.hpp"

namespace tandem::runtime {
namespace {

using test::FirstOrderRobot;
using test::JointRun;
using test::kNow;
using test::Names;
using test::Sine;

constexpr std::int64_t kCycle_ns = 1'000'000;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Writes places that the test says, and misbehaves on demand.
class Candidate : public Controller {
 public:
  explicit Candidate(hal::ControlMode mode = hal::ControlMode::kPosition) : mode_(mode) {}
  Status configure(ControllerSetup& setup) override {
    setup.claim(0, mode_);
    gains_ = &setup.gains;
    depth_ = setup.signal("depth", "m", "a number");
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage& command) noexcept override {
    ++starts;
    seen_rad = command.position_rad()[0];
  }
  Code update(const hal::CycleTime& time, const hal::StateImage&,
              hal::CommandImage& command) noexcept override {
    ++updates;
    depth_ = 0.25;
    if (clock != nullptr) clock->now += takes_ns;
    if (tunes) gains_->set_gains(0, hal::PidLoop::kPosition, {7.0, 0.0, 0.0});
    command.position_rad()[0] = from_rad + rate_rad * static_cast<double>(time.cycle);
    command.torque_Nm()[0] = torque_Nm;
    if (strays) command.position_rad()[2] = 1.0;
    return answer;
  }
  void stop() noexcept override { ++stops; }
  void archive(Archive& ar) override { ar(updates); }

  double from_rad = 0.3, rate_rad = 0.0, torque_Nm = 0.0, seen_rad = 0.0;
  Code answer = Code::kOk;
  bool strays = false, tunes = false;
  int starts = 0, updates = 0, stops = 0;
  rt::FakeClock* clock = nullptr;
  std::int64_t takes_ns = 0;

 private:
  hal::ControlMode mode_;
  Signal depth_;
  hal::ParameterImage* gains_ = nullptr;
};

/// "led" keeps joint 0 at 0.1 rad; "other", which is to be its shadow, is loaded beside it.
struct ShadowRun : JointRun {
  explicit ShadowRun(const CycleConfig& config = {},
                     hal::ControlMode mode = hal::ControlMode::kPosition, rt::Clock* its = nullptr)
      : other(std::make_shared<Candidate>(mode)) {
    if (its != nullptr) clock = its;
    led->from_rad = 0.1;
    add("led", led);
    add("other", other, false);
    begin(config);
    until(RunPhase::kRunning);
    steps(20);
  }
  void begin_shadow() {
    ASSERT_TRUE(services().begin_shadow("other", kNow));
    steps(1);
  }
  [[nodiscard]] ShadowStatus shadow() const {
    const auto all = services().shadows();
    EXPECT_EQ(all.size(), 1U);
    return all.empty() ? ShadowStatus{} : all.front();
  }
  [[nodiscard]] std::vector<hal::TextEvent> texts() const {
    std::vector<hal::TextEvent> all;
    std::uint64_t seen = 0;
    (void)services().texts().read(seen, all);
    return all;
  }
  /// What was said last.
  [[nodiscard]] std::string words() const {
    const std::vector<hal::TextEvent> all = texts();
    return all.empty() ? "" : all.back().words();
  }
  [[nodiscard]] double apart(CommandReference reference) const {
    return shadow().joints.at(0).now[static_cast<std::size_t>(reference)];
  }
  std::shared_ptr<Candidate> led = std::make_shared<Candidate>(), other;
};

/// The bytes of state, command and truth over `count` cycles.
std::vector<std::byte> bytes_of(ShadowRun& run, int count) {
  std::vector<std::byte> all;
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(run.cycle->step());
    for (const auto& bytes : {run.cycle->state().bytes(), run.cycle->command().bytes(),
                              std::as_const(run.backend.truth).bytes()}) {
      all.insert(all.end(), bytes.begin(), bytes.end());
    }
  }
  return all;
}

}  // namespace
}  // namespace tandem::runtime
