// The folders and the kernel's table of sockets, searched for processes of this user.
#include "apps/clients/control_search.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "apps/transport/control_path.hpp"
#include "base/utf8.hpp"

namespace tandem::apps {
namespace {

/// The process that "<kind>-<pid>.sock" names.
std::optional<pid_t> owner_of(const std::string& name) {
  pid_t pid = 0;
  const char* end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data() + name.rfind('-') + 1, end, pid);
  const bool named = parsed.ec == std::errc() && std::string_view(parsed.ptr, end) == ".sock";
  return named && pid > 0 ? std::optional(pid) : std::nullopt;
}

bool owner_is_dead(const std::string& name) {
  const std::optional<pid_t> pid = owner_of(name);
  return pid && ::kill(*pid, 0) != 0 && errno == ESRCH;
}

std::string whole_text(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// "tandem run squat.toml": its arguments, without its program's folder. Empty: nobody says.
std::string command_line_of(pid_t pid) {
  constexpr std::size_t kMost = 120;
  std::string words = whole_text(fmt::format("/proc/{}/cmdline", pid));
  while (!words.empty() && words.back() == '\0') words.pop_back();
  const std::size_t program = words.substr(0, words.find('\0')).rfind('/');
  if (program != std::string::npos) words.erase(0, program + 1);
  for (char& c : words) {
    if (c == '\0' || c == '\n') c = ' ';
  }
  if (words.size() > kMost) words = std::string(whole_characters(words, kMost)) + "...";
  return words;
}

/// "tandem run"
std::string name_of(const std::string& kind) { return kind.empty() ? "tandem" : "tandem " + kind; }

bool is_of_kind(const std::string& name, const std::string& kind) {
  return name.ends_with(".sock") && (kind.empty() || name.starts_with(kind + "-"));
}

/// As default_control_path() makes them: outside of our own folders other programs have sockets.
bool is_our_name(const std::string& name) {
  return (name.starts_with("run-") || name.starts_with("emulate-")) && owner_of(name);
}

/// A search under way: the same socket may have several paths.
class Search {
 public:
  explicit Search(const std::string& kind) : kind_(kind) {}

  /// Every socket in `folder`, which nobody else may change.
  void look_in(const std::string& folder) {
    found_.looked.push_back(folder);
    std::error_code error;
    if (!std::filesystem::exists(std::filesystem::symlink_status(folder, error))) return;
    if (const Status ours = check_private_folder(folder); !ours) {
      found_.refused.push_back(ours.error());
      return;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      const std::string name = entry.path().filename().string();
      if (!is_of_kind(name, kind_) || !entry.is_socket(error)) continue;
      if (control_socket_alive(entry.path().string())) {
        add(entry.path().string());
      } else if (owner_is_dead(name)) {
        ::unlink(entry.path().c_str());
      }
    }
  }
  /// What listens under such a name in any other folder that nobody else may change.
  void look_at_table(const std::string& file) {
    found_.looked.push_back(file);
    for (const std::string& path : listening_paths(whole_text(file))) {
      const std::filesystem::path place(path);
      const std::string name = place.filename().string();
      if (!is_of_kind(name, kind_) || !is_our_name(name)) continue;
      if (check_private_folder(place.parent_path().string())) add(path);
    }
  }
  [[nodiscard]] ControlSearch give() {
    std::ranges::sort(found_.sockets);
    return std::move(found_);
  }

 private:
  void add(const std::string& path) {
    struct stat found {};
    if (::stat(path.c_str(), &found) != 0 || !S_ISSOCK(found.st_mode)) return;
    if (known_.emplace(found.st_dev, found.st_ino).second) found_.sockets.push_back(path);
  }

  std::string kind_;
  ControlSearch found_;
  std::set<std::pair<dev_t, ino_t>> known_;
};

}  // namespace

ControlSearch search_control_sockets(const std::string& kind) {
  Search search(kind);
  for (const std::string& folder : control_folders()) search.look_in(folder);
  if (!one_control_folder()) search.look_at_table("/proc/net/unix");
  return search.give();
}

std::vector<std::string> running_control_sockets(const std::string& kind) {
  return search_control_sockets(kind).sockets;
}

std::string process_of(const std::string& path) {
  const std::optional<pid_t> pid = owner_of(std::filesystem::path(path).filename().string());
  if (!pid) return path;
  const std::string command = command_line_of(*pid);
  if (command.empty()) return fmt::format("process {}", *pid);
  return fmt::format("{} (process {})", command, *pid);
}

Result<std::vector<std::string>> find_control_sockets(const std::string& kind) {
  ControlSearch found = search_control_sockets(kind);
  if (!found.sockets.empty()) return std::move(found.sockets);
  const std::string own = control_folder();
  for (const Error& refused : found.refused) {
    if (refused.message.starts_with(own + " ")) return std::unexpected(refused);
  }
  return fail(fmt::format("no running `{}` in {}", name_of(kind), fmt::join(found.looked, ", ")),
              "start one, or name its socket with --socket");
}

Result<std::string> find_control_socket(const std::string& path, const std::string& kind) {
  if (!path.empty()) return path;
  const Result<std::vector<std::string>> running = find_control_sockets(kind);
  if (!running) return std::unexpected(running.error());
  if (running->size() == 1) return running->front();
  std::string list;
  for (const std::string& one : *running) {
    list += fmt::format("\n  --socket {}  {}", one, process_of(one));
  }
  return fail(
      fmt::format("{} running `{}`, and none of them was asked", running->size(), name_of(kind)),
      "say which:" + list);
}

}  // namespace tandem::apps
