// Layouts of the state and command images, from state_fields.inc and command_fields.inc. Fields of
// eight bytes come first, then four, two, one: an image's bytes are also its CDR encoding.
#include "hal/image.hpp"

#include <cassert>
#include <cstring>
#include <numeric>

#include "base/archive.hpp"
#include "hal/wire_name.hpp"

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

Image::Slot Image::slot(std::string_view name) const {
  const Field* field = layout_->find(wire_name(name));
  assert(field != nullptr);
  return {field->offset, field->count};
}

namespace {

// `count` of a row says these names.
std::shared_ptr<const Layout> state_layout(std::size_t joints, std::size_t sensors,
                                           std::size_t channels) {
  auto layout = std::make_shared<Layout>();
#define TANDEM_FIELD(type, name, count, doc) \
  layout->add(wire_name(#name), field_type<type>(), count, doc);
#include "hal/state_fields.inc"
#undef TANDEM_FIELD
  return layout;
}

std::shared_ptr<const Layout> command_layout(std::size_t joints) {
  auto layout = std::make_shared<Layout>();
#define TANDEM_FIELD(type, name, count, doc) \
  layout->add(wire_name(#name), field_type<type>(), count, doc);
#include "hal/command_fields.inc"
#undef TANDEM_FIELD
  return layout;
}

}  // namespace

StateImage::StateImage(const ImageShape& shape)
    : Image(state_layout(shape.joints, shape.sensor_channels.size(), shape.channels())) {
#define TANDEM_FIELD(type, name, count, doc) name##_ = slot(#name);
#include "hal/state_fields.inc"
#undef TANDEM_FIELD
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

CommandImage::CommandImage(const ImageShape& shape) : Image(command_layout(shape.joints)) {
#define TANDEM_FIELD(type, name, count, doc) name##_ = slot(#name);
#include "hal/command_fields.inc"
#undef TANDEM_FIELD
}

void ParameterImage::archive(Archive& ar) { ar(gains_, revision_); }

}  // namespace tandem::hal
