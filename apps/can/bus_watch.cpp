#include "apps/can/bus_watch.hpp"

#include <fmt/format.h>

namespace tandem::apps {

using hal::can::BusStatistics;

BusWatch::BusWatch(std::span<const OpenBus> buses, std::FILE* out)
    : buses_(buses), out_(out), told_(buses.size()) {}

void BusWatch::look() {
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    Told& told = told_[b];
    std::string text = buses_[b].end->status_text();
    if (text == told.text) continue;
    const Clock::time_point now = Clock::now();
    if (now < told.next) continue;
    restart_line(out_);
    fmt::print(
        out_, "note: {}\n",
        text.empty() ? fmt::format("interface {} is well again", buses_[b].interface) : text);
    told = {.text = std::move(text), .next = now + std::chrono::seconds(1)};
  }
}

void figures(Figures& f, const OpenBus& bus) {
  const BusStatistics s = bus.end == nullptr ? BusStatistics{} : bus.end->statistics();
  f("interface", bus.interface);
  f("status", "empty: good", [&] { return bus.end->status_text(); });
  f("sent", "frames", s.sent);
  f("received", "frames", s.received);
  f("send_refused", "frames not accepted", s.send_refused);
  f("queue_full", "times", s.queue_full);
  f("receive_lost", "frames", s.receive_lost);
  f("error_frames", s.error_frames);
  f("ignored", "frames: 29-bit, remote or malformed", s.ignored);
  f("recoveries", s.recoveries);
}

void add_bus_facts(std::span<const OpenBus> buses, Facts& facts) {
  for (const OpenBus& bus : buses) {
    const BusStatistics s = bus.end->statistics();
    const Json json = figures_json(bus);
    if (s.send_refused + s.receive_lost + s.error_frames + s.recoveries > 0) {
      add_figures(facts, json, bus.interface,
                  "{send_refused} frames not sent, {receive_lost} lost on the way in, "
                  "{error_frames} error frames, {recoveries} recoveries");
    }
    if (json["status"] != "") add_figures(facts, json, bus.interface, "{status}");
  }
}

}  // namespace tandem::apps
