// The studio's protocol, without a network: clients come and go, say something, and get frames.
// docs/studio.md has the protocol.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "apps/text/console.hpp"
#include "studio/feed.hpp"
#include "studio/messages.hpp"
#include "studio/outbox.hpp"
#include "studio/protocol.hpp"
#include "studio/sampler.hpp"

namespace tandem::studio {

inline constexpr std::size_t kMostClients = 32;
inline constexpr std::size_t kMostSubscribed = 4096;
inline constexpr std::size_t kMostWindowSignals = 256;
inline constexpr std::size_t kMostWindowNumbers = 500'000;  ///< of one answer
inline constexpr std::size_t kMostWaiting = 16;             ///< questions of one client
inline constexpr std::size_t kMostEvents = 1000;

class Hub final : public Protocol {
 public:
  static constexpr std::chrono::milliseconds kAlive{1000}, kWatch{250}, kRepeat{500};

  struct Options {
    std::string token;  ///< 32 hexadecimal digits
    bool open = true;   ///< who has not entered may look
  };
  /// All outlive it.
  Hub(const RunDescription& run, Sampler& sampler, Options options)
      : run_(&run), sampler_(&sampler), options_(std::move(options)) {}

  /// From now on questions are asked.
  void start(Feed feed, Asker asker);

  [[nodiscard]] std::span<const std::string_view> names() const override { return kNames; }
  [[nodiscard]] std::size_t most_clients() const override { return kMostClients; }
  [[nodiscard]] std::size_t clients() const override { return clients_.size(); }
  [[nodiscard]] ClientNumber connect(std::string name) override;
  void disconnect(ClientNumber number) override;
  /// @param binary  clients send none: it is answered as an error
  void receive(ClientNumber number, std::string_view message, bool binary,
               Clock::time_point now) override;
  /// Takes what the run has, and gives each client its tick.
  void tick(Clock::time_point now) override;
  /// Hands out what has been answered.
  void take_answers();
  void end(std::string_view how, std::string_view log) override;

  [[nodiscard]] std::optional<Frame> next(ClientNumber number) override;
  [[nodiscard]] Close closing(ClientNumber number) const override;
  [[nodiscard]] bool is_behind(ClientNumber number) const override;

 private:
  static constexpr std::string_view kNames[] = {kSubprotocol};
  struct Client {
    std::string name;
    Outbox out;
    bool token = false;
    bool greeted = false;
    Close close = Close::kNot;
    int bad = 0;  // messages in a row
    std::size_t asked = 0;
    std::uint32_t revision = 0;
    std::vector<SignalId> signals;
    bool repeats = false;  // the next tick comes whether or not a cycle has
    std::set<std::string> watched;
  };
  struct Watched {
    std::int64_t number = 0;  // of its questions
    std::string answer;
    bool asked = false;
    Clock::time_point due;
  };
  using Handler = void (Hub::*)(ClientNumber, Client&, const apps::Json&, Clock::time_point);

  void greet(ClientNumber number, Client& client);
  void refuse(Client& client, std::string_view message, std::string_view hint);
  void bad(Client& client, std::string_view message, std::string_view hint);
  void on_enter(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  void on_subscribe(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  void on_window(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  void on_ask(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  void on_watch(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  void on_control(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  void on_alive(ClientNumber, Client&, const apps::Json&, Clock::time_point);
  [[nodiscard]] bool all_known(Client& client, const apps::Json& list, std::size_t most,
                               std::vector<SignalId>& signals);
  void tell_control(bool went_back = false);
  void end_control(std::string_view why, bool halts = true);
  void tell(const std::vector<Event>& events);
  void tell_back(const TimeBack& back);
  [[nodiscard]] std::vector<Event> what_happened(std::vector<Event> told);
  void give_ticks(Clock::time_point now);
  void ask_watched(Clock::time_point now);
  void give(const Answer& answer);

  const RunDescription* run_;
  Sampler* sampler_;
  Options options_;
  Feed feed_;
  Asker asker_;
  std::map<ClientNumber, Client> clients_;
  ClientNumber newest_ = 0;
  std::uint32_t sources_ = 1;  // their revision
  std::deque<Event> events_;
  int late_ticks_ = 0;  // that may still bring events of a time that was taken back
  std::map<std::string, Watched> watched_;
  ClientNumber controls_ = 0;  // 0: nobody
  bool went_back_ = false;     // time did, in this tick
  Clock::time_point alive_;
  bool stands_ = false;
  bool ended_ = false;
  Clock::time_point repeat_;
};

}  // namespace tandem::studio
