// The name of a draft is known to a signal handler, which removes it by system calls alone.
#include "apps/text/draft.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <climits>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/open_file.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::array kEnds{SIGINT, SIGTERM, SIGHUP};
char drafted[PATH_MAX];             // for the handler; empty: nothing
char farewell[3 * PATH_MAX + 128];  // what it says then

/// Removes a file, or a folder with all in it. Safe in a signal handler.
void remove_entry(int folder, const char* name) {
  constexpr int kTries = 10;  // somebody may be writing into it
  if (::unlinkat(folder, name, 0) == 0) return;
  for (int i = 0; i < kTries && ::unlinkat(folder, name, AT_REMOVEDIR) != 0; ++i) {
    const int fd = ::openat(folder, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) return;
    alignas(dirent64) std::array<char, 2048> entries;
    for (long n = 0; (n = ::syscall(SYS_getdents64, fd, entries.data(), entries.size())) > 0;) {
      for (long at = 0; at < n;) {
        const auto* const entry = reinterpret_cast<const dirent64*>(&entries[std::size_t(at)]);
        const char* const one = entry->d_name;
        const bool itself = one[0] == '.' && (one[1] == 0 || (one[1] == '.' && one[2] == 0));
        if (!itself) remove_entry(fd, one);
        at += entry->d_reclen;
      }
    }
    ::close(fd);
  }
}

void on_end(int signal) {
  if (drafted[0] != 0) {
    remove_entry(AT_FDCWD, drafted);
    (void)!::write(STDERR_FILENO, farewell, std::strlen(farewell));
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// Ends wait, as long as it lives: a draft is made, and known to the handler, or neither.
class EndsWait {
 public:
  EndsWait() {
    sigset_t ends;
    ::sigemptyset(&ends);
    for (const int signal : kEnds) ::sigaddset(&ends, signal);
    ::pthread_sigmask(SIG_BLOCK, &ends, &before_);
  }
  ~EndsWait() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  EndsWait(const EndsWait&) = delete;
  EndsWait& operator=(const EndsWait&) = delete;

 private:
  sigset_t before_{};
};

void copy_text(const std::string& text, std::span<char> out) {
  const std::size_t size = text.size() < out.size() ? text.size() : 0;
  std::copy_n(text.data(), size, out.data());
  out[size] = 0;
}

/// From now on what stands in `path` does not outlive the process. Empty: no more.
/// @param words  what the end then says
void remember(const std::string& path, const std::string& words = {}) {
  const bool fits = path.size() < sizeof drafted;
  for (const int signal : kEnds) {
    using Action = struct sigaction;
    Action now{}, next{};
    ::sigaction(signal, nullptr, &now);
    const bool ours = now.sa_handler == on_end;
    if (!ours && now.sa_handler != SIG_DFL) continue;  // ignored, or somebody waits for it
    next.sa_handler = path.empty() ? SIG_DFL : on_end;
    if (path.empty()) ::sigaction(signal, &next, nullptr);
    if (path.empty() || !fits) continue;
    drafted[0] = 0;
    ::sigaction(signal, &next, nullptr);
  }
  copy_text("\ninterrupted: " + words + "\n", farewell);
  copy_text(path, drafted);
}

constexpr std::string_view kMark = ".new-";
std::string suffix() { return std::string(kMark) + std::to_string(::getpid()); }

/// A process other than this one. One of another user is there, too.
bool is_alive(pid_t process) {
  return process != ::getpid() && (::kill(process, 0) == 0 || errno == EPERM);
}

/// The number at the beginning of `text`, as std::to_string() writes it; 0: there is none. Cuts it
/// off.
pid_t take_process(std::string_view& text) {
  pid_t process = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), process);
  const bool ours =
      read.ec == std::errc{} && process > 0 && text.starts_with(std::to_string(process));
  text.remove_prefix(ours ? static_cast<std::size_t>(read.ptr - text.data()) : 0);
  return ours ? process : 0;
}

