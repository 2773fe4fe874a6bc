#include "tests/remote/peer_sequence.hpp"

#include <fmt/core.h>

#include <random>

namespace tandem::remote::test {
namespace {

const char* const kAsks[] = {"pause", "resume", "step", "rate", "reset", "stop", "look", "wait"};
const char* const kActs[] = {"join", "answer", "silent", "release", "die", "done", "stop", "reset"};
const char* const kEnds[] = {"by itself", "asked while paused", "the same without an owner",
                             "asked any time"};

template <class What>
std::string in_words(const char* who, const std::vector<Deed<What>>& deeds,
                     const char* const* words) {
  std::string text = fmt::format("\n  {}:", who);
  for (const auto& deed : deeds) {
    text += fmt::format(" {} {}", words[static_cast<int>(deed.what)], deed.amount);
    if (deed.rate != 0.0) text += fmt::format(" at {:g}", deed.rate);
    text += ",";
  }
  return text;
}

}  // namespace

PeerSequence::PeerSequence(std::uint32_t number) : seed(number) {
  std::mt19937 random(number);
  const auto below = [&random](std::uint32_t n) {
    return static_cast<std::uint32_t>(random() % n);
  };
  const double rates[] = {0.0, 0.0, 1000.0, 100.0, 1.0, 0.01};
  const double lease_s[] = {0.02, 0.05, 1.0}, answer_s[] = {0.005, 0.02, 60.0};
  server.lockstep = true;
  server.ends_with_owner = below(10) == 0;
  server.lease_timeout_s = lease_s[below(3)];
  server.lockstep_timeout_s = answer_s[below(3)];
  server.on_lost = below(2) == 0 ? hal::StopCategory::kWarn : hal::StopCategory::kCategory1;
  cycle.loop.start_paused = below(2) == 0;
  cycle.loop.rate = rates[below(6)];
  cycle.settle_cycles = below(4);
  const bool only_steps = cycle.loop.start_paused && below(3) == 0;
  operators.resize(below(3));
  for (auto& asks : operators) {
    for (std::uint32_t i = below(9); i > 0; --i) {
      Deed<Ask> ask{.what = static_cast<Ask>(below(8)), .amount = 1 + below(30)};
      if (ask.what == Ask::kRate) ask.rate = rates[below(6)];
      if (only_steps && ask.what == Ask::kResume) ask.what = Ask::kStep;
      if (ask.what == Ask::kStop && below(3) > 0) ask.what = Ask::kStep;
      asks.push_back(ask);
    }
  }
  peers.resize(below(4));
  for (auto& acts : peers) {
    for (std::uint32_t i = below(8); i > 0; --i) {
      Deed<Act> act{.what = static_cast<Act>(below(8)), .amount = 1 + below(20)};
      if (act.what >= Act::kStop && below(2) == 0) act.what = Act::kAnswer;
      acts.push_back(act);
    }
  }
  end = static_cast<End>(below(4));
  in_fault = end != End::kItself && below(4) == 0;
  has_owner = !in_fault && (end == End::kItself || end == End::kPaused);
  owner_late = below(2) == 0;
  watches_clock = below(100) == 0;
  for (std::uint32_t i = below(4); i > 0; --i) steps.push_back(1 + below(20));
  if (end == End::kItself) cycle.running_cycles = 1 + below(100);
}

bool PeerSequence::resumes() const {
  bool any = !cycle.loop.start_paused;
  for (const auto& asks : operators) {
    for (const auto& ask : asks) any = any || ask.what == Ask::kResume;
  }
  return any;
}

std::string PeerSequence::to_string() const {
  std::string text = fmt::format(
      "TANDEM_PEER_SEED={}: {}, rate {:g}, {} cycles, lease {:g} s, answers in {:g} s, {} on "
      "loss, {}an owner that stays{}{}",
      seed, cycle.loop.start_paused ? "started paused" : "started running", cycle.loop.rate,
      cycle.running_cycles, server.lease_timeout_s, server.lockstep_timeout_s,
      server.on_lost == hal::StopCategory::kWarn ? "held" : "stopped", has_owner ? "" : "not ",
      owner_late ? " (late)" : "", in_fault ? ", in fault" : "");
  if (server.ends_with_owner) text += ", ends with its owner";
  for (const auto& asks : operators) text += in_words("operator", asks, kAsks);
  for (const auto& acts : peers) text += in_words("peer", acts, kActs);
  text += "\n  steps:";
  for (const std::uint32_t step : steps) text += fmt::format(" {}", step);
  return text + "\n  ends: " + kEnds[static_cast<int>(end)];
}

}  // namespace tandem::remote::test
