// What the registers do: which can be written, time stamps, information memory, watchdog, SYNC0.
#include <algorithm>
#include <utility>

#include "firmware_emu/slaves/esc.hpp"

namespace tandem::firmware::esc {

using ethercat::AlState;
namespace reg = ethercat::reg;

namespace {

struct Range {
  std::size_t begin, end;
};

/// What the master may write; other bytes stay as they are.
constexpr std::array kWritable{
    Range{0x0010, 0x0012}, Range{0x0100, 0x0104}, Range{0x0120, 0x0122},
    Range{0x0200, 0x0202}, Range{0x0300, 0x0314}, Range{0x0400, 0x0402},
    Range{0x0410, 0x0412}, Range{0x0420, 0x0422}, Range{0x0442, 0x0444},
    Range{0x0500, 0x0501}, Range{0x0502, 0x0510}, Range{0x0600, 0x0680},
    Range{0x0800, 0x0840}, Range{0x0900, 0x0904}, Range{0x0910, 0x0918},
    Range{0x0920, 0x092C}, Range{0x0930, 0x0936}, Range{0x0980, 0x0982},
    Range{0x0990, 0x0998}, Range{0x09A0, 0x09A8}, Range{reg::kRam, kMemoryBytes}};

constexpr bool overlaps(std::size_t address, std::size_t size, std::size_t begin,
                        std::size_t bytes) noexcept {
  return address < begin + bytes && begin < address + size;
}

/// Registers that a write triggers and does not change.
constexpr bool is_trigger(std::size_t address) noexcept {
  return (address >= reg::kReceiveTime && address < reg::kReceiveTime + 4) ||
         (address >= reg::kSystemTime && address < reg::kSystemTime + 8);
}

/// Status bytes among a sync manager's registers.
constexpr bool is_status(std::size_t address) noexcept {
  if (address < reg::kSyncManager || address >= reg::kSyncManager + 64) return false;
  return address % 8 == 5 || address % 8 == 7;
}

constexpr bool is_counter(std::size_t address) noexcept {
  return (address >= 0x0300 && address < 0x0314) || (address >= 0x0442 && address < 0x0444);
}

}  // namespace

Esc::Esc(std::vector<std::uint8_t> sii, bool has_dc, const ClockSetup& clock)
    : sii_(std::move(sii)), has_dc_(has_dc), clock_(clock) {
  reset(0);
}

void Esc::reset(std::int64_t now_ns) noexcept TANDEM_RT {
  const auto links = at<std::uint16_t>(reg::kDlStatus);
  memory_.fill(0);
  memory_[reg::kType] = 0x11;
  memory_[reg::kFmmus] = kFmmus;
  memory_[reg::kSyncManagers] = kManagers;
  memory_[reg::kRamKb] = (kMemoryBytes - reg::kRam) / 1024;
  memory_[reg::kPorts] = 0x0F;
  set(reg::kFeatures,
      static_cast<std::uint16_t>(has_dc_ ? ethercat::kFeatureDc | ethercat::kFeatureDc64 : 0));
  if (sii_.size() >= 10) std::copy_n(&sii_[8], 2, &memory_[reg::kAlias]);
  set(reg::kDlStatus, links != 0 ? links : std::uint16_t{0x5401});  // all loops closed
  set(reg::kAlControl, static_cast<std::uint16_t>(AlState::kInit));
  set(reg::kAlStatus, static_cast<std::uint16_t>(AlState::kInit));
  memory_[reg::kPdiControl] = 0x08;
  set(reg::kWatchdogDivider, std::uint16_t{0x09C2});  // 100 us
  set(reg::kWatchdogData, std::uint16_t{0x03E8});     // 100 ms
  set(reg::kWatchdogStatus, std::uint16_t{1});
  set(reg::kSiiControl, std::uint16_t{ethercat::kSiiReads8Bytes});
  set(reg::kSpeedStart, std::uint16_t{0x1000});
  set(reg::kFilterDepth, std::uint16_t{0x0C00});
  open_ = {};
  al_requested_ = sii_requested_ = outputs_written_ = armed_ = expired_ = sync0_missed_ = false;
  last_message_bytes_ = 0;
  pulses_ = 0;
  clock_.restart(now_ns);
}

void Esc::set_link(std::size_t port, bool up) noexcept TANDEM_RT {
  auto status = at<std::uint16_t>(reg::kDlStatus);
  const bool was_up = (status & ethercat::link_bit(port)) != 0;
  const auto on = static_cast<std::uint16_t>(ethercat::link_bit(port) | ethercat::open_bit(port));
  const std::uint16_t off = ethercat::closed_bit(port);
  status = static_cast<std::uint16_t>(up ? (status | on) & ~off : (status | off) & ~on);
  set(reg::kDlStatus, status);
  std::uint8_t& lost = memory_[reg::kLostLinks + port];
  if (was_up && !up && lost < 0xFF) ++lost;
}

bool Esc::write(std::size_t address, std::span<const std::uint8_t> in,
                const Passage& passage) noexcept {
  if (in.empty() || address + in.size() > kMemoryBytes) return false;
  if (no_clock_here(address, in.size())) return false;
  bool any = false;
  for (const Range& range : kWritable) {
    any |= overlaps(address, in.size(), range.begin, range.end - range.begin);
  }
  if (!any || !managers_allow(address, in.size(), true)) return false;
  for (const Range& range : kWritable) {
    const std::size_t end = std::min(range.end, address + in.size());
    for (std::size_t to = std::max(range.begin, address); to < end; ++to) {
      if (is_trigger(to) || is_status(to)) continue;
      memory_[to] = is_counter(to) ? std::uint8_t{0} : in[to - address];
    }
  }
  managers_done(address, in.size(), true, passage.arrived_ns);
  written(address, in.size(), in, passage);
  return true;
}

bool Esc::no_clock_here(std::size_t address, std::size_t size) const noexcept {
  return !has_dc_ && address >= reg::kReceiveTime && address + size <= reg::kRam;
}

void Esc::written(std::size_t address, std::size_t size, std::span<const std::uint8_t> in,
                  const Passage& passage) noexcept {
  if (address >= reg::kRam) return;
  const auto covers = [&](std::size_t from, std::size_t bytes) {
    return address <= from && address + size >= from + bytes;
  };
  if (covers(reg::kAlControl, 1)) al_requested_ = true;
  if (covers(reg::kSiiControl + 1, 1)) {
    const auto control = at<std::uint16_t>(reg::kSiiControl);
    sii_requested_ = (control & (ethercat::kSiiRead | ethercat::kSiiWrite)) != 0;
    const unsigned busy = sii_requested_ ? ethercat::kSiiBusy : 0;
    set(reg::kSiiControl,
        static_cast<std::uint16_t>((control & 0x0700) | busy | ethercat::kSiiReads8Bytes));
  }
  written_managers(address, size);
  if (!has_dc_) return;
  if (covers(reg::kReceiveTime, 1)) latch(passage);
  if (covers(reg::kSystemTime, 4)) {
    std::uint64_t reference = 0;
    const std::size_t offset = reg::kSystemTime - address;
    if (covers(reg::kSystemTime, 8)) {
      reference = canopen::get<std::uint64_t>(&in[offset]);
    } else {  // the upper half is the slave's own
      const auto own = static_cast<std::uint64_t>(system_time_ns(passage.arrived_ns));
      reference = (own & ~std::uint64_t{0xFFFFFFFF}) | canopen::get<std::uint32_t>(&in[offset]);
    }
    compare_time(reference, passage);
  }
  if (covers(reg::kSpeedStart, 2)) clock_.restart(passage.arrived_ns);
  if (covers(reg::kSyncActivation, 1)) {
    pulses_ = 0;
    sync0_missed_ = system_time_ns(passage.arrived_ns) >= at<std::int64_t>(reg::kSyncStart);
  }
}

// A mailbox that is switched on or off is empty.
void Esc::written_managers(std::size_t address, std::size_t size) noexcept {
  for (std::size_t number = 0; number < kManagers; ++number) {
    const std::size_t base = reg::kSyncManager + ethercat::kSyncManagerBytes * number;
    if (!overlaps(address, size, base, 5)) continue;
    open_[number] = false;
    memory_[base + 5] = 0;
  }
}

void Esc::refresh(std::size_t address, std::size_t size, const Passage& passage) noexcept {
  if (!has_dc_ || !overlaps(address, size, reg::kSystemTime, 8)) return;
  set(reg::kSystemTime, static_cast<std::uint64_t>(clock_.stamp(passage.arrived_ns)) +
                            at<std::uint64_t>(reg::kTimeOffset));
}

void Esc::latch(const Passage& passage) noexcept {
  const std::int64_t arrived = clock_.stamp(passage.arrived_ns);
  set(reg::kReceiveTime, static_cast<std::uint32_t>(arrived));
  set(reg::kReceiveTimeLocal, arrived);
  if (passage.returned_ns < 0) return;
  set(reg::kReceiveTime + 4, static_cast<std::uint32_t>(clock_.stamp(passage.returned_ns)));
}

std::int64_t Esc::system_time_ns(std::int64_t now_ns) const noexcept TANDEM_RT {
  // Unsigned, because the master may write any offset.
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(clock_.local(now_ns)) +
                                   at<std::uint64_t>(reg::kTimeOffset));
}

