#include "runtime/condition/quantity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <span>

#include "base/nearest.hpp"
#include "hal/wire_name.hpp"
#include "log/info.hpp"
#include "log/schema.hpp"
#include "log/signal_name.hpp"
#include "runtime/condition/unit.hpp"

namespace tandem::runtime {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Whom the argument of a short name names.
enum class Named : std::uint8_t { kNothing, kElement, kFoot };

/// A short name: one number of a field.
struct ShortName {
  std::string_view name;
  Quantity::Of of;
  std::string_view field;
  Named named = Named::kElement;
  std::size_t each = 1;  ///< numbers for each of those that are named
  std::size_t at = 0;    ///< which of them
  std::string_view call, words;
};

using Of = Quantity::Of;
// A name a line.
// clang-format off
constexpr ShortName kShortNames[] = {
  {"time", Of::kState, "time_ns", Named::kNothing, 1, 0, "time()", "since the first cycle"},
  {"cycle", Of::kState, "cycle", Named::kNothing, 1, 0, "cycle()", "number of the cycle, from 0"},
  {"overruns", Of::kLoop, "", Named::kNothing, 1, 0, "overruns()", "late cycles so far"},
  {"position", Of::kState, "position_rad", Named::kElement, 1, 0, "position(JOINT)", "measured, link side"},
  {"velocity", Of::kState, "velocity_rad_s", Named::kElement, 1, 0, "velocity(JOINT)", "measured, link side"},
  {"acceleration", Of::kState, "acceleration_rad_s2", Named::kElement, 1, 0, "acceleration(JOINT)", "the differenced velocity"},
  {"torque", Of::kState, "torque_Nm", Named::kElement, 1, 0, "torque(JOINT)", "of the spring on the link"},
  {"motor_position", Of::kState, "motor_position_rad", Named::kElement, 1, 0, "motor_position(JOINT)", "reflected to the link"},
  {"motor_velocity", Of::kState, "motor_velocity_rad_s", Named::kElement, 1, 0, "motor_velocity(JOINT)", "reflected to the link"},
  {"current", Of::kState, "current_A", Named::kElement, 1, 0, "current(JOINT)", "of the motor"},
  {"voltage", Of::kState, "voltage_V", Named::kElement, 1, 0, "voltage(JOINT)", "applied to the motor"},
  {"temperature", Of::kState, "temperature_C", Named::kElement, 1, 0, "temperature(JOINT)", "of the winding"},
  {"age", Of::kState, "age_cycles", Named::kElement, 1, 0, "age(JOINT)", "cycles since its newest sample"},
  {"sensor", Of::kState, "sensor", Named::kElement, 1, 0, "sensor(SENSOR.CHANNEL)", "`sensor(left_foot.fz_N)`: a channel of a sensor"},
  {"reference", Of::kCommand, "position_rad", Named::kElement, 1, 0, "reference(JOINT)", "the position that is commanded"},
  {"reference_velocity", Of::kCommand, "velocity_rad_s", Named::kElement, 1, 0, "reference_velocity(JOINT)", "reference or feed-forward"},
  {"reference_torque", Of::kCommand, "torque_Nm", Named::kElement, 1, 0, "reference_torque(JOINT)", "reference or feed-forward"},
  {"height", Of::kTruth, "base_position_m", Named::kNothing, 3, 2, "height()", "true z of the base's origin in W"},
  {"tilt", Of::kTruth, "base_quaternion", Named::kNothing, 4, 0, "tilt()", "true angle of the base's z axis to the vertical"},
  {"com_height", Of::kTruth, "center_of_mass_m", Named::kNothing, 3, 2, "com_height()", "true z of the centre of mass in W"},
  {"foot_height", Of::kTruth, "foot_position_m", Named::kFoot, 3, 2, "foot_height(FOOT)", "true z of the foot's site in W"},
  {"foot_force", Of::kTruth, "foot_force_N", Named::kFoot, 3, 2, "foot_force(FOOT)", "true vertical force of the ground"},
  {"external_torque", Of::kEstimate, "external_torque_Nm", Named::kElement, 1, 0, "external_torque(JOINT)", "estimated, of what touches the robot"},
  {"contact", Of::kEstimate, "contact_probability", Named::kFoot, 1, 0, "contact(FOOT)", "estimated probability that the foot stands"},
};
// clang-format on

/// The units of a field's text: those of a leading "[N, Nm]", or of every bracket.
std::vector<std::string> bracketed(const std::string& doc) {
  std::vector<std::string> units;
  const bool leads = doc.starts_with('[');
  for (std::size_t at = doc.find('['); at != std::string::npos; at = doc.find('[', at + 1)) {
    std::string inside = doc.substr(at + 1, doc.find(']', at) - at - 1);
    for (std::size_t comma; (comma = inside.find(", ")) != std::string::npos;) {
      units.push_back(inside.substr(0, comma));
      inside.erase(0, comma + 2);
    }
    units.push_back(inside);
    if (leads) break;
  }
  return units;
}

/// Unit of a sensor's channel by its name: "wx_rad_s" is in rad/s.
std::string channel_unit(std::string_view channel) {
  constexpr std::string_view kEnds[][2] = {
      {"_rad_s", "rad/s"}, {"_m_s2", "m/s2"}, {"_Nm", "Nm"}, {"_N", "N"}};
  for (const auto& [end, unit] : kEnds) {
    if (channel.ends_with(end)) return std::string(unit);
  }
  return {};
}

/// Unit of an element. Fields of 6 with two units have the first in their first half.
std::string unit_text(const hal::Field& field, std::size_t index, const std::string& element,
                      const hal::Robot& robot) {
  if (field.name == "sensor") return channel_unit(element);
  const std::vector<std::string> units = bracketed(field.doc);
  if (units.empty()) return {};
  const std::string& unit = units[std::min(index * units.size() / field.count, units.size() - 1)];
  const std::size_t either = unit.find(" or ");
  if (either == std::string::npos) return unit;
  const bool slides = index < robot.joints.size() && robot.joints[index].slides;
  return slides ? unit.substr(either + 4) : unit.substr(0, either);
}

/// An image, as names see it.
struct ImageNames {
  std::string name;
  Of of;
  const hal::Layout* layout;
  std::shared_ptr<const hal::SignalBlock> block{};
  std::optional<hal::Layout> own{};  // a block's
};

/// Fills what tells that the element was measured.
void guard(Quantity& quantity, const hal::Field& field, std::size_t index,
           const QuantityNames& names, const log::RunInfo& info) {
  const auto by_age = [&](std::string_view ages, std::size_t at) {
    const hal::Field* age = names.state.find(ages);
    if (age == nullptr || at >= age->count) return;
    quantity.known = Quantity::Known::kByAge;
    quantity.known_at = age->offset + at * sizeof(std::uint32_t);
  };
  const std::string_view by = log::named_by(field, info);
  if (quantity.of == Of::kState && field.type == hal::FieldType::kF64) {
    if (by == "joints") by_age("age_cycles", index);
    for (std::size_t s = 0; by == "channels" && s < names.robot.sensors.size(); ++s) {
      const std::size_t channels = names.robot.sensors[s].channels();
      if (index < channels) return by_age("sensor_age_cycles", s);
      index -= channels;
    }
  }
  // A command's position repeats the measured one until a controller writes it.
  if (quantity.of == Of::kCommand && field.name == "position_rad") by_age("age_cycles", index);
  if (quantity.of == Of::kEstimate &&
      (field.name.starts_with("base_") || field.name == "innovation" ||
       field.name.ends_with("bias_rad_s") || field.name.ends_with("bias_m_s2"))) {
    const hal::Field* valid = names.estimate->find("base_valid");
    if (valid == nullptr || valid->count == 0 || field.name == "base_valid") return;
    quantity.known = Quantity::Known::kByFlag;
    quantity.known_at = valid->offset;
  }
}

Quantity place(const ImageNames& image, const hal::Field& field, std::size_t index,
               const QuantityNames& names, const log::RunInfo& info) {
  Quantity quantity;
  quantity.of = image.of;
  quantity.type = field.type;
  quantity.block = image.block;
  quantity.length = hal::size_of(field.type);
  quantity.offset = field.offset + index * quantity.length;
  const bool named = !log::named_by(field, info).empty();
  const std::string unit =
      unit_text(field, index, named ? log::element_name(field, index, info) : "", names.robot);
  const std::optional<Unit> known = unit_of(unit);
  quantity.unit = known ? known->base : unit;
  quantity.factor = known ? known->factor : 1.0;
  guard(quantity, field, index, names, info);
  return quantity;
}

std::vector<std::string> elements_of(const hal::Field& field, const log::RunInfo& info) {
  std::vector<std::string> all;
  const bool named = !log::named_by(field, info).empty();
  for (std::size_t i = 0; i < field.count; ++i)
    all.push_back(named ? log::element_name(field, i, info) : std::to_string(i));
  return all;
}

std::unexpected<Error> no_image(Of of) {
  if (of == Of::kTruth) {
    return fail("there is no truth in this run: its robot is not simulated",
                "name what is measured instead, such as position(JOINT) or sensor(SENSOR.fz_N)");
  }
  return fail("nothing is estimated in this run", "give the experiment a table [estimation]");
}

Result<std::size_t> index_in(const std::vector<std::string>& all, std::string_view element,
                             std::string_view what) {
  const auto at = std::ranges::find(all, element);
  if (at != all.end()) return static_cast<std::size_t>(at - all.begin());
  if (all.empty()) return fail("this robot has no " + std::string(what), "name another quantity");
  if (element.empty()) {
    return fail("which " + std::string(what) + " is not said", suggest("", all));
  }
  return fail("there is no " + std::string(what) + " '" + std::string(element) + "'",
              suggest(element, all));
}

std::string_view words_of_element(const hal::Field& field, const log::RunInfo& info) {
  const std::string_view by = log::named_by(field, info);
  return by == "joints"     ? "joint"
         : by == "sensors"  ? "sensor"
         : by == "channels" ? "channel"
                            : "element";
}

const hal::Layout* layout_of_image(Of of, const QuantityNames& names) {
  switch (of) {
    case Of::kState: return &names.state;
    case Of::kCommand: return &names.command;
    case Of::kTruth: return names.truth;
    case Of::kEstimate: return names.estimate;
    case Of::kSignals:
    case Of::kLoop: break;
  }
  return nullptr;
}

Result<Quantity> by_short_name(const ShortName& row, std::string_view argument,
                               const QuantityNames& names) {
  if (row.named == Named::kNothing && !argument.empty()) {
    return fail(std::string(row.call) + " names nothing", "leave the brackets empty");
  }
  if (row.of == Of::kLoop) {
    Quantity loop;
    loop.of = Of::kLoop;
    return loop;
  }
  const hal::Layout* layout = layout_of_image(row.of, names);
  if (layout == nullptr) return no_image(row.of);
  const log::RunInfo info = names_in_log(names.robot);
  const hal::Field* field = layout->find(hal::wire_name(row.field));
  if (field == nullptr || field->count < row.each) {
    return fail("this run has no " + std::string(row.call), "name another quantity");
  }
  std::size_t index = row.at;
  if (row.named == Named::kElement) {
    const auto found =
        index_in(elements_of(*field, info), argument, words_of_element(*field, info));
    if (!found) return std::unexpected(found.error());
    index = *found;
  }
  if (row.named == Named::kFoot) {
    std::vector<std::string> feet;
    for (const hal::Foot& foot : names.robot.feet) feet.push_back(foot.site);
    feet.resize(std::min(feet.size(), field->count / row.each));
    const auto found = index_in(feet, argument, "foot");
    if (!found) return std::unexpected(found.error());
    index = *found * row.each + row.at;
  }
  Quantity quantity = place({"", row.of, layout}, *field, index, names, info);
  quantity.tilt = row.field == "base_quaternion";
  if (quantity.tilt) quantity.unit = "rad";
  if (quantity.tilt) quantity.length = 4 * sizeof(double);
  return quantity;
}

std::vector<ImageNames> images_of(const QuantityNames& names) {
  std::vector<ImageNames> all{{"state", Of::kState, &names.state},
                              {"command", Of::kCommand, &names.command},
                              {"truth", Of::kTruth, names.truth},
                              {"estimate", Of::kEstimate, names.estimate}};
  for (const NamedSignals& one : names.signals)
    all.push_back(
        {"controller/" + one.controller, Of::kSignals, nullptr, one.block, one.block->layout()});
  return all;
}

Result<Quantity> by_path(std::string_view path, const QuantityNames& names) {
  const std::vector<ImageNames> images = images_of(names);
  const std::size_t dot = path.find('.');
  const std::string source(path.substr(0, dot));
  const auto image = std::ranges::find_if(images, [&](const ImageNames& one) {
    return one.name == source || one.name == "controller/" + source;
  });
  if (image == images.end()) {
    std::vector<std::string> known;
    for (const ImageNames& one : images) known.push_back(one.name);
    return fail("'" + source + "' is no image of this run, and no controller with signals",
                suggest(source, known));
  }
  const hal::Layout* layout = image->own ? &*image->own : image->layout;
  if (layout == nullptr) return no_image(image->of);
  std::string_view rest = dot == std::string_view::npos ? "" : path.substr(dot + 1);
  const std::size_t end = rest.find('.');
  const std::string name = hal::wire_name(rest.substr(0, end));
  const hal::Field* field = layout->find(name);
  if (field == nullptr) {
    std::vector<std::string> known;
    for (const hal::Field& one : layout->fields())
      if (one.count != 0) known.push_back(one.name);
    return fail(image->name + " has no field '" + name + "'", suggest(name, known));
  }
  const log::RunInfo info = names_in_log(names.robot);
  const std::vector<std::string> elements = elements_of(*field, info);
  if (end == std::string_view::npos && field->count == 1 && log::named_by(*field, info).empty())
    return place(*image, *field, 0, names, info);
  const auto index = index_in(elements, end == std::string_view::npos ? "" : rest.substr(end + 1),
                              words_of_element(*field, info));
  if (!index) return std::unexpected(index.error());
  return place(*image, *field, *index, names, info);
}

template <class T>
T number_at(std::span<const std::byte> bytes, std::size_t offset) noexcept TANDEM_RT {
  T value{};
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

double as_double(hal::FieldType type, std::span<const std::byte> bytes,
                 std::size_t offset) noexcept TANDEM_RT {
  switch (type) {
    case hal::FieldType::kF64: return number_at<double>(bytes, offset);
    case hal::FieldType::kI64: return static_cast<double>(number_at<std::int64_t>(bytes, offset));
    case hal::FieldType::kU64: return static_cast<double>(number_at<std::uint64_t>(bytes, offset));
    case hal::FieldType::kU32: return number_at<std::uint32_t>(bytes, offset);
    case hal::FieldType::kU16: return number_at<std::uint16_t>(bytes, offset);
    case hal::FieldType::kI8: return number_at<std::int8_t>(bytes, offset);
    case hal::FieldType::kU8: return number_at<std::uint8_t>(bytes, offset);
  }
  return kUnknown;
}

double tilt_angle(std::span<const std::byte> bytes, std::size_t offset) noexcept TANDEM_RT {
  std::array<double, 4> quaternion{};
  std::memcpy(quaternion.data(), bytes.data() + offset, sizeof quaternion);
  return hal::tilt_of(quaternion);
}

}  // namespace

double Quantity::read(const hal::CycleView& view) const noexcept TANDEM_RT {
  std::span<const std::byte> bytes;
  switch (of) {
    case Of::kLoop: return static_cast<double>(view.times.overruns);
    case Of::kState: bytes = view.state.bytes(); break;
    case Of::kCommand: bytes = view.command.bytes(); break;
    case Of::kTruth:
      if (view.truth != nullptr) bytes = view.truth->bytes();
      break;
    case Of::kEstimate:
      if (view.estimate != nullptr) bytes = view.estimate->bytes();
      break;
    case Of::kSignals:
      bytes = block->image();
      // The block begins with the cycle and the time of what it shows.
      if (number_at<std::uint64_t>(bytes, 0) != view.time.cycle ||
          number_at<std::int64_t>(bytes, sizeof(std::uint64_t)) != view.time.time_ns)
        return kUnknown;
      break;
  }
  if (offset + length > bytes.size()) return kUnknown;
  if (known == Known::kByAge) {
    const std::span<const std::byte> state = view.state.bytes();
    if (known_at + sizeof(std::uint32_t) > state.size() ||
        number_at<std::uint32_t>(state, known_at) > view.time.cycle)
      return kUnknown;
  }
  if (known == Known::kByFlag && (known_at >= bytes.size() || bytes[known_at] == std::byte{0}))
    return kUnknown;
  return tilt ? tilt_angle(bytes, offset) : factor * as_double(type, bytes, offset);
}

Result<Quantity> find_quantity(std::string_view function, std::string_view argument,
                               const QuantityNames& names) {
  if (function.empty() || function == "signal") return by_path(argument, names);
  const auto* row = std::ranges::find(kShortNames, function, &ShortName::name);
  if (row != std::end(kShortNames)) return by_short_name(*row, argument, names);
  std::vector<std::string> known{"signal", "phase", "fault", "abs"};
  for (const ShortName& one : kShortNames) known.emplace_back(one.name);
  return fail("there is no quantity '" + std::string(function) + "'", suggest(function, known, 40));
}

log::RunInfo names_in_log(const hal::Robot& robot) {
  log::RunInfo info;
  for (const hal::DrivenJoint& joint : robot.joints) info.joints.push_back(joint.name);
  for (const hal::Sensor& sensor : robot.sensors)
    info.sensors.push_back({sensor.name, sensor.channels()});
  return info;
}

std::vector<QuantityWords> quantity_words() {
  std::vector<QuantityWords> all;
  for (const ShortName& row : kShortNames) all.push_back({row.call, row.words});
  return all;
}

}  // namespace tandem::runtime
