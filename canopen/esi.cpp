// The root, the vendor, one device and its modules.
#include "canopen/esi.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "base/counted.hpp"
#include "base/xml_scan.hpp"
#include "canopen/esi_text.hpp"
#include "canopen/frame.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "canopen/sheet_mappings.hpp"

namespace tandem::canopen {
namespace {

constexpr std::size_t kShownDevices = 12;

std::string hex8(std::uint32_t number) {
  std::array<char, 16> text{};
  (void)std::snprintf(text.data(), text.size(), "0x%08X", number);
  return text.data();
}

/// A number of the identity; 0 is none.
std::optional<std::uint32_t> known(std::uint32_t number) {
  return number == 0 ? std::nullopt : std::optional(number);
}

/// What the root of another XML file tells, and what to do about it.
struct OtherXml {
  std::string_view root;
  const char* what;
  const char* hint;
};
constexpr std::array kOthers{
    OtherXml{"ISO15745ProfileContainer", "is an XDD or XDC (CiA 311), which is not read",
             "get the EDS or DCF of the device: its maker has one, and editors of XDD files, such "
             "as CANopenEditor, export one"},
    OtherXml{"EtherCATConfig", "is the configuration of a network (ENI), not of a slave",
             "name the ESI of the slave, which its maker offers"},
    OtherXml{"EtherCATModule", "has modules alone, and no device",
             "name the ESI of the device that they are for"},
    OtherXml{"EtherCATDict", "has a dictionary alone, and no device",
             "name the ESI of the device that it is for"},
    OtherXml{"robot", "is the description of a robot (URDF)",
             "name the EDS, DCF or ESI of a device"},
};

Error other_xml(const EsiElement& root) {
  for (const OtherXml& other : kOthers) {
    if (same_word(root.Name(), other.root)) {
      return {.message = other.what, .hint = other.hint, .file = {}, .key = {}};
    }
  }
  return {.message = "is XML, and no ESI: its first element is <" + printable(root.Name()) +
                     ">, not <EtherCATInfo>",
          .hint = "name the EDS, DCF or ESI of a device",
          .file = {},
          .line = root.GetLineNum(),
          .key = {}};
}

/// The English one of several, else the first.
std::string name_of(const EsiElement& e) {
  const EsiElement* found = e.FirstChildElement("Name");
  for (const EsiElement* one = found; one != nullptr; one = one->NextSiblingElement("Name")) {
    if (one->IntAttribute("LcId") == 1033) found = one;
  }
  return found == nullptr ? std::string{} : printable(esi_text(*found));
}

const EsiElement* child(const EsiElement* e, const char* name) {
  return e == nullptr ? nullptr : e->FirstChildElement(name);
}

class EsiReader {
 public:
  explicit EsiReader(std::string_view file) { esi_.sheet.file = file; }

  Result<DataSheet> read(std::string_view text, const DeviceChoice& choice) {
    if (Status parsed = parse(text); !parsed) return std::unexpected(std::move(parsed.error()));
    const EsiElement& root = *document_.RootElement();
    if (!same_word(root.Name(), "EtherCATInfo")) return std::unexpected(other_xml(root));
    descriptions_ = root.FirstChildElement("Descriptions");
    const EsiElement* vendor = root.FirstChildElement("Vendor");
    if (vendor == nullptr) {
      esi_.fail(root, "has no Vendor", "get the whole file from its maker");
    } else {
      esi_.sheet.vendor = known(static_cast<std::uint32_t>(esi_.number(*vendor, "Id", 0xFFFFFFFF)));
      esi_.sheet.vendor_name = name_of(*vendor);
    }
    const auto device = choose(root, choice);
    if (!device) return std::unexpected(device.error());
    if (!esi_.error) read_device(**device);
    if (esi_.error) return std::unexpected(std::move(*esi_.error));
    DataSheet& sheet = esi_.sheet;
    for (auto& [key, entry] : esi_.entries) sheet.entries.push_back(std::move(entry));
    for (const OddMapping& odd : odd_mappings(sheet)) esi_.remarks.add(odd.line, odd.text);
    sheet.remarks = esi_.remarks.take();
    return std::move(sheet);
  }

