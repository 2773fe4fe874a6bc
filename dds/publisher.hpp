// Shows a run to others: every cycle goes through a wait-free ring to a thread of this class' own,
// which makes DDS samples of it. docs/ros2.md says which, when and how.
// Layer: dds.  Thread: take() the loop's; the rest main.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

#include "base/spsc_ring.hpp"
#include "dds/participant.hpp"
#include "dds/run_topics.hpp"
#include "hal/cycle_observer.hpp"

namespace tandem::dds {

class Publisher final : public hal::CycleObserver {
 public:
  /// Makes every topic; nothing is published yet. Robot, tree and participant outlive it.
  /// Errors: RunTopics::create()'s.
  [[nodiscard]] static Result<std::unique_ptr<Publisher>> create(Participant& participant,
                                                                 const RunDescription& run);
  ~Publisher() override;
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  /// Publishes what does not change, and starts the thread.
  /// @param parallel  the second robot of RunDescription::parallel; null: there is none
  void start(FaultFeed faults, hal::ParallelSource* parallel = nullptr,
             const ControllerFeed& controllers = {});
  /// Publishes what is in the ring, and ends the thread. Once, when no cycle comes any more.
  PublishCounts stop();

  /// @rt copies the images that a topic is due for, at most: no lock, no heap, no system call.
  void take(const hal::CycleView& view) noexcept TANDEM_RT override;

 private:
  static constexpr std::size_t kTopics = RunTopics::kTopics;
  /// Record of every cycle.
  struct Times {
    std::uint64_t number;  // of take()'s calls
    hal::CycleTimes times;
  };
  /// Record of a cycle that some topic is due in; then the images follow.
  struct Head {
    std::uint64_t number;
    hal::CycleTime time;
    hal::CycleTimes times;
    std::uint32_t due;
    hal::RunPhase phase;
    Code read_code;
    bool truth, estimate;
  };

  Publisher(std::unique_ptr<Outlets> outlets, std::unique_ptr<RunTopics> topics,
            const RunDescription& run);
  [[nodiscard]] std::size_t slot_bytes() const;
  void copy_due(const hal::CycleView& view, std::uint64_t number) noexcept TANDEM_RT;
  void run();
  bool drain();
  void count_times(std::uint64_t up_to);
  void publish(std::span<const std::byte> slot);

  std::unique_ptr<Outlets> outlets_;
  std::unique_ptr<RunTopics> topics_;
  std::array<std::uint64_t, kTopics> every_;

  // Copies of what a slot holds, for the groups.
  hal::StateImage state_;
  hal::CommandImage command_;
  std::optional<hal::TruthImage> truth_;
  std::optional<hal::EstimateImage> estimate_;
  std::size_t state_at_, command_at_, truth_at_, estimate_at_;  // in a slot
  SpscRing times_ring_, image_ring_;
  std::uint64_t taken_ = 0;  // the loop's
  std::uint64_t cycle_ = 0;  // the loop's: of its last cycle

  std::atomic<std::int64_t> newest_ns_{0};  // of take()'s last cycle
  // Where time went back last, and by which of take()'s calls: what waited is not published.
  std::atomic<std::int64_t> back_ns_{0};
  std::atomic<std::uint64_t> back_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace tandem::dds
