// What a recorded cycle was asked, asked once more.
// Layer: runtime/replay.  Thread: the loop's, between two cycles.
#pragma once

#include <string>
#include <vector>

#include "runtime/replay/recorded_run.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {

class ReplayRequests {
 public:
  /// @param robot  the run's; all outlive it
  ReplayRequests(RobotCycle& cycle, ControllerHost& host, const hal::RobotConfig& robot,
                 const RecordedRun& run);

  /// Before the next cycle. @return why this cycle cannot be played; empty: it can
  [[nodiscard]] std::string ask(const RecordedCycle& cycle);
  /// After it. @return what was refused that was done then; empty: nothing was
  [[nodiscard]] std::string check();

 private:
  [[nodiscard]] std::string ask(const log::Given& given);
  [[nodiscard]] std::string ask_by_event(const RecordedCycle& cycle, const log::EventText& one);
  void offer(const RecordedCycle::Sample& sample);
  void set_parameters(const RecordedCycle& cycle);
  void request(CycleRequest request);
  [[nodiscard]] std::string name_of(std::uint32_t slot) const;

  RobotCycle& cycle_;
  ControllerHost& host_;
  const hal::RobotConfig& robot_;
  const bool has_given_, has_truth_;
  bool switch_waits_ = false;  // for its shadow, since some cycle
  std::uint64_t number_ = 0;
  std::vector<ParameterChange> changes_;  // of this cycle
};

}  // namespace tandem::runtime
