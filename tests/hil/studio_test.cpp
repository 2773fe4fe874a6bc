// The studio of an emulation on real sockets: what a run does on the other side is seen.
#include "tests/studio/web_client.hpp"

#include <gtest/gtest.h>

#include "tests/hil/process.hpp"

namespace tandem::test {
namespace {

using studio::test::id_in;
using studio::test::Json;
using studio::test::WebClient;

class HilStudio : public OwnFolder {};

TEST_F(HilStudio, OfAnEmulationShowsTheRobotThatARunLeads) {
  const std::string experiment = TANDEM_SOURCE_DIR "/config/double_pendulum/hold.toml";
  Process robot(tandem({"emulate", experiment, "--lockstep", "--no-socket", "--studio=0"}),
                folder_ / "emulate.txt");
  ASSERT_TRUE(robot.says("Ctrl-C ends it")) << robot.output();
  const std::string begin = "studio: http://127.0.0.1:";
  const std::string said = robot.output();
  ASSERT_NE(said.find(begin), std::string::npos) << said;
  const int port = std::stoi(said.substr(said.find(begin) + begin.size()));
  WebClient client(static_cast<std::uint16_t>(port));
  ASSERT_TRUE(client.open());
  EXPECT_EQ(client.next("hello")["emulated"], "can");
  const Json signals = client.next("signals");
  const std::vector<std::uint32_t> ids{id_in(signals, "boards", "all_enabled"),
                                       id_in(signals, "boards", "wire_load"),
                                       id_in(signals, "boards", "synced")};
  client.say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", ids}});
  bool stands = false;
  for (int i = 0; i < 20 && !stands; ++i) stands = (client.tick().flags & 1) != 0;
  EXPECT_TRUE(stands) << "until a master comes";

  Process run(tandem({"run", experiment, "--hal", "can", "--lockstep", "--no-socket", "--no-log",
                      "--duration", "0.5"}),
              folder_ / "run.txt");
  bool enabled = false, loaded = false, synced = false;
  for (int i = 0; i < 1000 && !(enabled && loaded && synced); ++i) {
    const auto tick = client.tick();
    enabled = enabled || tick.numbers[1] == 1.0F;
    loaded = loaded || (tick.numbers[4] > 0.05F && tick.numbers[4] < 1.0F);
    synced = synced || tick.numbers[7] == 1.0F;
  }
  EXPECT_TRUE(enabled);
  EXPECT_TRUE(loaded) << "of a wire at its bit rates";
  EXPECT_TRUE(synced);
  EXPECT_EQ(run.wait(), 0) << run.output();
  EXPECT_EQ(robot.interrupt(), 0) << robot.output();
}

}  // namespace
}  // namespace tandem::test
