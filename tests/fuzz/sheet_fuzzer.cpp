// Whatever bytes stand for a data sheet: an error with a message, or a sheet that holds together.
#include <cstdint>
#include <string_view>

#include "base/utf8.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
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

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto sheet = read_data_sheet(text, "fuzz.eds");
  if (sheet.has_value()) {
    check(*sheet);
  } else {
    require(!sheet.error().message.empty());
    require(sheet.error().file == "fuzz.eds");
    require(tandem::is_utf8(sheet.error().to_string()));
  }
  return 0;
}
