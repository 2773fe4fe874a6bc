// The studio's way in: HTTP and WebSocket, on one thread, for the clients of a hub.
// Layer: studio.  Thread: open, serve, end by main; answered() any; the rest is its own.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "studio/http_rules.hpp"
#include "studio/hub.hpp"

namespace tandem::studio {

/// Connections at once, HTTP and WebSocket together. A further one takes the place of
/// the one whose request is waited for longest; where there is none it gets status 503.
inline constexpr std::size_t kMostConnections = 64;
/// For a request: who takes longer to say it is closed.
inline constexpr std::chrono::seconds kRequestTime{5};
/// Without a port of the caller's the first free one from here is taken.
inline constexpr std::uint16_t kFirstPort = 8642, kLastPort = 8661;

class Server {
 public:
  /// Listens; nobody is answered yet.
  /// @param address  a number, or "localhost"
  /// @param port     empty: the first that is free, from kFirstPort to kLastPort; 0: any
  /// Errors: an address that is none, or not of this machine; a port that is taken.
  [[nodiscard]] static Result<std::unique_ptr<Server>> open(const std::string& address,
                                                            std::optional<std::uint16_t> port);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  [[nodiscard]] const Place& place() const;
  /// Starts the thread. Once. What is given is the thread's from now on, and outlives this.
  /// @param others  protocols beside the hub's
  void serve(Hub& hub, HttpRules rules, const std::vector<Protocol*>& others);
  /// The same without a run: pages alone.
  void serve(HttpRules rules);
  /// Any thread: the hub's asker has answers.
  void answered();
  /// Tells the clients that the run is over, closes them, and ends the thread.
  /// @param most  that is waited for them
  void end(const std::string& how, const std::string& log, std::chrono::milliseconds most);

  struct Impl;  ///< for the connections

 private:
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::studio
