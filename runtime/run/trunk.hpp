// The beginning that runs have in common which differ only in what happens later: simulated once.
// Layer: runtime/run.  Thread: main, but for TrunkFile's add(), the loop's.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "runtime/checkpoints.hpp"
#include "runtime/events.hpp"

namespace tandem::sim {
class FaultInjection;
class SimRobot;
}  // namespace tandem::sim

namespace tandem::runtime {

struct Experiment;

/// States of a run in which some rows of what happens never come. Where these rows have other
/// values, the run goes on from the last state before the first of them comes, to the same bits as
/// from its beginning.
struct Trunk {
  std::vector<Events::Row> events;
  std::vector<Checkpoint> states;  ///< in the order of their cycles
};

/// States that a trunk keeps at most.
inline constexpr std::uint64_t kMostStates = 64;

/// These rows never come: what the experiment of a trunk is.
void put_off(Experiment& e, std::span<const std::string> rows);

/// Writes a trunk, state by state.
class TrunkFile {
 public:
  /// @param events  of the run; null: it has none. Errors: the file cannot be made.
  [[nodiscard]] static Result<std::unique_ptr<TrunkFile>> open(const std::string& path,
                                                               const Events* events);
  void add(const Checkpoint& one);

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { (void)std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};
/// Errors: read_file()'s; it is damaged, as where the disk was full.
[[nodiscard]] Result<Trunk> read_trunk(const std::string& path);

/// The last state from which a run may go on: none of its rows `later` is due before. Puts what has
/// happened until then into `events`. @param events  null: it has none
/// @return null: the run has to begin from its beginning
[[nodiscard]] const Checkpoint* branching_state(const Trunk& trunk, const Experiment& e,
                                                std::span<const std::string> later, Events* events);

/// After the state was restored: the robot's faults of `later` are those that it was made with.
/// @param own  the robot's, from before
void come_later(sim::SimRobot& robot, const sim::FaultInjection& own, const Experiment& e,
                std::span<const std::string> later);

}  // namespace tandem::runtime
