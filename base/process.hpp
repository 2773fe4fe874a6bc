// Other programs: found, started, waited for.
// Layer: base.  Thread: non-RT.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/result.hpp"

namespace tandem {

/// Whether `program` is an executable file, or the name of one in $PATH.
[[nodiscard]] bool program_exists(const std::string& program);

/// What a program is started with.
struct Spawn {
  std::vector<std::string> command;  ///< the program, looked for in $PATH, and its arguments
  std::string output;                ///< file for standard output and standard error
  std::string directory = ".";       ///< that it works in
  int input = -1;                    ///< descriptor of its standard input; -1: it is empty
  bool own_group = false;            ///< a process group of its own, whose number is the child's
  bool ends_with_us = false;         ///< it is killed when the thread that starts it ends, however
};

/// Starts it. No shell is between: a word of `command` is a word of the program's.
/// Errors: the program cannot be started.
[[nodiscard]] Result<pid_t> spawn(const Spawn& what);

/// The file of this program: its parts (controllers, kernels, engines) are found from there, and
/// its owner is trusted. After an upgrade it is the new program's.
[[nodiscard]] std::string program_file();
/// For spawn(): this program once more, also after an upgrade.
[[nodiscard]] std::string same_program();
/// For a library in another program, such as Python's module: it is `path` whose parts are used. To
/// be called before anything else is.
void stand_for_program(std::string path);

/// The program of this name in the folder of this one.
[[nodiscard]] std::string program_beside(const std::string& name);

/// Becomes another program, with this process' number and descriptors.
/// @param words  its arguments, its name first
/// @return only an error: it cannot be started
[[nodiscard]] Error become(const std::string& program, const std::vector<std::string>& words);

/// Waits until it has ended.
/// @return its exit status; 128 + signal when a signal ended it; -1: it is no child of ours
[[nodiscard]] int wait_for(pid_t child);
/// The same of what waitpid() answered.
[[nodiscard]] int exit_status(int raw) noexcept;

/// Whether a debugger has this process, now.
[[nodiscard]] bool is_debugged();
/// From now on what takes long says nothing in this process, with a debugger or without: `--debug`.
void waive_time_limits() noexcept;
/// Whether it says nothing: is_debugged(), or waive_time_limits() was called. Every limit of time
/// on the wall clock that is there for what hangs asks this before it ends anything.
[[nodiscard]] bool time_limits_are_waived();

}  // namespace tandem
