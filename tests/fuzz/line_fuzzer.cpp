// Whatever Ethernet frames come back to the drive master of a robot on EtherCAT: changed, lost,
// doubled, from the first frame on or while the robot moves. Nothing breaks, and what reaches the
// image are numbers.
//
// The input: the first byte is where it begins, then an act for each frame (Wire::receive()).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "hal/config/capabilities.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/line/loopback_link.hpp"
#include "hal/ethercat-can/line_bus.hpp"
#include "hal/sim/line_boards.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/sim/swing_robot.hpp"

namespace {

using namespace tandem;
using fuzz::require;

constexpr int kMostCycles = 300;  // of an input

/// The master's end of the cable; what comes back is as the input says.
class Wire final : public hal::ecat::DataLink {
 public:
  explicit Wire(hal::ecat::DataLink& link) : link_(&link) {}

  void follow(std::span<const std::uint8_t> input) { input_ = input; }
  [[nodiscard]] bool more() const { return !input_.empty(); }

  std::size_t send(std::span<const hal::ecat::FrameBuffer> frames) noexcept override {
    return link_->send(frames);
  }
  std::size_t receive(std::span<hal::ecat::FrameBuffer> frames) noexcept override {
    const std::size_t came = link_->receive(frames);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < came; ++i) {
      const std::uint8_t act = more() ? byte() % 8 : 0;
      if (act == 1) continue;
      if (kept != i) frames[kept] = frames[i];
      hal::ecat::FrameBuffer& frame = frames[kept++];
      if (act == 2) frame.bytes[position(frame)] = byte();
      if (act == 3) frame.size = position(frame);
      for (int n = act == 4 ? byte() : 0; n > 0; --n) frame.bytes[position(frame)] = byte();
    }
    return kept;
  }
  [[nodiscard]] ethercat::MacAddress address() const noexcept override { return link_->address(); }
  [[nodiscard]] hal::ecat::LinkStatistics statistics() const noexcept override { return {}; }

 private:
  std::uint8_t byte() {
    if (input_.empty()) return 0;
    const std::uint8_t value = input_.front();
    input_ = input_.subspan(1);
    return value;
  }
  std::size_t position(const hal::ecat::FrameBuffer& frame) {
    const std::size_t at = byte() | std::size_t{byte()} << 8;
    return at % std::max<std::size_t>(frame.size, 1);
  }

  hal::ecat::DataLink* link_;
  std::span<const std::uint8_t> input_;
};

/// A robot on its line.
struct Robot {
  Robot() : wire(cable.master()), state(config.shape()), command(config.shape()) {
    auto made = sim::EmulatedRobot::create(config, test::swing_kernels(2), {.posture = "up"});
    require(made.has_value());
    emulated = std::move(*made);
    boards =
        std::make_unique<sim::LineBoards>(*emulated, 0, cable.slaves(), sim::LineBoards::Config{});
    auto bus = hal::can::LineBus::create(config, 0, wire, {});
    require(bus.has_value());
    line = std::move(*bus);
    const std::array<hal::can::Bus*, 1> ends{line.get()};
    auto drives = hal::can::DriveMaster::create(config, ends);
    require(drives.has_value());
    master = std::move(*drives);
    command.mode()[0] = static_cast<std::int8_t>(hal::ControlMode::kPosition);
  }
  void cycle() {
    const std::int64_t time_ns = static_cast<std::int64_t>(cycles) * 1'000'000;
    master->cycle_begin({.cycle = cycles++, .time_ns = time_ns, .period_ns = 1'000'000});
    hal::can::Bus& bus = emulated->bus(0).master();
    (void)bus.send(std::span(frames).first(boards->receive(frames)));
    require(emulated->step(time_ns) == Code::kOk);
    (void)boards->send(std::span(frames).first(bus.receive(frames)));
    boards->end_step();
    (void)master->receive(state);
    require(std::isfinite(state.position_rad()[0]) && std::isfinite(state.torque_Nm()[0]));
    (void)master->send(command, parameters);
  }

  hal::RobotConfig config = test::line_swing_robot();
  hal::ecat::LoopbackLink cable;
  Wire wire;
  std::unique_ptr<sim::EmulatedRobot> emulated;
  std::unique_ptr<sim::LineBoards> boards;
  std::unique_ptr<hal::can::LineBus> line;
  std::unique_ptr<hal::can::DriveMaster> master;
  hal::StateImage state;
  hal::CommandImage command;
  hal::ParameterImage parameters = hal::initial_parameters(config);
  std::array<canopen::Frame, 64> frames;
  std::uint64_t cycles = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Robot robot;
  if (data[0] % 2 == 1) {
    while (robot.master->phase() == hal::Phase::kBringUp) robot.cycle();
    require(robot.master->phase() == hal::Phase::kOperational);
  } else {
    for (int i = 0; i < 4 * (data[0] / 2); ++i) robot.cycle();
  }
  robot.wire.follow({data + 1, size - 1});
  for (int i = 0; i < kMostCycles && robot.wire.more(); ++i) {
    robot.cycle();
    robot.line->ask_again();
  }
  (void)robot.master->status_text();
  (void)robot.line->status_text();
  (void)robot.line->measured_text();
  return 0;
}
