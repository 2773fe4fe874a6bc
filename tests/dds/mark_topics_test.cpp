// tandem/controller/NAME/marks: what controllers draw, at its readers.
#include <set>

#include "hal/marker.hpp"
#include "tests/dds/drawn_marks.hpp"

namespace tandem::dds {
namespace {

using namespace test;

/// What a viewer keeps: one mark by each namespace and id, until it is deleted.
struct Viewer {
  explicit Viewer(PublisherRig& rig)
      : reader(rig.reader<visualization_msgs::MarkerArray>(kMarksTopic)) {}
  std::size_t look() {
    reader.take([&](const visualization_msgs::MarkerArray& message, const auto&) {
      ++samples;
      for (const auto& marker : list(message.markers)) {
        const auto key = std::pair(std::string(marker.ns), marker.id);
        marker.action == hal::Marker::kDelete ? (void)seen.erase(key) : (void)seen.insert(key);
      }
    });
    return seen.size();
  }

  Reader<visualization_msgs::MarkerArray> reader;
  std::set<std::pair<std::string, std::int32_t>> seen;
  std::size_t samples = 0;
};

TEST(MarkTopics, AreWhatRosViewersExpect) {
  Drawn drawn;
  PublisherRig rig;
  start(rig, drawn);
  auto reader = rig.reader<visualization_msgs::MarkerArray>(kMarksTopic);
  drawn.draw(20'000'000);
  std::size_t samples = 0;
  ASSERT_TRUE(eventually([&] {
    rig.show(40);
    reader.take([&](const visualization_msgs::MarkerArray& message, const auto&) {
      ++samples;
      const auto markers = list(message.markers);
      ASSERT_EQ(markers.size(), 2U);
      const auto& arrow = markers[0];
      EXPECT_EQ(ns(arrow.header.stamp), 20'000'000);
      EXPECT_EQ(std::string(arrow.header.frame_id), "link1");
      EXPECT_EQ(std::string(arrow.ns), "my_gait/push");
      EXPECT_EQ(arrow.id, 0);
      EXPECT_EQ(arrow.type, 0);
      EXPECT_EQ(arrow.action, 0);
      EXPECT_EQ(arrow.pose.orientation.w, 1.0);
      EXPECT_EQ(arrow.scale.y, 0.04) << "of the head";
      EXPECT_EQ(arrow.color.a, 1.0F);
      EXPECT_TRUE(arrow.frame_locked);
      ASSERT_EQ(arrow.points._length, 2U);
      EXPECT_EQ(arrow.points._buffer[1].y, 0.25);
      const auto& word = markers[1];
      EXPECT_EQ(std::string(word.header.frame_id), "link2") << "a site is no frame of tf";
      EXPECT_EQ(word.type, 9);
      EXPECT_EQ(std::string(word.text), "ouch");
      EXPECT_NEAR(word.pose.position.x, 1.0, 1e-12) << "turned by 90 degrees about z";
      EXPECT_NEAR(word.pose.position.y, 3.0, 1e-12);
      EXPECT_NEAR(word.pose.position.z, 3.0, 1e-12);
      EXPECT_NEAR(word.pose.orientation.z, std::sqrt(0.5), 1e-12);
      EXPECT_EQ(word.scale.z, 0.5);
    });
    return samples > 0;
  }));
  for (int i = 0; i < 20; ++i) rig.show(60);
  rig.publisher->stop();
  reader.take([&](const visualization_msgs::MarkerArray&, const auto&) { ++samples; });
  EXPECT_EQ(samples, 1U) << "what was shown once is not published twice";
}

TEST(MarkTopics, ThatAreHiddenAreDeleted) {
  Drawn drawn;
  PublisherRig rig;
  start(rig, drawn);
  Viewer viewer(rig);
  const auto sees = [&](std::size_t marks) {
    return eventually([&] {
      rig.show(20);
      return viewer.look() == marks;
    });
  };
  drawn.draw(1);
  ASSERT_TRUE(sees(2));
  drawn.block->show(drawn.arrow, 0);
  EXPECT_TRUE(drawn.block->show_to_viewers(2, true));
  ASSERT_TRUE(sees(1));
  EXPECT_EQ(viewer.seen.begin()->first, "my_gait/said");
  EXPECT_TRUE(drawn.block->show_to_viewers(3, false)) << "its controller is stopped";
  ASSERT_TRUE(sees(0));
  EXPECT_FALSE(drawn.block->show_to_viewers(4, false)) << "there is nothing to say any more";
  drawn.draw(5);
  EXPECT_TRUE(sees(2)) << "and starts again";
}

TEST(MarkTopics, OfAControllerThatIsUnloadedAreDeleted) {
  Drawn drawn;
  PublisherRig rig;
  start(rig, drawn);
  Viewer viewer(rig);
  drawn.draw(1);
  ASSERT_TRUE(eventually([&] {
    rig.show(20);
    return viewer.look() == 2;
  }));
  drawn.unload();
  EXPECT_TRUE(eventually([&] {
    rig.show(40);
    return viewer.look() == 0;
  }));
  EXPECT_TRUE(eventually([&] { return viewer.reader.endpoint().matched() == 0; }));
}

TEST(MarkTopics, AreDeletedAtTheEndOfTheRun) {
  Drawn drawn;
  PublisherRig rig;
  start(rig, drawn);
  Viewer viewer(rig);
  drawn.draw(1);
  ASSERT_TRUE(eventually([&] {
    rig.show(20);
    return viewer.look() == 2;
  }));
  rig.publisher.reset();
  rig.participant.reset();
  EXPECT_TRUE(eventually([&] { return viewer.look() == 0; }));
}

}  // namespace
}  // namespace tandem::dds
