#include "apps/can/round_trips.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <vector>

namespace tandem::apps {
namespace {

using hal::can::RoundTrip;

constexpr std::size_t kNodesShown = 5;

std::uint64_t echoes(const RoundTrip& trip) {
  return std::accumulate(trip.cycles.begin(), trip.cycles.end(), std::uint64_t{0});
}

std::string four(const rt::Percentiles& p, double unit, const char* format) {
  std::string text;
  for (const std::int64_t value : {p.p50, p.p99, p.p999, p.max}) {
    text += (text.empty() ? "" : " / ") +
            fmt::format(fmt::runtime(format), static_cast<double>(value) * unit);
  }
  return text;
}

/// What the slowest are sorted by.
auto slowness(const RoundTrip& trip) {
  const rt::Percentiles cycles = cycles_of(trip);
  return std::tuple(cycles.p999, cycles.max, trip.time.percentiles().p999);
}

}  // namespace

rt::Percentiles cycles_of(const RoundTrip& trip) {
  const std::uint64_t all = echoes(trip);
  const auto at = [&](double fraction) {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(all)));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < trip.cycles.size(); ++i) {
      seen += trip.cycles[i];
      if (seen >= wanted && seen > 0) return static_cast<std::int64_t>(i);
    }
    return std::int64_t{0};
  };
  return {at(0.5), at(0.99), at(0.999), at(1.0)};
}

void figures(Figures& f, const RoundTrip& trip) {
  f("node", trip.node);
  f("bus", trip.bus);
  f("id", trip.id);
  f("echoes", "answers that named the command they followed", echoes(trip));
  f("cycles", "in cycles: 1 is on time", cycles_of(trip));
  f("cycles_histogram", "index: cycles; the last: that many or more", trip.cycles);
  f("time_ns",
    "from handing the command over to the answer's arrival; null where the bus has no timestamps",
    trip.time);
}

void print_slowest_nodes(std::span<const RoundTrip> trips, std::FILE* out) {
  std::vector<const RoundTrip*> order;
  for (const RoundTrip& trip : trips) {
    if (echoes(trip) > 0) order.push_back(&trip);
  }
  if (order.empty()) return;
  std::ranges::stable_sort(order, std::ranges::greater{},
                           [](const RoundTrip* trip) { return slowness(*trip); });
  Table table({"slowest nodes", "round trip p50/p99/p99.9/max [cycles]", "[us]"});
  for (std::size_t i = 0; i < std::min(kNodesShown, order.size()); ++i) {
    const RoundTrip& trip = *order[i];
    const bool timed = trip.time.count() > 0;
    table.add({fmt::format("{} (node {} on {})", trip.node, trip.id, trip.bus),
               four(cycles_of(trip), 1.0, "{:.0f}"),
               timed ? four(trip.time.percentiles(), 1e-3, "{:.0f}") : "-"});
  }
  table.print(out);
}

}  // namespace tandem::apps
