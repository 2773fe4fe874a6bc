#include "apps/clients/control_client.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <thread>

#include "apps/clients/dds_client.hpp"
#include "apps/control/command_rows.hpp"
#include "apps/control/control_registry.hpp"
#include "apps/text/json_reader.hpp"
#include "apps/transport/control_path.hpp"
#include "apps/transport/control_socket.hpp"
#include "base/open_file.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr char kClosed[] = "the process closed the connection";
constexpr char kEnded[] = "the run has ended";
/// Whose place others took before it was read stops the robot the next time.
constexpr int kStopTries = 20;

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

Error no_answer(std::chrono::milliseconds patience) {
  return {.message = fmt::format("{} {:g} s", kNoAnswer, patience / 1.0s),
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
    if (ready < 0 && errno == EINTR && rt::stop_requested()) {
      return fail("interrupted before the answer came", "ask again");
    }
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return std::unexpected(no_answer(patience));
    char bytes[4096];
    const ssize_t count = out.empty()
                              ? ::recv(fd, bytes, sizeof bytes, MSG_DONTWAIT)
                              : ::send(fd, out.data(), out.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (count <= 0 && !out.empty()) {  // it takes no more, and may have said why
      out.clear();
      continue;
    }
    if (count <= 0) return fail(kClosed, "look at what it printed");
    if (out.empty()) {
      in.append(bytes, static_cast<std::size_t>(count));
    } else {
      out.erase(0, static_cast<std::size_t>(count));
    }
  }
  return in;
}

/// A process that ends in order removes its socket; one that is killed leaves it.
bool has_ended(const std::string& path) {
  std::error_code error;
  return !std::filesystem::exists(path, error);
}

Error ended() {
  return {.message = kEnded, .hint = "its own output and its log say how", .file = {}, .key = {}};
}

/// Whether a socket is there again within a second: of a run that begins where another one ended.
bool comes_back(const std::string& path) {
  for (int tries = 0; has_ended(path); ++tries) {
    if (tries == 20) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

Result<Json> ask_once(const std::string& path, const Json& question) {
  const Result<sockaddr_un> address = control_address(path);
  if (!address) return std::unexpected(address.error());
  const Descriptor descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const std::chrono::milliseconds patience = answer_time(question);
  const int error = connect_to(descriptor, *address, patience);
  if (error == EAGAIN) return std::unexpected(no_answer(patience));
  if (error != 0) {
    if (error == EACCES) {
      return fail(fmt::format("the socket {} is another user's: {}", path, std::strerror(error)),
                  "only who runs the process, and root, may ask it");
    }
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
  const CommandRow* row = command_row(question.value("do", ""));
  return std::chrono::seconds(row == nullptr ? CommandRow::More().answer_s : row->more.answer_s);
}

Result<Json> ask(const std::string& path, const Json& question) {
  const int tries = question.value("do", "") == "estop" ? kStopTries : 1;
  for (int left = tries;; --left) {
    Result<Json> answer = ask_once(path, question);
    if (answer || left == 1) return answer;
    const std::string& why = answer.error().message;
    if (why == kEnded ? !comes_back(path) : why != kClosed && why != kTooManyClients) return answer;
  }
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
