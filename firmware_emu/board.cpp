// Frames to the node, then per axis: which connection is lost (SYNC, commands, heartbeat),
// protections, controllers; emergencies and TPDOs out.
#include "firmware_emu/board.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "firmware_emu/wire.hpp"

namespace tandem::firmware {

namespace {

using namespace canopen;

constexpr std::string_view kSoftwareVersion = "tandem firmware 1.0";
constexpr std::string_view kHardwareVersion = "emulated";
constexpr std::size_t kBoardEntries = 5;
constexpr std::int64_t kNsPerUs = 1000;

std::uint8_t register_bits(ErrorCode code) noexcept {
  namespace bits = canopen::error_register;
  switch (code) {
    case ErrorCode::kOverCurrent:
    case ErrorCode::kI2t: return bits::kCurrent;
    case ErrorCode::kVoltage: return bits::kVoltage;
    case ErrorCode::kDriveTemperature: return bits::kTemperature;
    case ErrorCode::kHeartbeatLost:
    case ErrorCode::kSyncLost:
    case ErrorCode::kCommandTimeout: return bits::kCommunication;
    default: return bits::kProfile;
  }
}

Status bad(std::string key, std::string message) {
  return fail_at(std::move(key), std::move(message), "correct the board's setup");
}

/// A setting that may be infinite is one that means "no limit" then.
bool good(const DriveObject& object, double value) {
  const bool limit = object.unit == WireUnit::kCounts || object.unit == WireUnit::kMille;
  const bool is_signed = object.type == DataType::kInteger16 || object.type == DataType::kInteger32;
  return (is_signed || value >= 0.0) && (limit ? !std::isnan(value) : std::isfinite(value));
}

Status check_axis(const AxisSetup& axis, const std::string& key) {
  const DriveParameters& p = axis.parameters;
  for (const DriveObject& object : kDriveObjects) {
    if (!good(object, object.of(p))) return bad(key, "a setting is negative or not finite");
  }
  if (!(axis.torque_noise_Nm >= 0.0) || !(axis.torque_quantum_Nm >= 0.0)) {
    return bad(key, "the torque's noise or step is negative or not finite");
  }
  for (const double value : {p.link_counts_per_rev, p.motor_counts_per_rev}) {
    if (!(value >= 1.0 && value < 4294967296.0)) return bad(key, "an encoder has no resolution");
  }
  if (p.rated_torque_Nm < 1.0e-3) return bad(key, "the rated torque is below 1 mNm");
  if (!(p.torque_slope_Nm_s > 0.0)) return bad(key, "the torque's slope is not positive");
  if (!(p.min_position_rad < p.max_position_rad)) return bad(key, "position limits are inverted");
  return {};
}

}  // namespace

Status check(const BoardSetup& setup) {
  if (setup.node_id < 1 || setup.node_id > kMaxNodeId) return bad("node_id", "is not 1 to 127");
  if (setup.axes.empty() || setup.axes.size() > static_cast<std::size_t>(kMaxAxes)) {
    return bad("axes", "a board has 1 to " + std::to_string(kMaxAxes) + " axes");
  }
  if (setup.control_period_ns <= 0) return bad("control_period_ns", "is not positive");
  if (setup.sheet != nullptr) {
    if (Status status = check_sheet(*setup.sheet, setup.axes.size()); !status) return status;
  }
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    if (Status status = check_axis(setup.axes[i], "axes[" + std::to_string(i) + "]"); !status) {
      return status;
    }
  }
  return {};
}

