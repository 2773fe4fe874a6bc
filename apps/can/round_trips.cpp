#include "apps/can/round_trips.hpp"

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
  std::vector<RoundTrip> order;
  std::ranges::copy_if(trips, std::back_inserter(order),
                       [](const RoundTrip& trip) { return echoes(trip) > 0; });
  if (order.empty()) return;
  std::ranges::stable_sort(order, std::ranges::greater{}, slowness);
  order.resize(std::min(kNodesShown, order.size()));
  figures_table({{"slowest nodes", "{node} (node {id} on {bus})"},
                 {"round trip p50/p99/p99.9/max [cycles]", "{cycles:.0f}"},
                 {"[us]", "{time_ns:.0f}"}},
                figures_json(order))
      .print(out);
}

}  // namespace tandem::apps
