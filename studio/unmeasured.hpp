// Which numbers of a run nobody has measured yet: their 0 is no measurement.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "log/info.hpp"
#include "studio/signal_table.hpp"
#include "studio/tap.hpp"

namespace tandem::studio {

/// By the rule of log/unmeasured.hpp. A command's position repeats the measured one until a
/// controller writes it, so it is none before that either.
class Unmeasured {
 public:
  /// @param table  has the images as its first sources
  Unmeasured(const SignalTable& table, const Tap::Images& images, const log::RunInfo& robot);

  /// Makes a cycle's numbers that are not measured NaN.
  /// @param state  image of that cycle
  /// @param row    by id
  void drop(std::span<const std::byte> state, std::span<float> row) const;

 private:
  struct Age {
    std::size_t at;             // in the state's image [bytes]
    std::vector<SignalId> ids;  // numbers that are as old
  };
  std::size_t cycle_at_ = 0;
  std::vector<Age> ages_;
};

}  // namespace tandem::studio
