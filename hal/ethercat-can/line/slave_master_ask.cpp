// The datagrams of each stage.
#include <algorithm>
#include <array>
#include <utility>

#include "hal/ethercat-can/line/slave_master.hpp"

namespace tandem::hal::ecat {

using ethercat::AlState;
using ethercat::Command;
using ethercat::register_address;
namespace reg = ethercat::reg;

namespace {

constexpr std::size_t kSiiAnswer = 14;
constexpr std::size_t kAlAnswer = 6;
constexpr std::size_t kManagersUsed = 4;
constexpr std::size_t kFmmusUsed = 3;

template <class T>
std::array<std::uint8_t, sizeof(T)> bytes(T value) noexcept {
  std::array<std::uint8_t, sizeof(T)> out{};
  canopen::put(out.data(), value);
  return out;
}

}  // namespace

void SlaveMaster::ask(std::int64_t now_ns, Exchange& exchange,
                      const ClockReference& reference) noexcept {
  switch (stage_) {
    case SlaveStage::kReset: return ask_reset(exchange);
    case SlaveStage::kFeatures: return exchange.read_at(position_, station_, reg::kType, 10);
    case SlaveStage::kSii: return ask_sii(exchange);
    case SlaveStage::kPreOp:
      if (part_ != 0) return ask_state(exchange);
      {
        const auto& box = content_.mailbox;
        std::array<std::uint8_t, 2 * ethercat::kSyncManagerBytes> managers{};
        ethercat::put_sync_manager(&managers[0], {.start = box.out_start,
                                                  .length = box.out_bytes,
                                                  .control = ethercat::kControlMailboxOut,
                                                  .active = box.out_bytes != 0});
        ethercat::put_sync_manager(&managers[ethercat::kSyncManagerBytes],
                                   {.start = box.in_start,
                                    .length = box.in_bytes,
                                    .control = ethercat::kControlMailboxIn,
                                    .active = box.in_bytes != 0});
        return exchange.write_at(position_, station_, reg::kSyncManager, managers);
      }
    case SlaveStage::kProcessData: return ask_process_data(exchange);
    case SlaveStage::kClock: return clock_.ask(part_, exchange, position_, reference);
    case SlaveStage::kSafeOp:
    case SlaveStage::kOp: return ask_state(exchange);
    case SlaveStage::kSettle:
      if (!has_clock()) return enter_state(SlaveStage::kOp, AlState::kOp, now_ns);
      return exchange.read_at(position_, station_, reg::kTimeDifference, 4);
    case SlaveStage::kReady:
    case SlaveStage::kRunning: return ask_running(exchange);
    default: return;
  }
}

void SlaveMaster::ask_reset(Exchange& exchange) noexcept {
  static constexpr std::array<std::uint8_t, kManagersUsed * ethercat::kSyncManagerBytes> kNone{};
  static constexpr std::array<std::uint8_t, kFmmusUsed * ethercat::kFmmuBytes> kNoMap{};
  switch (part_) {
    case 0:
      return exchange.write(position_, Command::kApwr,
                            register_address(ethercat::at_position(position_), reg::kStation),
                            bytes(station_));
    case 1:
      return exchange.write_at(
          position_, station_, reg::kAlControl,
          bytes(std::uint16_t{std::to_underlying(AlState::kInit) | ethercat::kAlError}));
    case 2: return exchange.read_at(position_, station_, reg::kAlStatus, kAlAnswer);
    case 3: return exchange.write_at(position_, station_, reg::kSyncManager, kNone);
    default: return exchange.write_at(position_, station_, reg::kFmmu, kNoMap);
  }
}

void SlaveMaster::ask_sii(Exchange& exchange) noexcept {
  if (part_ == 1) return exchange.read_at(position_, station_, reg::kSiiControl, kSiiAnswer);
  std::array<std::uint8_t, 6> command{};
  canopen::put(&command[0], std::uint16_t{ethercat::kSiiRead});
  canopen::put(&command[2], static_cast<std::uint32_t>(sii_.size() / 2));
  exchange.write_at(position_, station_, reg::kSiiControl, command);
}

void SlaveMaster::ask_state(Exchange& exchange) noexcept {
  if (state_written_) return exchange.read_at(position_, station_, reg::kAlStatus, kAlAnswer);
  exchange.write_at(position_, station_, reg::kAlControl,
                    bytes(std::uint16_t{std::to_underlying(wanted_)}));
}

void SlaveMaster::put_fmmus(std::span<std::uint8_t> out) const noexcept {
  ethercat::put_fmmu(out.data(), {.logical = mapping_.outputs_at,
                                  .length = mapping_.outputs,
                                  .physical = outputs_memory_,
                                  .writes = true,
                                  .active = mapping_.outputs != 0});
  ethercat::put_fmmu(&out[ethercat::kFmmuBytes], {.logical = mapping_.inputs_at,
                                                  .length = mapping_.inputs,
                                                  .physical = inputs_memory_,
                                                  .reads = true,
                                                  .active = mapping_.inputs != 0});
}

void SlaveMaster::ask_process_data(Exchange& exchange) noexcept {
  if (part_ == 1) {
    std::array<std::uint8_t, 2 * ethercat::kFmmuBytes> fmmus{};
    put_fmmus(fmmus);
    return exchange.write_at(position_, station_, reg::kFmmu, fmmus);
  }
  std::array<std::uint8_t, 2 * ethercat::kSyncManagerBytes> managers{};
  ethercat::put_sync_manager(&managers[0], {.start = outputs_memory_,
                                            .length = mapping_.outputs,
                                            .control = ethercat::kControlOutputs,
                                            .active = mapping_.outputs != 0});
  ethercat::put_sync_manager(&managers[ethercat::kSyncManagerBytes],
                             {.start = inputs_memory_,
                              .length = mapping_.inputs,
                              .control = ethercat::kControlInputs,
                              .active = mapping_.inputs != 0});
  exchange.write_at(position_, station_, reg::kSyncManager + 2 * ethercat::kSyncManagerBytes,
                    managers);
}

void SlaveMaster::ask_running(Exchange& exchange) noexcept {
  if (part_ == 3) {
    return exchange.read_at(position_, station_, reg::kFmmu, 2 * ethercat::kFmmuBytes);
  }
  part_ = 0;
  if (std::exchange(look_wanted_, false)) {
    part_ = 2;
    return exchange.read_at(position_, station_, reg::kAlStatus, kAlAnswer);
  }
  if (std::exchange(difference_wanted_, false)) {
    part_ = 1;
    return exchange.read_at(position_, station_, reg::kTimeDifference, 4);
  }
}

}  // namespace tandem::hal::ecat