namespace {

std::vector<std::unique_ptr<Axis>> make_axes(const BoardSetup& setup, ObjectDictionary& od) {
  std::vector<std::unique_ptr<Axis>> axes;
  for (std::size_t i = 0; i < setup.axes.size(); ++i) {
    axes.push_back(std::make_unique<Axis>(setup.axes[i], setup, static_cast<int>(i), od));
  }
  return axes;
}

/// Adds the board's own entries before the node resolves anything.
std::vector<std::unique_ptr<Axis>> make_board(const BoardSetup& setup, ObjectDictionary& od,
                                              std::uint32_t& ignored_frames,
                                              std::uint32_t& sync_timeout_us,
                                              std::uint8_t& cycle_counter) {
  od.add_string(canopen::object::kHardwareVersion, 0, kHardwareVersion);
  od.add_string(canopen::object::kSoftwareVersion, 0, kSoftwareVersion);
  od.add(object::kIgnoredFrames, 0, ignored_frames, kReadTpdo);
  od.add(canopen::object::kCycleCounter, 0, cycle_counter, kWriteRpdo | kMapTpdo);
  od.add(canopen::object::kSyncTimeout, 0, sync_timeout_us, kReadWrite);
  return make_axes(setup, od);
}

}  // namespace

namespace {

std::size_t entries_of(const std::shared_ptr<const DataSheet>& sheet) {
  return sheet == nullptr ? 0 : sheet->entries.size() + sheet->dummies.size();
}

}  // namespace

Board::Board(const BoardSetup& setup)
    : setup_(setup),
      od_(kNodeObjects + kBoardEntries + setup.axes.size() * kAxisEntries +
          entries_of(setup.sheet)),
      axes_(make_board(setup_, od_, ignored_frames_, sync_timeout_us_, cycle_counter_)),
      node_({.id = setup_.node_id,
             .device_type = kDriveDeviceType,
             .vendor = setup_.vendor,
             .product = setup_.product,
             .revision = setup_.revision,
             .serial = setup_.serial,
             .name = setup_.name,
             .max_pdo_bytes = setup_.max_pdo_bytes},
            od_),
      sync_period_us_(
          static_cast<const std::uint32_t*>(od_.find(canopen::object::kSyncPeriod, 0)->data)),
      sheet_(setup.sheet == nullptr
                 ? SheetDictionary{}
                 : SheetDictionary{*setup.sheet, setup.node_id, setup.axes.size(), od_}),
      outbox_storage_(kOutboxFrames),
      outbox_(outbox_storage_),
      commands_(setup.axes.size()),
      drives_(setup.axes.size()) {
  node_.objects_changed();
}

void Board::hear(const Frame& frame) noexcept TANDEM_RT {
  NodeEvents events = 0;
  if (is_data_frame(frame)) {
    events = node_.receive(frame, outbox_);
  } else if (!is_remote_request(frame) || !node_.answer_remote(frame.id, outbox_)) {
    ++ignored_frames_;
  }
  if (heartbeat_lost_ && !node_.heartbeat_lost()) {
    heartbeat_lost_ = false;
    clear_when_well();
  }
  take(events);
}

void Board::take(NodeEvents events) noexcept {
  if (events == 0) return;
  if ((events & kEventSync) != 0) {
    if (sync_pending_) node_.transmit_synchronous(outbox_);  // no step since the last SYNC
    sync_pending_ = true;
    since_sync_ns_ = 0;
    for (Commands& axis : commands_) {
      if (axis.syncs_without < 0xFFFF) ++axis.syncs_without;
    }
  }
  if ((events & kEventRpdo) != 0) {
    for (Commands& axis : commands_) {
      if ((axis.rpdos & node_.applied_rpdos()) != 0) axis.syncs_without = 0;
    }
  }
  if ((events & kEventOperational) != 0) {
    offline_ = false;
    if (heartbeat_lost_) {
      heartbeat_lost_ = false;
      clear_when_well();
    }
    find_command_rpdos();
  }
  if ((events & kEventLeftOperational) != 0) offline_ = true;
  if ((events & kEventHeartbeatLost) != 0) heartbeat_lost_ = true;
  if ((events & kEventResetNode) != 0) {
    cycle_counter_ = 0;
    sync_timeout_us_ = 0;
    for (const auto& axis : axes_) axis->power_on();
    sheet_.restore_all();
    node_.objects_changed();
  }
  if ((events & kEventResetCommunication) != 0) {
    sheet_.restore_communication();
    node_.objects_changed();
  }
}

