// A run that Python steps: it stands between the halves of a cycle, where the state has been read
// and the command is awaited.
// Layer: python.  Thread: one at a time per run, else an error; long steps leave the
// interpreter's lock to others.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "python/arrays.hpp"
#include "python/lead.hpp"
#include "runtime/run/crash_guard.hpp"
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
  /// @param log   its folder, or a new NAME.mcap; empty: nothing is logged
  /// Errors: compose()'s; a robot that is not simulated in this process; an unknown joint or mode;
  /// open_log()'s.
  Running(const std::string& given, runtime::Overrides overrides, const std::string& all,
          const Control& some, const std::string& log);
  ~Running();
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  [[nodiscard]] runtime::Run& run() const { return *run_; }
  [[nodiscard]] Lead* lead() const { return lead_.get(); }
  /// Controllers have ended, or close() was called; the shut-down may be still to come.
  [[nodiscard]] bool over() const {
    return closed_ || !begun_ || run().cycle().phase() == runtime::RunPhase::kShutDown;
  }

  /// Gives the command and reads the next state, `cycles` times. False: the run has ended.
  bool step(std::int64_t cycles);
  /// Ends the run, if it has not ended, and carries out the shut-down; then close().
  void finish();
  /// Ends the log where the run stands, which goes no further. Error: messages were lost.
  void close();
  /// The log's; empty: there is none.
  [[nodiscard]] const std::string& log_path() const { return log_path_; }
  /// For iteration: the state that nobody has looked at yet, or else the next one. False, too, once
  /// the planned cycles have passed in fault or held, where none of them counts.
  bool next();

  /// A mark, whether the cycle has begun, and a hash of all the rest, which is RobotCycle's.
  [[nodiscard]] py::bytes save();
  /// Errors: another run's; a run with a log, which goes forward only.
  void restore(const py::bytes& snapshot);
  /// Acts in this cycle, as the next ones. Errors: a run that is over.
  void stop(int category);
  void reset_faults();
  /// The controllers that a reset holds back, and Python, lead again: its command begins where the
  /// robot is. Error: another phase than kHeld.
  void start();
  /// A command of the control socket that concerns controllers, inputs, joints, sensors or signals,
  /// carried out in this cycle. @return the answer's JSON. Errors: the command's.
  [[nodiscard]] std::string ask(const std::string& question);
  /// (controller, fields of its signals).
  [[nodiscard]] py::list signals();
  /// What controllers have said since the run was opened, or restored last: the last 256 as
  /// (time_s, cycle, controller, level, text).
  [[nodiscard]] py::list texts();

  /// Figures so far as JSON, those of `tandem run --json` that are no program's.
  [[nodiscard]] std::string result();

  /// The faults of a scenario's text. @return how many
  std::size_t inject(const std::string& scenario);

 private:
  /// Marks that a thread is in the run, and says whose crash it is if one crashes there.
  class Turn {
   public:
    /// @param hosts  controllers may be loaded
    explicit Turn(Running& of, bool hosts = false);
    ~Turn() { of_->busy_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    Running* of_;
    std::optional<runtime::CrashGuard> guard_;  // where there is a plugin that may crash
  };

  /// Whom ask() and events ask.
  [[nodiscard]] apps::ControlRegistry& commands();
  void carry_out_events();
  void add_lead(const std::string& all, const Control& some);
  void end_log();
  void end_log_by(const char* crash);
  void look_for_plugins();
  void check_open() const;
  void begin();
  void take_lead();
  bool advance();
  [[nodiscard]] std::int64_t per_turn() const;
  void check_command() const;
  void check_going(const char* what) const;
  [[nodiscard]] bool waits_too_long() const;

  std::unique_ptr<runtime::CrashScene> scene_;  // first: controllers tell it of their calls
  std::unique_ptr<runtime::Composition> c_;
  std::unique_ptr<log::Recorder> recorder_;  // null: nothing is logged
  std::unique_ptr<runtime::Run> run_;
  std::string log_path_;
  std::size_t plugins_at_start_ = 0;
  bool has_plugins_ = false;
  int process_ = 0;                                  // that opened the log
  bool closed_ = false;                              // nothing is stepped any more
  std::unique_ptr<apps::ControlRegistry> commands_;  // once something was asked
  std::uint64_t texts_before_ = 0;                   // the last restore()
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

}  // namespace tandem::python
