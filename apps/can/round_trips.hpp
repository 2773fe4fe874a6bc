// How long each node's answers to commands took, for a run's summary.
// Layer: apps/can.  Thread: main.
#pragma once

#include <cstdint>
#include <cstdio>
#include <span>

#include "apps/text/figures.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "rt/histogram.hpp"

namespace tandem::apps {

/// Percentiles of RoundTrip::cycles, in cycles; all 0 when no echo came.
[[nodiscard]] rt::Percentiles cycles_of(const hal::can::RoundTrip& trip);

void figures(Figures& f, const hal::can::RoundTrip& trip);

/// The nodes whose slowest answers are the slowest, five at most; nothing when no echo came.
void print_slowest_nodes(std::span<const hal::can::RoundTrip> trips, std::FILE* out);

}  // namespace tandem::apps
