// A slave's information memory (SII): what it is, its mailbox and its sync managers.
// Layer: ethercat.  Thread: any; not RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ethercat/errors.hpp"
#include "ethercat/registers.hpp"

// Words of 16 bits. Fixed: 0-6 settings, 7 check sum of them, 8 vendor, 10 product, 12 revision,
// 14 serial number, 24-27 mailbox (offset and size, to the slave and from it), 28 protocols,
// 62 size, 63 version. From 64 categories: type, length in words, data; type FFFF ends them.

namespace tandem::ethercat::sii {

inline constexpr std::size_t kFixedWords = 64;
inline constexpr std::uint32_t kVendorWord = 8;
inline constexpr std::uint32_t kMailboxWord = 24;
/// No more than this is read of any slave.
inline constexpr std::size_t kMaxWords = 2048;
inline constexpr std::size_t kMaxSyncManagers = 8;
inline constexpr std::uint16_t kProtocolCoe = 0x0004;

enum class Category : std::uint16_t {
  kStrings = 10,
  kGeneral = 30,
  kFmmu = 40,
  kSyncManagers = 41,
  kEnd = 0xFFFF,
};

/// A vendor id that nobody owns, of emulated slaves: "TEST", twice. No product may carry it.
inline constexpr std::uint32_t kNobodysVendor = 0x7E577E57;

struct Identity {
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  bool operator==(const Identity&) const = default;
};

/// Where a mailbox is; size 0: there is none.
struct Mailbox {
  std::uint16_t out_start = 0;  ///< to the slave
  std::uint16_t out_bytes = 0;
  std::uint16_t in_start = 0;
  std::uint16_t in_bytes = 0;
  bool operator==(const Mailbox&) const = default;
};

/// A sync manager as the SII describes it.
struct SyncManagerInfo {
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
  bool enabled = false;
  SyncManagerUse use = SyncManagerUse::kUnused;
  bool operator==(const SyncManagerInfo&) const = default;
};

/// What we take from an SII.
struct Content {
  Identity identity;
  std::uint16_t alias = 0;
  Mailbox mailbox;
  std::uint16_t protocols = 0;
  std::string name;
  std::vector<SyncManagerInfo> managers;  ///< at most kMaxSyncManagers
  bool operator==(const Content&) const = default;
};

/// The settings' check sum: CRC-8 with polynomial 07 and start value FF over the first 14 bytes.
[[nodiscard]] std::uint8_t check_sum(std::span<const std::uint8_t> settings) noexcept;

/// The bytes of an SII with this content; FMMUs for outputs, inputs and the mailbox's state.
[[nodiscard]] std::vector<std::uint8_t> build(const Content& content);
/// Reads `bytes`; `content` is only complete after kNone. Allocates nothing when `content.name` has
/// room for 255 characters and `content.managers` for kMaxSyncManagers.
[[nodiscard]] LineError parse(std::span<const std::uint8_t> bytes, Content& content);

}  // namespace tandem::ethercat::sii
