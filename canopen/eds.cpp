// The names of all objects, and the sections of an EDS file from a dictionary's entries.
#include "canopen/eds.hpp"

#include <array>
#include <cstdio>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "canopen/objects.hpp"

namespace tandem::canopen {
namespace {

struct ObjectName {
  std::uint16_t index;
  std::string_view name;
  std::string_view subs = {};  ///< from sub 1, by comma
};

constexpr std::string_view kPid = "kp,ki,kd,Output limit";

// Those of an axis as axis 0 has them.
constexpr std::array kNames{
    ObjectName{0x1000, "Device type"},
    ObjectName{0x1001, "Error register"},
    ObjectName{0x1003, "Pre-defined error field"},
    ObjectName{0x1005, "COB-ID SYNC"},
    ObjectName{0x1006, "Communication cycle period"},
    ObjectName{0x1008, "Manufacturer device name"},
    ObjectName{0x1009, "Manufacturer hardware version"},
    ObjectName{0x100A, "Manufacturer software version"},
    ObjectName{0x100C, "Guard time"},
    ObjectName{0x100D, "Life time factor"},
    ObjectName{0x1014, "COB-ID EMCY"},
    ObjectName{0x1016, "Consumer heartbeat time"},
    ObjectName{0x1017, "Producer heartbeat time"},
    ObjectName{0x1018, "Identity object", "Vendor-ID,Product code,Revision number,Serial number"},
    ObjectName{0x1029, "Error behaviour", "Communication error"},
    ObjectName{0x2000, "Motor position"},
    ObjectName{0x2001, "Motor velocity"},
    ObjectName{0x2002, "Motor current"},
    ObjectName{0x2003, "Motor voltage"},
    ObjectName{0x2004, "Winding temperature"},
    ObjectName{0x2010, "Stiffness"},
    ObjectName{0x2011, "Damping"},
    ObjectName{0x2012, "Target voltage"},
    ObjectName{0x2013, "Target current"},
    ObjectName{0x2020, "Position gains", kPid},
    ObjectName{0x2021, "Velocity gains", kPid},
    ObjectName{0x2022, "Torque gains", kPid},
    ObjectName{0x2023, "Current gains", kPid},
    ObjectName{0x2024, "Feed-forward", "Torque to voltage,Back-EMF compensation"},
    ObjectName{0x2025, "Position feedback"},
    ObjectName{0x2026, "Motor data", "Resistance,Torque constant,Spring"},
    ObjectName{0x2027, "Estimator cut-offs", "Link velocity,Motor velocity,Torque rate"},
    ObjectName{0x2028, "Transfer time"},
    ObjectName{0x2030, "Limits", "Voltage,Current,Torque,Velocity"},
    ObjectName{0x2031, "I2t", "Continuous current,Thermal time constant"},
    ObjectName{0x2032, "Command time-out"},
    ObjectName{0x2033, "Motor encoder resolution"},
    ObjectName{0x2034, "Temperature limit"},
    ObjectName{0x2035, "Under-voltage"},
    ObjectName{0x2036, "Stop time"},
    ObjectName{0x2037, "Position margin"},
    ObjectName{0x2038, "Sensor mismatch", "Window,Time"},
    ObjectName{0x2039, "Oscillation", "Limit,Time"},
    ObjectName{0x203A, "Brake", "Fitted,Release time,Engage time"},
    ObjectName{0x203B, "Excess", "Share,Time"},
    ObjectName{0x203C, "Swing"},
    ObjectName{0x2040, "Telemetry",
               "Torque reference,Transfer voltage,Position integral,Velocity integral,"
               "Torque integral,Current integral,I2t load,Oscillation load"},
    ObjectName{0x2041, "Refused values"},
    ObjectName{0x2050, "Ignored frames"},
    ObjectName{0x2051, "Cycle counter"},
    ObjectName{0x2052, "SYNC time-out"},
    ObjectName{0x2100, "Sensor channels"},
    ObjectName{0x6007, "Abort connection option code"},
    ObjectName{0x603F, "Error code"},
    ObjectName{0x6040, "Controlword"},
    ObjectName{0x6041, "Statusword"},
    ObjectName{0x605A, "Quick stop option code"},
    ObjectName{0x605B, "Shutdown option code"},
    ObjectName{0x605C, "Disable operation option code"},
    ObjectName{0x605D, "Halt option code"},
    ObjectName{0x605E, "Fault reaction option code"},
    ObjectName{0x6060, "Modes of operation"},
    ObjectName{0x6061, "Modes of operation display"},
    ObjectName{0x6064, "Position actual value"},
    ObjectName{0x6065, "Following error window"},
    ObjectName{0x6066, "Following error time out"},
    ObjectName{0x606C, "Velocity actual value"},
    ObjectName{0x6071, "Target torque"},
    ObjectName{0x6072, "Max torque"},
    ObjectName{0x6076, "Motor rated torque"},
    ObjectName{0x6077, "Torque actual value"},
    ObjectName{0x607A, "Target position"},
    ObjectName{0x607C, "Home offset"},
    ObjectName{0x607D, "Software position limit", "Min position limit,Max position limit"},
    ObjectName{0x6085, "Quick stop deceleration"},
    ObjectName{0x6087, "Torque slope"},
    ObjectName{0x608F, "Position encoder resolution", "Encoder increments,Motor revolutions"},
    ObjectName{0x6098, "Homing method"},
    ObjectName{0x6099, "Homing speeds",
               "Speed during search for switch,Speed during search for zero"},
    ObjectName{0x609A, "Homing acceleration"},
    ObjectName{0x60B1, "Velocity offset"},
    ObjectName{0x60B2, "Torque offset"},
    ObjectName{0x60C2, "Interpolation time period",
               "Interpolation time period value,"
               "Interpolation time index"},
    ObjectName{0x60F4, "Following error actual value"},
    ObjectName{0x60FD, "Digital inputs"},
    ObjectName{0x60FE, "Digital outputs", "Physical outputs"},
    ObjectName{0x60FF, "Target velocity"},
    ObjectName{0x6502, "Supported drive modes"},
};

template <class... T>
std::string format(const char* pattern, T... values) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

/// One line of a section.
std::string line(std::string_view key, std::string_view value) {
  return std::string(key) + "=" + std::string(value) + "\n";
}

struct PdoName {
  std::uint16_t first;
  std::string_view name;
  std::string_view sub;
};
constexpr std::array kPdoNames{
    PdoName{object::kRpdoParameter, "RPDO communication parameter", ""},
    PdoName{object::kRpdoMapping, "RPDO mapping parameter", "Application object "},
    PdoName{object::kTpdoParameter, "TPDO communication parameter", ""},
    PdoName{object::kTpdoMapping, "TPDO mapping parameter", "Application object "},
};

const PdoName* pdo_name(std::uint16_t index) {
  for (const PdoName& pdo : kPdoNames) {
    if (index >= pdo.first && index < pdo.first + kPdosPerNode) return &pdo;
  }
  return nullptr;
}

/// The same object of axis 0; the axis, or -1 for what is the node's own.
std::pair<std::uint16_t, int> on_axis(std::uint16_t index) {
  const bool manufacturer = index >= 0x2000 && index < 0x6000;
  const bool profile = index >= 0x6000 && index < 0xA000;
  if (!manufacturer && !profile) return {index, -1};
  const int base = manufacturer ? 0x2000 : 0x6000;
  const bool of_node =
      index == 0x2050 || index == object::kCycleCounter || index == object::kSensorChannels;
  const int offset = index - base;
  return {static_cast<std::uint16_t>(base + offset % kAxisStride),
          of_node ? -1 : offset / kAxisStride};
}

const ObjectName* find_name(std::uint16_t index) {
  for (const ObjectName& object : kNames) {
    if (object.index == index) return &object;
  }
  return nullptr;
}

std::string object_name(std::uint16_t index) {
  if (const PdoName* pdo = pdo_name(index)) {
    return std::string(pdo->name) + format(" %d", index - pdo->first + 1);
  }
  const auto [first, axis] = on_axis(index);
  const ObjectName* found = find_name(first);
  const std::string name = found != nullptr ? std::string(found->name) : format("%04X", index);
  return axis > 0 ? name + format(", axis %d", axis) : name;
}

std::string sub_name(std::uint16_t index, std::uint8_t sub) {
  if (sub == 0) return "Highest sub-index supported";
  if (const PdoName* pdo = pdo_name(index)) {
    constexpr std::array<std::string_view, 6> kParameter{
        "", "COB-ID", "Transmission type", "Inhibit time", "Reserved", "Event timer"};
    if (pdo->sub.empty() && sub < kParameter.size()) return std::string(kParameter[sub]);
    return std::string(pdo->sub) + format("%d", sub);
  }
  const ObjectName* found = find_name(on_axis(index).first);
  std::string_view rest = found != nullptr ? found->subs : std::string_view{};
  for (int i = 1; !rest.empty(); ++i) {
    const std::size_t end = rest.find(',');
    if (i == sub) return std::string(rest.substr(0, end));
    rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  }
  return object_name(index) + format(" %d", sub);
}

const char* access_name(const ObjectEntry& entry) {
  const bool written = (entry.access & kWrite) != 0;
  if (!written) return "ro";
  const bool by_rpdo = (entry.access & kMapRpdo) != 0;
  const bool by_tpdo = (entry.access & kMapTpdo) != 0;
  if (by_rpdo == by_tpdo) return "rw";
  return by_rpdo ? "rww" : "rwr";
}

template <class T>
std::string number(const ObjectEntry& entry) {
  return std::to_string(*static_cast<const T*>(entry.data));
}

std::string value_of(const ObjectEntry& entry) {
  switch (entry.type) {
    case DataType::kBoolean: return *static_cast<const bool*>(entry.data) ? "1" : "0";
    case DataType::kInteger8: return number<std::int8_t>(entry);
    case DataType::kInteger16: return number<std::int16_t>(entry);
    case DataType::kInteger32: return number<std::int32_t>(entry);
    case DataType::kUnsigned8: return number<std::uint8_t>(entry);
    case DataType::kUnsigned16: return number<std::uint16_t>(entry);
    case DataType::kUnsigned32:
      return format("0x%08X", *static_cast<const std::uint32_t*>(entry.data));
    case DataType::kReal32:
      return format("%.9g", static_cast<double>(*static_cast<const float*>(entry.data)));
    case DataType::kVisibleString: return {static_cast<const char*>(entry.data), entry.size};
  }
  return {};
}

bool integral(DataType type) {
  return type != DataType::kReal32 && type != DataType::kVisibleString &&
         type != DataType::kBoolean;
}

std::string variable(const ObjectEntry& entry, const std::string& name,
                     const EdsDefaults& defaults) {
  std::string text = line("ParameterName", name) + line("ObjectType", "0x7") +
                     line("DataType", format("0x%04X", static_cast<unsigned>(entry.type))) +
                     line("AccessType", access_name(entry));
  const bool limited = integral(entry.type) && entry.range.min > ObjectRange{}.min;
  if (limited) {
    text += line("LowLimit", format("%.0f", entry.range.min));
    text += line("HighLimit", format("%.0f", entry.range.max));
  }
  const auto found = defaults.find({entry.index, entry.sub});
  text += line("DefaultValue", found != defaults.end() ? found->second : value_of(entry));
  const bool mappable = (entry.access & (kMapRpdo | kMapTpdo)) != 0;
  return text + line("PDOMapping", mappable ? "1" : "0");
}

/// The entries of one index.
std::string object_text(std::span<const ObjectEntry> entries, const EdsDefaults& defaults) {
  const std::uint16_t index = entries[0].index;
  const std::string section = format("%04X", index);
  if (entries.size() == 1 && entries[0].sub == 0) {
    return "\n[" + section + "]\n" + variable(entries[0], object_name(index), defaults);
  }
  bool alike = true;
  for (const ObjectEntry& entry : entries.subspan(1)) {
    alike = alike && entry.type == entries[1].type;
  }
  const bool parameter = pdo_name(index) != nullptr || index == object::kIdentity;
  std::string text = "\n[" + section + "]\n" + line("ParameterName", object_name(index)) +
                     line("ObjectType", alike && !parameter ? "0x8" : "0x9") +
                     line("SubNumber", std::to_string(entries.size()));
  for (const ObjectEntry& entry : entries) {
    text += "\n[" + section + "sub" + format("%X", entry.sub) + "]\n" +
            variable(entry, sub_name(index, entry.sub), defaults);
  }
  return text;
}

std::string list_text(std::string_view title, const std::vector<std::uint16_t>& indices) {
  std::string text =
      "\n[" + std::string(title) + "]\n" + line("SupportedObjects", std::to_string(indices.size()));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    text += line(std::to_string(i + 1), format("0x%04X", indices[i]));
  }
  return text;
}

std::string head_text(const EdsDevice& device) {
  std::string text = "[FileInfo]\n" + line("FileName", device.file_name) +
                     line("FileVersion", "1") + line("FileRevision", "0") +
                     line("EDSVersion", "4.0") + line("Description", device.description) +
                     line("CreationTime", "12:00AM") + line("CreationDate", "01-01-2025") +
                     line("CreatedBy", "tandem eds") + line("ModificationTime", "12:00AM") +
                     line("ModificationDate", "01-01-2025") + line("ModifiedBy", "tandem eds");
  text += "\n[DeviceInfo]\n" + line("VendorName", "Tandem") +
          line("VendorNumber", format("0x%08X", device.vendor)) +
          line("ProductName", device.product_name) +
          line("ProductNumber", format("0x%08X", device.product)) +
          line("RevisionNumber", format("0x%08X", device.revision)) + line("OrderCode", "0");
  for (const int rate : {10, 20, 50, 125, 250, 500, 800, 1000}) {
    text += line("BaudRate_" + std::to_string(rate), "1");
  }
  return text + line("SimpleBootUpMaster", "0") + line("SimpleBootUpSlave", "1") +
         line("Granularity", "8") + line("DynamicChannelsSupported", "0") +
         line("GroupMessaging", "0") + line("NrOfRXPDO", std::to_string(kPdosPerNode)) +
         line("NrOfTXPDO", std::to_string(kPdosPerNode)) + line("LSS_Supported", "0");
}

}  // namespace

