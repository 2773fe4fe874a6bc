// One line of ros2msg per field, its comment with unit and meaning; read back strictly.
#include "log/schema.hpp"

#include <charconv>
#include <cstring>
#include <utility>

#include "base/bounds.hpp"

namespace tandem::log {
namespace {

using hal::FieldType;

constexpr std::pair<FieldType, std::string_view> kTypes[] = {
    {FieldType::kF64, "float64"}, {FieldType::kI64, "int64"},  {FieldType::kU64, "uint64"},
    {FieldType::kU32, "uint32"},  {FieldType::kU16, "uint16"}, {FieldType::kI8, "int8"},
    {FieldType::kU8, "uint8"},
};

std::string_view name_of(FieldType type) {
  for (const auto& [one, name] : kTypes) {
    if (one == type) return name;
  }
  return {};
}

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

/// "float64[29] position_rad" appended to `layout`.
Status add_member(std::string_view member, std::string_view comment, hal::Layout& layout) {
  const auto refuse = [&] {
    return fail("the schema's member '" + std::string(member) + "' is no fixed-size number");
  };
  const auto space = member.find(' ');
  if (space == std::string_view::npos) return refuse();
  std::string_view type = member.substr(0, space);
  const std::string_view name = trimmed(member.substr(space));
  std::size_t count = 1;
  if (const auto bracket = type.find('['); bracket != std::string_view::npos) {
    const std::string_view digits = type.substr(bracket + 1, type.size() - bracket - 2);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
    if (error != std::errc{} || end != digits.data() + digits.size() || type.back() != ']' ||
        count > bounds::kLogNumbers.most) {
      return refuse();
    }
    type = type.substr(0, bracket);
  }
  for (const auto& [one, text] : kTypes) {
    if (text != type) continue;
    const auto fields = layout.fields();
    if (!fields.empty() && hal::size_of(one) > hal::size_of(fields.back().type)) return refuse();
    if (fields.size() == bounds::kLogFields.most)
      return std::unexpected(beyond(bounds::kLogFields));
    if (layout.bytes() / 8 + count > bounds::kLogNumbers.most)
      return std::unexpected(beyond(bounds::kLogNumbers));
    layout.add(std::string(name), one, count, std::string(comment));
    return {};
  }
  return refuse();
}

template <class T>
double read(std::span<const std::byte> body, std::size_t offset) noexcept {
  T value;
  std::memcpy(&value, body.data() + offset, sizeof value);
  return static_cast<double>(value);
}

}  // namespace

std::string ros2msg_of(const hal::Layout& layout) {
  std::string text;
  for (const hal::Field& field : layout.fields()) {
    if (field.count == 0) continue;
    text += name_of(field.type);
    if (field.count > 1) text += "[" + std::to_string(field.count) + "]";
    text += " " + field.name;
    if (!field.doc.empty()) text += "  # " + field.doc;
    text += "\n";
  }
  return text;
}

Result<hal::Layout> layout_of(std::string_view ros2msg) {
  hal::Layout layout;
  while (!ros2msg.empty()) {
    const auto end = std::min(ros2msg.find('\n'), ros2msg.size());
    const std::string_view line = ros2msg.substr(0, end);
    ros2msg.remove_prefix(std::min(end + 1, ros2msg.size()));
    const auto hash = std::min(line.find('#'), line.size());
    const std::string_view member = trimmed(line.substr(0, hash));
    if (member.empty()) continue;
    const std::string_view comment =
        hash < line.size() ? trimmed(line.substr(hash + 1)) : std::string_view();
    if (Status added = add_member(member, comment, layout); !added) {
      return std::unexpected(added.error());
    }
  }
  return layout;
}

double element(const hal::Field& field, std::span<const std::byte> body,
               std::size_t index) noexcept {
  const std::size_t offset = field.offset + index * hal::size_of(field.type);
  switch (field.type) {
    case FieldType::kF64: return read<double>(body, offset);
    case FieldType::kI64: return read<std::int64_t>(body, offset);
    case FieldType::kU64: return read<std::uint64_t>(body, offset);
    case FieldType::kU32: return read<std::uint32_t>(body, offset);
    case FieldType::kU16: return read<std::uint16_t>(body, offset);
    case FieldType::kI8: return read<std::int8_t>(body, offset);
    case FieldType::kU8: return read<std::uint8_t>(body, offset);
  }
  return 0.0;
}

}  // namespace tandem::log
