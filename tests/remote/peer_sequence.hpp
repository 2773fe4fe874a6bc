// All that a seed decides of a served run in lockstep: its clock, its operators, its peers.
// Layer: tests.  Thread: any.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/remote/server.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::remote::test {

/// What an operator asks of the run.
enum class Ask : std::uint8_t {
  kPause,
  kResume,
  kStep,
  kRate,
  kReset,
  kStop,
  kLook,
  kWait,
};
/// What a peer over DDS does.
enum class Act : std::uint8_t {
  kJoin,     ///< asks for the lease, had by another or not
  kAnswer,   ///< some cycles
  kSilent,   ///< lives, and answers nothing
  kRelease,  ///< gives the lease back
  kDie,      ///< its participant goes without a word
  kDone,     ///< says that it is done, as a run's last command does
  kStop,     ///< asks for a stop of category 1
  kReset,    ///< asks for a reset
};
/// How the run comes to its end.
enum class End : std::uint8_t {
  kItself,  ///< with an owner, after its running cycles
  kPaused,  ///< asked to end while it is paused, with an owner
  kLonely,  ///< the same without
  kAsked,   ///< asked to end whatever it does
};

template <class What>
struct Deed {
  What what;
  std::uint32_t amount = 0;
  double rate = 0.0;
};

struct PeerSequence {
  explicit PeerSequence(std::uint32_t number);
  [[nodiscard]] std::string to_string() const;
  [[nodiscard]] bool resumes() const;

  std::uint32_t seed;
  ServerConfig server;
  runtime::CycleConfig cycle;
  std::vector<std::vector<Deed<Ask>>> operators;  // 0 to 2
  std::vector<std::vector<Deed<Act>>> peers;      // 0 to 3
  bool has_owner;   // one that stays, beside the peers, once the operators have left
  bool in_fault;    // it is stopped before it is stepped
  bool owner_late;  // the first step is asked for before it comes
  bool watches_clock;
  std::vector<std::uint32_t> steps;
  End end;
};

}  // namespace tandem::remote::test
