// Reports buses that are not well while a process runs, and what has passed on them at its end.
// Layer: apps/can.  Thread: main, beside the one that the buses belong to.
#pragma once

#include <chrono>
#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "apps/can/can_sockets.hpp"
#include "apps/text/figures.hpp"

namespace tandem::apps {

/// One line when a bus' state changes, once a second at most for each bus.
class BusWatch {
 public:
  using Clock = std::chrono::steady_clock;

  BusWatch(std::span<const OpenBus> buses, std::FILE* out);
  /// Prints what has changed. No system call while nothing has.
  void look();

 private:
  struct Told {
    std::string text;  ///< empty: well
    Clock::time_point next{};
  };
  std::span<const OpenBus> buses_;
  std::FILE* out_;
  std::vector<Told> told_;
};

void figures(Figures& f, const OpenBus& bus);
/// A line for every bus that lost frames or was not well.
void add_bus_facts(std::span<const OpenBus> buses, Facts& facts);

}  // namespace tandem::apps
