// What may be asked over DDS: reading and stops always, changes when they are allowed.
#include <gtest/gtest.h>

#include <string>

#include "apps/control/remote_gate.hpp"

namespace tandem::apps {
namespace {

using std::string_literals::operator""s;

TEST(RemoteGate, LetsReadingAndStopsThroughAndTheRestWhenItIsAllowed) {
  using runtime::RemoteAccess;
  const auto off = remote_gate({.command = RemoteAccess::kOff}, {});
  EXPECT_TRUE(off("status", ControlEffect::kReads, {}));
  EXPECT_TRUE(off("estop", ControlEffect::kStops, {}));
  const Status refused = off("clock.pause", ControlEffect::kChanges, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().hint.find("[remote] command"), std::string::npos);
  for (const RemoteAccess command : {RemoteAccess::kLocal, RemoteAccess::kNetwork}) {
    EXPECT_FALSE(remote_gate({.command = command}, {})("studio.open", ControlEffect::kChanges, {}))
        << "its answer has a token";
    EXPECT_TRUE(remote_gate({.command = command}, {})("clock.pause", ControlEffect::kChanges, {}));
  }
}

// Another user of the machine had a library of theirs loaded, and its constructor ran as root.
TEST(RemoteGate, LetsNoCodeInUnlessAskedForAndThenByNameOnly) {
  const auto error = [](bool load, const Json& request) {
    const auto gate = remote_gate({.command = runtime::RemoteAccess::kLocal, .load = load}, {});
    const Status status = gate("controller.load", ControlEffect::kChanges, request);
    return status ? "" : status.error().message;
  };
  EXPECT_EQ(error(false, {{"plugin", "hold"}}),
            "controller.load: this process loads no code over DDS");
  EXPECT_EQ(error(true, {{"plugin", "hold"}}), "");
  for (const char* path : {"/tmp/x.so", "./x.so", "a/hold", "../hold"}) {
    EXPECT_EQ(error(true, {{"plugin", path}}), "controller.load: a path is not taken over DDS");
  }
}

TEST(RemoteGate, RefusesChangesOfControllersAndJointsWhileSomebodyOwnsTheRobot) {
  std::string owner;
  const auto gate =
      remote_gate({.command = runtime::RemoteAccess::kLocal}, [&owner] { return owner; });
  EXPECT_TRUE(gate("controller.stop", ControlEffect::kChanges, {}));
  owner = "squat on robot-pc";
  for (const char* name : {"controller.stop", "joint.set", "joint.reset"}) {
    const Status refused = gate(name, ControlEffect::kChanges, {});
    ASSERT_FALSE(refused) << name;
    EXPECT_EQ(refused.error().message, name + ": 'squat on robot-pc' commands the robot"s);
  }
  EXPECT_TRUE(gate("controller.list", ControlEffect::kReads, {}));
  EXPECT_TRUE(gate("fault.reset", ControlEffect::kChanges, {}));
  EXPECT_TRUE(gate("estop", ControlEffect::kStops, {}));
}

}  // namespace
}  // namespace tandem::apps
