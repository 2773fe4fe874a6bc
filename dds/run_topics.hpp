// Every topic of a run, whoever takes their samples: what makes these of the run's cycles.
// docs/ros2.md says which, when and how.
// Layer: dds.  Thread: one at a time.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "dds/topic_group.hpp"
#include "hal/cycle_observer.hpp"

namespace tandem::dds {

/// Source of the run's faults; called on the topics' thread.
struct FaultFeed {
  std::function<std::uint64_t()>
      version;  ///< 0: there are none; another one: some have come or gone
  std::function<std::vector<FaultEntry>()> faults;
  std::function<std::uint64_t()> lost;  ///< that the list had no room for
};

class RunTopics {
 public:
  static constexpr std::size_t kTopics = kTopicPeriods.size();

  /// Makes every topic; there are no samples yet. Robot, tree and outlets outlive it.
  /// Errors: Outlets::open()'s; two sensors whose names are the same in ROS 2.
  [[nodiscard]] static Result<std::unique_ptr<RunTopics>> create(Outlets& outlets,
                                                                 const RunDescription& run);
  RunTopics(const RunTopics&) = delete;
  RunTopics& operator=(const RunTopics&) = delete;

  /// Cycles between two samples, by Topic; 0: there are none.
  [[nodiscard]] const std::array<std::uint64_t, kTopics>& every() const { return every_; }
  [[nodiscard]] PublishCounts& counts() { return counts_; }

  /// Writes what does not change.
  /// @param parallel  the second robot of RunDescription::parallel; null: there is none
  void start(FaultFeed faults, hal::ParallelSource* parallel, const ControllerFeed& controllers);
  /// Takes the times of every cycle, in their order.
  void count(const hal::CycleTimes& times);
  /// Cycles that never came here, so far.
  void set_dropped(std::uint64_t cycles) { loop_.dropped = cycles; }
  /// Samples of the topics that are due: bit i of `due` is Topic i.
  /// @param cycle  has the images that they need
  void publish(const hal::CycleView& cycle, std::uint32_t due);
  /// What belongs to no cycle: faults, words, parameters; and simulated time ten times a second.
  /// @param newest_ns  time of the newest cycle, where none waits to be published
  void publish_news(std::optional<std::int64_t> newest_ns);

 private:
  RunTopics(Outlets& outlets, const RunDescription& run);
  void publish_clock();
  void look_at_faults();
  [[nodiscard]] std::int64_t stamp_ns(const hal::CycleView& cycle);

  bool simulated_time_;
  std::array<std::uint64_t, kTopics> every_{};
  PublishCounts counts_;
  CycleRecord loop_;
  std::vector<std::unique_ptr<TopicGroup>> groups_;
  Output<rosgraph_msgs::Clock> clock_;
  std::optional<Error> error_;

  FaultFeed fault_source_;
  std::uint64_t fault_version_ = 0;
  std::vector<FaultEntry> faults_;
  std::int64_t clock_ns_ = 0;  // that `clock` publishes next
  std::chrono::steady_clock::time_point clock_due_, offset_due_;
  std::int64_t wall_offset_ns_ = 0;      // the wall clock less the loop's
  std::int64_t stamp_less_time_ns_ = 0;  // of the last published cycle
};

}  // namespace tandem::dds
