// States of a run that are kept in memory, thinned out with age to a budget.
// Layer: runtime.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "hal/backend.hpp"

namespace tandem::runtime {

/// All that the cycles from `cycle` on follow from, but for what other threads gave them.
struct Checkpoint {
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

  std::uint64_t cycle = 0;          ///< the first that follows from it
  std::uint64_t heard = kNever;     ///< the first cycle from there that heard other threads
  std::uint64_t controllers = 0;    ///< ControllerHost::fingerprint()
  std::vector<std::byte> bytes{};   ///< RobotCycle::save()
  std::uint64_t expects = 0;        ///< Expectations::fingerprint(); 0: there are none
  std::vector<std::byte> judged{};  ///< how far the run's expectations are
  /// What has come of its events, where they are kept apart: Events::apart().
  std::vector<std::byte> happened{};
  hal::KeptElsewhere elsewhere{};  ///< what of it another process keeps

  [[nodiscard]] std::size_t size() const {
    return bytes.size() + judged.size() + happened.size() +
           static_cast<std::size_t>(elsewhere.bytes);
  }
};

/// Ordered by cycle.
class Checkpoints {
 public:
  /// @param budget_bytes  that they take, at most, once there are more than two
  explicit Checkpoints(std::size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// After all that there are; one of the same cycle is replaced. Then others go until all fit:
  /// never the first or the last, and of the rest those that are closest together for their age.
  void add(Checkpoint one);
  /// Those of later cycles than `cycle` are of a future that does not come.
  void forget_after(std::uint64_t cycle);
  /// The last one of at most `cycle`; null: there is none.
  [[nodiscard]] const Checkpoint* before(std::uint64_t cycle) const noexcept;
  [[nodiscard]] Checkpoint* last() noexcept { return all_.empty() ? nullptr : &all_.back(); }
  [[nodiscard]] std::span<const Checkpoint> all() const noexcept { return all_; }
  /// What went since this was asked, of what other processes keep.
  [[nodiscard]] std::vector<hal::KeptElsewhere> take_gone() { return std::exchange(gone_, {}); }
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::size_t budget_bytes() const noexcept { return budget_bytes_; }

 private:
  void thin();
  void erase(std::size_t index);

  std::size_t budget_bytes_;
  std::size_t bytes_ = 0;
  std::vector<Checkpoint> all_;
  std::vector<hal::KeptElsewhere> gone_;
};

}  // namespace tandem::runtime
