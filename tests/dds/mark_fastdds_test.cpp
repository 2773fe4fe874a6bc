// What controllers draw, at a reader of another DDS.
#include <string>

#include "tests/dds/drawn_marks.hpp"
#include "tests/dds/fastdds.hpp"

namespace tandem::dds {
namespace {

using namespace test;

/// An array of two markers has 72 values with an arrow's two points, 66 without.
TEST(MarkFastDds, ReadsThem) {
  if (!have_fastdds()) GTEST_SKIP() << kNoFastDds;
  Drawn drawn;
  PublisherRig rig;
  start(rig, drawn);
  FastDdsPeer peer(
      {"hear", "reliable", "visualization_msgs/msg/MarkerArray", std::string("rt/") + kMarksTopic});
  std::int64_t time_ns = 0;
  const auto hears = [&](const std::string& values, bool shown) {
    return eventually([&] {
      shown ? drawn.draw(++time_ns) : (void)drawn.block->show_to_viewers(++time_ns, shown);
      rig.show(20);
      for (const std::string& line : peer.lines())
        if (line == "rt/" + std::string(kMarksTopic) + " other " + values) return true;
      return false;
    });
  };
  EXPECT_TRUE(hears("72", true));
  EXPECT_TRUE(hears("66", false));
}

}  // namespace
}  // namespace tandem::dds
