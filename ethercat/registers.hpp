// Where a slave controller keeps what, and its states. docs/ethercat.md explains them.
// Layer: ethercat.  Thread: any.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/realtime.hpp"
#include "canopen/bytes.hpp"

namespace tandem::ethercat {

/// Register addresses.
namespace reg {
inline constexpr std::uint16_t kType = 0x0000;              // u8
inline constexpr std::uint16_t kFmmus = 0x0004;             // u8: how many
inline constexpr std::uint16_t kSyncManagers = 0x0005;      // u8: how many
inline constexpr std::uint16_t kRamKb = 0x0006;             // u8 [KiB]
inline constexpr std::uint16_t kPorts = 0x0007;             // u8: 2 bits each, 3: MII
inline constexpr std::uint16_t kFeatures = 0x0008;          // u16: Feature
inline constexpr std::uint16_t kStation = 0x0010;           // u16
inline constexpr std::uint16_t kAlias = 0x0012;             // u16
inline constexpr std::uint16_t kDlControl = 0x0100;         // u32
inline constexpr std::uint16_t kDlStatus = 0x0110;          // u16: link_bit(), open_bit()
inline constexpr std::uint16_t kAlControl = 0x0120;         // u16: AlState, kAlError to acknowledge
inline constexpr std::uint16_t kAlStatus = 0x0130;          // u16: AlState, kAlError
inline constexpr std::uint16_t kAlCode = 0x0134;            // u16: AlCode
inline constexpr std::uint16_t kPdiControl = 0x0140;        // u8
inline constexpr std::uint16_t kLostLinks = 0x0310;         // u8 per port
inline constexpr std::uint16_t kWatchdogDivider = 0x0400;   // u16: + 2, of 40 ns each
inline constexpr std::uint16_t kWatchdogData = 0x0420;      // u16 [divided], 0: off
inline constexpr std::uint16_t kWatchdogStatus = 0x0440;    // u16: bit 0 not expired
inline constexpr std::uint16_t kWatchdogCount = 0x0442;     // u8: times that it expired
inline constexpr std::uint16_t kSiiConfig = 0x0500;         // u8: bit 0 the application has it
inline constexpr std::uint16_t kSiiControl = 0x0502;        // u16: SiiControl
inline constexpr std::uint16_t kSiiAddress = 0x0504;        // u32 [words]
inline constexpr std::uint16_t kSiiData = 0x0508;           // 8 bytes
inline constexpr std::uint16_t kFmmu = 0x0600;              // + 16 n
inline constexpr std::uint16_t kSyncManager = 0x0800;       // + 8 n
inline constexpr std::uint16_t kReceiveTime = 0x0900;       // u32 [ns] per port; a write latches
inline constexpr std::uint16_t kSystemTime = 0x0910;        // u64 [ns]
inline constexpr std::uint16_t kReceiveTimeLocal = 0x0918;  // u64 [ns], at the processing unit
inline constexpr std::uint16_t kTimeOffset = 0x0920;        // i64 [ns]
inline constexpr std::uint16_t kTimeDelay = 0x0928;         // u32 [ns]
inline constexpr std::uint16_t kTimeDifference = 0x092C;    // u32 [ns]: bit 31 the clock is behind
inline constexpr std::uint16_t kSpeedStart = 0x0930;        // u16; a write resets the regulation
inline constexpr std::uint16_t kFilterDepth = 0x0934;       // u16
inline constexpr std::uint16_t kSyncControl = 0x0980;       // u8
inline constexpr std::uint16_t kSyncActivation = 0x0981;    // u8: SyncActivation
inline constexpr std::uint16_t kSyncStart = 0x0990;         // u64 [ns]
inline constexpr std::uint16_t kSync0Cycle = 0x09A0;        // u32 [ns]
inline constexpr std::uint16_t kSync1Cycle = 0x09A4;        // u32 [ns]
inline constexpr std::uint16_t kRam = 0x1000;               // process data and mailboxes
}  // namespace reg

inline constexpr std::size_t kFmmuBytes = 16;
inline constexpr std::size_t kSyncManagerBytes = 8;
inline constexpr std::size_t kPortsPerSlave = 4;
/// Bit 31 of kTimeDifference: the slave's clock is behind the reference.
inline constexpr std::uint32_t kDifferenceSign = 0x80000000;

/// Bits of kFeatures.
enum Feature : std::uint16_t {
  kFeatureDc = 0x0004,
  kFeatureDc64 = 0x0008,
};

/// Bits of kSiiControl.
enum SiiControl : std::uint16_t {
  kSiiWriteEnable = 0x0001,
  kSiiReads8Bytes = 0x0040,
  kSiiRead = 0x0100,
  kSiiWrite = 0x0200,
  kSiiRefused = 0x2000,
  kSiiBusy = 0x8000,
};

/// Bits of kSyncActivation.
enum SyncActivation : std::uint8_t {
  kSyncCyclic = 0x01,
  kSync0On = 0x02,
};

/// In kDlStatus: something is plugged into the port.
[[nodiscard]] constexpr std::uint16_t link_bit(std::size_t port) noexcept {
  return static_cast<std::uint16_t>(0x0010u << port);
}
/// In kDlStatus: frames pass the port (communication), and do not turn back there.
[[nodiscard]] constexpr std::uint16_t open_bit(std::size_t port) noexcept {
  return static_cast<std::uint16_t>(0x0200u << (2 * port));
}
/// In kDlStatus: frames turn back at the port (loop closed).
[[nodiscard]] constexpr std::uint16_t closed_bit(std::size_t port) noexcept {
  return static_cast<std::uint16_t>(0x0100u << (2 * port));
}

/// States of the application layer.
enum class AlState : std::uint8_t {
  kNone = 0,
  kInit = 1,    ///< registers only
  kPreOp = 2,   ///< mailbox
  kBoot = 3,    ///< firmware download; not supported here
  kSafeOp = 4,  ///< inputs are valid, outputs are not taken
  kOp = 8,      ///< both
};
inline constexpr std::uint8_t kAlStateMask = 0x0F;
inline constexpr std::uint8_t kAlError = 0x10;  ///< status: error; control: acknowledged
/// "SAFEOP"; "no state" for anything else.
[[nodiscard]] const char* to_string(AlState state) noexcept;

/// Why a slave refused or left a state (AL status code).
enum class AlCode : std::uint16_t {
  kNone = 0x0000,
  kUnspecified = 0x0001,
  kNoMemory = 0x0002,
  kInvalidChange = 0x0011,
  kUnknownState = 0x0012,
  kNoBoot = 0x0013,
  kNoFirmware = 0x0014,
  kBootMailbox = 0x0015,
  kMailbox = 0x0016,
  kSyncManagers = 0x0017,
  kNoInputs = 0x0018,
  kNoOutputs = 0x0019,
  kSynchronisation = 0x001A,
  kWatchdog = 0x001B,
  kSyncManagerTypes = 0x001C,
  kOutputs = 0x001D,
  kInputs = 0x001E,
  kWatchdogConfiguration = 0x001F,
  kNeedsColdStart = 0x0020,
  kNeedsInit = 0x0021,
  kNeedsPreOp = 0x0022,
  kNeedsSafeOp = 0x0023,
  kInputMapping = 0x0024,
  kOutputMapping = 0x0025,
  kInconsistentSettings = 0x0026,
  kFreeRunOnly = 0x0027,
  kSyncOnly = 0x0028,
  kFatalSync = 0x002C,
  kNoSync = 0x002D,
  kDcConfiguration = 0x0030,
  kDcLatch = 0x0031,
  kPll = 0x0032,
  kDcIo = 0x0033,
  kDcTimeout = 0x0034,
  kDcPeriod = 0x0035,
  kDcSync0Period = 0x0036,
  kDcSync1Period = 0x0037,
  kMailboxCoe = 0x0042,
  kEepromNoAccess = 0x0050,
  kEepromError = 0x0051,
};
/// The code in words ("process data watchdog"); "unknown code" for any other number.
[[nodiscard]] const char* to_string(AlCode code) noexcept;

/// What a sync manager is for, in SII and in object 1C00.
enum class SyncManagerUse : std::uint8_t {
  kUnused = 0,
  kMailboxOut = 1,  ///< to the slave
  kMailboxIn = 2,
  kOutputs = 3,  ///< to the slave
  kInputs = 4,
};

/// One sync manager's registers.
struct SyncManager {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;  ///< SyncManagerControl
  std::uint8_t status = 0;   ///< kMailboxFull
  bool active = false;

