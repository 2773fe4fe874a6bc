// What a command to a running process has beside its row in command_rows(): how its line becomes a
// question where that is more than the row's keys, and how its answer is printed.
// Layer: apps/clients.  Thread: main.
#pragma once

#include <string>
#include <vector>

#include "apps/clients/control_client.hpp"
#include "apps/command_line/command_line.hpp"
#include "apps/text/console.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// A command on its way.
struct Asked {
  const AskedOptions& options;
  ControlClient& run;
  Json question;
  Json answer;  ///< written as JSON once it has been told

  [[nodiscard]] bool prints() const { return options.json != "-"; }
  [[nodiscard]] bool has(const char* flag) const { return options.given.value(flag, false); }
  [[nodiscard]] std::string text(const char* key) const { return options.given.value(key, ""); }
  [[nodiscard]] std::vector<std::string> texts(const char* key) const {
    return options.given.value(key, std::vector<std::string>());
  }
};

/// "done in cycle 7", and the note.
void tell_done(const Json& answer);

// Each completes a question.
Status ask_for_load(const AskedOptions& options, Json& question);
Status ask_for_set(const AskedOptions& options, Json& question);
Status ask_for_show(const AskedOptions& options, Json& question);
Status ask_for_start(const AskedOptions& options, Json& question);
Status ask_for_stop(const AskedOptions& options, Json& question);
Status ask_for_input(const AskedOptions& options, Json& question);
Status ask_for_list(const AskedOptions& options, Json& question);
Status ask_for_motion(const AskedOptions& options, Json& question);

// Each prints an answer.
void print_clock(const Json& answer);
void print_controllers(const Json& answer);
void print_differences(const Json& answer);
void print_shadow(const Json& answer);
void print_reloaded(const Json& answer);
void print_controller(const Json& answer);
void print_set(const Json& answer);
void print_switched(const Json& answer);
void print_latched(const Json& answer);
void print_joint_gains(const Json& joint);
void print_joint_set(const Json& joint);
void print_joint_stop(const Json& joint);
void print_tuning(const Json& answer);
void print_recovery(const Json& joint);

// Each prints an answer, waits for what is to come, and puts that into the answer. Exit::kFault: it
// did not come. An error: the command was refused.
Result<Exit> tell_clock_at_rest(Asked& asked);
Result<Exit> tell_until(Asked& asked);
Result<Exit> tell_loaded(Asked& asked);
Result<Exit> tell_switch(Asked& asked);
Result<Exit> tell_fault_reset(Asked& asked);
Result<Exit> tell_input(Asked& asked);
Result<Exit> tell_inputs(Asked& asked);
Result<Exit> tell_joints(Asked& asked);
Result<Exit> tell_motion(Asked& asked);
Result<Exit> tell_homing(Asked& asked);
Result<Exit> tell_joint_reset(Asked& asked);
Result<Exit> tell_prediction(Asked& asked);
Result<Exit> tell_sensors(Asked& asked);
Result<Exit> tell_signals(Asked& asked);
Result<Exit> tell_signal_watch(Asked& asked);
Result<Exit> tell_top(Asked& asked);

/// tandem estop: it asks all runs at once.
[[nodiscard]] Exit estop_command(const AskedOptions& options);

}  // namespace tandem::apps
