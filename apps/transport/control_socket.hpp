// The Unix-domain socket of a running process: a line of JSON in, a line of JSON out.
// Layer: apps/transport.  Thread: open/close main; one of its own talks, one for each turn answers.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "apps/control/control_registry.hpp"
#include "apps/control/turns.hpp"
#include "apps/transport/control_listener.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// Longest question [bytes], its end of line included.
inline constexpr std::size_t kMaxControlLine = kMaxQuestion + 1;
/// Clients at once. A further one takes the place of the one that has been quiet the longest, so
/// that an emergency stop always finds its way in.
inline constexpr std::size_t kMaxControlClients = 16;
/// The answer to the one that goes; it was not asked for anything.
inline constexpr char kTooManyClients[] = "16 clients are there already";
static_assert(kMaxControlClients == 16);

/// Serves a registry until it is destroyed, and the file with it, or until end(). Nothing that a
/// client does or leaves undone reaches the process: a client that sends a line that is too long,
/// that does not read its answers, or that is gone, is closed. What such a client asked for and has
/// not begun is dropped, unless it stops the robot. A client's questions are answered in order; one
/// whose turn is urgent waits for no other client's: who talks answers nothing itself, reads what a
/// new client has sent as it comes in, and parses kMaxUrgentQuestion bytes of a question at most.
class ControlSocket {
 public:
  /// @param registry  complete; outlives the socket
  /// Errors: of ControlListener::open(); no descriptors are left.
  [[nodiscard]] static Result<std::unique_ptr<ControlSocket>> open(const std::string& path,
                                                                   const ControlRegistry& registry);
  /// At the place of the one before: who waits there is served now.
  [[nodiscard]] static Result<std::unique_ptr<ControlSocket>> open(
      std::unique_ptr<ControlListener> listener, const ControlRegistry& registry);
  /// Serves no more, and keeps the place: who connects from now on waits for who serves next.
  /// @return the place; null of null
  [[nodiscard]] static std::unique_ptr<ControlListener> end(std::unique_ptr<ControlSocket> socket);
  ~ControlSocket();
  ControlSocket(const ControlSocket&) = delete;
  ControlSocket& operator=(const ControlSocket&) = delete;

  [[nodiscard]] const std::string& path() const noexcept { return listener_->path(); }

 private:
  struct Client;
  ControlSocket(std::unique_ptr<ControlListener> listener, const ControlRegistry& registry);
  void serve();
  void stop_serving(bool for_good);
  bool accept();
  static void send_away(Client& client);
  void take(Client& client);
  void answer_lines(Client& client);
  static void flush(Client& client);
  void hand_over(Client& client, std::string question);
  void drop_gone();
  void deliver();

  const ControlRegistry* registry_;
  std::unique_ptr<ControlListener> listener_;
  int wake_ = -1;             // eventfd: the end's word to the thread
  std::uint64_t turn_ = 0;    // counts what clients do, to know who has been quiet
  std::uint64_t newest_ = 0;  // client's number
  std::vector<std::unique_ptr<Client>> clients_;

  int done_ = -1;  // eventfd: to the thread that talks, "turns_ has answers"
  std::unique_ptr<ControlTurns> turns_;
  std::atomic<bool> ending_{false};

  std::thread thread_;
};

/// How a process takes questions over a socket.
struct ControlSocketOptions {
  std::string path;     ///< empty: the default one of `kind`
  std::string kind;     ///< "run", "emulate"
  bool wanted = true;   ///< false: none is opened
  bool needed = false;  ///< a robot moves: without a way to stop it nothing starts
  std::unique_ptr<ControlListener> listener{};  ///< of the one that served before, at `path`
};

/// Serves `registry`; null when no socket is wanted, or when it cannot be opened and is not needed,
/// which is said on standard error. Errors: a socket that is needed, or whose path was named, and
/// that cannot be opened; a path that was named in a folder that others may change.
[[nodiscard]] Result<std::unique_ptr<ControlSocket>> serve(const ControlRegistry& registry,
                                                           ControlSocketOptions options);

}  // namespace tandem::apps
