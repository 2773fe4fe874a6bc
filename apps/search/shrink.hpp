// The fewest and smallest events with which a scenario still fails. Pure: who asks runs them.
// Layer: apps/search.  Thread: main.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "apps/search/scenario_rows.hpp"

namespace tandem::apps {

/// The first of some sets of events, in this order, with which the scenario still fails; empty:
/// with none of them. From then on that it answers "none" to everything, the search ends.
using FirstFailing =
    std::function<std::optional<std::size_t>(const std::vector<ScenarioRows>& candidates)>;

/// Leaves events out (Zeller and Hildebrandt, "Simplifying and Isolating Failure-Inducing Input",
/// 2002: ddmin), then makes the values of those that are left simpler, by turns until nothing
/// changes. No single event of the result can be left out, and no value of it can become simpler in
/// one of the ways of simpler_rows(). Asks for nothing twice.
/// @param rows  with these it fails
/// @return rows with which it fails
[[nodiscard]] ScenarioRows shrunk(const ScenarioRows& rows, const FirstFailing& first_failing);

}  // namespace tandem::apps
