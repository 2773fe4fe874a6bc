// Whatever bytes stand for a data sheet: an error with a message, or a sheet that holds together,
// and for whose drive a board can stand in.
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string_view>

#include "base/utf8.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "firmware_emu/board.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using tandem::fuzz::require;
using namespace tandem::canopen;

bool fits(std::int64_t number, int bytes) {
  if (bytes == 8) return true;
  const std::int64_t most = std::int64_t{1} << (8 * bytes);
  return number < most && number >= -most / 2;
}

void check(const SheetEntry& entry) {
  require(entry.index >= 0x1000);
  require(entry.line > 0);
  require((entry.access & (kRead | kWrite)) != 0);
  require((entry.access & kMapRpdo) == 0 || (entry.access & kWrite) != 0);
  require((entry.access & kMapTpdo) == 0 || (entry.access & kRead) != 0);
  require(tandem::is_utf8(entry.name));
  require(!entry.value || entry.text.empty());
  for (const auto& number : {entry.low, entry.high}) {
    require(!number || (entry.size() > 0 && fits(*number, entry.size())));
  }
  require(!entry.value || (entry.size() > 0 && fits(entry.value->number, entry.size())));
}

void check(const DataSheet& sheet) {
  require(!sheet.entries.empty() || !sheet.remarks.empty());
  require(sheet.entries.size() <= kMaxSheetEntries);
  for (std::size_t i = 0; i < sheet.entries.size(); ++i) {
    const SheetEntry& entry = sheet.entries[i];
    check(entry);
    require(sheet.find(entry.index, entry.sub) == &entry);  // sorted, and each once
    require(sheet.has(entry.index));
  }
  require(!sheet.node_id || (*sheet.node_id >= 1 && *sheet.node_id <= kMaxNodeId));
  require(sheet.vendor != 0U && sheet.product != 0U && sheet.revision != 0U);
  require(sheet.remarks.size() <= 101);
  for (const std::string& remark : sheet.remarks) require(tandem::is_utf8(remark));
}

/// An SDO of the board: `command` on the entry, with `value`.
Frame sdo(const SheetEntry& entry, std::uint8_t command, std::uint32_t value) {
  const auto byte = [](std::uint32_t number, int n) {
    return static_cast<std::uint8_t>(number >> (8 * n));
  };
  return make_frame(0x605, std::array<std::uint8_t, 8>{
                               command, byte(entry.index, 0), byte(entry.index, 1), entry.sub,
                               byte(value, 0), byte(value, 1), byte(value, 2), byte(value, 3)});
}

/// A board that stands in for the drive of the sheet, with every entry read and written.
void stand_in(const DataSheet& sheet) {
  using namespace tandem::firmware;
  constexpr std::size_t kMost = 500;  // entries: more take long
  if (!check_sheet(sheet, 1) || sheet.entries.size() > kMost) return;
  BoardSetup setup;
  setup.node_id = 5;
  setup.sheet = std::make_shared<const DataSheet>(sheet);
  setup.axes.resize(1);
  setup.axes[0].modes = emulated_modes(sheet, 0);
  setup.max_pdo_bytes = 8;
  Board board(setup);
  std::array<AxisSense, 1> sense{};
  std::array<AxisDrive, 1> drive{};
  const auto cycle = [&] {
    board.receive(make_frame(0x080, {}));
    board.step(1'000'000, sense, drive);
    require(std::isfinite(drive[0].voltage_V));
    board.clear_outgoing();
  };
  cycle();
  board.receive(make_frame(0x000, std::array<std::uint8_t, 2>{1, 5}));
  constexpr std::uint8_t kRead = 0x40;
  constexpr std::array<std::uint8_t, 3> kWrites{0x23, 0x2B, 0x2F};  // of 4, 2, 1 bytes
  std::uint32_t value = 0x60400010;
  for (const SheetEntry& entry : sheet.entries) {
    board.receive(sdo(entry, kRead, 0));
    for (const std::uint8_t write : kWrites) board.receive(sdo(entry, write, value));
    value = value * 1664525U + 1013904223U;
    cycle();
  }
  for (const std::uint8_t command : std::initializer_list<std::uint8_t>{0x82, 0x81, 0x01}) {
    board.receive(make_frame(0x000, std::array<std::uint8_t, 2>{command, 5}));
    cycle();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto sheet = read_data_sheet(text, "fuzz.eds");
  if (sheet.has_value()) {
    check(*sheet);
    stand_in(*sheet);
  } else {
    require(!sheet.error().message.empty());
    require(sheet.error().file == "fuzz.eds");
    require(tandem::is_utf8(sheet.error().to_string()));
  }
  return 0;
}
