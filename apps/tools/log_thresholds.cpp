#include "apps/tools/log_thresholds.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/text/console.hpp"
#include "estimation/collision.hpp"
#include "log/event.hpp"

namespace tandem::apps {
namespace {

constexpr double kBlock_s = 0.5;
constexpr std::size_t kLeastBlocks = 16;
constexpr const char* kField = "external_torque_nm";

std::unexpected<Error> log_error(const log::LogFile& file, std::string message, std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), file.path(), 0, {}});
}

/// The largest magnitudes of a joint's torque, block by block; the last part of a block is left
/// out.
std::vector<double> largest_of(const std::vector<double>& time_s,
                               const std::vector<double>& torque) {
  std::vector<double> largest;
  double begin = time_s.front(), most = 0.0;
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    if (time_s[i] - begin >= kBlock_s) {
      largest.push_back(most);
      most = 0.0;
      begin = time_s[i];
    }
    most = std::max(most, std::abs(torque[i]));
  }
  return largest;
}

/// Where the robot was under control: from the bring-up to the end of the controllers, a request to
/// stop, or the first fault.
struct Span {
  double begin_s = 0.0, end_s = std::numeric_limits<double>::infinity();
};
Result<Span> under_control(const log::LogFile& file) {
  const auto events = file.events();
  if (!events) return std::unexpected(events.error());
  Span span;
  for (const auto& [event, text] : *events) {
    const double time_s = static_cast<double>(event.time_ns) * 1e-9;
    if (event.kind == log::EventKind::kBringUpDone) span.begin_s = std::max(span.begin_s, time_s);
    const bool ends = event.kind == log::EventKind::kControllersDone ||
                      event.kind == log::EventKind::kStopRequested || log::is_fault(event.kind);
    if (ends) span.end_s = std::min(span.end_s, time_s);
  }
  return span;
}

}  // namespace

Status print_thresholds(const log::LogFile& file, const LogOptions& options) {
  const std::vector<std::string>& joints = file.info().joints;
  const log::Topic* topic = file.find("/tandem/estimate");
  const hal::Field* field = topic == nullptr ? nullptr : topic->layout.find(kField);
  if (field == nullptr || field->count != joints.size() || joints.empty()) {
    return log_error(file, "this log has no external torques",
                     "record a run whose experiment has [estimation.observer]");
  }
  std::vector<log::Column> columns;
  for (std::size_t j = 0; j < joints.size(); ++j) columns.push_back({kField, j});
  auto table = file.read("/tandem/estimate", columns);
  if (!table) return std::unexpected(table.error());
  const Result<Span> span = under_control(file);
  if (!span) return std::unexpected(span.error());
  const double from_s = std::max(options.from_s, span->begin_s);
  const auto first = std::ranges::lower_bound(table->time_s, from_s) - table->time_s.begin();
  const auto last =
      std::max(first, std::ranges::lower_bound(table->time_s, span->end_s) - table->time_s.begin());
  const std::vector<double> time_s(table->time_s.begin() + first, table->time_s.begin() + last);
  fmt::print(human_output(options.json), "# {} s of {}, {} false alarms an hour\n",
             time_s.empty() ? 0.0 : std::round(time_s.back() - time_s.front()), file.path(),
             options.alarms_per_hour);
  std::string text = "[estimation.collision.threshold_Nm]\n";
  Json json{{"alarms_per_hour", options.alarms_per_hour}, {"threshold_Nm", Json::object()}};
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::vector<double> torque(table->columns[j].begin() + first,
                                     table->columns[j].begin() + last);
    if (!std::ranges::all_of(torque, [](double t) { return std::isfinite(t); })) {
      return log_error(file, "the external torque of " + joints[j] + " is not finite",
                       "record the run again");
    }
    const std::vector<double> largest =
        time_s.empty() ? std::vector<double>() : largest_of(time_s, torque);
    if (largest.size() < kLeastBlocks) {
      return log_error(file, "there are less than 8 s of external torques to learn from",
                       "record a longer run without faults, or choose an earlier --from");
    }
    const double share = options.alarms_per_hour / static_cast<double>(joints.size());
    // Rounded up: a threshold of 0, where nothing was ever felt, would be one of noise.
    const double threshold =
        std::ceil(1e3 * std::max(1e-3, estimation::learn_threshold(largest, kBlock_s, share))) *
        1e-3;
    text += fmt::format("\"{}\" = {:.3f}\n", joints[j], threshold);
    json["threshold_Nm"][joints[j]] = threshold;
  }
  fmt::print(human_output(options.json), "{}", text);
  return write_json(options.json, json);
}

}  // namespace tandem::apps
