// Entries and bits, counted as the sheet's values map them.
#include "canopen/sheet_mappings.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>

#include "canopen/frame.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"

namespace tandem::canopen {
namespace {

constexpr std::uint16_t kMappings = 0x200;  // of each direction
constexpr std::int64_t kMostEntries = 64;   // CiA 301, 7.4.8.2

std::string section(std::uint16_t index) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "[%04X]", index);
  return text.data();
}

/// An object that the sheet has not, or in another length. Fillers are data types, not objects.
void check_entry(const DataSheet& sheet, const SheetEntry& entry, std::vector<OddMapping>& odd) {
  const auto mapped = static_cast<std::uint32_t>(entry.value->number);
  const auto index = static_cast<std::uint16_t>(mapped >> 16);
  const auto sub = static_cast<std::uint8_t>(mapped >> 8 & 0xFF);
  const auto bits = static_cast<int>(mapped & 0xFF);
  if (mapped == 0 || index < 0x1000) return;
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "[%04Xsub%X] maps %04X:%02X, ", entry.index, entry.sub,
                index, sub);
  const SheetEntry* object = sheet.find(index, sub);
  if (object == nullptr) {
    odd.push_back(
        {entry.line, std::string(text.data()) + "which the sheet does not define", mapped});
  } else if (const int own = bits_of(*object); own > 0 && bits != own) {
    odd.push_back({entry.line,
                   std::string(text.data()) + "which has " + std::to_string(own) + " bits, with " +
                       std::to_string(bits),
                   mapped});
  }
}

/// @param count  the mapping's sub 0
void check(const DataSheet& sheet, const SheetEntry& count, std::vector<OddMapping>& odd) {
  const std::int64_t entries = count.value->number;
  const std::string name = section(count.index);
  if (entries >= 0xFE) return;  // CiA 301: multiplexed PDOs
  const std::int64_t most_entries = std::min(count.high.value_or(kMostEntries), kMostEntries);
  if (entries > most_entries) {
    odd.push_back({count.line, name + " maps " + std::to_string(entries) +
                                   " objects, and has room for " + std::to_string(most_entries)});
  }
  int bits = 0;
  std::int64_t missing = 0;
  for (std::int64_t sub = 1; sub <= std::min(entries, kMostEntries); ++sub) {
    const SheetEntry* entry = sheet.find(count.index, static_cast<std::uint8_t>(sub));
    if (entry == nullptr) ++missing;
    if (entry == nullptr || !entry->value) continue;
    bits += static_cast<int>(entry->value->number & 0xFF);
    check_entry(sheet, *entry, odd);
  }
  if (missing > 0) {
    odd.push_back({count.line, name + " maps " + std::to_string(entries) +
                                   " objects, and defines " + std::to_string(entries - missing)});
  }
  const int most = 8 * sheet.most_pdo_bytes;
  if (sheet.ethercat || bits <= most) return;  // a slave's PDOs are no frames
  const bool fits_fd = bits <= 8 * static_cast<int>(kMaxFrameBytes);
  odd.push_back({count.line, name + " maps " + std::to_string(bits) +
                                 " bits, and a frame has at most " + std::to_string(most) +
                                 (fits_fd ? "; one of CAN FD 512" : "")});
}

}  // namespace

int bits_of(const SheetEntry& object) noexcept {
  // A boolean is mapped with one bit as often as with eight.
  return object.type == static_cast<std::uint16_t>(DataType::kBoolean) ? 0 : 8 * object.size();
}

std::vector<OddMapping> odd_mappings(const DataSheet& sheet) {
  std::vector<OddMapping> odd;
  for (const std::uint16_t first : {object::kRpdoMapping, object::kTpdoMapping}) {
    auto at = std::ranges::lower_bound(sheet.entries, first, {}, &SheetEntry::index);
    for (; at != sheet.entries.end() && at->index < first + kMappings; ++at) {
      if (at->sub == 0 && at->value) check(sheet, *at, odd);
    }
  }
  return odd;
}

}  // namespace tandem::canopen
