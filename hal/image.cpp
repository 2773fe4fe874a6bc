#include "hal/image.hpp"

#include <cassert>
#include <cstring>
#include <numeric>

#include "base/archive.hpp"

namespace tandem::hal {

std::size_t size_of(FieldType type) noexcept {
  switch (type) {
    case FieldType::kF64:
    case FieldType::kI64:
    case FieldType::kU64: return 8;
    case FieldType::kU32: return 4;
    case FieldType::kU16: return 2;
    case FieldType::kI8:
    case FieldType::kU8: return 1;
  }
  return 0;
}

const char* to_string(ControlMode mode) noexcept {
  switch (mode) {
    case ControlMode::kIdle: return "idle";
    case ControlMode::kPosition: return "position";
    case ControlMode::kVelocity: return "velocity";
    case ControlMode::kTorque: return "torque";
    case ControlMode::kOpenLoop: return "open_loop";
    case ControlMode::kCurrent: return "current";
  }
  return "?";
}

const char* to_string(InteractionMode mode) noexcept {
  return mode == InteractionMode::kStiff ? "stiff" : "compliant";
}

const char* to_string(PidLoop loop) noexcept {
  switch (loop) {
    case PidLoop::kPosition: return "position";
    case PidLoop::kVelocity: return "velocity";
    case PidLoop::kTorque: return "torque";
    case PidLoop::kCurrent: return "current";
  }
  return "?";
}

const char* to_string(DriveState state) noexcept {
  switch (state) {
    case DriveState::kUnknown: return "unknown";
    case DriveState::kNotReadyToSwitchOn: return "not ready to switch on";
    case DriveState::kSwitchOnDisabled: return "switch on disabled";
    case DriveState::kReadyToSwitchOn: return "ready to switch on";
    case DriveState::kSwitchedOn: return "switched on";
    case DriveState::kOperationEnabled: return "operation enabled";
    case DriveState::kQuickStopActive: return "quick stop active";
    case DriveState::kFaultReactionActive: return "fault reaction active";
    case DriveState::kFault: return "fault";
  }
  return "?";
}

std::size_t Layout::add(std::string name, FieldType type, std::size_t count, std::string doc) {
  assert(fields_.empty() || size_of(type) <= size_of(fields_.back().type));
  const std::size_t offset = bytes_;
  fields_.push_back({std::move(name), type, count, offset, std::move(doc)});
  bytes_ += size_of(type) * count;
  return offset;
}

const Field* Layout::find(std::string_view name) const noexcept {
  for (const Field& field : fields_) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

std::size_t ImageShape::channels() const noexcept {
  return std::accumulate(sensor_channels.begin(), sensor_channels.end(), std::size_t{0});
}

Image::Image(std::shared_ptr<const Layout> layout)
    : layout_(std::move(layout)), block_((layout_->bytes() + 7) / 8, 0.0) {}

std::span<const std::byte> Image::bytes() const noexcept {
  return {reinterpret_cast<const std::byte*>(block_.data()), layout_->bytes()};
}
std::span<std::byte> Image::bytes() noexcept {
  return {reinterpret_cast<std::byte*>(block_.data()), layout_->bytes()};
}

void Image::assign(const Image& other) noexcept {
  assert(other.layout_->bytes() == layout_->bytes());
  std::memcpy(block_.data(), other.block_.data(), layout_->bytes());
}

void Image::archive(Archive& ar) { ar.raw(block_.data(), layout_->bytes()); }

namespace {

const char kLink[] = "link side, positive about the joint's +axis";

std::shared_ptr<const Layout> state_layout(const ImageShape& shape) {
  auto layout = std::make_shared<Layout>();
  const std::size_t n = shape.joints;
  layout->add("cycle", FieldType::kU64, 1, "number of the loop's cycle");
  layout->add("time_ns", FieldType::kI64, 1, "nominal time of the cycle since the start");
  layout->add("position_rad", FieldType::kF64, n, kLink);
  layout->add("velocity_rad_s", FieldType::kF64, n, kLink);
  layout->add("acceleration_rad_s2", FieldType::kF64, n, "differenced velocity_rad_s");
  layout->add("torque_Nm", FieldType::kF64, n, "of the spring on the link");
  layout->add("motor_position_rad", FieldType::kF64, n, "motor, reflected to the link");
  layout->add("motor_velocity_rad_s", FieldType::kF64, n, "motor, reflected to the link");
  layout->add("current_A", FieldType::kF64, n, "motor current");
  layout->add("voltage_V", FieldType::kF64, n, "motor voltage applied");
  layout->add("temperature_C", FieldType::kF64, n, "winding");
  layout->add("sensor", FieldType::kF64, shape.channels(), "every sensor's channels in order");
  layout->add("fault", FieldType::kU32, n, "0 or the drive's CiA 402 error code");
  layout->add("age_cycles", FieldType::kU32, n, "0: fresh in this cycle");
  layout->add("sensor_age_cycles", FieldType::kU32, shape.sensor_channels.size(), "0: fresh");
  layout->add("statusword", FieldType::kU16, n, "CiA 402");
  layout->add("mode", FieldType::kI8, n, "ControlMode in force");
  layout->add("interaction", FieldType::kU8, n, "InteractionMode in force");
  layout->add("drive_state", FieldType::kU8, n, "DriveState");
  return layout;
}

std::shared_ptr<const Layout> command_layout(const ImageShape& shape) {
  auto layout = std::make_shared<Layout>();
  const std::size_t n = shape.joints;
  layout->add("cycle", FieldType::kU64, 1, "the cycle that computed it");
  layout->add("time_ns", FieldType::kI64, 1, "its nominal time");
  layout->add("position_rad", FieldType::kF64, n, kLink);
  layout->add("velocity_rad_s", FieldType::kF64, n, "reference or feed-forward");
  layout->add("torque_Nm", FieldType::kF64, n, "reference or feed-forward");
  layout->add("voltage_V", FieldType::kF64, n, "open loop");
  layout->add("current_A", FieldType::kF64, n, "current mode");
  layout->add("stiffness_Nm_rad", FieldType::kF64, n, "virtual spring when compliant");
  layout->add("damping_Nms_rad", FieldType::kF64, n, "virtual damper when compliant");
  layout->add("mode", FieldType::kI8, n, "ControlMode wanted");
  layout->add("interaction", FieldType::kU8, n, "InteractionMode wanted");
  layout->add("fault_reset", FieldType::kU8, n, "1: clear the joint's latched fault");
  return layout;
}

template <class Slot>
Slot slot(const Layout& layout, std::string_view name) {
  const Field* field = layout.find(name);
  return {field->offset, field->count};
}

}  // namespace

#define TANDEM_BIND(name) name##_ = slot<Slot>(layout(), #name)

StateImage::StateImage(const ImageShape& shape) : Image(state_layout(shape)) {
  TANDEM_BIND(cycle);
  TANDEM_BIND(time_ns);
  TANDEM_BIND(position_rad);
  TANDEM_BIND(velocity_rad_s);
  TANDEM_BIND(acceleration_rad_s2);
  TANDEM_BIND(torque_Nm);
  TANDEM_BIND(motor_position_rad);
  TANDEM_BIND(motor_velocity_rad_s);
  TANDEM_BIND(current_A);
  TANDEM_BIND(voltage_V);
  TANDEM_BIND(temperature_C);
  TANDEM_BIND(sensor);
  TANDEM_BIND(fault);
  TANDEM_BIND(age_cycles);
  TANDEM_BIND(sensor_age_cycles);
  TANDEM_BIND(statusword);
  TANDEM_BIND(mode);
  TANDEM_BIND(interaction);
  TANDEM_BIND(drive_state);
  std::size_t first = 0;
  for (const std::size_t channels : shape.sensor_channels) {
    sensors_.push_back({first, channels});
    first += channels;
  }
}

std::span<const double> StateImage::sensor_values(std::size_t index) const noexcept {
  return sensor().subspan(sensors_[index].offset, sensors_[index].count);
}
std::span<double> StateImage::sensor_values(std::size_t index) noexcept {
  return sensor().subspan(sensors_[index].offset, sensors_[index].count);
}

CommandImage::CommandImage(const ImageShape& shape) : Image(command_layout(shape)) {
  TANDEM_BIND(cycle);
  TANDEM_BIND(time_ns);
  TANDEM_BIND(position_rad);
  TANDEM_BIND(velocity_rad_s);
  TANDEM_BIND(torque_Nm);
  TANDEM_BIND(voltage_V);
  TANDEM_BIND(current_A);
  TANDEM_BIND(stiffness_Nm_rad);
  TANDEM_BIND(damping_Nms_rad);
  TANDEM_BIND(mode);
  TANDEM_BIND(interaction);
  TANDEM_BIND(fault_reset);
}

#undef TANDEM_BIND

void ParameterImage::archive(Archive& ar) { ar(gains_, revision_); }

}  // namespace tandem::hal
