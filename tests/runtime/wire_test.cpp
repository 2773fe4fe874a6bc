// Master and boards in real time on a wire that passes one frame after the other, in a virtual
// time that depends on nothing else.
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/config/capabilities.hpp"
#include "hal/ethercat-can/can_backend.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "hal/sim/emulator.hpp"
#include "model/kernel_library.hpp"
#include "runtime/experiment.hpp"
#include "tests/support/serial_wire.hpp"

namespace tandem::runtime {
namespace {

using hal::can::LoopbackBus;

/// An experiment's robot behind wires. Its clock goes on while somebody waits.
class WiredRobot final : private hal::can::FrameWait {
 public:
  explicit WiredRobot(const std::string& experiment) {
    auto read = read_experiment(std::string(TANDEM_SOURCE_DIR) + "/config/" + experiment);
    if (!read) throw std::runtime_error(read.error().at(0).to_string());
    e = std::move(*read);
    kernels_ = model::load_kernels(std::string(TANDEM_BINARY_DIR) + "/lib/models/" + e.robot.name +
                                   "_kernels.so")
                   .value();
    const sim::SimRobotConfig config = e.sim_robot_config();
    boards_ = sim::EmulatedRobot::create(e.robot, kernels_.get(), config).value();
    std::vector<hal::can::Bus*> near, far;
    for (const hal::BusConfig& bus : e.robot.buses) {
      const auto data = bus.fd ? bus.data_bitrate : bus.bitrate;
      wires_.emplace_back(hal::can::BitRates{.nominal = bus.bitrate, .data = data});
      near.push_back(&near_.emplace_back(std::make_unique<LoopbackBus>())->master());
      far.push_back(&far_.emplace_back(std::make_unique<LoopbackBus>())->boards());
    }
    emulator_ = std::make_unique<sim::Emulator>(*boards_, far, boards_clock_,
                                                sim::EmulatorConfig{.period_ns = config.period_ns});
    backend = hal::can::CanBackend::create(e.robot, near, *this, {}).value();
    pass_until(kPowerOnNs);
  }

  /// Cycle `cycle`, at its time; it may not begin late.
  Code step(const hal::CommandImage& command, hal::StateImage& state) {
    hal::CycleTime time{.cycle = cycle, .period_ns = e.loop.period_ns};
    time.time_ns = kPowerOnNs + static_cast<std::int64_t>(cycle++) * time.period_ns;
    pass_until(time.time_ns);
    backend->exchange(time);
    const Code code = backend->read(time, state);
    EXPECT_EQ(backend->write(command, hal::initial_parameters(e.robot)), Code::kOk);
    return code;
  }

  Experiment e;
  std::unique_ptr<hal::can::CanBackend> backend;
  std::uint64_t cycle = 0;

 private:
  static constexpr std::int64_t kPowerOnNs = 100'000'000;  ///< the boards have booted by then

  /// That of the wires, for boards that never sleep.
  class BoardsClock final : public hal::can::FrameWait {
   public:
    explicit BoardsClock(const std::int64_t& now_ns) : shown_(&now_ns) {}
    std::int64_t now_ns() noexcept override { return *shown_; }
    void wait(std::int64_t, int) noexcept override {}

   private:
    const std::int64_t* shown_;
  };

  std::int64_t now_ns() noexcept override { return now_ns_; }
  void wait(std::int64_t at_most_ns, int) noexcept override { pass(now_ns_ + at_most_ns); }

  void pass_until(std::int64_t end_ns) {
    while (now_ns_ < end_ns) pass(end_ns);
    EXPECT_EQ(now_ns_, end_ns);
  }
  /// Up to the next frame that is through on a wire, or to `end_ns`.
  void pass(std::int64_t end_ns) {
    end_ns = std::min(end_ns, now_ns_ + e.loop.period_ns);  // boards have clocks of their own
    for (std::size_t b = 0; b < wires_.size(); ++b) {
      offer(b, near_[b]->boards(), true);
      offer(b, far_[b]->master(), false);
      deliver(b);  // puts a frame on an idle wire
      if (const auto through = wires_[b].through_ns()) end_ns = std::min(end_ns, *through);
    }
    now_ns_ = end_ns;
    for (std::size_t b = 0; b < wires_.size(); ++b) deliver(b);
    (void)emulator_->poll(0);
  }
  void offer(std::size_t b, hal::can::Bus& from, bool from_master) {
    std::array<canopen::Frame, 64> frames;
    while (const std::size_t count = from.receive(frames)) {
      wires_[b].offer(std::span(frames).first(count), from_master, now_ns_);
    }
  }
  void deliver(std::size_t b) {
    while (const auto through = wires_[b].take(now_ns_)) {
      hal::can::Bus& to = through->from_master ? far_[b]->master() : near_[b]->boards();
      EXPECT_EQ(to.send({&through->frame, 1}), 1U);
    }
  }

  model::KernelLibrary kernels_;
  std::unique_ptr<sim::EmulatedRobot> boards_;
  std::vector<std::unique_ptr<LoopbackBus>> near_, far_;
  std::vector<tandem::test::SerialWire> wires_;
  std::int64_t now_ns_ = 0;
  BoardsClock boards_clock_{now_ns_};
  std::unique_ptr<sim::Emulator> emulator_;
};

class Wire : public testing::TestWithParam<const char*> {};

// The wait for feedback had ended at a node's first TPDO. On classic CAN a sample takes two, and
// the second was left out as late: after ten cycles the board counted as lost.
TEST_P(Wire, EverySampleComesWholeInItsCycle) {
  WiredRobot robot(GetParam());
  hal::StateImage state(robot.e.robot.shape());
  hal::CommandImage idle(robot.e.robot.shape());
  while (robot.backend->phase() == hal::Phase::kBringUp && robot.cycle < 20'000) {
    (void)robot.step(idle, state);
  }
  ASSERT_EQ(robot.backend->phase(), hal::Phase::kOperational) << robot.backend->status_text();
  for (int k = 0; k < 500; ++k) {
    ASSERT_EQ(robot.step(idle, state), Code::kOk) << k << ": " << robot.backend->status_text();
  }
  EXPECT_EQ(robot.backend->master().warnings(), std::vector<std::string>{});
}

INSTANTIATE_TEST_SUITE_P(Of, Wire,
                         testing::Values("double_pendulum_classic/trajectory.toml",
                                         "double_pendulum_interpolated/trajectory.toml",
                                         "panda_classic/trajectory.toml",
                                         "double_pendulum/trajectory.toml", "coman/squat.toml"),
                         [](const auto& experiment) {
                           const std::string path = experiment.param;
                           return path.substr(0, path.find('/'));
                         });

}  // namespace
}  // namespace tandem::runtime
