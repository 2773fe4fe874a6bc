// How a datagram reaches registers and memory: addressing, working counter, FMMUs. What the
// registers do is in esc_registers.cpp.
#include "firmware_emu/slaves/esc.hpp"

#include <algorithm>

namespace tandem::firmware::esc {

using ethercat::Command;
using ethercat::Datagram;
using ethercat::Fmmu;
namespace reg = ethercat::reg;

namespace {

struct Access {
  bool read = false;
  bool write = false;
};

constexpr Access access_of(Command command) noexcept {
  switch (command) {
    case Command::kAprd:
    case Command::kFprd:
    case Command::kBrd:
    case Command::kLrd: return {.read = true};
    case Command::kApwr:
    case Command::kFpwr:
    case Command::kBwr:
    case Command::kLwr: return {.write = true};
    case Command::kAprw:
    case Command::kFprw:
    case Command::kBrw:
    case Command::kLrw: return {.read = true, .write = true};
    case Command::kNop:
    case Command::kArmw:
    case Command::kFrmw: break;  // depend on the slave
  }
  return {};
}

constexpr bool is_broadcast(Command command) noexcept {
  return command == Command::kBrd || command == Command::kBwr || command == Command::kBrw;
}

constexpr bool is_by_position(Command command) noexcept {
  return command == Command::kAprd || command == Command::kApwr || command == Command::kAprw ||
         command == Command::kArmw;
}

}  // namespace

void Esc::receive(Datagram& datagram, const Passage& passage) noexcept TANDEM_RT {
  const Command command = datagram.command();
  if (command == Command::kNop) return;
  if (ethercat::is_logical(command)) return logical_datagram(datagram, passage);
  const bool mine = addressed(datagram);
  register_datagram(datagram, mine, passage);
  if (is_by_position(command) || is_broadcast(command)) {
    datagram.set_slave(static_cast<std::uint16_t>(datagram.slave() + 1));
  }
}

bool Esc::addressed(Datagram& datagram) const noexcept {
  const Command command = datagram.command();
  if (is_broadcast(command)) return true;
  if (is_by_position(command)) return datagram.slave() == 0;
  if (datagram.slave() == at<std::uint16_t>(reg::kStation)) return true;
  const bool by_alias = (memory_[reg::kDlControl + 3] & 1) != 0;
  return by_alias && datagram.slave() == at<std::uint16_t>(reg::kAlias);
}

void Esc::register_datagram(Datagram& datagram, bool mine, const Passage& passage) noexcept {
  const Command command = datagram.command();
  Access access = access_of(command);
  if (command == Command::kArmw || command == Command::kFrmw) {
    access = {.read = mine, .write = !mine};
  } else if (!mine) {
    return;
  }
  const std::span<std::uint8_t> data = datagram.data();
  if (access.read && access.write) {
    // The slave takes what comes in and sends what it had.
    if (data.size() > scratch_.size()) return;
    std::copy(data.begin(), data.end(), scratch_.begin());
    const bool merge = is_broadcast(command);
    if (read(datagram.offset(), data, merge, passage)) datagram.add_working_counter(1);
    if (write(datagram.offset(), {scratch_.data(), data.size()}, passage)) {
      datagram.add_working_counter(2);
    }
    return;
  }
  const bool done = access.read ? read(datagram.offset(), data, is_broadcast(command), passage)
                                : write(datagram.offset(), data, passage);
  if (done) datagram.add_working_counter(1);
}

void Esc::logical_datagram(Datagram& datagram, const Passage& passage) noexcept {
  const Access access = access_of(datagram.command());
  bool has_written = false;
  bool has_read = false;
  for (const bool writes : {true, false}) {  // incoming data is taken before it is replaced
    if (writes ? !access.write : !access.read) continue;
    for (std::size_t number = 0; number < kFmmus; ++number) {
      const Fmmu fmmu = ethercat::get_fmmu(&memory_[reg::kFmmu + ethercat::kFmmuBytes * number]);
      if (!fmmu.active || !(writes ? fmmu.writes : fmmu.reads)) continue;
      const bool done = map_bits(fmmu, datagram.address(), datagram.data(), writes, passage);
      (writes ? has_written : has_read) |= done;
    }
  }
  if (has_read) datagram.add_working_counter(1);
  if (has_written) datagram.add_working_counter(access.read ? 2 : 1);
}

bool Esc::map_bits(const Fmmu& fmmu, std::uint32_t address, std::span<std::uint8_t> data,
                   bool write_data, const Passage& passage) noexcept {
  // Bits of the logical space that are in the map and in the datagram, both as [begin, end).
  if (fmmu.length == 0) return false;
  const std::int64_t first = 8 * std::int64_t{fmmu.logical} + fmmu.first_bit;
  const std::int64_t last = 8 * (std::int64_t{fmmu.logical} + fmmu.length - 1) + fmmu.last_bit + 1;
  const std::int64_t origin = 8 * std::int64_t{address};
  const std::int64_t begin = std::max(first, origin);
  const std::int64_t end = std::min(last, origin + 8 * static_cast<std::int64_t>(data.size()));
  if (begin >= end) return false;
  const std::int64_t physical = 8 * std::int64_t{fmmu.physical} + fmmu.physical_bit + begin - first;
  const auto from = static_cast<std::size_t>(physical / 8);
  const auto size = static_cast<std::size_t>((physical + end - begin + 7) / 8) - from;
  if (size > scratch_.size() || from + size > kMemoryBytes) return false;
  if (((begin - origin) | (end - origin) | physical) % 8 == 0) {  // whole bytes, as nearly always
    const auto at = static_cast<std::size_t>((begin - origin) / 8);
    const std::span<std::uint8_t> here = data.subspan(at, size);
    return write_data ? write(from, here, passage) : read(from, here, false, passage);
  }
  const std::span<std::uint8_t> bytes(scratch_.data(), size);
  if (write_data) {
    std::copy_n(&memory_[from], size, bytes.begin());
  } else if (!read(from, bytes, false, passage)) {
    return false;
  }
  for (std::int64_t bit = begin; bit < end; ++bit) {
    const auto here = static_cast<std::size_t>(bit - origin);
    const auto there = static_cast<std::size_t>(physical + bit - begin) - 8 * from;
    std::uint8_t& to = write_data ? bytes[there / 8] : data[here / 8];
    const unsigned value =
        write_data ? data[here / 8] >> (here % 8) : bytes[there / 8] >> (there % 8);
    const std::size_t shift = write_data ? there % 8 : here % 8;
    to = static_cast<std::uint8_t>((to & ~(1u << shift)) | ((value & 1u) << shift));
  }
  return !write_data || write(from, bytes, passage);
}

bool Esc::read(std::size_t address, std::span<std::uint8_t> out, bool merge,
               const Passage& passage) noexcept {
  if (out.empty() || address + out.size() > kMemoryBytes) return false;
  if (no_clock_here(address, out.size())) return false;
  if (!managers_allow(address, out.size(), false)) return false;
  refresh(address, out.size(), passage);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint8_t>(memory_[address + i] | (merge ? out[i] : 0));
  }
  managers_done(address, out.size(), false, passage.arrived_ns);
  return true;
}

