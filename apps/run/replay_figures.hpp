// What `tandem replay --json` has.
// Layer: apps/run.  Thread: main.
#pragma once

#include "apps/text/figures.hpp"
#include "runtime/replay/replay.hpp"

namespace tandem::apps {

void figures(Figures& f, const runtime::CommandDifference& first);
void figures(Figures& f, const runtime::CommandSpread& spread);
void figures(Figures& f, const runtime::ReplayResult& result);

}  // namespace tandem::apps
