// The entries by rights: what a PDO carries, what a master sets, what it reads.
#include "canopen/data_sheet.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "canopen/eds.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "canopen/pdo.hpp"

namespace tandem::canopen {
namespace {

using enum DataType;

struct Item {
  std::uint16_t index;
  std::uint8_t sub;
  DataType type;
  std::uint8_t access;
  std::optional<std::int64_t> low = {};
  std::optional<std::int64_t> high = {};
};

constexpr std::array kOfNode{
    Item{object::kDeviceType, 0, kUnsigned32, kRead},
    Item{object::kSyncTimeout, 0, kUnsigned32, kReadWrite},
    Item{object::kHeartbeatConsumer, 1, kUnsigned32, kReadWrite},
    Item{object::kHeartbeatProducer, 0, kUnsigned16, kReadWrite},
    Item{object::kIdentity, kVendor, kUnsigned32, kRead},
    Item{object::kIdentity, kProduct, kUnsigned32, kRead},
    Item{object::kIdentity, kRevision, kUnsigned32, kRead},
    Item{object::kIdentity, kSerial, kUnsigned32, kRead},
    Item{object::kCycleCounter, 0, kUnsigned8, kWriteRpdo | kMapTpdo},
};

constexpr std::array kOfAxis{
    // Demands
    Item{object::kControlword, 0, kUnsigned16, kWriteRpdo},
    Item{object::kMode, 0, kInteger8, kWriteRpdo},
    Item{object::kTargetPosition, 0, kInteger32, kWriteRpdo},
    Item{object::kTargetVelocity, 0, kInteger32, kWriteRpdo},
    Item{object::kVelocityOffset, 0, kInteger32, kWriteRpdo},
    Item{object::kTargetTorque, 0, kInteger16, kWriteRpdo},
    Item{object::kTorqueOffset, 0, kInteger16, kWriteRpdo},
    Item{object::kTargetVoltage, 0, kInteger16, kWriteRpdo},
    Item{object::kTargetCurrent, 0, kInteger16, kWriteRpdo},
    Item{object::kStiffness, 0, kReal32, kWriteRpdo},
    Item{object::kDamping, 0, kReal32, kWriteRpdo},
    // Actual values
    Item{object::kStatusword, 0, kUnsigned16, kReadTpdo},
    Item{object::kModeDisplay, 0, kInteger8, kReadTpdo},
    Item{object::kErrorCode, 0, kUnsigned16, kReadTpdo},
    Item{object::kPosition, 0, kInteger32, kReadTpdo},
    Item{object::kVelocity, 0, kInteger32, kReadTpdo},
    Item{object::kTorque, 0, kInteger16, kReadTpdo},
    Item{object::kMotorPosition, 0, kInteger32, kReadTpdo},
    Item{object::kMotorVelocity, 0, kInteger32, kReadTpdo},
    Item{object::kCurrent, 0, kInteger16, kReadTpdo},
    Item{object::kVoltage, 0, kInteger16, kReadTpdo},
    Item{object::kTemperature, 0, kInteger16, kReadTpdo},
    // Settings that a robot.toml has
    Item{object::kSupportedModes, 0, kUnsigned32, kRead},
    Item{object::kAbortConnectionOption, 0, kInteger16, kReadWrite},
    Item{object::kQuickStopOption, 0, kInteger16, kReadWrite},
    Item{object::kShutdownOption, 0, kInteger16, kReadWrite, 0, 1},
    Item{object::kDisableOption, 0, kInteger16, kReadWrite, 0, 1},
    Item{object::kHaltOption, 0, kInteger16, kReadWrite, 1, 2},
    Item{object::kFaultReactionOption, 0, kInteger16, kReadWrite, -1, 2},
    Item{object::kMotorResolution, 0, kUnsigned32, kReadWrite},
    Item{object::kHomeOffset, 0, kInteger32, kReadWrite},
    Item{object::kHomingMethod, 0, kInteger8, kReadWrite},
    Item{object::kHomingSpeeds, 1, kUnsigned32, kReadWrite},
    Item{object::kHomingSpeeds, 2, kUnsigned32, kReadWrite},
    Item{object::kHomingAcceleration, 0, kUnsigned32, kReadWrite},
};

void add(DataSheet& sheet, std::uint16_t index, std::uint8_t sub, DataType type,
         std::uint8_t access, std::optional<std::int64_t> value = {}, bool plus_node_id = false) {
  SheetEntry entry{.index = index,
                   .sub = sub,
                   .type = static_cast<std::uint16_t>(type),
                   .access = access,
                   .name = entry_name(index, sub)};
  if (value) entry.value = SheetValue{.number = *value, .plus_node_id = plus_node_id};
  sheet.entries.push_back(std::move(entry));
}

/// A PDO that can be mapped as a master likes, and is switched off until then.
void add_pdo(DataSheet& sheet, PdoDirection direction, int number) {
  const bool receive = direction == PdoDirection::kReceive;
  const auto offset = static_cast<std::uint16_t>(number - 1);
  const auto parameter = static_cast<std::uint16_t>(
      (receive ? object::kRpdoParameter : object::kTpdoParameter) + offset);
  const auto mapping =
      static_cast<std::uint16_t>((receive ? object::kRpdoMapping : object::kTpdoMapping) + offset);
  const std::uint32_t id = cob::kInvalid | (receive ? cob::rpdo(number, 0) : cob::tpdo(number, 0));
  add(sheet, parameter, 1, kUnsigned32, kReadWrite, id, true);
  add(sheet, parameter, 2, kUnsigned8, kReadWrite, kEventProfile);
  if (!receive) {
    add(sheet, parameter, 3, kUnsigned16, kReadWrite, 0);
    add(sheet, parameter, 5, kUnsigned16, kReadWrite, 0);
  }
  add(sheet, mapping, 0, kUnsigned8, kReadWrite, 0);
  for (std::size_t sub = 1; sub <= kMaxMappedObjects; ++sub) {
    add(sheet, mapping, static_cast<std::uint8_t>(sub), kUnsigned32, kReadWrite, 0);
  }
}

DataSheet make_sheet() {
  DataSheet sheet;
  sheet.product_name = "Tandem control board";
  sheet.most_pdo_bytes = static_cast<int>(kMaxFrameBytes);
  sheet.vendor = kTandemVendor;
  sheet.product = kBoardProduct;
  sheet.revision = kTandemRevision;
  for (const Item& item : kOfNode) add(sheet, item.index, item.sub, item.type, item.access);
  for (int number = 1; number <= kPdosPerNode; ++number) {
    add_pdo(sheet, PdoDirection::kReceive, number);
    add_pdo(sheet, PdoDirection::kTransmit, number);
  }
  for (int axis = 0; axis < kMaxAxes; ++axis) {
    for (const Item& item : kOfAxis) {
      const bool modes = item.index == object::kSupportedModes;
      const bool abort = item.index == object::kAbortConnectionOption;
      std::optional<std::int64_t> value;
      if (modes) value = kTandemModes;
      if (abort) value = 1;
      add(sheet, of_axis(item.index, axis), item.sub, item.type, item.access, value);
      sheet.entries.back().low = item.low;
      sheet.entries.back().high = item.high;
    }
  }
  std::ranges::sort(sheet.entries, {},
                    [](const SheetEntry& e) { return std::uint32_t{e.index} << 8 | e.sub; });
  return sheet;
}

}  // namespace

std::shared_ptr<const DataSheet> tandem_board_sheet() {
  static const auto sheet = std::make_shared<const DataSheet>(make_sheet());
  return sheet;
}

}  // namespace tandem::canopen