void Esc::compare_time(std::uint64_t reference_ns, const Passage& passage) noexcept {
  constexpr std::int64_t kMost = 0x7FFFFFFF;
  const std::uint64_t own = static_cast<std::uint64_t>(clock_.stamp(passage.arrived_ns)) +
                            at<std::uint64_t>(reg::kTimeOffset);
  const auto ahead =
      static_cast<std::int64_t>(own - reference_ns - at<std::uint32_t>(reg::kTimeDelay));
  const std::int64_t difference = std::clamp(ahead, -kMost, kMost);
  const auto size = static_cast<std::uint32_t>(difference < 0 ? -difference : difference);
  set(reg::kTimeDifference, size | (difference < 0 ? ethercat::kDifferenceSign : 0));
  clock_.regulate(difference, passage.arrived_ns);
}

void Esc::process(std::int64_t now_ns) noexcept TANDEM_RT {
  if (sii_requested_) run_sii();
  run_watchdog(now_ns);
  run_sync0(now_ns);
}

void Esc::run_sii() noexcept {
  sii_requested_ = false;
  const auto control = at<std::uint16_t>(reg::kSiiControl);
  std::uint16_t answer = ethercat::kSiiReads8Bytes;
  const bool refused = (control & ethercat::kSiiWrite) != 0 || (memory_[reg::kSiiConfig] & 1) != 0;
  if (refused) {
    answer |= ethercat::kSiiRefused;  // nothing here may be written
  } else {
    const std::size_t from = 2 * std::size_t{at<std::uint32_t>(reg::kSiiAddress)};
    for (std::size_t i = 0; i < 8; ++i) {
      memory_[reg::kSiiData + i] = from + i < sii_.size() ? sii_[from + i] : 0xFF;
    }
  }
  set(reg::kSiiControl, answer);
}

