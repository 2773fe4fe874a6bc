#include "log/run_window.hpp"

#include <algorithm>

namespace tandem::log {

double settle_time_s(TomlTable& experiment) {
  TomlTable sim = experiment.table_or_empty("sim");
  TomlTable hoist = sim.table_or_empty("hoist");
  const double by_hoist_s =
      hoist.boolean_or("enabled", true) ? hoist.number_or("release_s", 1.0) : 0.0;
  return experiment.table_or_empty("hal").number_or("settle_s", by_hoist_s);
}

double settle_time_s(const StringMap& configuration) {
  for (const auto& [file, text] : configuration) {
    if (!file.ends_with(".toml")) continue;
    const Result<TomlDocument> document = TomlDocument::parse(text, file);
    if (!document) continue;
    TomlTable root = document->root();
    if (root.has("robot")) return settle_time_s(root);
  }
  return 0.0;
}

RunWindow run_window(const std::vector<EventText>& events, double settle_s) {
  RunWindow window;
  for (const EventText& one : events) {
    const double time_s = static_cast<double>(one.event.time_ns) * 1e-9;
    if (one.event.kind == EventKind::kBringUpDone) {
      window.bring_up_s = time_s - kHalfNanosecond;
      window.begin_s = window.bring_up_s + settle_s;
    }
    const bool end = one.event.kind == EventKind::kControllersDone ||
                     one.event.kind == EventKind::kStopRequested;
    if (end) window.end_s = std::min(window.end_s, time_s + kHalfNanosecond);
    if (is_fault(one.event.kind)) window.fault_s = std::min(window.fault_s, time_s);
    if (is_stop(one.event)) window.stop_s = std::min(window.stop_s, time_s);
  }
  return window;
}

}  // namespace tandem::log
