// The name of a draft is known to a signal handler, which removes it by system calls alone.
#include "apps/text/draft.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstddef>
#include <utility>
#include <vector>

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::array kEnds{SIGINT, SIGTERM, SIGHUP};
char drafted[PATH_MAX];  // for the handler; empty: nothing

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
  if (drafted[0] != 0) remove_entry(AT_FDCWD, drafted);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

/// From now on what stands in `path` does not outlive the process. Empty: no more.
void remember(const std::string& path) {
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
  const std::size_t size = fits ? path.size() : 0;
  std::copy_n(path.data(), size, drafted);
  drafted[size] = 0;
}

std::string suffix() { return ".new-" + std::to_string(::getpid()); }

std::unexpected<Error> problem_of(std::string what, const std::error_code& problem,
                                  const std::string& file) {
  return std::unexpected(Error{std::move(what) + ": " + problem.message(),
                               "check the path, its permissions and the disk's free space",
                               file,
                               0,
                               {}});
}

}  // namespace

Draft::Draft(std::string final, fs::path root, std::string path)
    : final_(std::move(final)), root_(std::move(root)), path_(std::move(path)) {
  remember(root_.string());
}

Draft::Draft(Draft&& other) noexcept
    : final_(std::move(other.final_)),
      root_(std::exchange(other.root_, {})),
      path_(std::move(other.path_)) {}

Draft::~Draft() {
  if (!root_.empty()) remove();
}

void Draft::remove() {
  std::error_code ignored;
  fs::remove_all(root_, ignored);
  root_.clear();
  remember({});
}

Result<Draft> Draft::folder(const std::string& final) {
  std::error_code problem;
  fs::path whole = fs::absolute(final).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();  // a slash at the end
  if (fs::exists(whole, problem) && !fs::is_directory(whole, problem)) {
    return std::unexpected(
        Error{"this is a file, and a folder is needed", "name another folder", final, 0, {}});
  }
  fs::path root = whole / suffix(), path = root;
  if (!fs::exists(whole, problem)) {
    fs::path first = whole;  // of what is missing
    while (first.has_relative_path() && !fs::exists(first.parent_path(), problem))
      first = first.parent_path();
    root = first.string() + suffix();
    path = (root / whole.lexically_relative(first)).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();
  }
  Draft draft(final, root, path.string());
  fs::create_directories(path, problem);
  if (problem) return problem_of("the folder cannot be made", problem, final);
  return draft;
}

Draft Draft::file(const std::string& final) {
  std::error_code problem;
  const fs::path place(final);
  const fs::file_status there = fs::symlink_status(place, problem);
  const std::string folder = place.has_parent_path() ? place.parent_path().string() : ".";
  const bool beside = fs::is_regular_file(there) && ::access(folder.c_str(), W_OK) == 0;
  if (fs::exists(there) && !beside) return {final, {}, final};  // as /dev/null
  fs::path draft = place.parent_path() / place.stem();
  draft += suffix() + place.extension().string();
  return {final, draft, draft.string()};
}

std::string Draft::placed(const std::string& file) const {
  if (!file.starts_with(path_)) return file;
  return final_ + file.substr(path_.size());
}

Error Draft::placed(Error error) const {
  error.file = placed(error.file);
  return error;
}

Status Draft::place(const Before& before) {
  std::error_code problem;
  if (root_.empty()) return {};
  std::vector<std::pair<fs::path, fs::path>> moves;  // from, to
  if (fs::is_directory(root_, problem)) {
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
    fs::rename(from, to, problem);
    if (problem) return problem_of("the file cannot be written", problem, to.string());
  }
  remove();
  return {};
}

}  // namespace tandem::apps