 private:
  Status parse(std::string_view text) {
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
      return fail("is in UTF-16, which is not read", "save it as UTF-8");
    }
    if (text.size() > bounds::kEsiBytes.most) {
      return fail(beyond(bounds::kEsiBytes).message, "is this the file of a slave?");
    }
    const std::string file = esi_.sheet.file;
    if (Status within = check_xml_bounds(text, file, bounds::kEsiParts); !within) return within;
    const std::string plain = without_instructions(text);
    if (document_.Parse(plain.data(), plain.size()) != tinyxml2::XML_SUCCESS ||
        document_.RootElement() == nullptr) {
      return std::unexpected(Error{.message = "is no well-formed XML",
                                   .hint = "it seems to be cut off or changed: get the whole file",
                                   .file = file,
                                   .line = document_.ErrorLineNum(),
                                   .key = {}});
    }
    return {};
  }

  struct Device {
    const EsiElement* element;
    std::uint32_t product;
    std::uint32_t revision;
  };

  std::vector<Device> devices(const EsiElement& root) {
    std::vector<Device> all;
    const EsiElement* list = child(descriptions_, "Devices");
    if (list == nullptr) {
      esi_.fail(root, "has no device (Descriptions/Devices/Device)",
                "name the ESI of a slave, whole");
      return all;
    }
    for (const EsiElement* one = list->FirstChildElement("Device"); one != nullptr;
         one = one->NextSiblingElement("Device")) {
      const EsiElement* type = one->FirstChildElement("Type");
      if (type == nullptr) {
        esi_.fail(*one, "has no Type", "get the whole file from its maker");
        continue;
      }
      const auto number = [&](const char* name) {
        return static_cast<std::uint32_t>(esi_.attribute(*type, name, 0xFFFFFFFF));
      };
      all.push_back({one, number("ProductCode"), number("RevisionNo")});
    }
    if (all.empty()) esi_.fail(*list, "has no device", "name the ESI of a slave, whole");
    return all;
  }

  /// The one of this product and major revision; of several revisions the newest.
  Result<const EsiElement*> choose(const EsiElement& root, const DeviceChoice& choice) {
    const std::vector<Device> all = devices(root);
    if (esi_.error) return std::unexpected(*esi_.error);
    std::vector<Device> fitting;
    for (const Device& one : all) {
      const bool product = !choice.product || *choice.product == one.product;
      const bool revision = !choice.revision || *choice.revision >> 16 == one.revision >> 16;
      if (product && revision) fitting.push_back(one);
    }
    if (fitting.empty() && all.size() == 1) fitting = all;  // what differs is said of robot.toml
    const bool one_product = std::ranges::all_of(
        fitting, [&](const Device& one) { return one.product == fitting[0].product; });
    if (fitting.empty() || !one_product) return std::unexpected(which_device(all, fitting));
    const auto newest = std::ranges::max_element(fitting, {}, &Device::revision);
    if (fitting.size() > 1) {
      esi_.remarks.add(0, "the device has " + std::to_string(fitting.size()) +
                              " revisions; this is " + hex8(newest->revision) + ", the newest");
    }
    esi_.sheet.product = known(newest->product);
    esi_.sheet.revision = known(newest->revision);
    return newest->element;
  }

  [[nodiscard]] Error which_device(const std::vector<Device>& all,
                                   const std::vector<Device>& fitting) const {
    const std::vector<Device>& shown = fitting.empty() ? all : fitting;
    std::string list;
    for (std::size_t i = 0; i < std::min(shown.size(), kShownDevices); ++i) {
      list += (i > 0 ? ", " : "") + hex8(shown[i].product) + " revision " +
              hex8(shown[i].revision) + " (" + printable(name_of(*shown[i].element), 60) + ")";
    }
    if (shown.size() > kShownDevices) {
      list += " and " + std::to_string(shown.size() - kShownDevices) + " more";
    }
    return {.message = fitting.empty()
                           ? "has no device of this product and revision; it has " + list
                           : "has " + counted(shown.size(), "device") + ": " + list,
            .hint =
                "say which: product_code (and revision) of the board, or `tandem eds show "
                "FILE --product CODE`",
            .file = esi_.sheet.file,
            .key = {}};
  }

