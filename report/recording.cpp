#include "report/recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "apps/text/console.hpp"
#include "log/mcap_reader.hpp"
#include "log/schema.hpp"
#include "log/unmeasured.hpp"
#include "report/figure_sources.hpp"
#include "report/packing.hpp"

namespace tandem::report {
namespace {

using apps::Json;
using apps::json_text;
using Event = studio::Event;

/// "/tandem/controller/squat" is "controller/squat", as in a run.
std::string source_name(const std::string& prefix, std::string topic) {
  constexpr std::string_view kOurs = "/tandem/";
  if (topic.starts_with(kOurs)) topic.erase(0, kOurs.size());
  return prefix + topic;
}

bool has_numbers(const log::LoggedTopic& topic) {
  return topic.messages > 0 && !topic.layout.fields().empty();
}

double place(const RecordedLog& log, std::int64_t time_ns) {
  return log.slower * 1e-9 * static_cast<double>(time_ns) + log.later_s;
}

/// The numbers of one topic, row by row: a row is handed on when the next one begins.
class RowOfTopic {
 public:
  /// @param unmeasured  which of its numbers are none yet
  RowOfTopic(const studio::SignalTable& table, std::size_t source, Spans& spans,
             log::Unmeasured unmeasured)
      : table_(&table),
        source_(source),
        spans_(&spans),
        unmeasured_(std::move(unmeasured)),
        numbers_(table.size()) {
    clear();
  }
  void take(std::size_t row, std::span<const std::byte> image) {
    if (row != row_) flush();
    row_ = row;
    any_ = true;
    table_->convert(source_, image, numbers_);
    const studio::Source& its = table_->sources()[source_];
    drop_unmeasured(its, image);
    for (std::size_t i = 0; i < its.count; ++i) {
      const float value = numbers_[its.first + i];
      if (!std::isfinite(value)) continue;
      least_[i] = studio::least(least_[i], value);
      largest_[i] = studio::largest(largest_[i], value);
    }
  }
  void flush() {
    if (!std::exchange(any_, false)) return;
    const studio::Source& its = table_->sources()[source_];
    for (std::size_t i = 0; i < its.count; ++i) {
      spans_->add(its.first + i, row_, least_[i]);
      spans_->add(its.first + i, row_, largest_[i]);
    }
    clear();
  }
  [[nodiscard]] std::size_t bytes() const { return table_->sources()[source_].bytes; }
  void hold(std::size_t rows) {
    const studio::Source& its = table_->sources()[source_];
    for (std::size_t i = 0; rows > 0 && i < its.count; ++i) spans_->hold(its.first + i, rows);
  }

 private:
  void drop_unmeasured(const studio::Source& its, std::span<const std::byte> image) {
    std::size_t at = its.first;
    for (std::size_t field = 0; field < its.fields.size(); ++field) {
      const std::size_t count = its.fields[field].count;
      for (std::size_t i = 0; unmeasured_.tells(field) && i < count; ++i) {
        if (unmeasured_.is(field, i, image))
          numbers_[at + i] = std::numeric_limits<float>::quiet_NaN();
      }
      at += count;
    }
  }
  void clear() {
    const std::size_t count = table_->sources()[source_].count;
    least_.assign(count, std::numeric_limits<float>::quiet_NaN());
    largest_ = least_;
  }

