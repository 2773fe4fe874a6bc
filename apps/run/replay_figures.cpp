#include "apps/run/replay_figures.hpp"

namespace tandem::apps {

void figures(Figures& f, const runtime::CommandDifference& first) {
  f("cycle", first.cycle);
  f("time_ns", first.time_ns);
  f("joint", "empty: of no joint", first.joint);
  f("field", "of the command", first.field);
  f("recorded", first.recorded);
  f("replayed", first.replayed);
  f("controller", "who has the joint in the replay; empty: nobody", first.controller);
}

void figures(Figures& f, const runtime::CommandSpread& spread) {
  f("joint", "empty: of no joint", spread.joint);
  f("field", "of the command", spread.field);
  f("largest", "of the absolute difference", spread.largest);
  f("time_ns", "of that", spread.time_ns);
  f("first_ns", "of the first cycle in which it differs", spread.first_ns);
  f("cycles", "in which it differs", spread.cycles);
}

void figures(Figures& f, const runtime::ReplayResult& result) {
  f("equal", "every command of the log, to its end", result.equal());
  f("cycles", "that were played", result.cycles);
  f("compared", "of them, where the log has the command", result.compared);
  f("differ", "of these", result.differ);
  f("end_ns", "of the last one", result.end_ns);
  f("first", "null: none differs", result.first);
  f("spreads", "numbers that differ anywhere", result.spreads);
  f("why_short", "why it ends before the log; empty: it does not", result.why_short);
  f("changed", "controllers of `--plugin`", result.changed);
  f("log", "that was written; empty: none", result.log);
  f("wall_seconds", "of the cycles", result.seconds);
}

}  // namespace tandem::apps
