#include "studio/unmeasured.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>

#include "log/unmeasured.hpp"

namespace tandem::studio {
namespace {

/// The first id of a source's field.
SignalId first_id(const SignalTable& table, std::string_view source, std::string_view name) {
  const auto its = std::ranges::find(table.sources(), source, &Source::name);
  SignalId id = its->first;
  for (const SourceField& field : its->fields) {
    if (field.name == name) break;
    id += static_cast<SignalId>(field.count);
  }
  return id;
}

template <class Number>
Number number_at(std::span<const std::byte> image, std::size_t at) {
  Number number;
  std::memcpy(&number, image.data() + at, sizeof number);
  return number;
}

}  // namespace

Unmeasured::Unmeasured(const SignalTable& table, const Tap::Images& images,
                       const log::RunInfo& robot) {
  if (images.state == nullptr) return;
  const hal::Layout& state = images.state->layout();
  cycle_at_ = state.find("cycle")->offset;
  const auto add = [&](const hal::Field& age, std::size_t element, SignalId id) {
    const std::size_t at = age.offset + element * sizeof(std::uint32_t);
    const auto found = std::ranges::find(ages_, at, &Age::at);
    (found == ages_.end() ? ages_.emplace_back(at) : *found).ids.push_back(id);
  };
  for (const hal::Field& field : state.fields()) {
    const log::Ages ages = log::ages_of(state, field, robot);
    SignalId id = first_id(table, "state", field.name);
    for (const std::uint64_t element : ages.of) add(*ages.field, element, id++);
  }
  if (images.command == nullptr) return;
  const hal::Field& age = *state.find("age_cycles");
  SignalId id = first_id(table, "command", "position_rad");
  for (std::size_t joint = 0; joint < age.count; ++joint) add(age, joint, id++);
}

void Unmeasured::drop(std::span<const std::byte> state, std::span<float> row) const {
  if (state.empty()) return;
  const auto cycle = number_at<std::uint64_t>(state, cycle_at_);
  for (const Age& age : ages_) {
    if (number_at<std::uint32_t>(state, age.at) <= cycle) continue;
    for (const SignalId id : age.ids) row[id] = std::numeric_limits<float>::quiet_NaN();
  }
}

}  // namespace tandem::studio
