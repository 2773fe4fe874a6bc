#include "studio/hub.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace tandem::studio {

using apps::Json;

namespace {

/// One may have been asked for events before the jump, the next after it.
constexpr int kLateTicks = 2;

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

}  // namespace

void Hub::start(Feed feed, Asker asker) {
  feed_ = std::move(feed);
  asker_ = std::move(asker);
}

Hub::ClientNumber Hub::connect(std::string name) {
  const ClientNumber number = ++newest_;
  Client& client = clients_[number];
  client.name = std::move(name);
  if (options_.open) greet(number, client);
  return number;
}

void Hub::greet(ClientNumber number, Client& client) {
  if (std::exchange(client.greeted, true)) return;
  client.out.text(hello_text(*run_, sampler_->history().capacity_cycles()));
  client.out.text(signals_text(sources_, sampler_->table()));
  const std::vector<Event> events(events_.begin(), events_.end());
  client.out.text(events_text(events));
  const auto holder = clients_.find(controls_);
  const bool taken = holder != clients_.end();
  client.out.text(control_text(taken, controls_ == number, taken ? holder->second.name : ""));
}

void Hub::disconnect(ClientNumber number) {
  if (clients_.erase(number) == 0) return;
  if (asker_.drop) asker_.drop(number);
  if (controls_ == number) end_control("is gone");
}

std::optional<Frame> Hub::next(ClientNumber number) {
  const auto client = clients_.find(number);
  return client == clients_.end() ? std::nullopt : client->second.out.next();
}

Close Hub::closing(ClientNumber number) const {
  const auto client = clients_.find(number);
  if (client == clients_.end()) return Close::kGoingAway;
  return client->second.out.is_over() ? Close::kPolicy : client->second.close;
}

bool Hub::is_behind(ClientNumber number) const {
  const auto client = clients_.find(number);
  return client != clients_.end() && client->second.out.is_behind();
}

void Hub::tick(Clock::time_point now) {
  if (ended_) return;
  std::vector<Event> late;  // before the cycles: what comes with them is not later than they are
  if (feed_.events) feed_.events(late);
  if (sampler_->look(feed_)) {
    ++sources_;
    const auto text =
        std::make_shared<const std::string>(signals_text(sources_, sampler_->table()));
    for (auto& [number, client] : clients_) {
      if (client.greeted) client.out.text(text);
    }
  }
  tell(what_happened(std::move(late)));
  if (std::exchange(went_back_, false) && controls_ != 0) {
    // What was asked for was meant for another future. Nothing is halted: what goes on unchanged
    // has the same bits.
    if (asker_.drop) asker_.drop(controls_);
    end_control("has no control any more, for time went back: take it again", false);
  }
  if (controls_ != 0 && now - alive_ > kAlive) {
    // What the page asked for, and nobody expects any more.
    if (asker_.drop) asker_.drop(controls_);
    end_control("has been silent for a second");
  }
  give_ticks(now);
  ask_watched(now);
}

/// Ticks of what did not happen are dropped: texts go out before ticks.
void Hub::tell_back(const TimeBack& back) {
  const double to_s = seconds(back.to_ns);
  // The cycle of that time is done and is not made again: what happened in it is not told twice. A
  // request acts in the cycle after its time.
  std::erase_if(events_, [&](const Event& one) {
    return one.time_s > to_s || (one.time_s == to_s && one.is_request());
  });
  const auto text =
      std::make_shared<const std::string>(back_text(to_s, back.cycle, seconds(back.from_ns)));
  for (auto& [number, client] : clients_) {
    if (!client.greeted) continue;
    client.out.drop_ticks();
    client.out.text(text);
  }
  late_ticks_ = kLateTicks;
}

/// @param told  by the run, before the cycles were looked at: of what comes later than they are
/// just after a jump back, it is what did not happen
std::vector<Event> Hub::what_happened(std::vector<Event> told) {
  std::vector<Event> events;
  if (const auto back = sampler_->take_back()) {
    tell_back(*back);
    went_back_ = true;
    events.push_back({seconds(back->to_ns), back->cycle, Event::Level::kInfo, "",
                      fmt::format("time went back to {:.6g} s, from {:.6g} s", seconds(back->to_ns),
                                  seconds(back->from_ns))});
  }
  std::ranges::move(sampler_->take_events(), std::back_inserter(events));
  if (late_ticks_ > 0) {
    --late_ticks_;
    const double newest_s = seconds(sampler_->time_ns() + run_->period_ns);
    std::erase_if(told, [&](const Event& one) { return one.time_s > newest_s; });
  }
  std::ranges::move(told, std::back_inserter(events));
  return events;
}

