// One line of ros2msg per field, its comment with unit and meaning; read back strictly.
#include "log/schema.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstring>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "base/bounds.hpp"
#include "hal/wire_name.hpp"
#include "log/signal_name.hpp"

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

/// A message that others have as a member: as many numbers of one type. Its name -> those.
struct Part {
  FieldType type;
  std::size_t count;
};
using Parts = std::map<std::string_view, Part, std::less<>>;

/// A line of ros2msg: "float64[29] position_rad  # link side".
struct Member {
  std::string_view type, name, comment;
  std::size_t count = 1;
};

Result<Member> member_of(std::string_view line, std::string_view comment) {
  const auto refuse = [&] {
    return fail("the schema's member '" + std::string(line) + "' is no fixed-size number");
  };
  const auto space = line.find(' ');
  if (space == std::string_view::npos) return refuse();
  Member member{
      .type = line.substr(0, space), .name = trimmed(line.substr(space)), .comment = comment};
  const auto bracket = member.type.find('[');
  if (bracket == std::string_view::npos) return member;
  const std::string_view digits = member.type.substr(bracket + 1, member.type.size() - bracket - 2);
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), member.count);
  if (error != std::errc{} || end != digits.data() + digits.size() || member.type.back() != ']' ||
      member.count > bounds::kLogNumbers.most) {
    return refuse();
  }
  member.type = member.type.substr(0, bracket);
  return member;
}

/// Its numbers. A part is no array of parts.
std::optional<Part> numbers_of(const Member& member, const Parts& parts) {
  for (const auto& [one, text] : kTypes) {
    if (text == member.type) return Part{one, member.count};
  }
  const auto part = parts.find(member.type);
  if (part == parts.end() || member.count != 1) return std::nullopt;
  return part->second;
}

Status add_member(const Member& member, const Part& numbers, hal::Layout& layout) {
  const auto fields = layout.fields();
  if (!fields.empty() && hal::size_of(numbers.type) > hal::size_of(fields.back().type)) {
    return fail("the schema's member '" + std::string(member.name) +
                "' is larger than the one before it");
  }
  if (fields.size() == bounds::kLogFields.most) return std::unexpected(beyond(bounds::kLogFields));
  if (layout.bytes() / 8 + numbers.count > bounds::kLogNumbers.most)
    return std::unexpected(beyond(bounds::kLogNumbers));
  layout.add(std::string(member.name), numbers.type, numbers.count, std::string(member.comment));
  return {};
}

/// The next line, taken from `text`.
std::string_view take_line(std::string_view& text) {
  const auto end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

/// Calls `take` for each member of a message's text.
template <class Take>
Status each_member(std::string_view text, const Take& take) {
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    const auto hash = std::min(line.find('#'), line.size());
    if (trimmed(line.substr(0, hash)).empty()) continue;
    const auto member =
        member_of(trimmed(line.substr(0, hash)),
                  hash < line.size() ? trimmed(line.substr(hash + 1)) : std::string_view());
    if (!member) return std::unexpected(member.error());
    if (Status taken = take(*member); !taken) return taken;
  }
  return {};
}

constexpr std::string_view kBetween = "====";  // and more: before each part's "MSG: package/Name"

/// The text of the first message, taken from `ros2msg`; `name`: of the next one.
std::string_view take_message(std::string_view& ros2msg, std::string_view& name) {
  const auto end = std::min(ros2msg.find(kBetween), ros2msg.size());
  const std::string_view text = ros2msg.substr(0, end);
  ros2msg.remove_prefix(end);
  (void)take_line(ros2msg);
  constexpr std::string_view kName = "MSG: ";
  name = take_line(ros2msg);
  name = name.starts_with(kName) ? trimmed(name.substr(kName.size())) : std::string_view();
  return text;
}

Result<Part> part_of(std::string_view text) {
  std::optional<Part> part;
  const Status read = each_member(text, [&](const Member& member) -> Status {
    const std::optional<Part> numbers = numbers_of(member, {});
    if (!numbers || (part && part->type != numbers->type) ||
        (part ? part->count : 0) + numbers->count > bounds::kLogNumbers.most) {
      return fail("the schema's member '" + std::string(member.name) +
                  "' is no number of its part's type");
    }
    part = Part{numbers->type, (part ? part->count : 0) + numbers->count};
    return {};
  });
  if (!read) return std::unexpected(read.error());
  if (!part) return fail("the schema has an empty part");
  return *part;
}

/// As ROS 2 wants it: small letters and digits, a letter first, single '_' between them.
std::string identifier(const std::string& name) {
  std::string text;
  for (const char c : hal::wire_name(name)) {
    const bool is_letter = c >= 'a' && c <= 'z', is_digit = c >= '0' && c <= '9';
    if (text.empty() && !is_letter) text = "n";
    if (is_letter || is_digit) {
      text += c;
    } else if (text.back() != '_') {
      text += '_';
    }
  }
  while (text.ends_with('_')) text.pop_back();
  return text.empty() ? "n" : text;
}

/// The members of a part: a line for each element. Two that would have one name have their number.
std::string members_of(const hal::Field& field, const RunInfo& info) {
  std::string text;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < field.count; ++i) {
    std::string name = identifier(element_name(field, i, info));
    if (std::ranges::find(names, name) != names.end()) name += "_" + std::to_string(i);
    text += std::string(name_of(field.type)) + " " + name + "\n";
    names.push_back(std::move(name));
  }
  return text;
}

/// "JointsFloat64"
std::string part_name(std::string_view by, FieldType type) {
  std::string name = std::string(by) + std::string(name_of(type));
  for (const std::size_t first : {std::size_t{0}, by.size()}) {
    name[first] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[first])));
  }
  return name;
}

template <class T>
double read(std::span<const std::byte> body, std::size_t offset) noexcept {
  T value;
  std::memcpy(&value, body.data() + offset, sizeof value);
  return static_cast<double>(value);
}

}  // namespace

std::string ros2msg_of(const hal::Layout& layout, const RunInfo& info) {
  std::string text, parts;
  std::vector<std::string> told;
  for (const hal::Field& field : layout.fields()) {
    if (field.count == 0) continue;
    const std::string_view by = named_by(field, info);
    if (by.empty()) {
      text += name_of(field.type);
      if (field.count > 1) text += "[" + std::to_string(field.count) + "]";
    } else {
      const std::string part = part_name(by, field.type);
      text += "tandem/" + part;
      if (std::ranges::find(told, part) == told.end()) {
        parts += std::string(80, '=') + "\nMSG: tandem/" + part + "\n" + members_of(field, info);
        told.push_back(part);
      }
    }
    text += " " + field.name;
    if (!field.doc.empty()) text += "  # " + field.doc;
    text += "\n";
  }
  return text + parts;
}

Result<hal::Layout> layout_of(std::string_view ros2msg) {
  Parts parts;
  std::string_view name;
  const std::string_view message = take_message(ros2msg, name);
  while (!ros2msg.empty() || !name.empty()) {
    const std::string_view its_name = name;
    const auto part = part_of(take_message(ros2msg, name));
    if (!part) return std::unexpected(part.error());
    if (!parts.emplace(its_name, *part).second)
      return fail("the schema has the part '" + std::string(its_name) + "' twice");
  }
  hal::Layout layout;
  const Status read = each_member(message, [&](const Member& member) -> Status {
    const std::optional<Part> numbers = numbers_of(member, parts);
    if (numbers) return add_member(member, *numbers, layout);
    return fail("the schema's member '" + std::string(member.type) + " " +
                std::string(member.name) + "' is no fixed-size number");
  });
  if (!read) return std::unexpected(read.error());
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