/// Whether nobody has it locked, as the writer of a folder does, in another PID namespace, too.
bool is_free(const fs::path& draft) {
  const int fd = ::open(draft.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (fd < 0) return errno == ENOTDIR;  // a file has no lock
  const bool free = ::flock(fd, LOCK_EX | LOCK_NB) == 0;
  ::close(fd);
  return free;
}

/// Removes drafts of the same name whose process is gone: of an earlier one with our number, too.
/// @param removes  kAnyNumber: of names with other digits before the mark, too
void remove_left(const fs::path& draft, Draft::Removes removes = Draft::Removes::kSameName) {
  constexpr std::string_view kDigits = "0123456789";
  const bool any_number = removes == Draft::Removes::kAnyNumber;
  const std::string name = draft.filename().string();
  const std::size_t at = name.rfind(suffix());
  std::string begin = name.substr(0, at);
  const std::string end = name.substr(at + suffix().size());
  if (any_number) begin.erase(begin.find_last_not_of(kDigits) + 1);
  std::error_code ignored;
  const fs::path folder = draft.has_parent_path() ? draft.parent_path() : ".";
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const std::string one = entry.path().filename().string();
    std::string_view rest = one;
    if (!rest.starts_with(begin)) continue;
    rest.remove_prefix(begin.size());
    if (any_number) rest.remove_prefix(std::min(rest.find_first_not_of(kDigits), rest.size()));
    if (!rest.starts_with(kMark)) continue;
    rest.remove_prefix(kMark.size());
    const pid_t process = take_process(rest);
    if (process == 0 || rest != end) continue;
    if (!is_alive(process) && is_free(entry.path())) left.push_back(entry.path());
  }
  for (const fs::path& one : left) fs::remove_all(one, ignored);
}

std::unexpected<Error> problem_of(std::string what, const std::error_code& problem,
                                  const std::string& file) {
  return std::unexpected(Error{std::move(what) + ": " + problem.message(),
                               "check the path, its permissions and the disk's free space",
                               file,
                               0,
                               {}});
}

/// First of the missing folders above a path that is not there, or the path when none is missing.
fs::path first_missing(fs::path path) {
  std::error_code problem;
  while (path.has_relative_path() && !fs::exists(path.parent_path(), problem))
    path = path.parent_path();
  return path;
}

/// What somebody has put there is no draft of ours.
std::error_code make_new(const fs::path& folder) {
  return ::mkdir(folder.c_str(), 0777) == 0 ? std::error_code()
                                            : std::error_code(errno, std::generic_category());
}

/// From one folder into another, whatever their names lead to by then.
Status move_file(const fs::path& from, const fs::path& to) {
  const auto folder_of = [](const fs::path& file) {
    return open_folder(file.has_parent_path() ? file.parent_path().string() : ".");
  };
  const Result<Descriptor> source = folder_of(from), target = folder_of(to);
  const auto fails = [&](const std::string& why) {
    return std::unexpected(Error{"the file cannot be written: " + why,
                                 "check the path, its permissions and the disk's free space",
                                 to.string(),
                                 0,
                                 {}});
  };
  if (!source) return fails(source.error().message);
  if (!target) return fails(target.error().message);
  const int failed =
      ::renameat(source->get(), from.filename().c_str(), target->get(), to.filename().c_str());
  return failed == 0 ? Status() : fails(std::strerror(errno));
}

}  // namespace

Draft::Draft(std::string final, fs::path root, std::string path, const std::string& interrupted)
    : final_(std::move(final)), root_(std::move(root)), path_(std::move(path)) {
  remember(root_.string(), interrupted.empty() ? "nothing was written to " + final_ : interrupted);
}

Draft::Draft(Draft&& other) noexcept
    : final_(std::move(other.final_)),
      root_(std::exchange(other.root_, {})),
      path_(std::move(other.path_)),
      lock_(std::exchange(other.lock_, -1)) {}

