// Turns what the tap has taken into rows of numbers: for the history, and for the next tick.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "studio/feed.hpp"
#include "studio/history.hpp"
#include "studio/mark_source.hpp"
#include "studio/signal_table.hpp"
#include "studio/tap.hpp"
#include "studio/twin_source.hpp"
#include "studio/unmeasured.hpp"

namespace tandem::studio {

/// What became of every signal since begin_tick().
struct Span {
  std::uint64_t cycles = 0;  ///< that came
  bool gap = false;          ///< some were lost before
  std::vector<float> least, largest;
};

/// Simulated time went back.
struct TimeBack {
  std::int64_t from_ns = 0;  ///< where it had been
  std::int64_t to_ns = 0;
  std::uint64_t cycle = 0;  ///< the newest one now: the cycle that `to_ns` is of
};

class Sampler {
 public:
  /// @param tap     of the same images; outlives it
  /// @param robot   names the elements
  /// @param level_bytes  of each level of the history
  Sampler(Tap& tap, const Tap::Images& images, const log::RunInfo& robot, std::size_t level_bytes);

  /// Takes every cycle that is there. @return whether the sources are others than before
  bool look(const Feed& feed);
  /// Where time has gone back to in look(), once; of several times the earliest: what had been
  /// after it is no past of the run any more.
  [[nodiscard]] std::optional<TimeBack> take_back() { return std::exchange(back_, std::nullopt); }
  /// Events that look() found, once.
  [[nodiscard]] std::vector<Event> take_events() { return std::exchange(events_, {}); }

  [[nodiscard]] const SignalTable& table() const { return table_; }
  [[nodiscard]] const History& history() const { return history_; }
  /// Numbers of the newest cycle; NaN before the first.
  [[nodiscard]] const std::vector<float>& last() const { return row_; }
  [[nodiscard]] std::uint64_t cycle() const { return time_.cycle; }
  [[nodiscard]] std::int64_t time_ns() const { return time_.time_ns; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

  [[nodiscard]] const Span& span() const { return span_; }
  void begin_tick();

 private:
  /// A controller's block and its source. It is kept, so that no other has its address.
  struct Block {
    std::string name;
    std::shared_ptr<const hal::SignalBlock> block;
    std::size_t source;
    std::vector<std::byte> image;  // whose parts are coming in
  };

  bool look_for_controllers(const Feed& feed);
  bool look_for_marks(const Feed& feed);
  bool look_at_twin(const Feed& feed);
  bool add(const std::string& who, const std::string& name, const hal::Layout& layout,
           std::size_t& source);
  void widen();
  void begin_row();
  void go_back(const hal::CycleTime& to);
  void take(const Tap::Signals& part);
  void take(const Tap::Cycle& cycle);

  Tap* tap_;
  SignalTable table_;
  Unmeasured unmeasured_;
  std::array<std::size_t, Tap::kParts> sources_{};  // of those that there are
  History history_;
  std::vector<float> row_;
  bool row_is_whole_ = false;
  Span span_;
  std::vector<Block> blocks_;
  std::vector<MarkSource> marks_;
  std::optional<TwinSource> twin_;
  std::uint64_t loads_ = 0, lost_ = 0;
  bool unknown_block_ = false;
  hal::CycleTime time_;
  std::optional<TimeBack> back_;
  std::uint64_t first_ = 0;  // cycle that was seen
  bool has_phase_ = false;
  hal::RunPhase phase_ = hal::RunPhase::kBringUp;
  std::vector<Event> events_;
};

}  // namespace tandem::studio
