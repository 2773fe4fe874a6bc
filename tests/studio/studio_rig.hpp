// A studio of a made-up robot, whose registry the test is.
// Layer: tests.  Thread: main; the registry's answers are made at once.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "studio/studio.hpp"
#include "tests/studio/shown_robot.hpp"
#include "tests/studio/web_client.hpp"

namespace tandem::studio::test {

struct StudioRig {
  explicit StudioRig(const std::string& address = "127.0.0.1") {
    hal::RobotConfig config;
    config.name = "pair";
    for (const char* name : {"a", "b"}) {
      hal::JointConfig& joint = config.joints.emplace_back();
      joint.name = name;
      joint.min_position_rad = -1.0;
      joint.max_position_rad = 2.0;
      joint.max_velocity_rad_s = 3.0;
      joint.max_torque_Nm = 4.0;
    }
    auto opened = Studio::open({.address = address, .port = 0, .level_bytes = 1'000'000},
                               {.robot = config,
                                .urdf = "<robot name=\"pair\"/>",
                                .version = "1.2.3",
                                .experiment = "wave.toml",
                                .run = "0123abcd",
                                .simulated = true,
                                .period_ns = ShownRobot::kPeriod_ns},
                               robot.images());
    EXPECT_TRUE(opened) << opened.error().to_string();
    studio = std::move(*opened);
    const std::string text = studio->address();
    token = text.substr(text.find('=') + 1);
    const std::size_t colon = text.rfind(':');
    port = static_cast<std::uint16_t>(std::stoi(text.substr(colon + 1)));
  }
  ~StudioRig() { studio->finish("", ""); }
  StudioRig(const StudioRig&) = delete;
  StudioRig& operator=(const StudioRig&) = delete;

  void start(Protocol* guests = nullptr) {
    studio->start({.loads = [this] { return loads.load(); },
                   .signals = [this] { return signals; },
                   .events =
                       [this](std::vector<Event>& out) {
                         const std::lock_guard lock(mutex);
                         for (Event& one : events) out.push_back(std::move(one));
                         events.clear();
                       },
                   .time_stands = [this] { return stands.load(); }},
                  {.ask = [this](Question question) { ask(std::move(question)); },
                   .drop =
                       [this](std::uint64_t asker) {
                         const std::lock_guard lock(mutex);
                         dropped.push_back(asker);
                       },
                   .take =
                       [this] {
                         const std::lock_guard lock(mutex);
                         return std::exchange(answers, {});
                       },
                   .is_urgent =
                       [](const std::string& question) {
                         return question.find("\"estop\"") != std::string::npos;
                       },
                   .only_reads = [](const std::string& name) { return name == "status"; }},
                  guests);
  }
  void ask(Question question) {
    {
      const std::lock_guard lock(mutex);
      asked.push_back(question);
      if (holds_back) return;
      const Json echo{{"ok", true}, {"count", counts ? ++count : 0}, {"asked", question.text}};
      answers.push_back({question.asker, question.number, echo.dump()});
    }
    studio->answered();
  }
  [[nodiscard]] std::vector<Question> questions() {
    const std::lock_guard lock(mutex);
    return asked;
  }
  /// Whether one of them was asked by the studio itself.
  [[nodiscard]] bool asked_itself(const std::string& text) {
    for (const Question& one : questions()) {
      if (one.asker == 0 && one.text.find(text) != std::string::npos) return true;
    }
    return false;
  }
  void show(std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t cycle = from; cycle < to; ++cycle) robot.show(studio->tap(), cycle, {});
  }
  /// A client that has got its hello.
  std::unique_ptr<WebClient> client() {
    auto made = std::make_unique<WebClient>(port);
    EXPECT_TRUE(made->open()) << made->status();
    return made;
  }

  ShownRobot robot;
  std::atomic<std::uint64_t> loads{1};
  std::vector<Feed::Signals> signals;  // before the first client
  std::atomic<bool> stands{false};
  std::mutex mutex;  // of what follows
  std::vector<Event> events;
  std::vector<Question> asked;
  std::vector<Answer> answers;
  std::vector<std::uint64_t> dropped;
  bool holds_back = false;  // nothing is answered
  bool counts = false;      // each answer is another
  int count = 0;

  std::unique_ptr<Studio> studio;
  std::string token;
  std::uint16_t port = 0;
};

}  // namespace tandem::studio::test
