#include "hal/ethercat-can/line/slave_clock.hpp"

#include <algorithm>
#include <array>

#include "ethercat/registers.hpp"

namespace tandem::hal::ecat {

using canopen::get;
using canopen::put;
namespace reg = ethercat::reg;

namespace {

constexpr std::size_t kLatched = 0x20;

}  // namespace

void SlaveClock::ask(int part, Exchange& exchange, std::size_t channel,
                     const ClockReference& reference) const noexcept TANDEM_RT {
  static constexpr std::array<std::uint8_t, 2> kSpeedStart{0x00, 0x10};
  static constexpr std::array<std::uint8_t, 2> kOff{};
  static constexpr std::array<std::uint8_t, 2> kOn{
      0, std::uint8_t{ethercat::kSyncCyclic} | std::uint8_t{ethercat::kSync0On}};
  switch (part) {
    case 0: return exchange.read_at(channel, station_, reg::kDlStatus, 2);
    case 1: return exchange.read_at(channel, reference.station, reg::kReceiveTime, kLatched);
    case 2: return exchange.read_at(channel, station_, reg::kReceiveTime, kLatched);
    case 3: {
      std::array<std::uint8_t, 12> times{};
      put(&times[0], offset_ns_);
      put(&times[8], delay_ns_);
      return exchange.write_at(channel, station_, reg::kTimeOffset, times);
    }
    case 4: return exchange.write_at(channel, station_, reg::kSpeedStart, kSpeedStart);
    case 5: return exchange.write_at(channel, station_, reg::kSyncControl, kOff);
    case 6: return exchange.read_at(channel, station_, reg::kSystemTime, 8);
    case 7: {
      std::array<std::uint8_t, 24> times{};  // start (8), others (8), cycles of SYNC0 and SYNC1
      put(&times[0], sync0_start_ns_);
      put(&times[16], static_cast<std::uint32_t>(sync0_cycle_ns_));
      return exchange.write_at(channel, station_, reg::kSyncStart, times);
    }
    default: return exchange.write_at(channel, station_, reg::kSyncControl, kOn);
  }
}

bool SlaveClock::take(int part, std::span<const std::uint8_t> data, std::int64_t now_ns,
                      ClockReference& reference) noexcept TANDEM_RT {
  const auto latched = [&](bool behind) {
    return Latched{.arrived = get<std::uint32_t>(&data[0]),
                   .returned = get<std::uint32_t>(&data[4]),
                   .behind = behind,
                   .local_ns = get<std::uint64_t>(&data[0x18])};
  };
  switch (part) {
    case 0: behind_ = (get<std::uint16_t>(data.data()) & ethercat::open_bit(1)) != 0; break;
    case 1: reference_times_ = latched(reference.station != station_ || behind_); break;
    case 2: {
      const Latched own = latched(behind_);
      is_reference_ = reference.station == station_;
      if (is_reference_) {  // its system time is the loop's
        reference.offset_ns = static_cast<std::uint64_t>(now_ns) - own.local_ns;
      }
      delay_ns_ = ecat::delay_ns(reference_times_, own);
      offset_ns_ = ecat::offset_ns(reference_times_, reference.offset_ns, own);
      break;
    }
    case 3: reference.set |= is_reference_; break;
    case 6:
      sync0_start_ns_ =
          ecat::sync0_start_ns(get<std::uint64_t>(data.data()), kSync0LeadNs, sync0_cycle_ns_);
      break;
    default: break;
  }
  return part == 8 || (part == 5 && sync0_cycle_ns_ == 0);
}

void SlaveClock::take_difference(std::span<const std::uint8_t> data,
                                 bool counts) noexcept TANDEM_RT {
  if (is_reference_) return;  // the register has what an earlier reference left there
  const auto raw = get<std::uint32_t>(data.data());
  const auto size = static_cast<std::int32_t>(raw & ~ethercat::kDifferenceSign);
  difference_ns_ = (raw & ethercat::kDifferenceSign) != 0 ? -size : size;
  if (!counts) return;
  figures_.least = figures_.count == 0 ? difference_ns_ : std::min(figures_.least, difference_ns_);
  figures_.most = figures_.count == 0 ? difference_ns_ : std::max(figures_.most, difference_ns_);
  ++figures_.count;
}

bool SlaveClock::settled(const ClockReference& reference) const noexcept TANDEM_RT {
  const std::int64_t off = difference_ns_ < 0 ? -std::int64_t{difference_ns_} : difference_ns_;
  return off <= kSettledNs &&
         (sync0_cycle_ns_ == 0 || reference.time_ns > sync0_start_ns_ + 2 * sync0_cycle_ns_);
}

}  // namespace tandem::hal::ecat
