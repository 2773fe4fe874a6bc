// Building and reading are independent of each other; tests have literal bytes for both.
#include "ethercat/sii.hpp"

#include <algorithm>

#include "canopen/bytes.hpp"

namespace tandem::ethercat::sii {

namespace {

using Bytes = std::span<const std::uint8_t>;

constexpr std::size_t kManagerBytes = 8;
constexpr std::size_t kGeneralBytes = 32;
constexpr std::size_t kMaxName = 63;

void put_word(std::vector<std::uint8_t>& out, std::size_t word, std::uint16_t value) {
  canopen::put(&out[2 * word], value);
}

void put_long(std::vector<std::uint8_t>& out, std::size_t word, std::uint32_t value) {
  canopen::put(&out[2 * word], value);
}

void append(std::vector<std::uint8_t>& out, Category type, std::vector<std::uint8_t> data) {
  if (data.size() % 2 != 0) data.push_back(0);
  std::array<std::uint8_t, 4> header{};
  canopen::put(&header[0], static_cast<std::uint16_t>(type));
  canopen::put(&header[2], static_cast<std::uint16_t>(data.size() / 2));
  out.insert(out.end(), header.begin(), header.end());
  out.insert(out.end(), data.begin(), data.end());
}

std::vector<std::uint8_t> general(const Content& content) {
  std::vector<std::uint8_t> data(kGeneralBytes, 0);
  data[3] = content.name.empty() ? 0 : 1;                           // the name is string 1
  data[5] = (content.protocols & kProtocolCoe) != 0 ? 0x0D : 0x00;  // SDO, assignment, mapping
  canopen::put(&data[16], std::uint16_t{0x0033});                   // two MII ports
  return data;
}

std::vector<std::uint8_t> managers(const Content& content) {
  std::vector<std::uint8_t> data(content.managers.size() * kManagerBytes, 0);
  std::uint8_t* at = data.data();
  for (const SyncManagerInfo& info : content.managers) {
    canopen::put(at, info.start);
    canopen::put(at + 2, info.length);
    at[4] = info.control;
    at[6] = info.enabled ? 1 : 0;
    at[7] = static_cast<std::uint8_t>(info.use);
    at += kManagerBytes;
  }
  return data;
}

LineError read_name(Bytes strings, std::uint8_t number, std::string& name) {
  if (strings.empty()) return LineError::kSiiContent;
  std::size_t at = 1;
  for (int left = strings[0], one = 1; left > 0; --left, ++one) {
    if (at >= strings.size()) return LineError::kSiiContent;
    const std::size_t length = strings[at++];
    if (length > strings.size() - at) return LineError::kSiiContent;
    if (one == number) {
      name.assign(reinterpret_cast<const char*>(&strings[at - 1]) + 1, length);
    }
    at += length;
  }
  return LineError::kNone;
}

LineError read_managers(Bytes data, std::vector<SyncManagerInfo>& out) {
  if (data.size() % kManagerBytes != 0) return LineError::kSiiContent;
  if (data.size() / kManagerBytes > kMaxSyncManagers) return LineError::kSiiContent;
  out.clear();
  for (; !data.empty(); data = data.subspan(kManagerBytes)) {
    const std::uint8_t use = data[7];
    out.push_back({.start = canopen::get<std::uint16_t>(&data[0]),
                   .length = canopen::get<std::uint16_t>(&data[2]),
                   .control = data[4],
                   .enabled = (data[6] & 1) != 0,
                   .use = use <= 4 ? static_cast<SyncManagerUse>(use) : SyncManagerUse::kUnused});
  }
  return LineError::kNone;
}

/// The categories that we want, found in one walk.
struct Found {
  Bytes strings, general, managers;
};

LineError find_categories(Bytes bytes, Found& found) {
  std::size_t at = 2 * kFixedWords;
  while (bytes.size() >= at + 2) {
    const auto type = static_cast<Category>(canopen::get<std::uint16_t>(&bytes[at]));
    if (type == Category::kEnd) return LineError::kNone;
    if (bytes.size() < at + 4) return LineError::kSiiCategory;
    const std::size_t length = 2 * std::size_t{canopen::get<std::uint16_t>(&bytes[at + 2])};
    at += 4;
    if (length > bytes.size() - at) return LineError::kSiiCategory;
    const Bytes data = bytes.subspan(at, length);
    if (type == Category::kStrings) found.strings = data;
    if (type == Category::kGeneral) found.general = data;
    if (type == Category::kSyncManagers) found.managers = data;
    at += length;
  }
  return LineError::kSiiCategory;
}

}  // namespace

std::uint8_t check_sum(Bytes settings) noexcept {
  unsigned crc = 0xFF;
  for (std::size_t i = 0; i < std::min<std::size_t>(14, settings.size()); ++i) {
    crc ^= settings[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80) != 0 ? ((crc << 1) ^ 0x07) : crc << 1;
    crc &= 0xFF;
  }
  return static_cast<std::uint8_t>(crc);
}

std::vector<std::uint8_t> build(const Content& content) {
  std::vector<std::uint8_t> out(2 * kFixedWords, 0);
  put_word(out, 0, 0x0008);  // the application's interface: a processor
  put_word(out, 4, content.alias);
  put_word(out, 7, check_sum(out));
  put_long(out, kVendorWord, content.identity.vendor);
  put_long(out, 10, content.identity.product);
  put_long(out, 12, content.identity.revision);
  put_long(out, 14, content.identity.serial);
  put_word(out, 24, content.mailbox.out_start);
  put_word(out, 25, content.mailbox.out_bytes);
  put_word(out, 26, content.mailbox.in_start);
  put_word(out, 27, content.mailbox.in_bytes);
  put_word(out, 28, content.protocols);
  put_word(out, 62, 0x001F);  // 32 kbit, less one
  put_word(out, 63, 1);
  const std::string name = content.name.substr(0, kMaxName);
  if (!name.empty()) {
    std::vector<std::uint8_t> strings{1, static_cast<std::uint8_t>(name.size())};
    strings.insert(strings.end(), name.begin(), name.end());
    append(out, Category::kStrings, strings);
  }
  append(out, Category::kGeneral, general(content));
  append(out, Category::kFmmu, {1, 2, 3, 0});
  append(out, Category::kSyncManagers, managers(content));
  out.insert(out.end(), {0xFF, 0xFF, 0xFF, 0xFF});
  return out;
}

LineError parse(Bytes bytes, Content& content) {
  content.name.clear();  // and not the whole, which would free what a caller has reserved
  content.managers.clear();
  if (bytes.size() < 2 * kFixedWords) return LineError::kSiiTooShort;
  if (bytes[14] != check_sum(bytes)) return LineError::kSiiCheckSum;
  const auto word = [&](std::size_t at) { return canopen::get<std::uint16_t>(&bytes[2 * at]); };
  const auto wide = [&](std::size_t at) { return canopen::get<std::uint32_t>(&bytes[2 * at]); };
  content.alias = word(4);
  content.identity = {
      .vendor = wide(kVendorWord), .product = wide(10), .revision = wide(12), .serial = wide(14)};
  content.mailbox = {
      .out_start = word(24), .out_bytes = word(25), .in_start = word(26), .in_bytes = word(27)};
  content.protocols = word(28);
  Found found;
  if (const LineError error = find_categories(bytes, found); error != LineError::kNone)
    return error;
  const std::uint8_t name = found.general.size() >= 4 ? found.general[3] : 0;
  if (name != 0) {
    const LineError error = read_name(found.strings, name, content.name);
    if (error != LineError::kNone) return error;
  }
  return read_managers(found.managers, content.managers);
}

}  // namespace tandem::ethercat::sii