void Hub::tell(const std::vector<Event>& events) {
  if (events.empty()) return;
  for (const Event& event : events) events_.push_back(event);
  while (events_.size() > kMostEvents) events_.pop_front();
  const std::size_t count = std::min(events.size(), kMostEvents);
  const auto text = std::make_shared<const std::string>(events_text(std::span(events).last(count)));
  for (auto& [number, client] : clients_) {
    if (client.greeted) client.out.text(text);
  }
}

/// Where time stands, or nothing comes, the last values are repeated now and then.
void Hub::give_ticks(Clock::time_point now) {
  const Span& span = sampler_->span();
  const bool stands = feed_.time_stands && feed_.time_stands();
  const bool repeats = std::exchange(stands_, stands) != stands || now >= repeat_;
  const bool fresh = span.cycles > 0;
  if (fresh || repeats) repeat_ = now + kRepeat;
  const std::vector<float>& last = sampler_->last();
  for (auto& [number, client] : clients_) {
    if (client.signals.empty() || client.close != Close::kNot) continue;
    if (!fresh && !repeats && !client.repeats) continue;
    client.repeats = false;
    Tick tick{.stands = stands,
              .gap = span.gap,
              .revision = client.revision,
              .cycle = sampler_->cycle(),
              .time_s = seconds(sampler_->time_ns())};
    tick.numbers.reserve(3 * client.signals.size());
    for (const SignalId signal : client.signals) {
      tick.numbers.push_back(fresh ? span.least[signal] : last[signal]);
      tick.numbers.push_back(fresh ? span.largest[signal] : last[signal]);
      tick.numbers.push_back(last[signal]);
    }
    client.out.tick(std::move(tick));
  }
  sampler_->begin_tick();
}

void Hub::ask_watched(Clock::time_point now) {
  if (!asker_.ask) return;
  for (auto& [name, one] : watched_) {
    if (one.asked || now < one.due) continue;
    const bool wanted = std::ranges::any_of(
        clients_, [&](const auto& client) { return client.second.watched.contains(name); });
    if (!wanted) continue;
    one.asked = true;
    one.due = now + kWatch;
    asker_.ask({.asker = 0,
                .number = one.number,
                .text = apps::json_text(Json{{"do", name}}),
                .rights = {.token = true, .control = true}});
  }
}

void Hub::take_answers() {
  if (!asker_.take) return;
  for (const Answer& answer : asker_.take()) give(answer);
}

void Hub::give(const Answer& answer) {
  if (answer.asker == 0) {
    const auto found = std::ranges::find_if(
        watched_, [&](const auto& entry) { return entry.second.number == answer.number; });
    if (found == watched_.end()) return;
    auto& [name, one] = *found;
    one.asked = false;
    if (one.answer == answer.text) return;
    one.answer = answer.text;
    const auto text = std::make_shared<const std::string>(watched_text(name, answer.text));
    for (auto& [number, client] : clients_) {
      if (client.watched.contains(name)) client.out.text(text);
    }
    return;
  }
  const auto asker = clients_.find(answer.asker);
  if (asker == clients_.end()) return;
  if (asker->second.asked > 0) --asker->second.asked;
  asker->second.out.text(answer_text(answer.number, answer.text));
}

/// @param went_back  why it has ended: time did
void Hub::tell_control(bool went_back) {
  const auto holder = clients_.find(controls_);
  const bool taken = holder != clients_.end();
  for (auto& [number, client] : clients_) {
    if (!client.greeted) continue;
    client.out.text(
        control_text(taken, number == controls_, taken ? holder->second.name : "", went_back));
  }
}

/// Nobody expects a motion any more: what the holder has set going brakes, if it `halts`.
void Hub::end_control(std::string_view why, bool halts) {
  const auto holder = clients_.find(controls_);
  const std::string who = holder == clients_.end() ? "who had control" : holder->second.name;
  controls_ = 0;
  if (asker_.ask && halts) {
    asker_.ask({.asker = 0,
                .number = -1,
                .text = R"({"do": "joint.halt"})",
                .rights = {.token = true, .control = true}});
  }
  tell({{seconds(sampler_->time_ns()), sampler_->cycle(), Event::Level::kWarn, "",
         who + " " + std::string(why) + (halts ? ": every joint that it moved is halted" : "")}});
  tell_control(!halts);
}

void Hub::end(std::string_view how, std::string_view log) {
  if (std::exchange(ended_, true)) return;
  controls_ = 0;  // the run halts by itself
  const auto text = std::make_shared<const std::string>(ended_text(how, log));
  for (auto& [number, client] : clients_) {
    if (client.greeted) client.out.text(text);
    client.close = Close::kGoingAway;
  }
}

}  // namespace tandem::studio
