// The threads that answer questions to a registry, one for each turn, whatever carries them to it.
// Layer: apps/control.  Thread: one asks, drops and takes; three of its own answer.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "apps/control/control_registry.hpp"

namespace tandem::apps {

/// Hands each question to the thread of its turn and keeps the answers until they are taken. A
/// question whose turn is urgent waits for no other one. What somebody asked for who is gone, and
/// what has not begun, is dropped, unless it is urgent.
class ControlTurns {
 public:
  struct Answer {
    std::uint64_t asker = 0;   ///< who asked
    std::uint64_t number = 0;  ///< of the question, as ask() got it
    std::string text;          ///< JSON, in a line
  };

  /// @param registry  complete; outlives it
  /// @param answered  called on a turn's thread: take() has something. It outlives it, and does not
  ///                  call back.
  ControlTurns(const ControlRegistry& registry, std::function<void()> answered);
  ~ControlTurns();
  ControlTurns(const ControlTurns&) = delete;
  ControlTurns& operator=(const ControlTurns&) = delete;

  /// @param how  whose question it is; its after_stop is set here, to now
  /// @return the turn that it waits for
  ControlTurn ask(std::uint64_t asker, std::uint64_t number, std::string question,
                  ControlRegistry::Asked how = {});
  /// Drops what waits, but stops and ends, of every asker that `gone` picks.
  void drop(const std::function<bool(std::uint64_t asker)>& gone);
  [[nodiscard]] std::vector<Answer> take();
  /// What has not begun is dropped from now on, unless it is urgent: blocks until that is answered,
  /// and take() has it then. What is urgent and asked later, ask() answers before it returns. The
  /// other threads end, and are joined by the destructor.
  void end();
  /// end(), and blocks until all threads have ended: take() has all answers then.
  void finish();

 private:
  struct Question {
    std::uint64_t asker, number;
    std::string text;
    ControlRegistry::Asked how;
  };
  struct Turn {
    std::condition_variable more;
    std::deque<Question> questions;
    std::thread thread;
  };
  void work(Turn& turn);
  void answer(const Question& question);
  [[nodiscard]] Turn& urgent() { return turns_[static_cast<std::size_t>(ControlTurn::kUrgent)]; }

  const ControlRegistry* registry_;
  std::function<void()> answered_;
  std::mutex mutex_;  // of what follows, but the turns' threads
  std::array<Turn, kControlTurns> turns_;
  std::vector<Answer> answers_;
  bool ending_ = false;
  bool stops_are_over_ = false;  // the urgent turn's thread takes no more
};

}  // namespace tandem::apps
