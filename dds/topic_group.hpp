// What the publisher's topics have in common: where their samples come from and go to.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "dds/config.hpp"
#include "dds/outlet.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/cycle_observer.hpp"
#include "hal/mark_block.hpp"
#include "hal/parallel_source.hpp"
#include "hal/signal_block.hpp"
#include "hal/stop_category.hpp"
#include "hal/text_event.hpp"
#include "model/tree.hpp"
#include "rt/histogram.hpp"

namespace tandem::dds {

/// A fault of the run as it is published.
struct FaultEntry {
  std::uint64_t cycle = 0;
  double time_s = 0.0;
  std::string joint;  ///< or sensor, or controller; empty: of the whole robot
  std::string board;  ///< the joint's; may be empty
  std::string text;
  hal::StopCategory category = hal::StopCategory::kWarn;
  bool latched = true;
  double cleared_s = 0.0;  ///< when it is not latched
};

/// A parameter of a controller, as ROS 2's parameter of the node.
struct NodeParameter {
  enum class Type : std::uint8_t {  ///< rcl_interfaces/msg/ParameterType
    kNotSet = 0,
    kBool = 1,
    kInteger = 2,
    kDouble = 3,
    kText = 4,
    kDoubles = 8,
  };
  std::string name;  ///< "squat.depth_m"
  Type type = Type::kNotSet;
  double number = 0.0;  ///< of a bool 0 or 1
  std::string text{};
  std::vector<double> numbers{};
};

/// Source of what controllers tell; called on the publisher's thread. Empty: they tell nothing.
struct ControllerFeed {
  using Signals = std::pair<std::string, std::shared_ptr<const hal::SignalBlock>>;
  using Marks = std::pair<std::string, std::shared_ptr<const hal::MarkBlock>>;

  std::function<std::uint64_t()> version{};  ///< not 0; another one: controllers came or went
  std::function<std::vector<Signals>()> signals{};  ///< by controller
  std::function<std::vector<Marks>()> marks{};      ///< the same
  /// Appends what was said after the first `seen`, and raises it.
  std::function<void(std::uint64_t& seen, std::vector<hal::TextEvent>&)> texts{};
  std::function<std::uint64_t()> parameter_version{};        ///< another one: some may be different
  std::function<std::vector<NodeParameter>()> parameters{};  ///< of every controller
};

/// What is the same in every cycle of a run.
struct RunDescription {
  const hal::RobotConfig& robot;
  const model::Tree& tree;  ///< of the robot's description, for frames
  std::string urdf{};       ///< the description's text
  std::string hal{};        ///< "sim", "can"
  std::string version{};    ///< of Tandem
  std::string description_hash{};
  std::int64_t period_ns = 1'000'000;
  bool simulated_time = false;  ///< stamps are time_ns and `clock` publishes them; else wall clock
  const hal::TruthImage* truth = nullptr;        ///< the cycles'; null: they bring none
  const hal::EstimateImage* estimate = nullptr;  ///< the same
  std::vector<std::string> wrenches{};           ///< sites of the estimate's wrenches, in its order
  bool parallel = false;                         ///< a second robot runs beside it
  std::uint64_t run = 0;                         ///< drawn at its start
  /// How long each controller's calls take, by name; on the publisher's thread. Empty: not known.
  std::function<std::vector<std::pair<std::string, rt::Percentiles>>()> controllers{};
};

/// The loop's times, of every cycle so far.
struct CycleRecord {
  std::uint64_t cycles = 0;  ///< counted here
  std::uint64_t overruns = 0;
  std::uint64_t skipped = 0;
  std::uint64_t dropped = 0;  ///< that did not fit into a ring
  rt::Histogram wakeup, bus, work;
};

/// One cycle that some topic is due in.
struct CycleSample {
  hal::CycleTime time;
  std::int64_t stamp_ns;  ///< of `time`, on the clock that the stamps have
  hal::RunPhase phase;
  Code read_code;
  std::uint32_t due;             ///< bit i: Topic i
  const hal::StateImage& state;  ///< good when a topic is due that needs it, as are
  const hal::CommandImage& command;
  const hal::TruthImage* truth;        ///< null: none
  const hal::EstimateImage* estimate;  ///< null: none
  const CycleRecord& loop;
  const std::vector<FaultEntry>& faults;

  [[nodiscard]] bool is_due(Topic topic) const {
    return (due >> static_cast<unsigned>(topic) & 1U) != 0;
  }
};

struct PublishCounts {
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;  ///< by DDS: a reader was too far behind, or memory short
  std::uint64_t dropped = 0;  ///< cycles that did not fit into the ring
};

/// A topic of this process; one that was not made or is off takes no samples.
template <class T>
class Output {
 public:
  Output() = default;
  Output(std::unique_ptr<Outlet> outlet, PublishCounts& counts)
      : outlet_(std::move(outlet)), counts_(&counts) {}

