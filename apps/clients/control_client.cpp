#include "apps/clients/control_client.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>

#include "apps/clients/dds_client.hpp"
#include "apps/control/control_registry.hpp"
#include "apps/text/json_reader.hpp"
#include "apps/transport/control_path.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

/// 0, or the errno of what went wrong.
int connect_to(const Descriptor& descriptor, const sockaddr_un& address,
               std::chrono::milliseconds patience) {
  if (descriptor.get() < 0) return errno;
  // A process that is stopped accepts nobody: once enough wait before us, connect() waits, too.
  const timeval wait{.tv_sec = patience / 1s, .tv_usec = patience % 1s / 1us};
  (void)::setsockopt(descriptor.get(), SOL_SOCKET, SO_SNDTIMEO, &wait, sizeof wait);
  const auto* raw = reinterpret_cast<const sockaddr*>(&address);
  return ::connect(descriptor.get(), raw, sizeof address) == 0 ? 0 : errno;
}

/// Whoever listens must be this user, or root. Root may ask anybody's process when it names it, and
/// nobody else may have put another one in its place.
Status check_listener(int descriptor, const std::string& path) {
  const std::int64_t user = peer_user(descriptor);
  const bool named = std::filesystem::path(path).parent_path() != control_folder();
  const bool trusted = user == ::geteuid() || user == 0 || (::geteuid() == 0 && named && user >= 0);
  if (trusted) {
    return named ? check_socket_folder(path, static_cast<uid_t>(user)) : Status{};
  }
  return fail(fmt::format("what listens at {} belongs to user {}, not to you: nothing was asked",
                          path, user),
              "name your own run's socket with --socket, or stop the robot by its own means");
}

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

/// "tandem run squat.toml": its arguments, without its program's folder. Empty: nobody says.
std::string command_line_of(pid_t pid) {
  constexpr std::size_t kMost = 120;
  std::ifstream file(fmt::format("/proc/{}/cmdline", pid), std::ios::binary);
  std::string words{std::istreambuf_iterator<char>(file), {}};
  while (!words.empty() && words.back() == '\0') words.pop_back();
  const std::size_t program = words.substr(0, words.find('\0')).rfind('/');
  if (program != std::string::npos) words.erase(0, program + 1);
  for (char& c : words) {
    if (c == '\0' || c == '\n') c = ' ';
  }
  if (words.size() > kMost) words = words.substr(0, kMost) + "...";
  return words;
}

Error no_answer(std::chrono::milliseconds patience) {
  return {.message = fmt::format("no answer within {:g} s", patience / 1.0s),
          .hint = patience == kStopAnswer
                      ? "a process that was stopped carries the stop out when "
                        "it continues; until then stop the robot by its own stop "
                        "circuit"
                      : "is the process stopped, or very busy?",
          .file = {},
          .key = {}};
}

/// Sends all of `out`, then receives up to the end of a line, both in `patience` from now on.
Result<std::string> exchange(int fd, std::string out, std::chrono::milliseconds patience) {
  const auto deadline = SteadyClock::now() + patience;
  std::string in;
  while (!in.ends_with('\n')) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - SteadyClock::now());
    pollfd watched{fd, static_cast<short>(out.empty() ? POLLIN : POLLOUT), 0};
    const int ready =
        ::poll(&watched, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return std::unexpected(no_answer(patience));
    char bytes[4096];
    const ssize_t count = out.empty()
                              ? ::recv(fd, bytes, sizeof bytes, MSG_DONTWAIT)
                              : ::send(fd, out.data(), out.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (count <= 0) return fail("the process closed the connection", "look at what it printed");
    if (out.empty()) {
      in.append(bytes, static_cast<std::size_t>(count));
    } else {
      out.erase(0, static_cast<std::size_t>(count));
    }
  }
  return in;
}

/// "tandem run"
std::string name_of(const std::string& kind) { return kind.empty() ? "tandem" : "tandem " + kind; }

/// A process that ends in order removes its socket; one that is killed leaves it.
bool has_ended(const std::string& path) {
  std::error_code error;
  return !std::filesystem::exists(path, error);
}