void Esc::arm_watchdog(std::int64_t now_ns) noexcept TANDEM_RT {
  armed_ = true;
  fed_ns_ = now_ns;
}

void Esc::run_watchdog(std::int64_t now_ns) noexcept {
  const std::int64_t unit_ns = 40 * (std::int64_t{at<std::uint16_t>(reg::kWatchdogDivider)} + 2);
  const std::int64_t limit_ns = unit_ns * at<std::uint16_t>(reg::kWatchdogData);
  const ethercat::SyncManager outputs = manager(2);
  const bool runs = armed_ && limit_ns != 0 && outputs.active && outputs.watched();
  const bool expired = runs && now_ns - fed_ns_ > limit_ns;
  if (expired && !expired_ && memory_[reg::kWatchdogCount] < 0xFF) ++memory_[reg::kWatchdogCount];
  expired_ = expired;
  set(reg::kWatchdogStatus, static_cast<std::uint16_t>(expired ? 0 : 1));
}

bool Esc::sync0_active() const noexcept {
  constexpr std::uint8_t kBoth = ethercat::kSyncCyclic | ethercat::kSync0On;
  return has_dc_ && (memory_[reg::kSyncActivation] & kBoth) == kBoth;
}

void Esc::run_sync0(std::int64_t now_ns) noexcept {
  const auto cycle_ns = at<std::uint32_t>(reg::kSync0Cycle);
  if (!sync0_active() || sync0_missed_ || cycle_ns == 0) return;
  const auto since = static_cast<std::int64_t>(static_cast<std::uint64_t>(system_time_ns(now_ns)) -
                                               at<std::uint64_t>(reg::kSyncStart));
  if (since >= 0) pulses_ = static_cast<std::uint64_t>(since) / cycle_ns + 1;
}

