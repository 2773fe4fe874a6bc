// What others do to the loop, measured in blocks: the same run with them and without, by turns, and
// the times of its cycles in histograms of each block.
#pragma once

#include <cstdint>
#include <cstdio>
#include <span>
#include <string_view>
#include <vector>

#include "hal/cycle_observer.hpp"
#include "rt/histogram.hpp"
#include "runtime/robot_cycle.hpp"

namespace CLI {
class App;
}

namespace tandem::bench {

struct BlockOptions {
  int blocks = 6;  ///< of each kind
  double seconds = 5.0;
  int cpu = -1;
};
/// --blocks, --seconds, --cpu
void add_options(CLI::App& app, BlockOptions& options);

/// Keeps the times of each cycle in its block's histograms, and hands the cycle on.
class BlockTap final : public hal::CycleObserver {
 public:
  struct Block {
    rt::Histogram wakeup;  ///< from the grid point to the cycle's begin
    rt::Histogram work;    ///< from the return of the wait to the hand-over's end
  };
  /// @param kinds    a letter each, in the order of the blocks: the other process reads which is on
  /// @param settles  first cycles of a block that do not count: the other process changes
  BlockTap(const BlockOptions& options, std::string_view kinds, std::uint64_t settles,
           std::int64_t period_ns = 1'000'000);

  /// Who gets the cycles as well. Before the first of them.
  void hand_on_to(hal::CycleObserver& to) { to_ = &to; }
  void take(const hal::CycleView& view) noexcept TANDEM_RT override;
  void take_signals(const hal::CycleTime& time,
                    const hal::SignalBlock& signals) noexcept TANDEM_RT override;
  /// Steps through all blocks on a thread of its own; writes the kind of each to `other`.
  void step_through(runtime::RobotCycle& cycle, std::FILE* other) const;
  /// A row a kind: percentiles as medians of its blocks, and the p99.9 over that of the first.
  /// @param names  of the kinds
  void print(const char* what, rt::Histogram Block::*which,
             std::span<const char* const> names) const;

 private:
  std::string_view kinds_;
  std::uint64_t settles_, cycles_per_block_;
  int cpu_;
  std::vector<Block> blocks_;
  hal::CycleObserver* to_ = nullptr;
};

}  // namespace tandem::bench