Error ended() {
  return {.message = "the run has ended",
          .hint = "its own output and its log say how",
          .file = {},
          .key = {}};
}

class SocketClient : public ControlClient {
 public:
  explicit SocketClient(std::string path) : path_(std::move(path)) {}
  Result<Json> ask(const Json& question) override {
    Result<Json> answer = apps::ask(path_, question);
    if (!answer && heard_ && has_ended(path_)) return std::unexpected(ended());
    heard_ = heard_ || answer;
    return answer;
  }

 private:
  std::string path_;
  bool heard_ = false;
};

}  // namespace

std::chrono::milliseconds answer_time(const Json& question) {
  return question.value("do", "") == "estop" ? kStopAnswer : 5000ms;
}

std::vector<std::string> running_control_sockets(const std::string& kind) {
  std::vector<std::string> found;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(control_folder(), error)) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".sock") || !entry.is_socket(error)) continue;
    if (!kind.empty() && !name.starts_with(kind + "-")) continue;
    if (control_socket_alive(entry.path().string())) {
      found.push_back(entry.path().string());
    } else if (owner_is_dead(name)) {
      ::unlink(entry.path().c_str());
    }
  }
  std::ranges::sort(found);
  return found;
}

std::string process_of(const std::string& path) {
  const std::optional<pid_t> pid = owner_of(std::filesystem::path(path).filename().string());
  if (!pid) return path;
  const std::string command = command_line_of(*pid);
  if (command.empty()) return fmt::format("process {}", *pid);
  return fmt::format("{} (process {})", command, *pid);
}

Result<std::vector<std::string>> find_control_sockets(const std::string& kind) {
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(control_folder(), error))) {
    if (const Status ours = check_private_folder(control_folder()); !ours) {
      return std::unexpected(ours.error());
    }
  }
  std::vector<std::string> running = running_control_sockets(kind);
  if (!running.empty()) return running;
  return fail(fmt::format("no running `{}` in {}", name_of(kind), control_folder()),
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

Result<Json> ask(const std::string& path, const Json& question) {
  const Result<sockaddr_un> address = control_address(path);
  if (!address) return std::unexpected(address.error());
  const Descriptor descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const std::chrono::milliseconds patience = answer_time(question);
  const int error = connect_to(descriptor, *address, patience);
  if (error == EAGAIN) return std::unexpected(no_answer(patience));
  if (error != 0) {
    return fail(fmt::format("no process listens at {}: {}", path, std::strerror(error)),
                "is the process running?");
  }
  if (const Status ours = check_listener(descriptor.get(), path); !ours) {
    return std::unexpected(ours.error());
  }
  const Result<std::string> line = exchange(descriptor.get(), json_text(question) + "\n", patience);
  if (!line) return std::unexpected(has_ended(path) ? ended() : line.error());
  return read_answer(*line, "what listens at " + path);
}

Result<Json> read_answer(std::string_view text, const std::string& who) {
  Result<Json> answer = read_json_object(text);
  const auto text_of = [&](const char* key) {
    return answer->contains(key) && (*answer)[key].is_string() ? (*answer)[key].get<std::string>()
                                                               : std::string();
  };
  if (!answer || !answer->contains("ok") || !(*answer)["ok"].is_boolean()) {
    return fail(who + " is no tandem", "name another one with --socket");
  }
  if ((*answer)["ok"].get<bool>()) return answer;
  const std::string error = text_of("error");
  return fail(error.empty() ? "refused" : error, text_of("hint"));
}

Result<std::unique_ptr<ControlClient>> ControlClient::open(const ControlTarget& target,
                                                           const std::string& kind) {
  if (target.dds) return open_dds_client(target);
  const Result<std::string> path = find_control_socket(target.socket, kind);
  if (!path) return std::unexpected(path.error());
  return std::make_unique<SocketClient>(*path);
}

Result<Json> ask(const ControlTarget& target, const std::string& kind, const Json& question) {
  const auto client = ControlClient::open(target, kind);
  if (!client) return std::unexpected(client.error());
  return (*client)->ask(question);
}

}  // namespace tandem::apps