// A command of an axis is an RPDO with its controlword; without any, every RPDO is one.
void Board::find_command_rpdos() noexcept {
  for (std::size_t a = 0; a < commands_.size(); ++a) {
    const std::uint32_t index = of_axis(canopen::object::kControlword, static_cast<int>(a));
    std::uint32_t found = 0;
    for (int n = 0; n < kPdosPerNode; ++n) {
      const auto mapping = static_cast<std::uint16_t>(canopen::object::kRpdoMapping + n);
      const ObjectEntry* count = od_.find(mapping, 0);  // a sheet may lack it, or some entries
      for (std::uint8_t sub = 1; count != nullptr && sub <= od_.value<std::uint8_t>(mapping, 0);
           ++sub) {
        const ObjectEntry* entry = od_.find(mapping, sub);
        if (entry == nullptr) break;
        if (od_.value<std::uint32_t>(mapping, sub) >> 16 == index) found |= 1U << n;
      }
    }
    commands_[a] = {.syncs_without = 0, .rpdos = found != 0 ? found : ~0U};
  }
}

// The register shows what is wrong now: a lost heartbeat that is back is not, when no axis took it
// for a fault.
void Board::clear_when_well() noexcept {
  const bool all_clear =
      std::ranges::all_of(axes_, [](const auto& one) { return one->objects().error_code == 0; });
  if (all_clear && !heartbeat_lost_) node_.clear_errors(outbox_);
}

ErrorCode Board::connection(std::size_t axis) const noexcept {
  const std::uint32_t allowed =
      static_cast<std::uint32_t>(axes_[axis]->parameters().command_timeout_syncs);
  const std::int64_t by_period_us = std::int64_t{allowed + 1} * *sync_period_us_;
  const std::int64_t most_us = sync_timeout_us_ != 0 ? sync_timeout_us_ : by_period_us;
  const bool silent = allowed != 0 && most_us > 0 && since_sync_ns_ > most_us * kNsPerUs;
  // A master whose SYNC is lost may stop the node for it: SYNC is the cause.
  if (offline_ && !heartbeat_lost_) {
    return silent ? ErrorCode::kSyncLost : ErrorCode::kCommandTimeout;
  }
  if (allowed == 0) return ErrorCode::kNone;
  if (commands_[axis].syncs_without > allowed) return ErrorCode::kCommandTimeout;
  return silent ? ErrorCode::kSyncLost : ErrorCode::kNone;
}

void Board::supervise(std::size_t axis) noexcept {
  const AxisEvents events = axes_[axis]->supervise(connection(axis), heartbeat_lost_);
  // The node itself has reported a lost heartbeat.
  if (events.raised != ErrorCode::kNone && events.raised != ErrorCode::kHeartbeatLost) {
    node_.raise_error(events.raised, register_bits(events.raised), static_cast<int>(axis), outbox_);
  }
  if (events.reset) clear_when_well();
}

void Board::step(std::int64_t dt_ns, std::span<const AxisSense> sense,
                 std::span<AxisDrive> drive) noexcept TANDEM_RT {
  take(node_.process(dt_ns, outbox_));
  const bool due = until_control_ns_ <= 0;
  if (due) {
    until_control_ns_ = setup_.control_period_ns;
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      axes_[a]->sample(sense[a]);
      supervise(a);
    }
  }
  if (sync_pending_) node_.transmit_synchronous(outbox_);
  sync_pending_ = false;
  if (due) {
    for (std::size_t a = 0; a < axes_.size(); ++a) drives_[a] = axes_[a]->control();
  }
  std::ranges::copy(drives_, drive.begin());
  until_control_ns_ -= dt_ns;
  since_sync_ns_ += dt_ns;
}

void Board::archive(Archive& ar) {
  ar(od_, node_);
  for (const auto& axis : axes_) axis->archive(ar);
  ar(commands_, ignored_frames_, sync_timeout_us_, cycle_counter_, until_control_ns_,
     since_sync_ns_, offline_, heartbeat_lost_, sync_pending_);
  for (AxisDrive& drive : drives_) ar(drive.voltage_V, drive.enabled, drive.brake_open);
  archive_outbox(ar, outbox_, kOutboxFrames);
}

}  // namespace tandem::firmware
