// What a client may say, and what follows.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "apps/text/json_reader.hpp"
#include "base/nearest.hpp"
#include "studio/http_rules.hpp"
#include "studio/hub.hpp"

namespace tandem::studio {
namespace {

using apps::Json;

constexpr char kNeedsToken[] = "open the address with its token";
constexpr char kListing[] = "docs/studio.md lists the messages";
constexpr char kNoRun[] = "an emulation is led and asked by the run on the other side of its wire";
constexpr char kTheRun[] = "there: tandem run … --studio";
constexpr double kMostPoints = 100'000.0;

/// The whole number at `key`, from 0 to `most`; empty: it is none.
std::optional<std::uint64_t> whole(const Json& message, const char* key, std::uint64_t most) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_number_integer()) return std::nullopt;
  if (!found->is_number_unsigned() && found->get<std::int64_t>() < 0) return std::nullopt;
  const auto number = found->get<std::uint64_t>();
  return number <= most ? std::optional(number) : std::nullopt;
}

/// The finite number at `key`; empty: it is none.
std::optional<double> number_at(const Json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_number()) return std::nullopt;
  const auto number = found->get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

std::string text_at(const Json& message, const char* key) {
  const auto found = message.find(key);
  return found == message.end() || !found->is_string() ? "" : found->get<std::string>();
}

}  // namespace

void Hub::refuse(Client& client, std::string_view message, std::string_view hint) {
  client.out.text(error_text(message, hint));
}

void Hub::bad(Client& client, std::string_view message, std::string_view hint) {
  refuse(client, message, hint);
  if (++client.bad >= kMostBad) client.close = Close::kPolicy;
}

void Hub::receive(ClientNumber number, std::string_view message, bool binary,
                  Clock::time_point now) {
  struct Row {
    const char* op;
    Handler handler;
  };
  static constexpr Row kRows[] = {
      {"enter", &Hub::on_enter}, {"subscribe", &Hub::on_subscribe}, {"window", &Hub::on_window},
      {"ask", &Hub::on_ask},     {"watch", &Hub::on_watch},         {"control", &Hub::on_control},
      {"alive", &Hub::on_alive},
  };
  const auto found = clients_.find(number);
  if (found == clients_.end() || ended_) return;
  Client& client = found->second;
  if (client.close != Close::kNot || client.out.is_over()) return;
  if (binary) return bad(client, "a client sends no binary messages", kListing);
  if (message.size() > kMostFromClient) {
    return bad(client, fmt::format("a message of more than {} bytes", kMostFromClient), kListing);
  }
  const Result<Json> read = apps::read_json_object(message);
  if (!read) return bad(client, read.error().message, kListing);
  const std::string op = text_at(*read, "op");
  const auto* const row = std::ranges::find_if(kRows, [&](const Row& one) { return op == one.op; });
  if (row == std::end(kRows)) {
    return bad(client, fmt::format("unknown op \"{}\"", op.substr(0, kMostNamed)), kListing);
  }
  client.bad = 0;
  if (!client.greeted && op != "enter") {
    return refuse(client, "nobody is answered here who has not entered", kNeedsToken);
  }
  (this->*row->handler)(number, client, *read, now);
}

void Hub::on_enter(ClientNumber number, Client& client, const Json& message, Clock::time_point) {
  const std::string token = text_at(message, "token");
  if (!token.empty() && !is_secret(token, options_.token)) {
    return bad(client, "this is not the token of the run",
               "open the address that the run has printed");
  }
  client.token = client.token || !token.empty();
  if (!client.token && !options_.open) return bad(client, "a token is needed", kNeedsToken);
  client.out.text(entered_text(client.token));
  greet(number, client);
}

/// Ids of signals; what is none is answered.
bool Hub::all_known(Client& client, const Json& list, std::size_t most,
                    std::vector<SignalId>& signals) {
  if (!list.is_array() || list.size() > most) {
    refuse(client, fmt::format("\"signals\" is no list of up to {} numbers", most), kListing);
    return false;
  }
  const std::size_t size = sampler_->table().size();
  for (const Json& one : list) {
    const bool known = one.is_number_unsigned() && one.get<std::uint64_t>() < size;
    if (!known) {
      refuse(client, "there is no signal " + apps::json_text(one).substr(0, kMostNamed),
             "take them from the newest \"signals\"");
      return false;
    }
    signals.push_back(one.get<SignalId>());
  }
  return true;
}

