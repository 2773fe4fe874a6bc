// States of a run that are kept in memory, thinned out with age to a budget.
// Layer: runtime.  Thread: one at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

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

  [[nodiscard]] std::size_t size() const { return bytes.size() + judged.size(); }
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
  [[nodiscard]] std::size_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::size_t budget_bytes() const noexcept { return budget_bytes_; }

 private:
  void thin();

  std::size_t budget_bytes_;
  std::size_t bytes_ = 0;
  std::vector<Checkpoint> all_;
};

}  // namespace tandem::runtime
