// Parses .msg, .srv and .action text; the hash is SHA-256 of the REP-2016 description as JSON.
#include "dds/message_definition.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <map>

#include "base/sha256.hpp"

namespace tandem::dds {
namespace {

struct Word {
  std::string_view text;
  MessageFieldType type;
};

constexpr std::array kWords{
    Word{"bool", MessageFieldType::kBool},       Word{"byte", MessageFieldType::kByte},
    Word{"char", MessageFieldType::kUint8},      Word{"int8", MessageFieldType::kInt8},
    Word{"uint8", MessageFieldType::kUint8},     Word{"int16", MessageFieldType::kInt16},
    Word{"uint16", MessageFieldType::kUint16},   Word{"int32", MessageFieldType::kInt32},
    Word{"uint32", MessageFieldType::kUint32},   Word{"int64", MessageFieldType::kInt64},
    Word{"uint64", MessageFieldType::kUint64},   Word{"float32", MessageFieldType::kFloat32},
    Word{"float64", MessageFieldType::kFloat64}, Word{"string", MessageFieldType::kString},
};

bool is_name(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && letter(text.front()) &&
         std::ranges::all_of(text, [&](char c) { return letter(c) || digit(c) || c == '_'; });
}

/// @return 0 of what is no number above 0
std::uint64_t number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  return code == std::errc() && end == text.data() + text.size() ? value : 0;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string_view package_of(std::string_view name) { return name.substr(0, name.find('/')); }

/// "[]", "[<=3]", "[3]" at the end of a type; false when it is malformed.
bool read_repeat(std::string_view& type, MessageField& field) {
  const auto open = type.find('[');
  if (open == std::string_view::npos) return true;
  if (type.back() != ']') return false;
  std::string_view inside = type.substr(open + 1, type.size() - open - 2);
  type = type.substr(0, open);
  if (inside.empty()) {
    field.repeat = Repeat::kSequence;
    return true;
  }
  const bool bounded = inside.starts_with("<=");
  if (bounded) inside.remove_prefix(2);
  field.repeat = bounded ? Repeat::kBoundedSequence : Repeat::kArray;
  field.capacity = number(inside);
  return field.capacity > 0;
}

/// What stands before the brackets: "float64", "string<=8", "Wrench", "std_msgs/Header".
bool read_element(std::string_view type, std::string_view package, MessageField& field) {
  constexpr std::string_view kBounded = "string<=";
  if (type.starts_with(kBounded)) {
    field.type = MessageFieldType::kBoundedString;
    field.string_capacity = number(type.substr(kBounded.size()));
    return field.string_capacity > 0;
  }
  const auto word = std::ranges::find(kWords, type, &Word::text);
  if (word != kWords.end()) {
    field.type = word->type;
    return true;
  }
  field.type = MessageFieldType::kMessage;
  const auto slash = type.find('/');
  const std::string_view own = slash == std::string_view::npos ? package : type.substr(0, slash);
  const std::string_view message = slash == std::string_view::npos ? type : type.substr(slash + 1);
  field.message_name = fmt::format("{}/msg/{}", own, message);
  return is_name(own) && is_name(message);
}

/// One line without its comment: a field, or false; a constant is none but well.
Result<bool> read_line(std::string_view line, std::string_view package, MessageField& field) {
  const auto space = line.find_first_of(" \t");
  if (space == std::string_view::npos) return fail("a type without a name", "float64 x");
  std::string_view type = line.substr(0, space);
  const std::string_view rest = trimmed(line.substr(space));
  if (!read_repeat(type, field) || !read_element(type, package, field)) {
    return fail(fmt::format("'{}' is no type", line.substr(0, space)),
                "float64, string[], uint8[<=3], std_msgs/Header");
  }
  const std::string_view name = rest.substr(0, rest.find_first_of(" \t="));
  if (!is_name(name)) return fail(fmt::format("'{}' is no name", name), "small letters, digits, _");
  field.name = name;
  return !trimmed(rest.substr(name.size())).starts_with('=');  // after it may stand a default
}

MessageField field(std::string name, MessageFieldType type) {
  return {.name = std::move(name), .type = type, .message_name = {}};
}

/// ROS 2 gives a message without fields one, since IDL has no empty structure.
MessageField placeholder() {
  return field("structure_needs_at_least_one_member", MessageFieldType::kUint8);
}

Result<MessageDefinition> read_message(std::string name, std::string_view text, int& line_number) {
  MessageDefinition message{.name = std::move(name), .text = std::string(text), .fields = {}};
  while (!text.empty()) {
    ++line_number;
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::string_view content = trimmed(line.substr(0, line.find('#')));
    if (content.empty()) continue;
    MessageField field{.name = {}, .type = MessageFieldType::kBool, .message_name = {}};
    const Result<bool> is_field = read_line(content, package_of(message.name), field);
    if (!is_field) {
      Error error = is_field.error();
      error.file = message.name;
      error.line = line_number;
      return std::unexpected(error);
    }
    if (*is_field) message.fields.push_back(std::move(field));
  }
  if (message.fields.empty()) message.fields.push_back(placeholder());
  return message;
}

MessageField message_field(std::string name, std::string type, Repeat repeat = Repeat::kOne) {
  return {.name = std::move(name),
          .type = MessageFieldType::kMessage,
          .repeat = repeat,
          .capacity = repeat == Repeat::kOne ? 0u : 1u,
          .message_name = std::move(type)};
}

/// What ROS 2 makes of a service beside its request and response, for introspection and hash.
void add_service(std::vector<MessageDefinition>& out, const std::string& name) {
  const std::string request = name + "_Request", response = name + "_Response";
  out.push_back({.name = name + "_Event",
                 .text = {},
                 .fields = {message_field("info", "service_msgs/msg/ServiceEventInfo"),
                            message_field("request", request, Repeat::kBoundedSequence),
                            message_field("response", response, Repeat::kBoundedSequence)}});
  out.push_back({.name = name,
                 .text = {},
                 .fields = {message_field("request_message", request),
                            message_field("response_message", response),
                            message_field("event_message", name + "_Event")}});
}

/// And of an action: services that send a goal and get its result, a message of its feedback.
void add_action(std::vector<MessageDefinition>& out, const std::string& name) {
  const MessageField goal_id = message_field("goal_id", "unique_identifier_msgs/msg/UUID");
  const auto add = [&](const char* part, std::vector<MessageField> fields) {
    out.push_back({.name = name + part, .text = {}, .fields = std::move(fields)});
  };
  add("_SendGoal_Request", {goal_id, message_field("goal", name + "_Goal")});
  add("_SendGoal_Response", {field("accepted", MessageFieldType::kBool),
                             message_field("stamp", "builtin_interfaces/msg/Time")});
  add_service(out, name + "_SendGoal");
  add("_GetResult_Request", {goal_id});
  add("_GetResult_Response",
      {field("status", MessageFieldType::kInt8), message_field("result", name + "_Result")});
  add_service(out, name + "_GetResult");
  add("_FeedbackMessage", {goal_id, message_field("feedback", name + "_Feedback")});
  add("", {message_field("goal", name + "_Goal"), message_field("result", name + "_Result"),
           message_field("feedback", name + "_Feedback"),
           message_field("send_goal_service", name + "_SendGoal"),
           message_field("get_result_service", name + "_GetResult"),
           message_field("feedback_message", name + "_FeedbackMessage")});
}

/// The messages of a file, between which stand lines of three dashes.
Result<std::vector<MessageDefinition>> read_parts(const std::string& name, std::string_view text,
                                                  std::initializer_list<const char*> parts) {
  constexpr std::string_view kBetween = "---\n";
  std::vector<MessageDefinition> out;
  int line = 0;
  for (const char* part : parts) {
    const bool last = out.size() + 1 == parts.size();
    const auto between = text.starts_with(kBetween) ? 0 : text.find("\n---\n") + 1;
    if (text.substr(between).starts_with(kBetween) == last) {
      return fail(fmt::format("{} has {} lines --- than {}", name, last ? "more" : "fewer",
                              parts.size() - 1));
    }
    auto message = read_message(name + part, last ? text : text.substr(0, between), line);
    if (!message) return std::unexpected(message.error());
    out.push_back(std::move(*message));
    if (last) break;
    text.remove_prefix(between + kBetween.size());
    ++line;
  }
  return out;
}

/// Every message in it, at any depth, once, in the order of their names.
using References = std::map<std::string, const MessageDefinition*>;
void collect(const MessageDefinition& definition, References& out) {
  for (const MessageField& field : definition.fields) {
    if (field.message == nullptr || out.contains(field.message_name)) continue;
    out.emplace(field.message_name, field.message);
    collect(*field.message, out);
  }
}

std::string description(const MessageDefinition& definition) {
  std::string fields;
  for (const MessageField& field : definition.fields) {
    fields += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": {}, )"
        R"("nested_type_name": "{}"}}}})",
        fields.empty() ? "" : ", ", field.name,
        static_cast<int>(field.type) + static_cast<int>(field.repeat), field.capacity,
        field.string_capacity, field.message_name);
  }
  return fmt::format(R"({{"type_name": "{}", "fields": [{}]}})", definition.name, fields);
}

}  // namespace