  [[nodiscard]] constexpr bool mailbox() const noexcept { return (control & 0x03) == 0x02; }
  /// Whether the master writes it.
  [[nodiscard]] constexpr bool written() const noexcept { return (control & 0x0C) == 0x04; }
  [[nodiscard]] constexpr bool watched() const noexcept { return (control & 0x40) != 0; }
};
inline constexpr std::uint8_t kMailboxFull = 0x08;  ///< of SyncManager::status
inline constexpr std::uint8_t kSmEnable = 0x01;     ///< of byte 6
inline constexpr std::uint8_t kSmRepeat = 0x02;     ///< of byte 6, and of byte 7 as its answer

inline constexpr std::uint8_t kControlMailboxOut = 0x26;  ///< written, with the slave's interrupt
inline constexpr std::uint8_t kControlMailboxIn = 0x22;   ///< read, with the slave's interrupt
inline constexpr std::uint8_t kControlOutputs = 0x64;     ///< written, buffered, with watchdog
inline constexpr std::uint8_t kControlInputs = 0x20;      ///< read, buffered

inline void put_sync_manager(std::uint8_t* out, const SyncManager& manager) noexcept TANDEM_RT {
  canopen::put(out, manager.start);
  canopen::put(out + 2, manager.length);
  out[4] = manager.control;
  out[5] = manager.status;
  out[6] = manager.active ? kSmEnable : 0;
  out[7] = 0;
}
[[nodiscard]] inline SyncManager get_sync_manager(const std::uint8_t* in) noexcept TANDEM_RT {
  return {.start = canopen::get<std::uint16_t>(in),
          .length = canopen::get<std::uint16_t>(in + 2),
          .control = in[4],
          .status = in[5],
          .active = (in[6] & kSmEnable) != 0};
}

/// One entry of the map from logical addresses to a slave's memory, of bits.
struct Fmmu {
  std::uint32_t logical = 0;
  std::uint16_t length = 0;  ///< bytes that are touched
  std::uint8_t first_bit = 0;
  std::uint8_t last_bit = 7;
  std::uint16_t physical = 0;
  std::uint8_t physical_bit = 0;
  bool reads = false;   ///< serves LRD and LRW
  bool writes = false;  ///< serves LWR and LRW
  bool active = false;
};

inline void put_fmmu(std::uint8_t* out, const Fmmu& fmmu) noexcept TANDEM_RT {
  canopen::put(out, fmmu.logical);
  canopen::put(out + 4, fmmu.length);
  out[6] = fmmu.first_bit;
  out[7] = fmmu.last_bit;
  canopen::put(out + 8, fmmu.physical);
  out[10] = fmmu.physical_bit;
  out[11] = static_cast<std::uint8_t>((fmmu.reads ? 1 : 0) | (fmmu.writes ? 2 : 0));
  out[12] = fmmu.active ? 1 : 0;
  out[13] = out[14] = out[15] = 0;
}
[[nodiscard]] inline Fmmu get_fmmu(const std::uint8_t* in) noexcept TANDEM_RT {
  return {.logical = canopen::get<std::uint32_t>(in),
          .length = canopen::get<std::uint16_t>(in + 4),
          .first_bit = static_cast<std::uint8_t>(in[6] & 7),
          .last_bit = static_cast<std::uint8_t>(in[7] & 7),
          .physical = canopen::get<std::uint16_t>(in + 8),
          .physical_bit = static_cast<std::uint8_t>(in[10] & 7),
          .reads = (in[11] & 1) != 0,
          .writes = (in[11] & 2) != 0,
          .active = (in[12] & 1) != 0};
}

}  // namespace tandem::ethercat
