#include "report/differences.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include "log/compare.hpp"

namespace tandem::report {
namespace {

constexpr std::size_t kMostShown = 15;

/// How far a signal of the first log and its twin are apart.
struct TwinGap {
  std::string name, unit;
  double largest = 0.0, at_s = 0.0;
  double range = 0.0;  // of the first one

  [[nodiscard]] double share() const {
    return range > 0.0 ? largest / range : std::numeric_limits<double>::infinity();
  }
};

TwinGap twin_gap(const Spans& spans, std::size_t first, std::size_t second) {
  const auto low = spans.least(first), high = spans.largest(first);
  const auto its_low = spans.least(second), its_high = spans.largest(second);
  TwinGap found;
  float least = NAN, largest = NAN;
  for (std::size_t row = 0; row < low.size(); ++row) {
    least = studio::least(least, low[row]);
    largest = studio::largest(largest, high[row]);
    const double now = std::max(std::abs(static_cast<double>(low[row]) - its_low[row]),
                                std::abs(static_cast<double>(high[row]) - its_high[row]));
    if (!(now > found.largest)) continue;
    found.largest = now;
    found.at_s = spans.grid().start_s + spans.grid().step_s() * static_cast<double>(row);
  }
  found.range = std::isnan(least) ? 0.0 : static_cast<double>(largest) - least;
  return found;
}

/// "rad or m" is the unit of what turns, then of what slides: that of `joint`. Where it is no
/// joint's, that of all when they are alike.
std::string unit_of(const std::string& unit, const std::string& joint,
                    std::span<const hal::JointConfig> joints) {
  constexpr std::string_view kOr = " or ";
  const std::size_t end = unit.find(kOr);
  if (end == std::string::npos || joints.empty()) return unit;
  const auto its = std::ranges::find(joints, joint, &hal::JointConfig::name);
  const bool slides = (its == joints.end() ? joints.front() : *its).slides;
  const auto is_other = [&](const hal::JointConfig& one) { return one.slides != slides; };
  if (its == joints.end() && std::ranges::any_of(joints, is_other)) return unit;
  return slides ? unit.substr(end + kOr.size()) : unit.substr(0, end);
}

bool is_clock(const std::string& field) { return field == "cycle" || field == "time_ns"; }

/// Every signal of two sources with the same fields, as far as they differ.
void add_gaps(const Recording& recording, const studio::Source& first, const studio::Source& second,
              std::vector<TwinGap>& all) {
  std::size_t at = 0;
  for (const studio::SourceField& field : first.fields) {
    for (std::size_t i = 0; i < field.count; ++i, ++at) {
      if (at >= second.count || is_clock(field.name)) continue;
      TwinGap one = twin_gap(recording.spans(), first.first + at, second.first + at);
      if (!(one.largest > 0.0)) continue;
      one.name = recording.table().name(static_cast<studio::SignalId>(first.first + at));
      const std::string element = i < field.elements.size() ? field.elements[i] : "";
      one.unit = unit_of(field.unit, element, recording.joints());
      all.push_back(std::move(one));
    }
  }
}

bool same_fields(const studio::Source& a, const studio::Source& b) {
  return std::ranges::equal(a.fields, b.fields, [](const auto& x, const auto& y) {
    return x.name == y.name && x.count == y.count;
  });
}

}  // namespace

Result<PageTable> first_differences(const std::string& a, const std::string& b, char letter) {
  const auto first = log::LogFile::open(a), second = log::LogFile::open(b);
  if (!first) return std::unexpected(first.error());
  if (!second) return std::unexpected(second.error());
  const auto found = log::compare(*first, *second);
  if (!found) return std::unexpected(found.error());
  PageTable table{.title = fmt::format("First differences of A and {}", letter),
                  .caption =
                      "The first message of each topic that is not the same to the last "
                      "bit, counted from 0; by the logs' own times.",
                  .header = {"topic", "message", "time [s]", "signal", "A", std::string(1, letter)},
                  .rows = {}};
  for (const log::TopicComparison& one : found->topics) {
    if (one.messages_a + one.messages_b == 0) continue;
    if (one.first) {
      table.rows.push_back({one.topic, std::to_string(one.first->message),
                            fmt::format("{:.3f}", 1e-9 * static_cast<double>(one.first->time_ns)),
                            one.first->signal, fmt::format("{:.6g}", one.first->a),
                            fmt::format("{:.6g}", one.first->b)});
    } else if (!one.equal()) {
      table.rows.push_back({one.topic, "", "", "messages", std::to_string(one.messages_a),
                            std::to_string(one.messages_b)});
    } else {
      table.rows.push_back({one.topic, "", "", "the same", "", ""});
    }
  }
  return table;
}

std::vector<PageTable> largest_differences(const Recording& recording) {
  std::vector<PageTable> tables;
  const auto sources = recording.table().sources();
  for (const char letter : {'B', 'C'}) {
    std::vector<TwinGap> all;
    for (const studio::Source& first : sources) {
      if (first.name.starts_with("report/")) continue;  // made of the others
      const auto twin = std::ranges::find(sources, std::string(1, letter) + "/" + first.name,
                                          &studio::Source::name);
      if (twin == sources.end() || !same_fields(first, *twin)) continue;
      add_gaps(recording, first, *twin, all);
    }
    if (all.empty()) continue;
    std::ranges::stable_sort(all, std::ranges::greater{}, &TwinGap::share);
    PageTable table{.title = fmt::format("Largest differences of A and {}", letter),
                    .caption = fmt::format("Of {} signals that differ those that do most, by the "
                                           "share of what A's changes; as they are drawn.",
                                           all.size()),
                    .header = {"signal", "largest", "unit", "at [s]", "A's range"},
                    .rows = {}};
    for (const TwinGap& one : std::span(all).first(std::min(all.size(), kMostShown))) {
      table.rows.push_back({one.name, fmt::format("{:.4g}", one.largest), one.unit,
                            fmt::format("{:.3f}", one.at_s), fmt::format("{:.4g}", one.range)});
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace tandem::report
