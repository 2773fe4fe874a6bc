#include "apps/tools/eds_files.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "canopen/eds.hpp"
#include "firmware_emu/board.hpp"
#include "firmware_emu/sensor_board.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::apps {
namespace {

using hal::can::NodePlan;
namespace object = canopen::object;

/// COB-IDs after power-on, which depend on the node's id: of the emergencies, and of PDOs, all off.
canopen::EdsDefaults cob_ids() {
  canopen::EdsDefaults defaults;
  defaults[{object::kEmergencyId, 0}] = "$NODEID+0x80";
  for (int n = 0; n < canopen::kPdosPerNode; ++n) {
    const auto offset = static_cast<std::uint16_t>(n);
    const auto rpdo = static_cast<std::uint16_t>(object::kRpdoParameter + offset);
    const auto tpdo = static_cast<std::uint16_t>(object::kTpdoParameter + offset);
    defaults[{rpdo, 1}] = fmt::format("$NODEID+0x{:X}", 0x80000200U + 0x100U * offset);
    defaults[{tpdo, 1}] = fmt::format("$NODEID+0x{:X}", 0xC0000180U + 0x100U * offset);
  }
  return defaults;
}

EdsFile board_sheet(const hal::RobotConfig& robot, const NodePlan& node, bool fd,
                    const std::string& name) {
  const hal::BoardConfig& config = robot.boards[static_cast<std::size_t>(node.board)];
  firmware::BoardSetup setup;
  setup.vendor = config.vendor_id.value_or(setup.vendor);
  setup.product = config.product_code.value_or(setup.product);
  setup.revision = config.revision.value_or(setup.revision);
  setup.axes.resize(node.joints.size());
  const firmware::Board board(setup);
  const std::size_t axes = node.joints.size();
  const canopen::EdsDevice device{
      .file_name = name,
      .description = fmt::format("Control board with {} ax{}", axes, axes == 1 ? "is" : "es"),
      .product_name = setup.name,
      .vendor = setup.vendor,
      .product = setup.product,
      .revision = setup.revision,
      .fd = fd};
  return {.name = name,
          .nodes = {node.name},
          .objects = board.dictionary().entries().size(),
          .text = canopen::make_eds(board.dictionary(), device, cob_ids())};
}

EdsFile sensor_sheet(const hal::RobotConfig& robot, const NodePlan& node, bool fd,
                     const std::string& name) {
  const hal::SensorConfig& config = robot.sensors[static_cast<std::size_t>(node.sensor)];
  firmware::SensorSetup setup;
  setup.channels = config.channels();
  const firmware::SensorBoard board(setup);
  const canopen::EdsDevice device{
      .file_name = name,
      .description = fmt::format("Sensor with {} channels", setup.channels),
      .product_name = setup.name,
      .vendor = canopen::kTandemVendor,
      .product = canopen::kSensorProduct,
      .revision = canopen::kTandemRevision,
      .fd = fd};
  return {.name = name,
          .nodes = {node.name},
          .objects = board.dictionary().entries().size(),
          .text = canopen::make_eds(board.dictionary(), device, cob_ids())};
}

/// "board_2_axes_fd", "imu_fd".
std::string type_name(const hal::RobotConfig& robot, const NodePlan& node, bool fd) {
  const char* bus = fd ? "fd" : "classic";
  if (node.board >= 0) {
    const std::size_t axes = node.joints.size();
    return fmt::format("board_{}_{}_{}", axes, axes == 1 ? "axis" : "axes", bus);
  }
  const hal::SensorConfig& sensor = robot.sensors[static_cast<std::size_t>(node.sensor)];
  const bool imu = sensor.type == hal::SensorType::kImu;
  return fmt::format("{}_{}", imu ? "imu" : "force_torque", bus);
}

}  // namespace

Result<std::vector<EdsFile>> make_eds_files(const hal::RobotConfig& robot) {
  const auto layout = hal::can::make_pdo_layout(robot);
  if (!layout) return std::unexpected(layout.error());
  std::vector<EdsFile> files;
  for (const NodePlan& node : layout->nodes) {
    const bool foreign =
        node.board >= 0 && !robot.boards[static_cast<std::size_t>(node.board)].eds.empty();
    if (foreign) continue;
    const bool fd = robot.buses[node.bus].fd;
    const std::string type = type_name(robot, node, fd);
    // Equal but for their identity: the second kind is type_2, and so on.
    for (int kind = 1;; ++kind) {
      const std::string name = type + (kind > 1 ? fmt::format("_{}", kind) : "") + ".eds";
      EdsFile sheet = node.board >= 0 ? board_sheet(robot, node, fd, name)
                                      : sensor_sheet(robot, node, fd, name);
      const auto found = std::ranges::find(files, name, &EdsFile::name);
      if (found == files.end()) {
        files.push_back(std::move(sheet));
        break;
      }
      if (found->text != sheet.text) continue;
      found->nodes.push_back(node.name);
      break;
    }
  }
  return files;
}

}  // namespace tandem::apps
