// Ages are those of the topic itself; a command's are those of the state beside it.
#include "log/unmeasured.hpp"

#include <algorithm>
#include <limits>

#include "log/schema.hpp"

namespace tandem::log {
namespace {

constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

/// The cycle in which each joint was first measured, by the state `topic`; empty: not known.
Result<std::vector<std::uint64_t>> first_cycles(const LogFile& log, const std::string& topic) {
  const LoggedTopic* state = log.find(topic);
  const hal::Field* age = state == nullptr ? nullptr : state->layout.find("age_cycles");
  const hal::Field* cycle = state == nullptr ? nullptr : state->layout.find("cycle");
  if (age == nullptr || cycle == nullptr) return std::vector<std::uint64_t>();
  std::vector<std::uint64_t> first(age->count, kNever);
  const Status done = log.for_each(topic, [&](std::int64_t, std::span<const std::byte> body) {
    const double now = element(*cycle, body, 0);
    for (std::size_t i = 0; i < first.size(); ++i) {
      const double old = element(*age, body, i);
      if (first[i] == kNever && old <= now) first[i] = static_cast<std::uint64_t>(now - old);
    }
  });
  if (!done) return std::unexpected(done.error());
  return first;
}

}  // namespace

Ages ages_of(const hal::Layout& layout, const hal::Field& field, const RunInfo& robot) {
  if (field.type != hal::FieldType::kF64) return {};
  const bool sensor = field.name == "sensor";
  const hal::Field* age = layout.find(sensor ? "sensor_age_cycles" : "age_cycles");
  if (age == nullptr) return {};
  std::vector<std::uint64_t> of;
  for (std::size_t i = 0; !sensor && i < field.count; ++i) of.push_back(i);
  for (std::size_t s = 0; sensor && s < robot.sensors.size(); ++s)
    of.insert(of.end(), robot.sensors[s].channels, s);
  const bool fits = of.size() == field.count && (of.empty() || of.back() < age->count);
  return fits ? Ages{age, std::move(of)} : Ages{};
}

Result<Unmeasured> Unmeasured::of(const LogFile& log, const LoggedTopic& topic) {
  Unmeasured out;
  const hal::Layout& layout = topic.layout;
  out.cycle_ = layout.find("cycle");
  out.rows_.resize(layout.fields().size());
  if (out.cycle_ == nullptr) return out;
  for (std::size_t f = 0; f < layout.fields().size(); ++f) {
    Ages ages = ages_of(layout, layout.fields()[f], log.info());
    out.rows_[f] = {ages.field, std::move(ages.of)};
  }
  constexpr std::string_view kCommand = "/command";
  if (!topic.name.ends_with(kCommand)) return out;
  const std::string stem = topic.name.substr(0, topic.name.size() - kCommand.size());
  Result<std::vector<std::uint64_t>> first = first_cycles(log, stem + "/state");
  if (!first) return std::unexpected(first.error());
  for (std::size_t f = 0; f < layout.fields().size(); ++f) {
    const hal::Field& field = layout.fields()[f];
    if (field.name == "position_rad" && field.count == first->size()) out.rows_[f].of = *first;
  }
  return out;
}

bool Unmeasured::is(std::size_t field, std::size_t index, std::span<const std::byte> body) const {
  const Row& row = rows_[field];
  if (row.of.empty()) return false;
  const double now = element(*cycle_, body, 0);
  if (row.age == nullptr)
    return row.of[index] == kNever || now < static_cast<double>(row.of[index]);
  return element(*row.age, body, row.of[index]) > now;
}

}  // namespace tandem::log
