// Who wants a copy of the run while it goes on.
// Layer: runtime.  Thread: the loop's calls.
#pragma once

#include <cstdint>

#include "base/archive.hpp"
#include "base/realtime.hpp"

namespace tandem::runtime {

/// Asked between any two cycles.
class SnapshotPort {
 public:
  virtual ~SnapshotPort() = default;
  /// Whether the loop shall write itself down now. @rt one atomic load.
  [[nodiscard]] virtual bool wanted() const noexcept TANDEM_RT = 0;
  /// Whether the backend shall, too: a simulation, in simulated time. Else the copy is of
  /// everything else, and takes no heap.
  [[nodiscard]] virtual bool whole() const noexcept TANDEM_RT = 0;
  /// Empty, with all the memory that it needs.
  [[nodiscard]] virtual Archive& archive() noexcept TANDEM_RT = 0;
  /// It is written, before cycle `next_cycle`, in so much time. In simulated time this may block.
  virtual void taken(std::uint64_t next_cycle, std::int64_t took_ns) noexcept = 0;
};

}  // namespace tandem::runtime
