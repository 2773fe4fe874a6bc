// The logical space begins at 0; a slave's data never crosses the end of a frame.
#include "hal/ethercat-can/line/process_image.hpp"

#include <algorithm>

namespace tandem::hal::ecat {

namespace {

// Bytes of a frame that a group may fill, so that the datagrams of state and clock fit beside it.
constexpr std::size_t kMostOfGroup = 1400;

}  // namespace

ProcessImage::ProcessImage(const std::vector<SlavePlan>& plans) {
  for (const SlavePlan& plan : plans) {
    mappings_.push_back({.outputs = static_cast<std::uint16_t>(bytes_of(plan.outputs)),
                         .inputs = static_cast<std::uint16_t>(bytes_of(plan.inputs))});
  }
  std::size_t at = 0;
  for (std::size_t slave = 0; slave < mappings_.size();) {
    Group group{.first = slave, .last = slave, .begin = at};
    for (; slave < mappings_.size(); group.last = ++slave) {
      const std::size_t more = std::size_t{mappings_[slave].outputs} + mappings_[slave].inputs;
      if (group.bytes != 0 && group.bytes + more > kMostOfGroup) break;
      group.bytes += more;
    }
    for (std::size_t i = group.first; i < group.last; ++i) {
      mappings_[i].outputs_at = static_cast<std::uint32_t>(at);
      at += mappings_[i].outputs;
    }
    group.outputs = at - group.begin;
    for (std::size_t i = group.first; i < group.last; ++i) {
      mappings_[i].inputs_at = static_cast<std::uint32_t>(at);
      at += mappings_[i].inputs;
    }
    if (group.bytes != 0) groups_.push_back(group);
  }
  out_.resize(at);
  in_.resize(at);
}

std::span<std::uint8_t> ProcessImage::outputs(std::size_t slave) noexcept TANDEM_RT {
  return std::span(out_).subspan(mappings_[slave].outputs_at, mappings_[slave].outputs);
}

std::span<const std::uint8_t> ProcessImage::inputs(std::size_t slave) const noexcept TANDEM_RT {
  return std::span(in_).subspan(mappings_[slave].inputs_at, mappings_[slave].inputs);
}

void ProcessImage::begin(std::uint8_t index,
                         std::span<const SlaveMaster> slaves) noexcept TANDEM_RT {
  index_ = index;
  for (Group& group : groups_) {
    group.back = false;
    group.counter = 0;
    group.expected = 0;
    for (std::size_t i = group.first; i < group.last; ++i) {
      if (!slaves[i].mapped()) continue;
      group.expected =
          static_cast<std::uint16_t>(group.expected + (mappings_[i].outputs != 0 ? 2 : 0) +
                                     (mappings_[i].inputs != 0 ? 1 : 0));
    }
  }
}

void ProcessImage::send(FrameBatch& batch) noexcept TANDEM_RT {
  for (const Group& group : groups_) {
    if (group.back) continue;
    const std::span<std::uint8_t> data = batch.add(
        ethercat::Command::kLrw, index_, static_cast<std::uint32_t>(group.begin), group.bytes);
    if (data.empty()) return;
    std::copy_n(out_.begin() + static_cast<std::ptrdiff_t>(group.begin), group.bytes, data.begin());
  }
}

std::size_t ProcessImage::write(FrameBatch& batch) noexcept TANDEM_RT {
  std::size_t datagrams = 0;
  for (const Group& group : groups_) {
    if (group.outputs == 0) continue;
    const std::span<std::uint8_t> data = batch.add(
        ethercat::Command::kLwr, index_, static_cast<std::uint32_t>(group.begin), group.outputs);
    if (data.empty()) break;
    std::copy_n(out_.begin() + static_cast<std::ptrdiff_t>(group.begin), group.outputs,
                data.begin());
    ++datagrams;
  }
  return datagrams;
}

bool ProcessImage::take(const ethercat::Datagram& datagram) noexcept TANDEM_RT {
  if (datagram.command() != ethercat::Command::kLrw || datagram.index() != index_) return false;
  for (Group& group : groups_) {
    if (group.begin != datagram.address() || group.bytes != datagram.data().size()) continue;
    if (group.back) return false;
    group.back = true;
    group.counter = datagram.working_counter();
    if (group.counter < group.expected) return true;  // nobody knows whose inputs are missing
    std::ranges::copy(datagram.data(), in_.begin() + static_cast<std::ptrdiff_t>(group.begin));
    return true;
  }
  return false;
}

bool ProcessImage::complete() const noexcept { return std::ranges::all_of(groups_, &Group::back); }

unsigned ProcessImage::counter() const noexcept {
  unsigned sum = 0;
  for (const Group& group : groups_) sum += group.counter;
  return sum;
}

unsigned ProcessImage::expected() const noexcept {
  unsigned sum = 0;
  for (const Group& group : groups_) sum += group.expected;
  return sum;
}

}  // namespace tandem::hal::ecat