Result<std::vector<MessageDefinition>> parse_definition(std::string_view name,
                                                        std::string_view text) {
  std::vector<MessageDefinition> out;
  int line = 0;
  const std::string own(name);
  if (name.find("/msg/") != std::string_view::npos) {
    auto message = read_message(own, text, line);
    if (!message) return std::unexpected(message.error());
    out.push_back(std::move(*message));
    return out;
  }
  const bool is_action = name.find("/action/") != std::string_view::npos;
  auto parts = is_action ? read_parts(own, text, {"_Goal", "_Result", "_Feedback"})
                         : read_parts(own, text, {"_Request", "_Response"});
  if (!parts) return std::unexpected(parts.error());
  out = std::move(*parts);
  if (is_action) {
    add_action(out, own);
  } else {
    add_service(out, own);
  }
  for (MessageDefinition& one : out) {
    one.request_or_response = one.name.ends_with("_Request") || one.name.ends_with("_Response");
  }
  return out;
}

Status resolve(std::vector<MessageDefinition>& definitions) {
  std::ranges::sort(definitions, {}, &MessageDefinition::name);
  for (MessageDefinition& definition : definitions) {
    for (MessageField& field : definition.fields) {
      if (field.type != MessageFieldType::kMessage) continue;
      const auto found =
          std::ranges::lower_bound(definitions, field.message_name, {}, &MessageDefinition::name);
      if (found == definitions.end() || found->name != field.message_name) {
        return fail(fmt::format("{}: {} is of {}, which has no definition", definition.name,
                                field.name, field.message_name));
      }
      field.message = &*found;
    }
  }
  for (const MessageDefinition& definition : definitions) {
    References all;
    collect(definition, all);
    if (all.contains(definition.name)) return fail(definition.name + " contains itself");
  }
  return {};
}

std::string type_hash(const MessageDefinition& definition) {
  References all;
  collect(definition, all);
  std::string referenced;
  for (const auto& [name, one] : all) {
    referenced += (referenced.empty() ? "" : ", ") + description(*one);
  }
  const std::string text =
      fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                  description(definition), referenced);
  return "RIHS01_" + sha256(text);
}

std::string full_text(const MessageDefinition& definition) {
  References all;
  collect(definition, all);
  std::string text = definition.text;
  for (const auto& [name, one] : all) {
    std::string short_name = name;
    short_name.erase(short_name.find('/'), std::string_view("/msg").size());
    text += std::string(80, '=') + "\nMSG: " + short_name + "\n" + one->text;
  }
  return text;
}

}  // namespace tandem::dds