  void read_device(const EsiElement& device) {
    DataSheet& sheet = esi_.sheet;
    sheet.ethercat = true;
    sheet.most_pdo_bytes = static_cast<int>(kMaxFrameBytes);
    sheet.product_name = name_of(device);
    if (sheet.product_name.empty()) sheet.product_name = printable(esi_text(device, "Type"));
    sheet.description = printable(esi_text(device, "GroupType"));
    read_mailbox(device);
    read_managers(device);
    read_esi_objects(esi_, device, {});
    read_esi_pdos(esi_, device, {});
    read_slots(device);
    add_esi_assignment(esi_, device);
    add_profile(device);
    add_written(device);
    read_clock(device);
  }

  /// What an InitCmd writes is an object, also where the file has no dictionary, or none of it
  /// there. It has that value whenever the drive is in use.
  void add_written(const EsiElement& device) {
    for (const SheetWrite& write : esi_.sheet.writes) {
      if (esi_.entries.contains({write.index, write.sub})) continue;
      SheetEntry& entry = esi_.entry(write.index, write.sub, device);
      entry.type = esi_unsigned(8 * write.bytes.size());
      entry.access = kReadWrite;
      entry.name = "InitCmd";
      std::int64_t value = 0;
      for (std::size_t i = write.bytes.size(); i-- > 0;) value = value << 8 | write.bytes[i];
      entry.value = SheetValue{.number = value};
    }
  }

  void read_mailbox(const EsiElement& device) {
    const EsiElement* mailbox = device.FirstChildElement("Mailbox");
    const EsiElement* coe = child(mailbox, "CoE");
    if (coe == nullptr) {
      esi_.hinder(device, "no CoE is said (Mailbox/CoE): without it the drive cannot be set up");
      return;
    }
    esi_.assigns = esi_flag(*coe, "PdoAssign");
    esi_.configures = esi_flag(*coe, "PdoConfig");
    for (const EsiElement* write = coe->FirstChildElement("InitCmd"); write != nullptr;
         write = write->NextSiblingElement("InitCmd")) {
      read_write(*write);
    }
  }

  /// PDOs are the master's own; what is longer, or for another change of state, is left out.
  void read_write(const EsiElement& e) {
    const auto index = static_cast<std::uint16_t>(esi_.number(e, "Index", 0xFFFF));
    const auto sub = static_cast<std::uint8_t>(esi_.number(e, "SubIndex", 0xFF, 0));
    const bool of_pdos = index >= 0x1600 && index < 0x1D00;
    bool before = false;
    for (const EsiElement* at = e.FirstChildElement("Transition"); at != nullptr;
         at = at->NextSiblingElement("Transition")) {
      before = before || same_word(esi_text(*at), "PS");
    }
    const auto bytes = esi_bytes(esi_text(e, "Data"));
    if (of_pdos || esi_flag(e, "Disabled")) return;
    if (before && bytes && !bytes->empty() && bytes->size() <= 4) {
      esi_.sheet.writes.push_back({.index = index, .sub = sub, .bytes = *bytes});
      return;
    }
    std::array<char, 16> name{};
    (void)std::snprintf(name.data(), name.size(), "%04X:%02X", unsigned{index}, unsigned{sub});
    esi_.hinder(e, std::string("InitCmd of ") + name.data() +
                       " is not sent: it is no value of one to four bytes on the way from PREOP to "
                       "SAFEOP");
  }

  void read_managers(const EsiElement& device) {
    for (const EsiElement* one = device.FirstChildElement("Sm"); one != nullptr;
         one = one->NextSiblingElement("Sm")) {
      const auto number = [&](const char* name) {
        return static_cast<std::uint32_t>(esi_.attribute(*one, name, 0xFFFF));
      };
      esi_.sheet.managers.push_back({.use = printable(esi_text(*one), 40),
                                     .start = number("StartAddress"),
                                     .bytes = number("DefaultSize"),
                                     .most_bytes = number("MaxSize")});
    }
  }

  void read_clock(const EsiElement& device) {
    const EsiElement* clock = device.FirstChildElement("Dc");
    if (clock == nullptr) return;
    for (const EsiElement* mode = clock->FirstChildElement("OpMode"); mode != nullptr;
         mode = mode->NextSiblingElement("OpMode")) {
      esi_.sheet.dc_modes.push_back({.name = printable(esi_text(*mode, "Name"), 80),
                                     .activate = static_cast<std::uint16_t>(
                                         esi_.number(*mode, "AssignActivate", 0xFFFF, 0))});
    }
  }

