// Children by posix_spawn, without a shell: their arguments cannot become commands.
#include "base/process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/open_file.hpp"

extern char** environ;  // NOLINT: POSIX

namespace tandem {

bool program_exists(const std::string& program) {
  if (program.find('/') != std::string::npos) return access(program.c_str(), X_OK) == 0;
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "/usr/bin:/bin" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

namespace {

/// As exec() wants them; `words` outlives them.
std::vector<char*> arguments_of(const std::vector<std::string>& words) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  return arguments;
}

}  // namespace

namespace {

constexpr const char* kSelf = "/proc/self/exe";

std::string& stands_for() {
  static std::string path;
  return path;
}

}  // namespace

std::string program_file() {
  if (!stands_for().empty()) return stands_for();
  std::error_code ignored;
  std::string file = std::filesystem::read_symlink(kSelf, ignored).string();
  // The kernel's word for a file whose name another one has taken.
  constexpr std::string_view kReplaced = " (deleted)";
  if (file.ends_with(kReplaced) && !std::filesystem::exists(file, ignored))
    file.resize(file.size() - kReplaced.size());
  return file;
}

std::string same_program() { return stands_for().empty() ? kSelf : stands_for(); }

void stand_for_program(std::string path) { stands_for() = std::move(path); }

std::string program_beside(const std::string& name) {
  return std::filesystem::path(program_file()).replace_filename(name).string();
}

Error become(const std::string& program, const std::vector<std::string>& words) {
  ::execvp(program.c_str(), arguments_of(words).data());
  return {.message = std::string("cannot be started: ") + std::strerror(errno),
          .hint = {},
          .file = program,
          .key = {}};
}

/// posix_spawn() has no way to say so; all that the child does here is a system call.
static pid_t fork_with_us(const Spawn& what, int output, const char* const* arguments) noexcept {
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child != 0) return child;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it has ended meanwhile
  if (what.own_group) setpgid(0, 0);
  const int input = what.input < 0 ? open("/dev/null", O_RDONLY | O_CLOEXEC) : what.input;
  if (dup2(input, 0) < 0 || dup2(output, 1) < 0 || dup2(1, 2) < 0) _exit(127);
  if (what.directory != "." && chdir(what.directory.c_str()) != 0) _exit(127);
  execvp(arguments[0], const_cast<char* const*>(arguments));
  _exit(127);
}

Result<pid_t> spawn(const Spawn& what) {
  const std::vector<char*> arguments = arguments_of(what.command);
  const Result<Descriptor> output = open_output(what.output, 0644);
  if (!output) {
    return fail(what.command.front() + " could not be started: " + what.output + ": " +
                output.error().message);
  }
  if (what.ends_with_us) {
    const pid_t child = fork_with_us(what, output->get(), arguments.data());
    if (child > 0 && what.own_group) (void)setpgid(child, child);  // before anybody signals it
    if (child > 0) return child;
    return fail(what.command.front() + " could not be started: " + std::strerror(errno));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (what.input < 0) {
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  } else {
    posix_spawn_file_actions_adddup2(&actions, what.input, 0);
  }
  posix_spawn_file_actions_adddup2(&actions, output->get(), 1);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  if (what.directory != ".")  // what confines a run does not let it change its folder
    posix_spawn_file_actions_addchdir_np(&actions, what.directory.c_str());
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  if (what.own_group) posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  int error = posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  // A folder of $PATH that is closed to this user makes it say EACCES of a program that is in none.
  if (error == EACCES && !program_exists(what.command.front())) error = ENOENT;
  if (error != 0) {
    return fail(what.command.front() + " could not be started: " + std::strerror(error));
  }
  return child;
}

int exit_status(int raw) noexcept {
  return WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
}

int wait_for(pid_t child) {
  int raw = 0;
  while (waitpid(child, &raw, 0) < 0) {
    if (errno != EINTR) return -1;
  }
  return exit_status(raw);
}

namespace {
std::atomic<bool> waived{false};
}  // namespace

void waive_time_limits() noexcept { waived.store(true); }

bool time_limits_are_waived() { return waived.load() || is_debugged(); }

bool is_debugged() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    int tracer = 0;
    if (key == "TracerPid:") return status >> tracer && tracer != 0;
  }
  return false;
}

}  // namespace tandem