  /// Whether there is a topic.
  [[nodiscard]] bool exists() const { return outlet_ != nullptr; }
  /// Whether somebody would get a sample.
  [[nodiscard]] bool wanted() const { return exists() && outlet_->wanted(); }
  void write(const T& sample) {
    if (!exists()) return;
    ++(outlet_->write(&sample) ? counts_->sent : counts_->refused);
  }

 private:
  std::unique_ptr<Outlet> outlet_;
  PublishCounts* counts_ = nullptr;
};

/// Makes topics in the configured namespace, and keeps the first thing that went wrong.
class OutputMaker {
 public:
  OutputMaker(Outlets& outlets, std::int64_t period_ns, PublishCounts& counts)
      : outlets_(outlets), period_ns_(period_ns), counts_(counts) {}

  /// Cycles between two samples; 0: the topic is off.
  [[nodiscard]] std::uint64_t every(Topic topic) const {
    return outlets_.config().cycles_between(topic, period_ns_);
  }
  /// One of samples that come again and again; nothing when [dds.every] has turned it off.
  template <class T>
  [[nodiscard]] Output<T> periodic(Topic topic, const std::string& ros_name) {
    if (every(topic) == 0) return {};
    return make<T>(ros_name, {.reliable = true, .transient_local = false, .depth = 16});
  }
  /// One whose last sample is given to readers that come late.
  template <class T>
  [[nodiscard]] Output<T> latched(const std::string& ros_name) {
    return make<T>(ros_name, {.reliable = true, .transient_local = true, .depth = 1});
  }
  /// ROS 2's /rosout, which every node has in common, in no namespace.
  [[nodiscard]] Output<rcl_interfaces::Log> rosout() {
    return make_named<rcl_interfaces::Log>(
        "rt/rosout", {.reliable = true, .transient_local = true, .depth = 100});
  }
  /// ROS 2's /parameter_events, which every node has in common, in no namespace.
  [[nodiscard]] Output<rcl_interfaces::ParameterEvent> parameter_events() {
    return make_named<rcl_interfaces::ParameterEvent>(
        "rt/parameter_events", {.reliable = true, .transient_local = false, .depth = 1000});
  }
  /// "/tandem_run", "/left/tandem_run".
  [[nodiscard]] std::string full_node_name() const {
    return outlets_.config().topic_name(outlets_.node()).substr(2);
  }
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  template <class T>
  Output<T> make(const std::string& ros_name, const Qos& qos) {
    return make_named<T>(outlets_.config().topic_name(ros_name), qos);
  }
  template <class T>
  Output<T> make_named(const std::string& topic, const Qos& qos) {
    auto outlet = outlets_.open(type<T>(), topic, qos);
    if (outlet) return Output<T>(std::move(*outlet), counts_);
    if (!error_) error_ = outlet.error();
    return {};
  }

  Outlets& outlets_;
  std::int64_t period_ns_;
  PublishCounts& counts_;
  std::optional<Error> error_;
};

/// When what comes at any time is published.
struct News {
  std::int64_t now_ns = 0;              ///< on the clock that the stamps have
  std::int64_t stamp_less_time_ns = 0;  ///< of a cycle
};

/// Some topics that belong together.
class TopicGroup {
 public:
  virtual ~TopicGroup() = default;
  /// Before the first cycle: what does not change.
  virtual void begin(std::int64_t /*stamp_ns*/) {}
  /// A cycle in which at least one topic of some group is due.
  virtual void publish(const CycleSample& sample) = 0;
  /// Faults have come or gone.
  virtual void publish_faults(const std::vector<FaultEntry>& /*faults*/, std::uint64_t /*lost*/) {}
  /// What has come since the last call and belongs to no sample: words, parameters.
  virtual void publish_news(const News& /*news*/) {}
  /// Where controllers' signals, words and parameters come from. Before the first cycle.
  virtual void follow(const ControllerFeed& /*feed*/) {}
  /// Where a second robot's cycles come from; null: nowhere. Before the first cycle.
  virtual void show(hal::ParallelSource* /*second*/) {}
};

/// Makes the topics of one file, NAME_topics.cpp.
using MakeTopics = std::unique_ptr<TopicGroup>(OutputMaker& maker, const RunDescription& run);
MakeTopics joint_topics, sensor_topics, frame_topics, image_topics, diagnostic_topics,
    parallel_topics, controller_topics, parameter_topics, mark_topics, introspection_topics;
MakeTopics wrench_topics;  ///< @pre run.wrenches are sites of run.robot

}  // namespace tandem::dds
