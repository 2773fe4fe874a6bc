// Who may feed an input over DDS, and who does: one at a time.
// Layer: apps/run.  Thread: any, non-RT.
#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

#include "apps/control/control_registry.hpp"
#include "apps/transport/dds_admission.hpp"
#include "base/result.hpp"
#include "dds/participant.hpp"
#include "runtime/run_services.hpp"

namespace tandem::apps {

/// What every feed of an input needs; all outlive it.
struct FeedParts {
  dds::Participant& participant;
  runtime::RunServices& services;
  ControlRegistry::Gate gate;
  const DdsAdmission& admission;
  bool simulated_time;  ///< stamps are the run's time, else CLOCK_REALTIME
};

/// Who has an input. Another one is refused until the first has been silent for the input's
/// time-out, and for half a second at least; and as long as a goal of the first is under way.
class InputLease {
 public:
  explicit InputLease(const FeedParts& parts) : parts_(parts) {}

  /// Whether `who` may feed `port` now: then he has it. A sample passes the same gate as
  /// "input.set". Who was admitted stays so, as far as the gate lets anybody through.
  /// @param writer  tells the writers of a participant apart; never 0
  [[nodiscard]] Status take(const runtime::InputPort& port,
                            const std::optional<dds::ParticipantId>& who, std::uint64_t writer);
  /// Whether `who` may change something at all.
  [[nodiscard]] Status check(const std::optional<dds::ParticipantId>& who) const;
  /// Whoever has it keeps it, or from now on only as long as he is not silent.
  void keep(bool on);

 private:
  FeedParts parts_;
  std::mutex mutex_;  // of all below
  std::uint64_t writer_ = 0;
  std::optional<dds::ParticipantId> participant_;  // of the writer
  bool kept_ = false;
  std::chrono::steady_clock::time_point heard_at_;
};

}  // namespace tandem::apps
