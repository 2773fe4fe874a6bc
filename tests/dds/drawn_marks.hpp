// A controller that draws, for readers of what it shows.
// Layer: tests.  Thread: main.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "tests/dds/publisher_rig.hpp"

namespace tandem::dds::test {

inline constexpr const char* kMarksTopic = "tandem/controller/my_gait/marks";

/// A controller that draws: an arrow, and a word in the site of a link.
struct Drawn {
  Drawn() {
    arrow = block->declare("push", {.shape = hal::MarkShape::kArrow, .frame = "link1"});
    word = block->declare("said", {.shape = hal::MarkShape::kText, .frame = "tip", .size_m = 0.5});
    const std::vector<std::string> links{"link1", "link2"};
    hal::Site tip{.name = "tip", .link = "link2", .xyz_m = {1.0, 2.0, 3.0}};
    tip.rpy_rad[2] = M_PI / 2;
    EXPECT_TRUE(block->close(links, std::vector{tip}));
  }
  /// Both of them, from now on.
  void draw(std::int64_t time_ns) {
    block->place(arrow, 0, {0.0, 0.0, 0.0});
    block->place(arrow, 1, {0.0, 0.25, 1.0});
    block->place(word, 0, {1.0, 0.0, 0.0});
    block->say(word, "ouch");
    EXPECT_TRUE(block->show_to_viewers(time_ns, true));
  }
  ControllerFeed feed() {
    return {.version = [this] { return version.load(); },
            .marks =
                [this] {
                  std::vector<ControllerFeed::Marks> all;
                  if (version.load() == 1) all.emplace_back("my_gait", block);
                  return all;
                }};
  }
  void unload() { version = 2; }

  std::shared_ptr<hal::MarkBlock> block = std::make_shared<hal::MarkBlock>();
  std::size_t arrow = 0, word = 0;
  std::atomic<std::uint64_t> version{1};
};

inline void start(PublisherRig& rig, Drawn& drawn) {
  rig.publisher->start({.version = [] { return std::uint64_t{0}; },
                        .faults = [] { return std::vector<FaultEntry>(); },
                        .lost = [] { return std::uint64_t{0}; }},
                       nullptr, drawn.feed());
  rig.show(0);
}

}  // namespace tandem::dds::test
