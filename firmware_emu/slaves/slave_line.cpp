// A frame visits the slaves one after another, and each changes its datagrams in order.
#include "firmware_emu/slaves/slave_line.hpp"

#include <algorithm>
#include <utility>

namespace tandem::firmware::esc {

SlaveLine::SlaveLine(std::vector<Slave*> slaves, std::int64_t hop_ns)
    : slaves_(std::move(slaves)),
      hop_ns_(hop_ns),
      cable_whole_(slaves_.size(), 1),
      powered_(slaves_.size(), 1) {
  update_links();
}

std::size_t SlaveLine::reached() const noexcept {
  std::size_t count = 0;
  while (count < slaves_.size() && cable_whole_[count] != 0 && powered_[count] != 0) ++count;
  return count;
}

bool SlaveLine::pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept TANDEM_RT {
  const std::size_t count = reached();
  if (count == 0) return false;
  if (ethercat::check_frame(frame) != ethercat::LineError::kNone) {
    ++malformed_;
    return true;
  }
  frame[6] |= ethercat::kProcessedMark;
  const std::int64_t last_ns = now_ns + static_cast<std::int64_t>(count) * hop_ns_;
  for (std::size_t position = 0; position < count; ++position) {
    const std::int64_t arrived = now_ns + static_cast<std::int64_t>(position + 1) * hop_ns_;
    const bool last = position + 1 == count;
    const Passage passage{.arrived_ns = arrived, .returned_ns = last ? -1 : 2 * last_ns - arrived};
    ethercat::FrameReader reader(frame);
    ethercat::Datagram datagram;
    while (reader.next(datagram)) slaves_[position]->controller().receive(datagram, passage);
  }
  return true;
}

void SlaveLine::process(std::int64_t now_ns) noexcept TANDEM_RT {
  for (std::size_t position = 0; position < slaves_.size(); ++position) {
    if (powered_[position] == 0) continue;
    slaves_[position]->process(now_ns);
    slaves_[position]->publish();
  }
}

void SlaveLine::set_cable(std::size_t number, bool whole) noexcept TANDEM_RT {
  if (whole == (cable_whole_[number] != 0)) return;
  cable_whole_[number] = whole ? 1 : 0;
  update_links();
}

void SlaveLine::set_power(std::size_t position, bool on, std::int64_t now_ns) noexcept TANDEM_RT {
  if (on == (powered_[position] != 0)) return;
  if (on) slaves_[position]->reset(now_ns);
  powered_[position] = on ? 1 : 0;
  update_links();
}

void SlaveLine::update_links() noexcept {
  for (std::size_t position = 0; position < slaves_.size(); ++position) {
    const std::size_t next = position + 1;
    const bool before = position == 0 || powered_[position - 1] != 0;
    const bool after = next < slaves_.size() && cable_whole_[next] != 0 && powered_[next] != 0;
    slaves_[position]->controller().set_link(0, cable_whole_[position] != 0 && before);
    slaves_[position]->controller().set_link(1, after);
  }
}

void SlaveLine::archive(Archive& ar) {
  ar(cable_whole_, powered_, malformed_);
  for (Slave* slave : slaves_) ar(*slave);
}

}  // namespace tandem::firmware::esc
