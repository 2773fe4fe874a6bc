// /parameter_events: what readers get when parameters come, change and go.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <atomic>
#include <limits>

#include "tests/dds/publisher_rig.hpp"

namespace tandem::dds {
namespace {

using namespace test;
using Type = NodeParameter::Type;

/// Parameters that come and go.
struct Tuned {
  std::atomic<std::uint64_t> version{1};
  std::mutex mutex;
  std::vector<NodeParameter> parameters;

  void are(std::vector<NodeParameter> now) {
    const std::lock_guard lock(mutex);
    parameters = std::move(now);
    ++version;
  }
  ControllerFeed feed() {
    return {.parameter_version = [this] { return version.load(); },
            .parameters =
                [this] {
                  const std::lock_guard lock(mutex);
                  return parameters;
                }};
  }
};

/// An event as text: "+arm.kp=8[40,20] ~arm.on=1:true -arm.word=0".
std::string text_of(const rcl_interfaces::ParameterEvent& event) {
  std::string text;
  const auto add = [&text](const char* sign, const auto& parameters) {
    for (const auto& one : list(parameters)) {
      text += (text.empty() ? "" : " ") + (sign + std::string(one.name)) + "=" +
              std::to_string(one.value.type);
      if (one.value.type == 1) text += one.value.bool_value ? ":true" : ":false";
      if (one.value.type == 2) text += ":" + std::to_string(one.value.integer_value);
      if (one.value.type == 3) text += fmt::format(":{:g}", one.value.double_value);
      if (one.value.type == 4) text += ":" + std::string(one.value.string_value);
      if (one.value.type == 8)
        text += fmt::format("[{:g}]", fmt::join(list(one.value.double_array_value), ","));
    }
  };
  add("+", event.new_parameters);
  add("~", event.changed_parameters);
  add("-", event.deleted_parameters);
  return text;
}

struct ParameterEvents : testing::Test {
  explicit ParameterEvents(const RigOptions& options = {}) : rig(options) {
    rig.publisher->start({.version = [] { return std::uint64_t{0}; },
                          .faults = [] { return std::vector<FaultEntry>(); },
                          .lost = [] { return std::uint64_t{0}; }},
                         nullptr, tuned.feed());
    auto made =
        Reader<rcl_interfaces::ParameterEvent>::create(*rig.listener, "rt/parameter_events", kRos);
    EXPECT_TRUE(made) << made.error().to_string();
    reader.emplace(std::move(*made));
    EXPECT_TRUE(eventually([&] { return reader->endpoint().matched() == 1; }));
  }
  /// The next event, as text.
  std::string next() {
    std::string text;
    EXPECT_TRUE(eventually([&] {
      rig.show(cycle += 10);
      reader->take([&](const rcl_interfaces::ParameterEvent& event, const auto&) {
        text += text_of(event);
        node = event.node;
        stamp_ns = ns(event.stamp);
      });
      return !text.empty();
    }));
    return text;
  }

  /// rmw_qos_profile_parameter_events
  inline static const Qos kRos{
      .reliable = true, .transient_local = false, .depth = 1000, .user_data = {}};
  Tuned tuned;
  PublisherRig rig;
  std::optional<Reader<rcl_interfaces::ParameterEvent>> reader;
  std::uint64_t cycle = 0;
  std::string node;
  std::int64_t stamp_ns = -1;
};

TEST_F(ParameterEvents, TellWhatCameChangedAndWent) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const NodeParameter on{"arm.on", Type::kBool, 1.0}, count{"arm.count", Type::kInteger, -3.0};
  const NodeParameter word{"arm.word", Type::kText, 0.0, "stiff"};
  tuned.are({{"arm.kp", Type::kDoubles, 0.0, "", {40.0, nan, 20.5}},
             on,
             count,
             {"arm.share", Type::kDouble, 0.25},
             word,
             {"arm.none"}});
  EXPECT_EQ(next(),
            "+arm.count=2:-3 +arm.kp=8[40,nan,20.5] +arm.on=1:true +arm.share=3:0.25 "
            "+arm.word=4:stiff")
      << "one that is not set is not there";
  EXPECT_EQ(node, "/tandem_run");
  EXPECT_GT(stamp_ns, 0);
  EXPECT_LE(stamp_ns, static_cast<std::int64_t>(cycle) * PublisherRig::kPeriod_ns);
  tuned.are({{"arm.kp", Type::kDoubles, 0.0, "", {40.0, nan, 21.0}},
             on,
             {"arm.share", Type::kDouble, 0.25},
             {"arm.word", Type::kText, 0.0, "compliant"},
             {"arm.none", Type::kDouble, 2.0}});
  EXPECT_EQ(next(), "+arm.none=3:2 ~arm.kp=8[40,nan,21] ~arm.word=4:compliant -arm.count=0");
  tuned.are(tuned.parameters);  // another version of the same
  for (int i = 0; i < 20; ++i) rig.show(cycle += 10);
  tuned.are({});
  EXPECT_EQ(next(), "-arm.kp=0 -arm.none=0 -arm.on=0 -arm.share=0 -arm.word=0");
}

TEST_F(ParameterEvents, HaveTheQualityOfServiceOfRos2) {
  const auto late = Reader<rcl_interfaces::ParameterEvent>::create(
      *rig.listener, "rt/parameter_events",
      {.reliable = true, .transient_local = true, .depth = 1000, .user_data = {}});
  ASSERT_TRUE(late);
  for (int i = 0; i < 20; ++i) rig.show(cycle += 10);
  EXPECT_EQ(late->endpoint().matched(), 0U) << "they are volatile";
}

RigOptions in_a_namespace() {
  RigOptions options;
  options.config.name_space = "left";
  return options;
}
struct ParameterEventsInANamespace : ParameterEvents {
  ParameterEventsInANamespace() : ParameterEvents(in_a_namespace()) {}
};

TEST_F(ParameterEventsInANamespace, NameTheNodeAndShareTheTopic) {
  tuned.are({{"arm.share", Type::kDouble, 0.25}});
  EXPECT_EQ(next(), "+arm.share=3:0.25");
  EXPECT_EQ(node, "/left/tandem_run");
}

}  // namespace
}  // namespace tandem::dds
