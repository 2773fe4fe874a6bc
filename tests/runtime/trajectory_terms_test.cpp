#include <gtest/gtest.h>

#include <cmath>

#include "hal/config/capabilities.hpp"
#include "runtime/input_port.hpp"
#include "tests/hal/fake_backend.hpp"

namespace tandem::runtime {
namespace {

/// What a goal says besides: a joint that stays needs no place, a tolerance may be -1.
TEST(InputPort, ChecksTheTermsOfATrajectory) {
  const hal::Robot robot = hal::robot_of(hal::test::fake_robot());
  auto io = std::make_shared<ControllerIo>();
  io->inputs.declare("way", InputKind::kTrajectory,
                     {.names = {"shoulder", "elbow"}, .most_points = 1, .terms = true});
  const InputBlock& block = io->inputs.all.front();
  const auto port = InputPort::make(io, io->inputs.all.front(), "one", robot, 1'000'000, nullptr);
  ASSERT_TRUE(port) << port.error().to_string();
  ASSERT_EQ(block.values(), 2U + 5U + 2U + 10U);
  const std::vector<double> right{1, 0, 0.5, 0.1, 0, 0, 0, -3, 2, 0, 0.1, -1, 0, 0, 1, 0, 0, 0, 0};
  EXPECT_TRUE((*port)->check(right)) << (*port)->check(right).error().to_string();
  const auto why = [&](std::size_t at, double value) {
    std::vector<double> sample = right;
    sample[at] = value;
    const Status fits = (*port)->check(sample);
    return fits ? std::string() : fits.error().to_string();
  };
  EXPECT_NE(why(7, 1e7).find("start"), std::string::npos);
  EXPECT_NE(why(8, -2.0).find("goal_time_tolerance"), std::string::npos);
  EXPECT_NE(why(10, std::nan("")).find("shoulder's tolerance: is not finite"), std::string::npos);
  EXPECT_NE(why(18, -2.0).find("elbow's tolerance"), std::string::npos);
  EXPECT_NE(why(14, 2.0).find("elbow stays"), std::string::npos);
  EXPECT_NE(why(4, 0.1).find("elbow"), std::string::npos) << "it stays, and has a place";
  EXPECT_NE(why(3, 9.0).find("shoulder"), std::string::npos);
}

}  // namespace
}  // namespace tandem::runtime
