#include "runtime/replay/command_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "log/schema.hpp"
#include "log/signal_name.hpp"

namespace tandem::runtime {

CommandComparison::CommandComparison(const hal::Layout& log, const hal::ImageShape& shape,
                                     const log::RunInfo& info)
    : info_(info), recorded_(shape), replayed_(shape), copy_(log, recorded_.layout()) {
  for (const hal::Field& field : recorded_.layout().fields()) {
    std::vector<CommandSpread>& each = spreads_.emplace_back(field.count);
    const bool by_joint = log::named_by(field, info) == "joints";
    for (std::size_t i = 0; i < each.size(); ++i) {
      each[i].field = field.name;
      if (by_joint) each[i].joint = log::element_name(field, i, info);
    }
  }
}

std::int32_t CommandComparison::take(const hal::CommandImage& replayed,
                                     std::span<const std::byte> recorded, std::int64_t time_ns) {
  ++cycles_;
  recorded_.assign(replayed);  // what the log lacks is not compared
  copy_(recorded, recorded_.bytes());
  const std::span<const std::byte> a = recorded_.bytes(), b = replayed.bytes();
  if (std::memcmp(a.data(), b.data(), a.size()) == 0) return -1;
  ++differ_;
  joint_ = -1;
  replayed_.assign(replayed);
  for (const hal::Field& field : recorded_.layout().fields()) {
    const std::size_t size = hal::size_of(field.type);
    for (std::size_t i = 0; i < field.count; ++i) {
      const std::size_t at = field.offset + i * size;
      if (std::memcmp(a.data() + at, b.data() + at, size) != 0) look(field, i, time_ns);
    }
  }
  return joint_;
}

void CommandComparison::look(const hal::Field& field, std::size_t index, std::int64_t time_ns) {
  const auto number = static_cast<std::size_t>(&field - recorded_.layout().fields().data());
  CommandSpread& spread = spreads_[number][index];
  const double was = log::element(field, recorded_.bytes(), index);
  const double is = log::element(field, replayed_.bytes(), index);
  if (!first_) {
    first_ = {.cycle = replayed_.cycle()[0],
              .time_ns = time_ns,
              .joint = spread.joint,
              .field = field.name,
              .recorded = was,
              .replayed = is};
    if (!spread.joint.empty()) joint_ = static_cast<std::int32_t>(index);
  }
  const double apart = std::abs(is - was);
  if (spread.cycles++ == 0) spread.first_ns = time_ns;
  if (spread.cycles == 1 || apart > spread.largest || std::isnan(apart)) {
    spread.largest = apart;
    spread.time_ns = time_ns;
  }
}

std::vector<CommandSpread> CommandComparison::spreads() const {
  std::vector<CommandSpread> all;
  for (const auto& field : spreads_) {
    for (const CommandSpread& one : field) {
      if (one.cycles > 0) all.push_back(one);
    }
  }
  std::ranges::stable_sort(all, {}, [this](const CommandSpread& one) {
    return std::ranges::find(info_.joints, one.joint) - info_.joints.begin();
  });
  return all;
}

}  // namespace tandem::runtime
