// What a data sheet says of a device: identity and objects. An EDS or DCF (CiA 306), or the ESI of
// an EtherCAT slave (ETG.2000).
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
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

/// Which device of a file that has several, as an ESI may; what is empty is any.
struct DeviceChoice {
  std::optional<std::uint32_t> product;
  std::optional<std::uint32_t> revision;  ///< its major is compared
};

/// A sync manager of an ESI: its process data or its mailbox.
struct SheetManager {
  std::string use;  ///< "Outputs"
  std::uint32_t start = 0;
  std::uint32_t bytes = 0;       ///< from power-on
  std::uint32_t most_bytes = 0;  ///< 0: not said
};

/// A way to be synchronous that an ESI offers (Dc/OpMode).
struct SheetDcMode {
  std::string name;
  std::uint16_t activate = 0;  ///< AssignActivate: bit 9 SYNC0, bit 10 SYNC1
  [[nodiscard]] bool sync0() const noexcept { return (activate & 0x0200) != 0; }
  [[nodiscard]] bool sync1() const noexcept { return (activate & 0x0400) != 0; }
};

/// A value that an ESI wants to be written before SAFEOP (CoE/InitCmd).
struct SheetWrite {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  std::vector<std::uint8_t> bytes;  ///< one to four
};

/// What of an ESI keeps the master from using the drive as its file means it.
struct SheetHindrance {
  int line = 0;
  std::string text;
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
  /// EtherCAT: PDOs are any of 1600 to 17FF and 1A00 to 1BFF, without COB-IDs; 1C12 and 1C13 say
  /// which of them are the process data. An ESI's sheet, or one of a board on such a bus.
  bool ethercat = false;
  // The rest of an ESI
  std::vector<SheetManager> managers;
  std::vector<SheetDcMode> dc_modes;
  std::vector<SheetWrite> writes;
  std::vector<std::pair<std::uint16_t, std::uint16_t>> excludes;  ///< PDOs, of which one at a time
  std::vector<std::uint16_t> mandatory;    ///< PDOs that are always among the process data
  std::vector<SheetHindrance> hindrances;  ///< each is among the remarks, too
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

/// Reads the text of an EDS or DCF, or of an ESI: a text that begins with `<`.
///
/// Takes what sheets of real drives have (docs/drives.md lists it) and notes it in `remarks`.
/// @param file  name for errors; nothing is opened.
/// Errors, with line and "[section] key": not a sheet at all, an object twice with different
/// contents, a number that is none or does not fit its type, an unknown access or object type;
/// the file ends in the middle of a section, or lacks more than a tenth of the objects that it
/// lists; it is larger than kMaxSheetBytes or kMaxSheetEntries.
/// An ESI's errors have line and element: no well-formed XML, or another kind of it; no device, or
/// several of which `choice` does not name one; a number or a PDO that cannot be.
[[nodiscard]] Result<DataSheet> read_data_sheet(std::string_view text, std::string_view file,
                                                const DeviceChoice& choice = {});

/// Reads the file. Errors: those of read_data_sheet(); there is no such file, it is none, or it is
/// larger than kMaxSheetBytes, of which nothing is read; "….xml": than bounds::kEsiBytes.
[[nodiscard]] Result<DataSheet> load_data_sheet(const std::string& file,
                                                const DeviceChoice& choice = {});

/// Our firmware's objects that a master reads, writes or maps, for all eight axes; a board without
/// a sheet of its own is one of these. What `tandem eds` writes has more: all that the firmware
/// has.
[[nodiscard]] std::shared_ptr<const DataSheet> tandem_board_sheet();

}  // namespace tandem::canopen
