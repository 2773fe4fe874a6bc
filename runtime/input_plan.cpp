#include "runtime/input_plan.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "base/nearest.hpp"
#include "base/open_file.hpp"
#include "log/log_file.hpp"

namespace tandem::runtime {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;
constexpr std::size_t kMostRows = 1'000'000;

/// A row of a timeline, and where it stands.
struct Row {
  double time_s = 0.0;
  std::vector<double> numbers;  ///< after it
  int line = 0;
};

/// What a file or a timeline says before it is samples.
struct Rows {
  std::string file;
  std::vector<std::string> components;
  std::vector<Row> rows;
};

std::unexpected<Error> wrong(Error at, std::string message, std::string hint) {
  at.message = std::move(message);
  at.hint = std::move(hint);
  return std::unexpected(std::move(at));
}

/// The columns of a timeline that names none: of a trajectory each way-point's time and positions.
std::vector<std::string> every_component(const InputBlock& block) {
  std::vector<std::string> all = block.components;
  if (block.kind == InputKind::kTrajectory) all.insert(all.begin(), "after_s");
  return all;
}

std::vector<std::string> cut(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream in(line);
  for (std::string word; std::getline(in, word, ',');) words.push_back(word);
  return words;
}

Result<Rows> read_csv(const std::string& file) {
  const Result<std::string> text = read_file(file, "is `file` right?", kMostBytes);
  if (!text) return std::unexpected(text.error());
  std::istringstream in(*text);
  Rows out{.file = file, .components = {}, .rows = {}};
  std::string line;
  const auto at = [&](int number) {
    return Error{.message = {}, .hint = {}, .file = file, .line = number, .key = {}};
  };
  const auto next = [&] {
    if (!std::getline(in, line)) return false;
    if (line.ends_with('\r')) line.pop_back();
    return true;
  };
  if (!next() || !line.starts_with("time_s,")) {
    return wrong(at(1), "does not begin with the names of the columns",
                 "the first line is time_s and the input's components, with commas");
  }
  out.components = cut(line);
  out.components.erase(out.components.begin());
  for (int number = 2; next(); ++number) {
    Row row;
    row.line = number;
    const std::vector<std::string> words = cut(line);
    for (const std::string& word : words) {
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (end == word.c_str() || *end != '\0' || !std::isfinite(value)) {
        return wrong(at(number), "'" + word.substr(0, 40) + "' is no finite number", {});
      }
      row.numbers.push_back(value);
    }
    if (row.numbers.size() != out.components.size() + 1) {
      return wrong(at(number),
                   fmt::format("has {} numbers for {} columns", row.numbers.size(),
                               out.components.size() + 1),
                   "write a number for each name of the first line");
    }
    row.time_s = row.numbers.front();
    row.numbers.erase(row.numbers.begin());
    if (out.rows.size() == kMostRows) {
      return wrong(at(number), "there are more than 1000000 rows", "use fewer");
    }
    out.rows.push_back(std::move(row));
  }
  return out;
}

Rows rows_of(const PlannedInput& input, const InputSource& source) {
  Rows out{.file = {}, .components = source.components, .rows = {}};
  if (out.components.empty()) out.components = every_component(input.block);
  for (const std::vector<double>& numbers : source.timeline) {
    if (numbers.empty()) continue;
    out.rows.push_back({numbers.front(), {numbers.begin() + 1, numbers.end()}, 0});
  }
  return out;
}

/// Way-points of one time, as a sample of a trajectory.
std::vector<double> trajectory_of(const InputBlock& block, std::span<const Row> points) {
  std::vector<double> sample(block.values(), 0.0);
  const std::size_t step = 1 + 2 * block.components.size();
  sample[0] = static_cast<double>(points.size());
  for (std::size_t p = 0; p < std::min(points.size(), block.options.most_points); ++p) {
    std::ranges::copy(points[p].numbers,
                      sample.begin() + static_cast<std::ptrdiff_t>(2 + p * step));
  }
  return sample;
}

Result<InputPlan> plan_of(const PlannedInput& input, const Rows& rows, const InputSource& source) {
  const bool points = input.block.kind == InputKind::kTrajectory;
  InputPlan plan;
  double before_s = 0.0;
  const auto at = [&](std::size_t r) {
    if (rows.file.empty()) return source.where;
    return Error{.message = {},
                 .hint = {},
                 .file = rows.file,
                 .line = r < rows.rows.size() ? rows.rows[r].line : 1,
                 .key = {}};
  };
  const auto place = [&](std::size_t r) {
    return rows.file.empty() ? fmt::format("row {} of its timeline ", r + 1) : std::string();
  };
  if (points && rows.components != every_component(input.block)) {
    return wrong(at(0),
                 "a way-point is not " +
                     fmt::format("after_s and its {} joints", input.block.components.size()),
                 "leave `components` out, and name the joints in their order in a file");
  }
  for (std::size_t r = 0; r < rows.rows.size(); ++r) {
    const std::size_t numbers = rows.rows[r].numbers.size();
    if (numbers == rows.components.size()) continue;
    return wrong(at(r),
                 place(r) + fmt::format("has {} numbers after its time, not {}", numbers,
                                        rows.components.size()),
                 "a row is the time [s], then each of `components`, or of the input's");
  }
  for (std::size_t r = 0; r < rows.rows.size();) {
    const Row& row = rows.rows[r];
    if (!(row.time_s >= before_s) || row.time_s > 1e6) {
      return wrong(at(r), place(r) + "is not later than the one before, or beyond 1e6 s",
                   "times are seconds after the controller's start, and grow");
    }
    std::size_t end = r + 1;
    while (points && end < rows.rows.size() && rows.rows[end].time_s == row.time_s) ++end;
    auto sample = points ? Result<std::vector<double>>(
                               trajectory_of(input.block, std::span(rows.rows).subspan(r, end - r)))
                         : sample_of(input.block, input.without, rows.components, row.numbers);
    if (!sample) return wrong(at(r), sample.error().message, sample.error().hint);
    if (const Status fits = input.check(*sample); !fits) {
      return wrong(at(r), place(r) + fits.error().key + " " + fits.error().message,
                   fits.error().hint);
    }
    const auto cycle = static_cast<std::uint64_t>(
        std::llround(row.time_s * 1e9 / static_cast<double>(input.period_ns)));
    if (!plan.at.empty() && cycle <= plan.at.back()) {
      return wrong(at(r), place(r) + "is in the same cycle as the one before",
                   "leave one of them out");
    }
    plan.at.push_back(cycle);
    plan.number.push_back(rows.file.empty() ? r + 1 : static_cast<std::size_t>(row.line));
    plan.values.insert(plan.values.end(), sample->begin(), sample->end());
    before_s = row.time_s;
    r = end;
  }
  plan.repeat_cycles = static_cast<std::uint64_t>(
      std::llround(source.repeat_s * 1e9 / static_cast<double>(input.period_ns)));
  return plan;
}

/// The samples of this input that a log has, in their cycles.
Result<InputPlan> read_log(const PlannedInput& input, const InputSource& source) {
  if (source.repeat_s > 0.0) {
    return wrong(source.where, "a log's samples arrive as they did", "leave out repeat_s");
  }
  const auto file = log::LogFile::open(source.file);
  if (!file) return std::unexpected(file.error());
  if (file->damage_loses_messages()) {
    const Error damaged{.message = {}, .hint = {}, .file = source.file, .line = 0, .key = {}};
    return wrong(damaged, "is damaged, so its inputs cannot be replayed: " + file->damage().front(),
                 "copy the file again");
  }
  if (const Status whole = file->require_samples(); !whole) return std::unexpected(whole.error());
  const std::string topic = "/tandem/input/" + input.controller + "/" + input.block.name;
  if (const auto found = file->require(topic); !found) return std::unexpected(found.error());
  InputPlan plan{.at = {}, .values = {}, .number = {}, .of_run = true};
  const std::size_t size = input.block.values();
  bool right = true;
  const Status read = file->for_each(topic, [&](std::int64_t, std::span<const std::byte> body) {
    right = right && body.size() == (2 + size) * sizeof(double);
    if (!right) return;
    std::uint64_t cycle = 0;
    std::memcpy(&cycle, body.data(), sizeof cycle);
    plan.at.push_back(cycle);
    plan.values.resize(plan.values.size() + size);
    std::memcpy(plan.values.data() + plan.values.size() - size, body.data() + 16,
                size * sizeof(double));
  });
  if (!read) return std::unexpected(read.error());
  const Error where{.message = {}, .hint = {}, .file = source.file, .line = 0, .key = topic};
  if (!right)
    return wrong(where, "has other components than the input", "replay the same controller");
  if (!std::ranges::is_sorted(plan.at)) return wrong(where, "its cycles fall", {});
  for (std::size_t r = 0; r < plan.at.size(); ++r) {
    if (const Status fits = input.check(plan.row(r, size)); !fits) {
      return wrong(where, fits.error().key + " " + fits.error().message, fits.error().hint);
    }
  }
  return plan;
}

}  // namespace

Result<std::vector<double>> sample_of(const InputBlock& block, std::span<const double> without,
                                      std::span<const std::string> components,
                                      std::span<const double> numbers) {
  std::vector<double> sample(without.begin(), without.end());
  for (std::size_t i = 0; i < components.size(); ++i) {
    const auto found = std::ranges::find(block.components, components[i]);
    if (found == block.components.end()) {
      return fail("the input '" + block.name + "' has no component '" + components[i] + "'",
                  suggest(components[i], block.components));
    }
    sample[static_cast<std::size_t>(found - block.components.begin())] = numbers[i];
  }
  return sample;
}

Result<InputPlan> make_plan(const PlannedInput& input, const InputSource& source) {
  if (source.feeder == InputFeeder::kTimeline)
    return plan_of(input, rows_of(input, source), source);
  if (source.feeder != InputFeeder::kFile) return InputPlan{};
  if (source.file.ends_with(".mcap")) return read_log(input, source);
  const Result<Rows> rows = read_csv(source.file);
  if (!rows) return std::unexpected(rows.error());
  return plan_of(input, *rows, source);
}

}  // namespace tandem::runtime
