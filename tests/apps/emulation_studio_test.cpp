// What the studio of an emulation shows, and that the emulation is the same with it as without: in
// its steps no heap, lock or system call.
#include "apps/run/emulation_studio.hpp"

#include <algorithm>
#include <optional>

#include "base/archive.hpp"
#include "canopen/messages.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/runtime/bundled_run.hpp"
#include "tests/runtime/lockstep.hpp"
#include "tests/studio/web_client.hpp"
#include "tests/support/rt_trap.hpp"

namespace tandem::apps {
namespace {

using runtime::test::LockstepRobot;
using studio::test::id_in;
using studio::test::Json;
using studio::test::WebClient;

/// The double pendulum on an emulated wire, led for a while, with a studio or without.
struct Led {
  explicit Led(bool looks)
      : run("double_pendulum", "hold", {.hal = "can", .lockstep = true}, {},
            [this, looks](runtime::Composition& c) -> Diagnostics {
              place.emplace(c.experiment.robot, c.kernels.get(), c.experiment.sim_robot_config());
              c.backend = std::move(place->backend);
              if (looks) open(c.experiment);
              return {};
            }) {}
  void open(const runtime::Experiment& e) {
    auto opened =
        EmulationStudio::open({.wanted = true, .port = 0}, {.config = e.robot,
                                                            .urdf = "<robot name=\"pendulum\"/>",
                                                            .file = "config/hold.toml",
                                                            .period_ns = e.loop.period_ns,
                                                            .lockstep = true,
                                                            .robot = *place->emulated,
                                                            .wires = {nullptr}});
    ASSERT_TRUE(opened) << opened.error().to_string();
    studio = std::move(*opened);
    place->emulator->watch(*studio);
  }
  [[nodiscard]] std::vector<std::byte> plant() const {
    Archive archive;
    place->emulated->plant().archive(archive);
    return {archive.bytes().begin(), archive.bytes().end()};
  }

  std::optional<LockstepRobot> place;
  std::unique_ptr<EmulationStudio> studio;
  runtime::BundledRun run;
};

TEST(EmulationStudio, ShowsTruthAndBoardsAndLeavesTheEmulationAsItIs) {
  Led with(true), without(false);
  const std::string address = with.studio->address();
  WebClient client(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  ASSERT_TRUE(client.open());
  const Json hello = client.next("hello");
  EXPECT_EQ(hello["emulated"], "can");
  const Json signals = client.next("signals");
  ASSERT_EQ(signals["sources"].size(), 2U) << "truth and boards, and nothing that a run has";
  const std::vector<std::uint32_t> ids{id_in(signals, "truth", "position_rad"),
                                       id_in(signals, "boards", "all_enabled"),
                                       id_in(signals, "boards", "drive_state")};
  client.say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", ids}});
  EXPECT_EQ(client.tick().numbers[5], 0.0F) << "as it stands before a master comes";

  // The emulator runs in the cycle, where the traps are.
  for (Led* one : {&with, &without}) one->run.steps(2500);
  EXPECT_EQ(with.plant(), without.plant()) << "to the last bit";
  const auto& plant = with.place->emulated->plant();
  bool shown = false;
  // Free running loses steps before the studio: now one after the other.
  for (int i = 0; i < 60 && !shown; ++i) {
    with.run.steps(1);
    const auto tick = client.tick();
    shown = tick.cycle + 1 == with.place->emulator->statistics().steps &&
            tick.numbers[2] == static_cast<float>(plant.joint(0).position_rad) &&
            tick.numbers[5] == 1.0F && tick.numbers[8] == 5.0F;
  }
  EXPECT_TRUE(shown) << "the last step, with its drives in operation enabled";
}

TEST(EmulationStudio, IsNeitherAskedNorLed) {
  Led led(true);
  const std::string address = led.studio->address();
  const std::string token = address.substr(address.find('=') + 1);
  WebClient client(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
  ASSERT_TRUE(client.open());
  client.say(Json{{"op", "enter"}, {"token", token}});
  EXPECT_EQ(client.next("entered")["may"], "all");
  const Json answer = client.ask(Json{{"do", "estop"}});
  EXPECT_EQ(answer["ok"], false);
  EXPECT_NE(answer["error"].get<std::string>().find("other side of its wire"), std::string::npos);
  client.say(Json{{"op", "control"}, {"take", true}});
  EXPECT_NE(client.next("error")["hint"].get<std::string>().find("tandem run"), std::string::npos);
}

TEST(EmulationStudio, TakesAStepWithoutHeapLockOrSystemCall) {
  Led led(true);
  const rt::ScopedRealtime in_step;
  for (std::uint64_t step = 1; step < 3000; ++step) {
    sim::EmulatorStatistics so_far;
    so_far.steps = step;
    led.studio->stepped(so_far, true);
  }
}

TEST(WireMeter, AddsUpTheTimesOfFramesBothWays) {
  hal::can::LoopbackBus wire;
  hal::can::WireMeter meter(wire.boards(), {.nominal = 1'000'000, .data = 8'000'000});
  const canopen::Frame sync = canopen::make_sync();
  (void)wire.master().send({&sync, 1});
  std::array<canopen::Frame, 4> frames{};
  ASSERT_EQ(meter.receive(frames), 1U);
  ASSERT_EQ(meter.send({frames.data(), 1}), 1U);
  // A frame without data: 34 stuffable bits, 8 stuff bits at most, 13 more: 55 us at 1 Mbit/s.
  EXPECT_EQ(meter.take_wire_ns(), 2 * 55'000);
  EXPECT_EQ(meter.take_wire_ns(), 0);
}

}  // namespace
}  // namespace tandem::apps