  const studio::SignalTable* table_;
  std::size_t source_;
  Spans* spans_;
  log::Unmeasured unmeasured_;
  std::vector<float> numbers_, least_, largest_;
  std::size_t row_ = 0;
  bool any_ = false;
};

/// Fills what a log has into `spans`.
Status add_log(const RecordedLog& log, const studio::SignalTable& table, Spans& spans) {
  std::map<std::string, RowOfTopic> rows;
  for (const log::LoggedTopic& topic : log.file->topics()) {
    const std::string name = source_name(log.prefix, topic.name);
    const auto source = std::ranges::find(table.sources(), name, &studio::Source::name);
    if (!has_numbers(topic) || source == table.sources().end()) continue;
    auto unmeasured = log::Unmeasured::of(*log.file, topic);
    if (!unmeasured) return std::unexpected(unmeasured.error());
    const auto index = static_cast<std::size_t>(source - table.sources().begin());
    rows.emplace(topic.name, RowOfTopic(table, index, spans, std::move(*unmeasured)));
  }
  const Status read = log.file->visit([&](const auto& reader, const auto& view) -> Status {
    const auto found = rows.find(reader.channels().at(view.channel).topic);
    if (found == rows.end()) return {};
    const auto row = spans.grid().row_of(place(log, view.time_ns));
    const std::size_t head = log::kCdrHeader.size();
    if (!row || view.data.size() < head + found->second.bytes()) return {};
    found->second.take(*row, view.data.subspan(head, found->second.bytes()));
    return {};
  });
  if (!read) return read;
  const bool exact = log.prefix.empty() && log.file->info().hal != "import";
  for (const log::LoggedTopic& topic : log.file->topics()) {
    const auto found = rows.find(topic.name);
    if (found == rows.end()) continue;
    found->second.flush();
    const double steps = static_cast<double>(topic.messages) - 1.0;
    const double whole_s = log.slower * 1e-9 * static_cast<double>(topic.last_ns - topic.first_ns);
    found->second.hold(spans.grid().held_rows(whole_s / steps, exact));
  }
  return {};
}

Result<std::vector<Event>> events_of(const RecordedLog& log) {
  if (log.file->find("/tandem/event") == nullptr) return std::vector<Event>();
  const auto read = log.file->events();
  if (!read) return std::unexpected(read.error());
  std::vector<Event> events;
  for (const log::EventText& one : *read) {
    if (events.size() == kMostRecordedEvents) break;
    const bool fault = log::is_fault(one.event.kind);
    events.push_back({.time_s = place(log, one.event.time_ns),
                      .cycle = one.event.cycle,
                      .level = log::is_stop(one.event) ? Event::Level::kError
                               : fault                 ? Event::Level::kWarn
                                                       : Event::Level::kInfo,
                      .who = log.prefix.substr(0, 1),
                      .text = one.text});
  }
  return events;
}

/// The times that all logs have together, by their periods.
Result<Grid> grid_of(const std::vector<RecordedLog>& logs, std::size_t signals,
                     const RowLimits& limits) {
  double start_s = std::numeric_limits<double>::infinity(), end_s = -start_s;
  double period_s = 1e-9 * static_cast<double>(logs.front().file->info().period_ns);
  for (const RecordedLog& log : logs) {
    for (const log::LoggedTopic& topic : log.file->topics()) {
      if (!has_numbers(topic)) continue;
      start_s = std::min(start_s, place(log, topic.first_ns));
      end_s = std::max(end_s, place(log, topic.last_ns));
      const double steps = static_cast<double>(topic.messages) - 1.0;
      if (!(period_s > 0.0) && steps > 0.0)
        period_s = 1e-9 * static_cast<double>(topic.last_ns - topic.first_ns) / steps;
    }
  }
  if (!(start_s <= end_s)) {
    return std::unexpected(Error{"this log has no numbers: no topic has a message of them",
                                 "`tandem log info` says what it has",
                                 logs.front().file->path(),
                                 0,
                                 {}});
  }
  if (!(period_s > 0.0)) period_s = 1e-3;
  const std::size_t most = std::clamp<std::size_t>(limits.numbers / signals, 100, limits.rows);
  return Grid::over(start_s, end_s, period_s, most);
}

std::string codes_text(const Packed& packed) {
  std::string text;
  for (const auto& one : packed.signals) {
    if (!text.empty()) text += ',';
    if (const double* constant = std::get_if<double>(&one)) {
      text += std::isnan(*constant) ? "null" : fmt::format("{}", *constant);
    } else {
      const Codes& codes = std::get<Codes>(one);
      text += fmt::format("[{},{},{}]", codes.least, codes.scale, codes.bytes);
    }
  }
  return text;
}

/// In JSON a "<" is within a string; so the page cannot take it for a tag.
std::string without_tags(std::string_view json) {
  std::string out;
  for (const char one : json) {
    if (one == '<') {
      out += "\\u003c";
    } else {
      out += one;
    }
  }
  return out;
}

}  // namespace

Result<Recording> Recording::read(const RecordingParts& parts) {
  const std::vector<RecordedLog>& logs = parts.logs;
  studio::SignalTable table(logs.front().file->info());
  for (const RecordedLog& log : logs) {
    for (const log::LoggedTopic& topic : log.file->topics()) {
      if (!has_numbers(topic)) continue;
      const auto added = table.add(source_name(log.prefix, topic.name), topic.layout);
      if (!added) return std::unexpected(added.error());
    }
  }
  Json shown = Json::array();
  std::vector<FigurePart> curves;
  for (const Figure& figure : parts.figures) {
    if (!is_over_time(figure)) continue;
    std::vector<std::string> series = figure.signals;
    if (series.empty()) {
      for (FigurePart& part : parts_of(figure)) {
        part.first = static_cast<studio::SignalId>(table.size());
        const auto names = add_source(part, table);
        if (!names) return std::unexpected(names.error());
        series.insert(series.end(), names->begin(), names->end());
        curves.push_back(std::move(part));
      }
    }
    shown.push_back({{"title", figure.title}, {"series", series}});
  }
  const auto grid = grid_of(logs, std::max<std::size_t>(table.size(), 1), parts.most);
  if (!grid) return std::unexpected(grid.error());
  Recording made(*grid, std::move(table), parts.run.robot.joints);
  std::vector<Event> events;
  Json names = Json::array();
  for (const RecordedLog& log : logs) {
    if (const Status read = add_log(log, made.table_, made.spans_); !read)
      return std::unexpected(read.error());
    auto its = events_of(log);
    if (!its) return std::unexpected(its.error());
    events.insert(events.end(), its->begin(), its->end());
    names.push_back({{"prefix", log.prefix}, {"path", log.file->path()}});
  }
  std::ranges::stable_sort(events, {}, &Event::time_s);
  for (const FigurePart& part : curves) add_curves(part, made.spans_);
  made.head_ = without_tags(fmt::format(
      R"("hello":{},"signals":{},"events":{},"urdf":{},"figures":{},"logs":{},"at_s":{},)",
      studio::hello_text(parts.run, {}), studio::signals_text(1, made.table_),
      studio::events_text(events), json_text(parts.run.urdf), json_text(shown), json_text(names),
      parts.at_s));
  return made;
}

Recording::Text Recording::text(std::size_t most) const {
  Text text;
  constexpr std::size_t kFewest = 16;
  const std::size_t rows = spans_.grid().rows;
  const std::size_t allowed = std::clamp<std::size_t>(
      kReportRows.numbers / std::max<std::size_t>(spans_.signals(), 1), 100, kReportRows.rows);
  for (std::size_t merge = (rows + allowed - 1) / allowed;; merge += (merge + 1) / 2) {
    const Packed packed = pack(spans_, merge);
    const Grid& grid = packed.grid;
    text.grid = grid;
    text.json = fmt::format(
        R"({{"format":1,{}"grid":{{"start_s":{},"step_s":{},"rows":{},"cycles":{}}},"codes":[{}],"data":"{}"}})",
        head_, grid.start_s, grid.step_s(), grid.rows, grid.cycles, codes_text(packed),
        packed.bytes);
    if (text.json.size() <= most || grid.rows <= kFewest) break;
  }
  return text;
}

std::string Recording::window(const std::vector<std::size_t>& signals, double from_s, double to_s,
                              std::size_t points) const {
  const Grid& grid = spans_.grid();
  const double rows = static_cast<double>(grid.rows);
  const auto row_at = [&](double time_s) {
    return static_cast<std::size_t>(
        std::clamp((time_s - grid.start_s) / grid.step_s() + 1e-6, 0.0, rows));
  };
  const std::size_t first = row_at(from_s);
  const std::size_t past = std::max(first, std::min(grid.rows, row_at(to_s) + 2));
  const std::size_t count = past - first;
  const std::size_t merge = count > 4 * points ? (count + 2 * points - 1) / (2 * points) : 1;
  const std::size_t cycles = grid.cycles * merge;
  const studio::FrameHead head{.signals = signals.size(),
                               .rows = (count + merge - 1) / merge,
                               .cycles = cycles,
                               .start_s = grid.start_s + grid.step_s() * static_cast<double>(first),
                               .step_s = grid.period_s * static_cast<double>(cycles)};
  std::vector<float> numbers;
  for (const std::size_t signal : signals) {
    const bool known = signal < spans_.signals();
    for (std::size_t row = first; row < first + count; row += merge) {
      float least = std::numeric_limits<float>::quiet_NaN(), largest = least;
      for (std::size_t i = row; known && i < std::min(row + merge, first + count); ++i) {
        least = studio::least(least, spans_.least(signal)[i]);
        largest = studio::largest(largest, spans_.largest(signal)[i]);
      }
      numbers.push_back(least);
      if (cycles > 1) numbers.push_back(largest);
    }
  }
  return studio::window_frame(head, numbers);
}

}  // namespace tandem::report
