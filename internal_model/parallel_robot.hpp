// A second robot, simulated in this process, that gets what the first one gets: the internal model.
// Start here to read the room.
// Layer: internal_model.  Thread: made, start(), finish() main's; the second robot its own.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "base/triple_buffer.hpp"
#include "hal/backend.hpp"
#include "hal/parallel_source.hpp"
#include "hal/truth.hpp"
#include "internal_model/command_tape.hpp"
#include "internal_model/differences.hpp"
#include "internal_model/duplicating_backend.hpp"
#include "log/recorder.hpp"

namespace tandem::internal_model {

/// All outlive the ParallelRobot.
struct ParallelParts {
  hal::Backend& first;                     ///< whatever the loop drives
  hal::Backend& second;                    ///< a simulation; this thread's from start() on
  const hal::TruthImage* truth = nullptr;  ///< the second's, filled by its read(); null: none
  log::Recorder* recorder = nullptr;       ///< not started yet; null: nothing is logged
  /// The first's, where it is a simulation with a floating base, as the second; null: no figures of
  /// the bases.
  const hal::TruthImage* first_truth = nullptr;
};

/// What a run in parallel amounts to.
struct ParallelResult {
  std::uint64_t cycles = 0;       ///< that the second robot made
  std::uint64_t missed = 0;       ///< commands that it never got, for it was too far behind
  std::uint64_t most_behind = 0;  ///< cycles between the first robot and the second
  std::string fault;              ///< why the second robot stopped by itself; empty: it did not
};

/// Who looks at the second robot while it runs: each on a thread of its own.
enum class ParallelReader : std::uint8_t { kDds, kStudio, kCount };

/// Plays the first robot's tape to the second, on a thread of its own, cycle by cycle and call by
/// call, from power-on: two equal robots stay equal to the last bit. When the second is late, it is
/// late alone. Where the run goes back in time, it does, and what it is compared by.
class ParallelRobot {
 public:
  /// Adds its channels to the recorder.
  /// @param gains  that the drives start with
  ParallelRobot(const ParallelParts& parts, const hal::ImageShape& shape,
                const hal::ParameterImage& gains, std::int64_t period_ns);
  ~ParallelRobot();
  ParallelRobot(const ParallelRobot&) = delete;
  ParallelRobot& operator=(const ParallelRobot&) = delete;

  /// What the loop drives instead of the first robot's backend.
  [[nodiscard]] DuplicatingBackend& backend() noexcept { return backend_; }

  /// Before the first cycle, after the recorder has started.
  void start();
  /// When no cycle comes any more: plays what is left, and ends the thread. Before the recorder
  /// is closed. Once.
  ParallelResult finish();

  /// What the second robot did last, for one reader. None slows another, nor the robot.
  [[nodiscard]] hal::ParallelSource& shown_to(ParallelReader reader) noexcept {
    return shown_[static_cast<std::size_t>(reader)];
  }

  /// The loop's, before its cycle `next_cycle`: wants a snapshot of the second robot when it has
  /// made every cycle so far. Its thread takes it. False: another one is still wanted. @rt
  bool snapshot_now(std::uint64_t next_cycle) noexcept TANDEM_RT;
  /// Blocks for that snapshot, `patience_s` at most, and gives it away. Empty: it did not come.
  [[nodiscard]] std::optional<std::vector<std::byte>> wait_snapshot(std::uint64_t next_cycle,
                                                                    double patience_s);
  /// Whether snapshot_now() would be refused. @rt
  [[nodiscard]] bool snapshot_pending() const noexcept TANDEM_RT {
    return snapshot_after_.load(std::memory_order_acquire) != kNone;
  }

  /// The figures, for when finish() has returned.
  [[nodiscard]] const Differences& differences() const noexcept { return differences_; }

 private:
  class Shown final : public hal::ParallelSource {
   public:
    explicit Shown(const hal::ParallelView& nothing) : views_(nothing) {}
    [[nodiscard]] hal::ParallelView& back() noexcept { return views_.back(); }
    void publish() noexcept { views_.publish(); }
    [[nodiscard]] const hal::ParallelView* newest() noexcept override;

   private:
    TripleBuffer<hal::ParallelView> views_;
    bool any_ = false;  // the reader's
  };

  [[nodiscard]] bool archive(Archive& ar);
  void run();
  void play(const CommandRecord& record);
  void make_up(const CommandRecord& record);
  void call(const BackendCall& call) noexcept;
  void compare_bases(const CommandRecord& record);
  [[nodiscard]] bool both_follow(const CommandRecord& record) const;
  void note_fault();
  void take_snapshot();
  void log(std::int64_t time_ns);
  void show(const CommandRecord& record);
  void show_again();
  void fill(hal::ParallelView& view, const CommandRecord& record) const;

  hal::Backend* second_;
  const hal::TruthImage* truth_;
  log::Recorder* recorder_;
  log::Recorder::Channel state_channel_ = 0, truth_channel_ = 0;
  bool all_counts_;  // simulated time: nothing may be left out
  CommandTape tape_;
  std::atomic<std::uint64_t> done_{0};
  DuplicatingBackend backend_;
  bool bases_;  // both are known

  // The second robot's thread's.
  hal::StateImage state_;
  hal::CommandImage command_;  // the last one written, and whether there is one
  bool commanded_ = false;
  hal::ParameterImage gains_;
  std::uint64_t last_number_ = 0;
  hal::CycleTime last_time_;
  bool diverged_ = false;
  Differences differences_;
  ParallelResult result_;
  std::array<Shown, static_cast<std::size_t>(ParallelReader::kCount)> shown_;

  static constexpr std::uint64_t kNone = ~std::uint64_t{0};
  struct Snapshot {
    std::uint64_t next_cycle = 0;
    std::vector<std::byte> bytes;
  };
  std::atomic<std::uint64_t> snapshot_after_{kNone};  // record; the loop sets, the thread clears
  std::uint64_t snapshot_cycle_ = 0;                  // handed over with it
  std::mutex snapshot_mutex_;
  std::condition_variable snapshot_there_;
  std::vector<Snapshot> snapshots_;  // taken, and not given away; a few at most

  std::atomic<bool> closing_{false};
  std::thread thread_;
};

}  // namespace tandem::internal_model