  void add_unsigned(std::uint16_t index, std::uint8_t sub, const char* name, const EsiElement& at) {
    SheetEntry& entry = esi_.entry(index, sub, at);
    if (entry.type != 0) return;
    entry.type = static_cast<std::uint16_t>(DataType::kUnsigned32);
    entry.name = name;
  }

  /// What every slave with CoE has, though its file may have no dictionary: 1000, as Profile says,
  /// and 1018.
  void add_profile(const EsiElement& device) {
    add_unsigned(object::kDeviceType, 0, "Device type", device);
    std::uint8_t sub = 0;
    for (const char* name : {"Vendor-ID", "Product code", "Revision number", "Serial number"}) {
      add_unsigned(object::kIdentity, ++sub, name, device);
    }
    const EsiElement* profile = device.FirstChildElement("Profile");
    if (profile == nullptr) return;
    const std::uint64_t number = esi_.number(*profile, "ProfileNo", 0xFFFF, 0);
    const std::uint64_t more = esi_.number(*profile, "AddInfo", 0xFFFF, 0);
    SheetEntry& type = esi_.entry(object::kDeviceType, 0, *profile);
    if (type.value.value_or(SheetValue{}).number != 0 || number == 0) return;
    type.value = SheetValue{.number = static_cast<std::int64_t>(more << 16 | number)};
  }

  const EsiElement* module(std::uint64_t ident) {
    const EsiElement* list = child(descriptions_, "Modules");
    if (list == nullptr) return nullptr;
    for (const EsiElement* one = list->FirstChildElement("Module"); one != nullptr;
         one = one->NextSiblingElement("Module")) {
      const EsiElement* type = one->FirstChildElement("Type");
      if (type != nullptr && esi_.attribute(*type, "ModuleIdent", 0xFFFFFFFF) == ident) return one;
    }
    return nullptr;
  }

  /// Drives with modules: a slot for an axis, a module for its modes. Those that are plugged from
  /// power-on, and in the first slot at least one.
  void read_slots(const EsiElement& device) {
    const EsiElement* slots = device.FirstChildElement("Slots");
    if (slots == nullptr) return;
    const auto step = [&](const char* name) { return esi_.attribute(*slots, name, 0xFFFF); };
    const std::uint64_t objects = step("SlotIndexIncrement");
    const std::uint64_t pdos = step("SlotPdoIncrement");
    std::uint64_t place = 0;
    for (const EsiElement* slot = slots->FirstChildElement("Slot"); slot != nullptr;
         slot = slot->NextSiblingElement("Slot"), ++place) {
      const EsiElement* ident = slot->FirstChildElement("ModuleIdent");
      const EsiElement* chosen = ident;
      for (const EsiElement* one = ident; one != nullptr;
           one = one->NextSiblingElement("ModuleIdent")) {
        if (esi_flag(*one, "Default")) chosen = one;
      }
      const bool plugged = chosen != nullptr && (place == 0 || esi_flag(*chosen, "Default") ||
                                                 esi_.attribute(*slot, "MinInstances", 0xFFFF) > 0);
      if (!plugged) continue;
      const std::uint64_t number = esi_number(esi_text(*chosen)).value_or(0);
      const EsiElement* found = module(number);
      if (found == nullptr) {
        return esi_.fail(*chosen, "no Module has this ident", "get the whole file from its maker");
      }
      const EsiShift shift{.object = static_cast<std::uint16_t>(objects * place),
                           .pdo = static_cast<std::uint16_t>(pdos * place)};
      read_esi_objects(esi_, *found, shift);
      read_esi_pdos(esi_, *found, shift);
      esi_.remarks.add(chosen->GetLineNum(), "slot " + std::to_string(place + 1) +
                                                 " is taken to have the module '" +
                                                 name_of(*found) + "'");
    }
  }

  EsiSheet esi_;
  tinyxml2::XMLDocument document_;
  const EsiElement* descriptions_ = nullptr;
};

}  // namespace

bool is_xml(std::string_view text) noexcept {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) return true;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return trimmed(text).starts_with('<');
}

Result<DataSheet> read_esi(std::string_view text, std::string_view file,
                           const DeviceChoice& choice) {
  return EsiReader(file).read(text, choice);
}

}  // namespace tandem::canopen