bool Esc::take_al_request(std::uint16_t& request) noexcept TANDEM_RT {
  request = at<std::uint16_t>(reg::kAlControl);
  return std::exchange(al_requested_, false);
}

void Esc::set_al(AlState state, bool error, ethercat::AlCode code) noexcept TANDEM_RT {
  const unsigned status = static_cast<unsigned>(state) | (error ? ethercat::kAlError : 0u);
  set(reg::kAlStatus, static_cast<std::uint16_t>(status));
  set(reg::kAlCode, static_cast<std::uint16_t>(code));
  if (state != AlState::kOp) armed_ = false;
}

ethercat::SyncManager Esc::manager(std::size_t number) const noexcept TANDEM_RT {
  return ethercat::get_sync_manager(
      &memory_[reg::kSyncManager + ethercat::kSyncManagerBytes * number]);
}

std::span<std::uint8_t> Esc::memory(std::uint16_t start, std::size_t size) noexcept TANDEM_RT {
  if (start < reg::kRam || std::size_t{start} + size > kMemoryBytes) return {};
  return {&memory_[start], size};
}

std::span<const std::uint8_t> Esc::take_mailbox() noexcept TANDEM_RT {
  const ethercat::SyncManager box = manager(0);
  if (!box.active || !box.mailbox() || (box.status & ethercat::kMailboxFull) == 0) return {};
  memory_[reg::kSyncManager + 5] = 0;
  return memory(box.start, box.length);
}

bool Esc::post_mailbox(std::span<const std::uint8_t> message) noexcept TANDEM_RT {
  const ethercat::SyncManager box = manager(1);
  if (!box.active || !box.mailbox() || (box.status & ethercat::kMailboxFull) != 0) return false;
  const std::span<std::uint8_t> to = memory(box.start, box.length);
  if (message.size() > to.size() || message.size() > last_message_.size()) return false;
  std::ranges::fill(to, std::uint8_t{0});
  std::ranges::copy(message, to.begin());
  std::ranges::copy(message, last_message_.begin());
  last_message_bytes_ = message.size();
  memory_[reg::kSyncManager + ethercat::kSyncManagerBytes + 5] = ethercat::kMailboxFull;
  return true;
}

bool Esc::answer_repeat() noexcept TANDEM_RT {
  const std::size_t base = reg::kSyncManager + ethercat::kSyncManagerBytes;
  if (((memory_[base + 6] ^ memory_[base + 7]) & ethercat::kSmRepeat) == 0) return false;
  if (last_message_bytes_ != 0) {
    memory_[base + 5] = 0;
    (void)post_mailbox({last_message_.data(), last_message_bytes_});
  }
  memory_[base + 7] ^= ethercat::kSmRepeat;
  return true;
}

void Esc::clear_mailboxes() noexcept TANDEM_RT {
  memory_[reg::kSyncManager + 5] = 0;
  memory_[reg::kSyncManager + ethercat::kSyncManagerBytes + 5] = 0;
  open_[0] = open_[1] = false;
  last_message_bytes_ = 0;
}

bool Esc::take_outputs() noexcept TANDEM_RT { return std::exchange(outputs_written_, false); }

void Esc::archive(Archive& ar) {
  ar(clock_, memory_, last_message_, last_message_bytes_, open_, al_requested_, sii_requested_,
     outputs_written_, armed_, expired_, sync0_missed_, fed_ns_, pulses_);
}

}  // namespace tandem::firmware::esc
