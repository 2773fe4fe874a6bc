#include "apps/tools/log_torques.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/collision.hpp"
#include "hal/fault_kind.hpp"
#include "log/event.hpp"

namespace tandem::apps {
namespace {

constexpr const char* kField = "external_torque_nm";
constexpr const char* kBase = "external_base_wrench";

std::unexpected<Error> log_error(const log::LogFile& file, std::string message, std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), file.path(), 0, {}});
}

/// What the log's events say of it.
struct Span {
  double begin_s = 0.0, end_s = std::numeric_limits<double>::infinity();
  double stop_s = std::numeric_limits<double>::infinity();  ///< also by a collision
  std::vector<double> push_s;
};
Result<Span> under_control(const log::LogFile& file) {
  const auto events = file.events();
  if (!events) return std::unexpected(events.error());
  Span span;
  for (const auto& [event, text] : *events) {
    const double time_s = static_cast<double>(event.time_ns) * 1e-9;
    using log::EventKind;
    if (event.kind == EventKind::kBringUpDone) span.begin_s = std::max(span.begin_s, time_s);
    const bool is_push = event.kind == EventKind::kInjected &&
                         event.code == static_cast<std::uint32_t>(hal::FaultKind::kPush);
    if (is_push) span.push_s.push_back(time_s);
    const bool found = event.kind == EventKind::kCollision && !span.push_s.empty();
    const bool ends = event.kind == EventKind::kControllersDone ||
                      event.kind == EventKind::kStopRequested ||
                      (log::is_fault(event.kind) && !found);
    if (ends) span.end_s = std::min(span.end_s, time_s);
    if (log::is_stop(event)) span.stop_s = std::min(span.stop_s, time_s);
  }
  return span;
}

}  // namespace

std::size_t ExternalTorques::free_rows() const {
  if (push_s.empty()) return time_s.size();
  return static_cast<std::size_t>(std::ranges::lower_bound(time_s, push_s.front()) -
                                  time_s.begin());
}

std::vector<double> ExternalTorques::at(std::size_t row) const {
  std::vector<double> all;
  for (const auto& joint : torque_Nm) all.push_back(joint[row]);
  return all;
}

std::vector<std::string> felt_channels(const log::LogFile& file) {
  std::vector<std::string> names = file.info().joints;
  const log::LoggedTopic* topic = file.find("/tandem/estimate");
  const hal::Field* field = topic == nullptr ? nullptr : topic->layout.find(kBase);
  if (field != nullptr && field->count == estimation::kBaseChannels.size())
    names.insert(names.end(), estimation::kBaseChannels.begin(), estimation::kBaseChannels.end());
  return names;
}

Result<ExternalTorques> read_external_torques(const log::LogFile& file, double from_s) {
  if (const Status whole = file.require_samples(); !whole) return std::unexpected(whole.error());
  const std::vector<std::string>& joints = file.info().joints;
  const log::LoggedTopic* topic = file.find("/tandem/estimate");
  const hal::Field* field = topic == nullptr ? nullptr : topic->layout.find(kField);
  if (field == nullptr || field->count != joints.size() || joints.empty()) {
    return log_error(file, "this log has no external torques",
                     "record a run whose experiment has [estimation.observer]");
  }
  std::vector<log::Column> columns;
  for (std::size_t j = 0; j < joints.size(); ++j) columns.push_back({kField, j});
  const std::vector<std::string> names = felt_channels(file);
  for (std::size_t k = 0; joints.size() + k < names.size(); ++k) columns.push_back({kBase, k});
  auto table = file.read("/tandem/estimate", columns);
  if (!table) return std::unexpected(table.error());
  Result<Span> span = under_control(file);
  if (!span) return std::unexpected(span.error());
  const auto row_at = [&](double time_s) {
    return std::ranges::lower_bound(table->time_s, time_s) - table->time_s.begin();
  };
  const auto first = row_at(std::max(from_s, span->begin_s));
  const auto last = std::max(first, row_at(span->end_s));
  ExternalTorques all{.time_s = {table->time_s.begin() + first, table->time_s.begin() + last},
                      .torque_Nm = {},
                      .push_s = std::move(span->push_s)};
  std::erase_if(all.push_s, [&](double push_s) {
    const bool seen = !all.time_s.empty() && push_s >= all.time_s.front() &&
                      push_s <= std::min(all.time_s.back(), span->stop_s);
    return !seen;
  });
  for (std::size_t j = 0; j < names.size(); ++j) {
    const auto begin = table->columns[j].begin();
    all.torque_Nm.emplace_back(begin + first, begin + last);
    if (!std::ranges::all_of(all.torque_Nm[j], [](double t) { return std::isfinite(t); })) {
      return log_error(file, "the external torque of " + names[j] + " is not finite",
                       "record the run again");
    }
  }
  return all;
}

}  // namespace tandem::apps
