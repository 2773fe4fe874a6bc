// What an electronic data sheet (EDS, DCF; CiA 306) says of a device: identity and objects.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/bounds.hpp"
#include "base/result.hpp"

namespace tandem::canopen {

/// A number of a sheet, which may depend on the node's id: "$NODEID+0x180".
struct SheetValue {
  std::int64_t number = 0;    ///< as a bit pattern for unsigned 64 bit and for reals
  bool plus_node_id = false;  ///< the node's id is added

  [[nodiscard]] std::int64_t of(int node_id) const noexcept {
    return plus_node_id ? number + node_id : number;
  }
  bool operator==(const SheetValue&) const = default;
};

/// One sub-index of an object, as the sheet declares it.
struct SheetEntry {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::uint16_t type = 0;   ///< data type's number in CiA 301; may be one that DataType has not
  std::uint8_t access = 0;  ///< Access bits, kMapRpdo and kMapTpdo as PDOMapping and access allow
  bool constant = false;    ///< AccessType const: the value is the same in every device
  std::string name{};       ///< ParameterName
  std::optional<SheetValue> value{};  ///< ParameterValue (DCF), else DefaultValue; none: unknown
  std::optional<std::int64_t> low{};  ///< LowLimit; none for reals and texts
  std::optional<std::int64_t> high{};
  std::string text{};  ///< the value of a string, domain, time or unknown type, as written
  int line = 0;        ///< of its section

  /// Bytes on the wire by its type; 0: not fixed (strings, domains).
  [[nodiscard]] int size() const noexcept;
};

/// A data sheet that was read. Entries are sorted by index and sub-index.
struct DataSheet {
  std::string file;
  std::string vendor_name;
  std::string product_name;
  std::string description;
  std::optional<std::uint32_t> vendor;  ///< 1018:1, else VendorNumber
  std::optional<std::uint32_t> product;
  std::optional<std::uint32_t> revision;
  std::vector<int> bit_rates_kbit_s;   ///< that the device takes
  std::optional<int> node_id;          ///< a DCF's own
  std::optional<int> bit_rate_kbit_s;  ///< a DCF's own
  bool lss = false;                    ///< its id can be set over the bus
  int most_pdo_bytes = 8;              ///< 64: frames of CAN FD; CiA 306 has no word for that
  std::optional<int> granularity;      ///< of PDO mappings [bit]; 0: they cannot be changed
  std::vector<std::uint16_t> dummies;  ///< data types that an RPDO may have as filler
  std::vector<SheetEntry> entries;
  /// What contradicts itself or CiA 306 and was read all the same: "line 12: …".
  std::vector<std::string> remarks;

  [[nodiscard]] const SheetEntry* find(std::uint16_t index, std::uint8_t sub = 0) const noexcept;
  /// Whether any sub-index of the object is there.
  [[nodiscard]] bool has(std::uint16_t index) const noexcept;
  /// The entry's value for a node of this id; none: no entry, or the sheet does not tell.
  [[nodiscard]] std::optional<std::int64_t> value(std::uint16_t index, std::uint8_t sub,
                                                  int id) const noexcept;
};

/// The most that a sheet may have; those of real drives have up to 0.2 MB and 1,200 entries.
inline constexpr std::size_t kMaxSheetBytes = bounds::kSheetBytes.most;
inline constexpr std::size_t kMaxSheetEntries = bounds::kSheetEntries.most;

/// Reads the text of an EDS or DCF.
///
/// Takes what sheets of real drives have (docs/drives.md lists it) and notes it in `remarks`.
/// @param file  name for errors; nothing is opened.
/// Errors, with line and "[section] key": not a sheet at all, an object twice with different
/// contents, a number that is none or does not fit its type, an unknown access or object type;
/// the file ends in the middle of a section, or lacks more than a tenth of the objects that it
/// lists; it is larger than kMaxSheetBytes or kMaxSheetEntries.
[[nodiscard]] Result<DataSheet> read_data_sheet(std::string_view text, std::string_view file);

/// Reads the file. Errors: those of read_data_sheet(); there is no such file, it is none, or it is
/// larger than kMaxSheetBytes, of which nothing is read.
[[nodiscard]] Result<DataSheet> load_data_sheet(const std::string& file);

}  // namespace tandem::canopen
