// An expression's quantities are found in the log's topics by their names: the recorded robot may
// have its joints in another order.
#include "runtime/condition/recorded.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "base/nearest.hpp"
#include "hal/truth.hpp"
#include "log/log_file.hpp"
#include "log/signal_name.hpp"

namespace tandem::runtime {
namespace {

constexpr double kNotRecorded = std::numeric_limits<double>::quiet_NaN();

/// One quantity over the log's time.
struct Series {
  std::vector<double> time_ns, value;
};

double between(std::span<const double> times, std::span<const double> values, double at) noexcept {
  const auto after = std::ranges::lower_bound(times, at);
  if (after == times.end()) return kNotRecorded;
  const auto right = static_cast<std::size_t>(after - times.begin());
  if (*after == at) return values[right];
  if (right == 0) return kNotRecorded;
  const double share = (at - times[right - 1]) / (times[right] - times[right - 1]);
  return values[right - 1] + share * (values[right] - values[right - 1]);
}

struct Image {
  std::string topic;
  hal::Layout layout;
};

Result<Image> image_of(const Quantity& quantity, const QuantityNames& names) {
  switch (quantity.of) {
    case Quantity::Of::kState: return Image{"/tandem/state", names.state};
    case Quantity::Of::kCommand: return Image{"/tandem/command", names.command};
    case Quantity::Of::kTruth: return Image{"/tandem/truth", *names.truth};
    case Quantity::Of::kEstimate: return Image{"/tandem/estimate", *names.estimate};
    case Quantity::Of::kSignals:
      for (const NamedSignals& one : names.signals) {
        if (one.block == quantity.block)
          return Image{"/tandem/controller/" + one.controller, one.block->layout()};
      }
      break;
    case Quantity::Of::kLoop: break;
  }
  return fail("late cycles are of the computer: no log has them", "compare another number");
}

/// "position_rad" of "LKneeSag": the column, wherever the log has it.
Result<std::vector<log::Column>> columns_of(const Quantity& quantity, const Image& image,
                                            const log::LoggedTopic& topic, const log::LogFile& log,
                                            const QuantityNames& names) {
  const auto here = std::ranges::find_if(image.layout.fields(), [&](const hal::Field& field) {
    const std::size_t end = field.offset + field.count * hal::size_of(field.type);
    return quantity.offset >= field.offset && quantity.offset < end;
  });
  const std::size_t index = (quantity.offset - here->offset) / hal::size_of(here->type);
  const log::RunInfo info = names_in_log(names.robot);
  const std::string wanted = log::signal_name(*here, index, info);
  const std::string_view path = log.path();
  const hal::Field* const there = topic.layout.find(here->name);
  if (there == nullptr) {
    std::string left_out = log.left_out(topic.name, here->name);
    std::vector<std::string> known;
    for (const hal::Field& one : topic.layout.fields()) known.push_back(one.name);
    if (left_out.empty()) left_out = suggest(here->name, known);
    return fail("the log " + std::string(path) + " has no " + here->name + " in " + topic.name,
                left_out);
  }
  std::vector<std::string> elements;
  for (std::size_t i = 0; i < there->count; ++i)
    elements.push_back(log::signal_name(*there, i, log.info()));
  const auto found = std::ranges::find(elements, wanted);
  if (found == elements.end()) {
    return fail("the log " + std::string(path) + " has no '" + wanted + "' in " + topic.name,
                suggest(wanted, elements));
  }
  const auto first = static_cast<std::size_t>(found - elements.begin());
  std::vector<log::Column> columns{{"time_ns", 0}};
  for (std::size_t i = 0; i < (quantity.tilt ? 4U : 1U); ++i)
    columns.push_back({there->name, first + i});
  return columns;
}

Result<Series> series_of(const Quantity& quantity, const log::LogFile& log,
                         const QuantityNames& names) {
  const auto image = image_of(quantity, names);
  if (!image) return std::unexpected(image.error());
  const auto topic = log.require(image->topic);
  if (!topic) return std::unexpected(topic.error());
  const auto columns = columns_of(quantity, *image, **topic, log, names);
  if (!columns) return std::unexpected(columns.error());
  auto read = log.read(image->topic, *columns);
  if (!read) return std::unexpected(read.error());
  Series series{.time_ns = std::move(read->columns[0]), .value = std::move(read->columns[1])};
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    if (!quantity.tilt) {
      series.value[i] *= quantity.factor;
      continue;
    }
    const std::array turned{series.value[i], read->columns[2][i], read->columns[3][i],
                            read->columns[4][i]};
    series.value[i] = hal::tilt_of(turned);
  }
  return series;
}

}  // namespace

Result<Recorded> Recorded::read(const Expression& expression, const QuantityNames& names,
                                const log::LogFile& log) {
  const std::span<const Quantity> quantities = expression.quantities();
  if (quantities.empty()) {
    return fail("'" + expression.text() + "' names no number of the run",
                "write one, such as position(JOINT)");
  }
  std::vector<Series> all;
  for (const Quantity& quantity : quantities) {
    auto series = series_of(quantity, log, names);
    if (!series) return std::unexpected(series.error());
    if (series->time_ns.empty())
      return fail(
          "the log " + std::string(log.path()) + " has no sample of '" + expression.text() + "'",
          "record it again");
    all.push_back(std::move(*series));
  }
  Recorded recorded;
  std::vector<double> now(quantities.size());
  for (const double time_ns : all.front().time_ns) {
    for (std::size_t i = 0; i < all.size(); ++i)
      now[i] = between(all[i].time_ns, all[i].value, time_ns);
    recorded.time_ns_.push_back(static_cast<std::int64_t>(time_ns));
    recorded.values_.push_back(expression.value(now));
  }
  return recorded;
}

double Recorded::at(std::int64_t time_ns) const noexcept TANDEM_RT {
  const auto after = std::ranges::lower_bound(time_ns_, time_ns);
  if (after == time_ns_.end()) return kNotRecorded;
  const auto right = static_cast<std::size_t>(after - time_ns_.begin());
  if (*after == time_ns) return values_[right];
  if (right == 0) return kNotRecorded;
  const double share = static_cast<double>(time_ns - time_ns_[right - 1]) /
                       static_cast<double>(time_ns_[right] - time_ns_[right - 1]);
  return values_[right - 1] + share * (values_[right] - values_[right - 1]);
}

}  // namespace tandem::runtime