// A sync manager's mailbox is begun at its first byte and ended at its last one. Buffers are
// handed over whole anyway, because a frame passes within one call.
bool Esc::managers_allow(std::size_t address, std::size_t size, bool write_access) noexcept {
  for (std::size_t number = 0; number < kManagers; ++number) {
    const ethercat::SyncManager one = manager(number);
    const std::size_t begin = one.start;
    const std::size_t end = begin + one.length;
    if (!one.active || address >= end || address + size <= begin) continue;
    if (one.written() != write_access) return false;
    if (!one.mailbox()) continue;
    const bool full = (one.status & ethercat::kMailboxFull) != 0;
    if (full == write_access) return false;
    if (address <= begin) open_[number] = true;
    if (!open_[number]) return false;
  }
  return true;
}

void Esc::managers_done(std::size_t address, std::size_t size, bool write_access,
                        std::int64_t now_ns) noexcept {
  for (std::size_t number = 0; number < kManagers; ++number) {
    const ethercat::SyncManager one = manager(number);
    const std::size_t end = std::size_t{one.start} + one.length;
    if (!one.active || one.length == 0 || address >= end || address + size < end) continue;
    if (one.mailbox()) {
      std::uint8_t& status = memory_[reg::kSyncManager + ethercat::kSyncManagerBytes * number + 5];
      open_[number] = false;
      status = static_cast<std::uint8_t>(write_access ? status | ethercat::kMailboxFull
                                                      : status & ~ethercat::kMailboxFull);
    } else if (write_access) {
      if (one.watched()) fed_ns_ = now_ns;
      if (number == 2) outputs_written_ = true;
    }
  }
}

}  // namespace tandem::firmware::esc
