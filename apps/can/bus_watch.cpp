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

Json buses_json(std::span<const OpenBus> buses) {
  Json all = Json::array();
  for (const OpenBus& bus : buses) {
    const BusStatistics s = bus.end->statistics();
    Json json;
    json["interface"] = bus.interface;
    json["status"] = bus.end->status_text();
    json["sent"] = s.sent;
    json["received"] = s.received;
    json["send_refused"] = s.send_refused;
    json["queue_full"] = s.queue_full;
    json["receive_lost"] = s.receive_lost;
    json["error_frames"] = s.error_frames;
    json["ignored"] = s.ignored;
    json["recoveries"] = s.recoveries;
    all.push_back(std::move(json));
  }
  return all;
}

void add_bus_facts(std::span<const OpenBus> buses, Facts& facts) {
  for (const OpenBus& bus : buses) {
    const BusStatistics s = bus.end->statistics();
    const std::string status = bus.end->status_text();
    if (s.send_refused + s.receive_lost + s.error_frames + s.recoveries > 0) {
      facts.add(bus.interface,
                fmt::format("{} frames not sent, {} lost on the way in, {} error frames, {} "
                            "recoveries",
                            s.send_refused, s.receive_lost, s.error_frames, s.recoveries));
    }
    if (!status.empty()) facts.add(bus.interface, status);
  }
}

}  // namespace tandem::apps
