// What clients of a WebSocket and the server say to each other, without a network: the server
// serves several of these at one port, by the subprotocol that a client offers.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tandem::studio {

/// A WebSocket's message to a client.
struct Frame {
  bool binary = false;
  std::shared_ptr<const std::string> bytes;
};

/// Why the server closes a connection: WebSocket's numbers.
enum class Close : std::uint16_t { kNot = 0, kGoingAway = 1001, kPolicy = 1008 };

inline constexpr std::size_t kMostFromClient = 64 * 1024;  ///< bytes of one message
inline constexpr int kMostBad = 20;                        ///< bad messages in a row

class Protocol {
 public:
  using Clock = std::chrono::steady_clock;
  using ClientNumber = std::uint64_t;

  virtual ~Protocol() = default;
  /// Its subprotocols.
  [[nodiscard]] virtual std::span<const std::string_view> names() const = 0;
  [[nodiscard]] virtual std::size_t most_clients() const = 0;
  [[nodiscard]] virtual std::size_t clients() const = 0;

  /// @param name  for others to read: its address
  [[nodiscard]] virtual ClientNumber connect(std::string name) = 0;
  virtual void disconnect(ClientNumber number) = 0;
  /// A whole message.
  virtual void receive(ClientNumber number, std::string_view message, bool binary,
                       Clock::time_point now) = 0;
  /// Thirty times a second.
  virtual void tick(Clock::time_point now) = 0;
  /// The run is over.
  virtual void end(std::string_view how, std::string_view log) = 0;

  [[nodiscard]] virtual std::optional<Frame> next(ClientNumber number) = 0;
  /// Whether the connection is to be closed once next() has nothing more.
  [[nodiscard]] virtual Close closing(ClientNumber number) const = 0;
  /// Whether so much waits to be sent that nothing more is to be read.
  [[nodiscard]] virtual bool is_behind(ClientNumber number) const = 0;
};

}  // namespace tandem::studio