Draft::~Draft() {
  if (!root_.empty()) remove();
}

void Draft::remove() {
  std::error_code ignored;
  fs::remove_all(root_, ignored);
  root_.clear();
  remember({});
  if (lock_ >= 0) ::close(std::exchange(lock_, -1));
}

void Draft::lock() {
  lock_ = ::open(root_.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (lock_ >= 0) ::flock(lock_, LOCK_SH | LOCK_NB);
}

Result<Draft> Draft::folder(const std::string& final, Removes removes,
                            const std::string& interrupted) {
  std::error_code problem;
  fs::path whole = fs::absolute(final).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // a slash at the end
  if (fs::exists(whole, problem) && !fs::is_directory(whole, problem)) {
    return std::unexpected(
        Error{"this is a file, and a folder is needed", "name another folder", final, 0, {}});
  }
  fs::path root = whole / suffix(), path = root;
  remove_left(whole.string() + suffix(), removes);  // made when the folder was not there
  if (!fs::exists(whole, problem)) {
    const fs::path first = first_missing(whole);
    root = first.string() + suffix();
    path = (root / whole.lexically_relative(first)).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();
  }
  remove_left(root);
  std::optional<EndsWait> waiting(std::in_place);
  if (problem = make_new(root); problem) {
    return problem_of("the folder cannot be made", problem, final);
  }
  Draft draft(final, root, path.string(), interrupted);
  waiting.reset();
  fs::create_directories(path, problem);
  if (problem) return problem_of("the folder cannot be made", problem, final);
  draft.lock();
  return draft;
}

Draft Draft::file(const std::string& final) {
  std::error_code problem;
  const fs::path place(final);
  const fs::file_status there = fs::symlink_status(place, problem);
  const std::string folder = place.has_parent_path() ? place.parent_path().string() : ".";
  const bool beside = fs::is_regular_file(there) && ::access(folder.c_str(), W_OK) == 0;
  if (fs::exists(there) && !beside) return {final, {}, final};  // as /dev/null
  if (!fs::exists(folder, problem)) {
    const fs::path whole = fs::absolute(place).lexically_normal();
    const fs::path first = first_missing(whole);
    const fs::path root = first.string() + suffix();
    const fs::path path = root / whole.lexically_relative(first);
    remove_left(root);
    const EndsWait waiting;
    problem = make_new(root);  // who writes to it finds out
    Draft in_folder(final, problem ? fs::path() : root, path.string());
    if (!problem) fs::create_directories(path.parent_path(), problem);
    in_folder.lock();
    return in_folder;
  }
  fs::path draft = place.parent_path() / place.stem();
  draft += suffix() + place.extension().string();
  remove_left(draft);
  return {final, draft, draft.string()};
}

std::string Draft::placed(std::string text) const {
  for (std::size_t at = 0; (at = text.find(path_, at)) != std::string::npos; at += final_.size())
    text.replace(at, path_.size(), final_);
  return text;
}

Error Draft::placed(Error error) const {
  for (std::string* text : {&error.file, &error.message, &error.hint}) *text = placed(*text);
  return error;
}

Status Draft::place(const Before& before) {
  std::error_code problem;
  if (root_.empty()) return {};
  std::vector<std::pair<fs::path, fs::path>> moves;  // from, to
  if (fs::is_directory(path_, problem)) {
    for (const auto& entry : fs::recursive_directory_iterator(path_)) {
      if (!entry.is_directory())
        moves.emplace_back(entry.path(), final_ / entry.path().lexically_relative(path_));
    }
    std::ranges::sort(moves);
  } else {
    moves.emplace_back(path_, final_);
  }
  for (const auto& [from, to] : moves) {
    if (to.has_parent_path()) fs::create_directories(to.parent_path(), problem);
    if (Status ready = before ? before(to, from) : Status{}; !ready) return ready;
    if (Status moved = move_file(from, to); !moved) return moved;
  }
  remove();
  return {};
}

}  // namespace tandem::apps
