// A run that Python steps: it stands between the halves of a cycle, where the state has been read
// and the command is awaited.
// Layer: python.  Thread: one at a time per run, else an error; long steps leave the
// interpreter's lock to others.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "python/arrays.hpp"
#include "python/lead.hpp"
#include "runtime/run/run.hpp"

namespace tandem::python {

/// Which joints Python leads, in which mode.
using Control = std::map<std::string, std::string>;

/// The run, the controller that Python is, and where in a cycle they stand. Arrays keep it alive.
class Running {
 public:
  /// Opens the run and steps it to its first cycle of control.
  /// @param all   the mode of every joint, without the experiment's controllers; empty: see `some`
  /// @param some  the modes of those that Python leads beside them
  /// Errors: Run::open()'s; a robot that is not simulated in this process; an unknown joint or
  /// mode.
  Running(const std::string& file, runtime::Overrides overrides, const std::string& all,
          const Control& some);

  [[nodiscard]] runtime::Run& run() const { return *run_; }
  [[nodiscard]] Lead* lead() const { return lead_.get(); }
  /// Controllers have ended; the shut-down may be still to come.
  [[nodiscard]] bool over() const {
    return !begun_ || run().cycle().phase() == runtime::RunPhase::kShutDown;
  }

  /// Gives the command and reads the next state, `cycles` times. False: the run has ended.
  bool step(std::int64_t cycles);
  /// Ends the run, if it has not ended, and carries out the shut-down.
  void finish();
  /// For iteration: the state that nobody has looked at yet, or else the next one. False, too, once
  /// the planned cycles have passed in fault or held, where none of them counts.
  bool next();

  /// A mark, whether the cycle has begun, and a hash of all the rest, which is RobotCycle's.
  [[nodiscard]] py::bytes save();
  void restore(const py::bytes& snapshot);
  /// Acts in this cycle, as the next ones. Errors: a run that is over.
  void stop(int category);
  void reset_faults();
  /// The controllers that a reset holds back, and Python, lead again: its command begins where the
  /// robot is. Error: another phase than kHeld.
  void start();
  /// The faults of a scenario's text. @return how many
  std::size_t inject(const std::string& scenario);

 private:
  /// Marks that a thread is in the run.
  class Turn {
   public:
    explicit Turn(Running& of);
    ~Turn() { of_->busy_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Running* of_;
  };

  void add_lead(const std::string& all, const Control& some);
  void begin();
  bool advance();
  [[nodiscard]] std::int64_t per_turn() const;
  void check_command() const;
  void check_going(const char* what) const;
  [[nodiscard]] bool waits_too_long() const;

  std::unique_ptr<runtime::Run> run_;
  std::shared_ptr<Lead> lead_;
  std::vector<std::string> joints_;
  std::atomic<bool> busy_{false};
  bool begun_ = false;       // the cycle's first half is done
  bool fresh_ = true;        // nobody has looked at its state
  bool led_ = false;         // controllers ran in the cycle before
  std::uint64_t first_ = 0;  // cycle of control
};

/// Every fault so far, as tandem.Run.faults has it.
[[nodiscard]] py::list faults_of(const Running& running);
/// Figures so far, those of `tandem run --json` that are of the simulation and not of the program.
[[nodiscard]] py::dict result_of(const Running& running);

}  // namespace tandem::python