std::string entry_name(std::uint16_t index, std::uint8_t sub) {
  return sub == 0 ? object_name(index) : sub_name(index, sub);
}

std::string make_eds(const ObjectDictionary& od, const EdsDevice& device,
                     const EdsDefaults& defaults) {
  std::vector<std::uint16_t> mandatory, optional, manufacturer;
  std::string objects;
  const std::span<const ObjectEntry> all = od.entries();
  for (std::size_t i = 0; i < all.size();) {
    std::size_t end = i;
    while (end < all.size() && all[end].index == all[i].index) ++end;
    const std::uint16_t index = all[i].index;
    const bool needed = index == object::kDeviceType || index == object::kErrorRegister ||
                        index == object::kIdentity;
    const bool own = index >= 0x2000 && index < 0x6000;
    (needed ? mandatory : own ? manufacturer : optional).push_back(index);
    objects += object_text(all.subspan(i, end - i), defaults);
    i = end;
  }
  std::string text = head_text(device) + "\n[DummyUsage]\n";
  for (int type = 1; type <= 7; ++type) text += line(format("Dummy%04d", type), "0");
  text += "\n[Comments]\n" + line("Lines", "1");
  text += line("Line1", device.fd ? "PDOs of up to 64 bytes: CAN FD" : "Classic CAN");
  return text + list_text("MandatoryObjects", mandatory) + list_text("OptionalObjects", optional) +
         list_text("ManufacturerObjects", manufacturer) + objects;
}

}  // namespace tandem::canopen