void Hub::on_subscribe(ClientNumber, Client& client, const Json& message, Clock::time_point) {
  const auto revision = whole(message, "revision", 0xFFFF'FFFFU);
  if (!revision) return refuse(client, "\"revision\" is no number of 32 bits", kListing);
  std::vector<SignalId> signals;
  if (!all_known(client, message.value("signals", Json()), kMostSubscribed, signals)) return;
  client.revision = static_cast<std::uint32_t>(*revision);
  client.signals = std::move(signals);
  client.out.drop_ticks();
  client.repeats = true;
}

void Hub::on_window(ClientNumber, Client& client, const Json& message, Clock::time_point) {
  const auto id = whole(message, "id", 0xFFFF'FFFFU);
  const auto from_s = number_at(message, "from_s"), to_s = number_at(message, "to_s");
  const auto points = number_at(message, "points");
  if (!id) return refuse(client, "\"id\" is no number of 32 bits", kListing);
  if (!from_s || !to_s || *from_s > *to_s) {
    return refuse(client, "\"from_s\" and \"to_s\" are no span of time", kListing);
  }
  if (!points || *points < 1.0 || *points > kMostPoints) {
    return refuse(client, fmt::format("\"points\" is not from 1 to {:g}", kMostPoints), kListing);
  }
  std::vector<SignalId> signals;
  if (!all_known(client, message.value("signals", Json()), kMostWindowSignals, signals)) return;
  // Many signals have fewer points: an answer is kMostWindowNumbers at most.
  const std::size_t most = kMostWindowNumbers / (8 * std::max<std::size_t>(1, signals.size()));
  const double period_s = 1e-9 * static_cast<double>(run_->period_ns);
  constexpr double kLastCycle = 1e18;
  const auto cycle = [&](double time_s) {
    return static_cast<std::uint64_t>(std::clamp(time_s / period_s, 0.0, kLastCycle));
  };
  const History& history = sampler_->history();
  const Window window = *to_s < 0.0
                            ? Window()
                            : history.plan(cycle(*from_s), cycle(*to_s),
                                           std::min(static_cast<std::size_t>(*points), most));
  client.out.window(
      window_frame(static_cast<std::uint32_t>(*id), history, window, signals, run_->period_ns));
}

void Hub::on_ask(ClientNumber number, Client& client, const Json& message, Clock::time_point) {
  const auto id = message.find("id");
  if (id == message.end() || !id->is_number_integer()) {
    return refuse(client, "\"id\" is no whole number", kListing);
  }
  const auto question = id->get<std::int64_t>();
  const auto request = message.find("request");
  if (request == message.end() || !request->is_object()) {
    return refuse(client, "\"request\" is no object", kListing);
  }
  const auto answer = [&](const char* error, const char* hint) {
    client.out.text(
        answer_text(question, apps::json_text({{"ok", false}, {"error", error}, {"hint", hint}})));
  };
  if (!run_->emulated.empty()) return answer(kNoRun, kTheRun);
  if (!asker_.ask) return answer("the run is not ready to answer yet", "ask again");
  std::string text = apps::json_text(*request);
  // A stop finds its way past what waits.
  const std::size_t most = asker_.is_urgent(text) ? 4 * kMostWaiting : kMostWaiting;
  if (client.asked >= most) {
    return answer("16 questions of this page wait already", "wait for their answers");
  }
  ++client.asked;
  asker_.ask({.asker = number,
              .number = question,
              .text = std::move(text),
              .rights = {.token = client.token, .control = controls_ == number}});
}
static_assert(kMostWaiting == 16);

void Hub::on_watch(ClientNumber, Client& client, const Json& message, Clock::time_point) {
  const Json list = message.value("requests", Json());
  if (!list.is_array() || list.size() > kMostWaiting) {
    return refuse(client, "\"requests\" is no list of up to 16 commands", kListing);
  }
  if (!run_->emulated.empty() && !list.empty()) return refuse(client, kNoRun, kTheRun);
  std::set<std::string> wanted;
  for (const Json& one : list) {
    const std::string name = one.is_string() ? one.get<std::string>() : std::string();
    if (!asker_.only_reads || !asker_.only_reads(name)) {
      return refuse(client,
                    fmt::format("\"{}\" is no command that only reads", name.substr(0, kMostNamed)),
                    "watch those of {\"do\": \"help\"} whose effect is \"reads\"");
    }
    wanted.insert(name);
  }
  for (const std::string& name : wanted) {
    const auto [entry, is_new] = watched_.try_emplace(name);
    if (is_new) entry->second.number = static_cast<std::int64_t>(watched_.size());
    if (client.watched.contains(name) || entry->second.answer.empty()) continue;
    client.out.text(watched_text(name, entry->second.answer));
  }
  client.watched = std::move(wanted);
}

void Hub::on_control(ClientNumber number, Client& client, const Json& message,
                     Clock::time_point now) {
  const auto take = message.find("take");
  if (take == message.end() || !take->is_boolean()) {
    return refuse(client, "\"take\" is neither true nor false", kListing);
  }
  if (!run_->emulated.empty()) return refuse(client, kNoRun, kTheRun);
  if (!client.token) return refuse(client, "control needs the token of the run", kNeedsToken);
  if (!take->get<bool>()) {
    if (controls_ == number) end_control("has given control back");
    return;
  }
  if (controls_ != 0 && controls_ != number) {
    return refuse(client, clients_.at(controls_).name + " has control",
                  "it has to be given back there");
  }
  controls_ = number;
  alive_ = now;
  tell_control();
}

void Hub::on_alive(ClientNumber number, Client&, const Json&, Clock::time_point now) {
  if (controls_ == number) alive_ = now;
}

}  // namespace tandem::studio
