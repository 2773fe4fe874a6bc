// Topics that feed inputs, in one process: a loop, its feeds, and another participant that writes.
#include "apps/run/input_topics.hpp"

#include <cmath>
#include <thread>

#include "dds/endpoint.hpp"
#include "dds/service.hpp"
#include "tests/runtime/loop_run.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::apps {
namespace {

using dds::geometry_msgs::Twist;
using runtime::InputFeeder;
using runtime::RunPhase;

/// Does nothing but have an input.
class Listener : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    input = setup.input("twist", InputKind::kTwist, {.max = {1.0}, .timeout_s = 60.0});
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {}
  Code update(const hal::CycleTime&, const hal::StateImage&, hal::CommandImage&) noexcept override {
    return Code::kOk;
  }
  void archive(Archive&) override {}
  Input input;
};

struct InputTopic : testing::Test, runtime::test::JointRun {
  std::unique_ptr<dds::Participant> join(const char* name) const {
    auto joined = dds::Participant::open(domain, name);
    return std::move(joined.value());
  }
  void begin_with(bool everybody) {
    const runtime::InputSource source{
        .name = "twist", .feeder = InputFeeder::kTopic, .topic = "cmd_vel"};
    auto made = std::make_shared<Listener>();
    listener = made.get();
    ASSERT_TRUE(host->add("one", std::move(made), runtime::test::parameters(), true,
                          std::span(&source, 1)));
    begin();
    (void)until(RunPhase::kRunning);
    admission.emplace(everybody);
    const auto gate = [this](const std::string&, ControlEffect, const Json&) -> Status {
      return owned ? fail("somebody commands the robot") : Status();
    };
    auto opened = InputTopics::open(own.get(), services(), gate, *admission);
    ASSERT_TRUE(opened) << opened.error().to_string();
    topics = std::move(*opened);
  }
  [[nodiscard]] std::string why() { return services().inputs().front().look.why; }
  /// Writes and cycles until `there`.
  template <class There>
  bool write_until(dds::Writer<Twist>& writer, const Twist& twist, const There& there) {
    for (int i = 0; i < 1000; ++i) {
      EXPECT_TRUE(writer.write(twist));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      steps(1);
      if (there()) return true;
    }
    return false;
  }
  static Twist yaw(double rad_s) { return {.linear = {}, .angular = {0.0, 0.0, rad_s}}; }

  std::shared_ptr<dds::Domain> domain = dds::Domain::open(dds::test::own_config()).value();
  std::unique_ptr<dds::Participant> own = join("run"), peer = join("teleop");
  std::optional<DdsAdmission> admission;
  std::atomic<bool> owned{false};
  Listener* listener = nullptr;
  std::unique_ptr<InputTopics> topics;
};

TEST_F(InputTopic, IsTakenOfOneNodeAtATime) {
  begin_with(true);
  auto writer = dds::Writer<Twist>::create(*peer, "rt/cmd_vel", {}).value();
  EXPECT_TRUE(write_until(writer, yaw(0.5), [&] { return listener->input.fresh(); }));
  EXPECT_EQ(listener->input[5], 0.5);
  auto other = dds::Writer<Twist>::create(*peer, "rt/cmd_vel", {}).value();
  EXPECT_TRUE(write_until(other, yaw(0.1), [&] { return why().contains("another node"); }));
  EXPECT_EQ(listener->input[5], 0.5);
  EXPECT_TRUE(
      write_until(writer, yaw(std::nan("")), [&] { return why().contains("yaw: is not"); }));
  EXPECT_TRUE(write_until(writer, yaw(2.0), [&] { return why().contains("yaw: 2 is beyond"); }));
  EXPECT_EQ(listener->input[5], 0.5);
  owned = true;
  EXPECT_TRUE(write_until(writer, yaw(0.2), [&] { return why().contains("commands the robot"); }));
  EXPECT_EQ(listener->input[5], 0.5);
  owned = false;
  EXPECT_TRUE(write_until(writer, yaw(0.2), [&] { return listener->input[5] == 0.2; }));
}

TEST_F(InputTopic, OfAStrangerIsRefusedUntilHeIsAdmitted) {
  begin_with(false);
  auto writer = dds::Writer<Twist>::create(*peer, "rt/cmd_vel", {}).value();
  EXPECT_TRUE(write_until(writer, yaw(0.5), [&] { return why().contains("stranger"); }));
  EXPECT_EQ(listener->input.sequence(), 0U);
  admission->admit(dds::id_of(*peer));
  EXPECT_TRUE(write_until(writer, yaw(0.5), [&] { return listener->input.fresh(); }));
}

}  // namespace
}  // namespace tandem::apps
