#include "apps/control/dds_parameter_types.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "apps/control/dds_reply.hpp"
#include "runtime/cycle_request.hpp"

namespace tandem::apps {
namespace {

using dds::ReplyMemory;
using Value = ::rcl_interfaces_msg_dds__ParameterValue_;

/// rcl_interfaces/msg/ParameterType.
enum RosType : std::uint8_t {
  kNotSet = 0,
  kBool = 1,
  kInteger = 2,
  kDouble = 3,
  kString = 4,
  kIntegerArray = 7,
  kDoubleArray = 8,
};

constexpr std::size_t kMostNames = 1024, kLongestName = 512;  // of a request
constexpr std::size_t kMostElements = 1024;                   // of an array

std::string name_of(const char* name) { return {name, ::strnlen(name, kLongestName)}; }

Json names_of(const dds_sequence_string& names) {
  Json list = Json::array();
  const std::size_t count = std::min<std::size_t>(names._length, kMostNames);
  for (const char* name : std::span(names._buffer, count)) list.push_back(name_of(name));
  return list;
}

ParameterQuestion about(const dds_sequence_string& names) {
  return {.question = {{"do", "controller.show"}}, .names = names_of(names)};
}

template <class Sequence>
Json elements_of(const Sequence& sequence) {
  Json list = Json::array();
  const std::size_t count = std::min<std::size_t>(sequence._length, kMostElements);
  for (const auto& one : std::span(sequence._buffer, count)) list.push_back(one);
  return list;
}

/// Null: of a type that no parameter has.
Json json_of(const Value& value) {
  switch (value.type) {
    case kBool: return value.bool_value;
    case kInteger: return value.integer_value;
    case kDouble: return value.double_value;
    case kString: return name_of(value.string_value);
    case kIntegerArray: return elements_of(value.integer_array_value);
    case kDoubleArray: return elements_of(value.double_array_value);
    default: return nullptr;
  }
}

template <class Sequence>
ParameterQuestion setting(const Sequence& parameters, bool each) {
  ParameterQuestion asked{.question = {{"do", "controller.set"}, {"each", each}}};
  Json& values = asked.question["parameters"] = Json::object();
  asked.count = parameters._length;
  if (asked.count > runtime::kMostParameterChanges) {
    const std::string counts = std::to_string(asked.count) + " parameters at once";
    asked.refusal = {{"ok", false},
                     {"error", "sets " + counts},
                     {"hint", "set at most " + std::to_string(runtime::kMostParameterChanges)}};
    return asked;
  }
  for (const auto& one : std::span(parameters._buffer, asked.count)) {
    const std::string name = name_of(one.name);
    values[name] = json_of(one.value);
    asked.names.push_back(name);
  }
  return asked;
}

/// Every parameter of the answer by its full name, in the order of the controllers.
struct NamedParameter {
  std::string name;
  const Json* facts;
};
std::vector<NamedParameter> named_parameters(const Json& answer) {
  std::vector<NamedParameter> all;
  const auto controllers = answer.find("controllers");
  if (controllers == answer.end()) return all;
  for (const Json& one : *controllers) {
    for (const Json& parameter : one["parameters"]) {
      all.push_back({one.value("name", "") + "." + parameter.value("name", ""), &parameter});
    }
  }
  return all;
}

/// Null: there is none.
const Json* find(const std::vector<NamedParameter>& all, const Json& name) {
  const auto found =
      std::ranges::find(all, name.get_ref<const std::string&>(), &NamedParameter::name);
  return found == all.end() ? nullptr : found->facts;
}

RosType type_of(const Json& parameter) {
  const std::string type = parameter.value("type", "");
  return type == "boolean"   ? kBool
         : type == "integer" ? kInteger
         : type == "choice"  ? kString
         : type == "numbers" ? kDoubleArray
                             : kDouble;
}

/// One that is not given is no number.
double number_of(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

/// @param parameter  null: there is none
void fill_value(const Json* parameter, Value& to, ReplyMemory& memory) {
  to.string_value = memory.text("");
  if (parameter == nullptr || (*parameter)["value"].is_null()) return;
  const Json& value = (*parameter)["value"];
  to.type = type_of(*parameter);
  if (to.type == kBool) to.bool_value = value.get<bool>();
  if (to.type == kInteger) to.integer_value = value.get<std::int64_t>();
  if (to.type == kDouble) to.double_value = value.get<double>();
  if (to.type == kString) to.string_value = memory.text(value.get<std::string>());
  if (to.type != kDoubleArray) return;
  const auto places = room(to.double_array_value, value.size(), memory);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = number_of(value[i]);
}

/// What its range and type do not say.
std::string constraints(const Json& parameter) {
  std::string text = parameter.value("unit", "");
  if (parameter.value("above_min", false))
    text += text.empty() ? "above its minimum" : ", above its minimum";
  for (const char* words : {"choices", "elements"}) {
    for (const Json& word : parameter[words])
      text += (text.empty() ? "" : ", ") + word.get<std::string>();
  }
  return text;
}

/// The end of a range, of a list the one of all its elements: null where there is none.
Json limit_of(const Json& parameter, const char* key, bool most) {
  const Json& limit = parameter[key];
  if (!limit.is_array()) return limit;
  const auto less = [](const Json& a, const Json& b) { return number_of(a) < number_of(b); };
  if (limit.empty() || std::ranges::any_of(limit, &Json::is_null)) return nullptr;
  return most ? *std::ranges::max_element(limit, less) : *std::ranges::min_element(limit, less);
}

void fill_descriptor(const Json& name, const Json* parameter,
                     ::rcl_interfaces_msg_dds__ParameterDescriptor_& to, ReplyMemory& memory) {
  to.name = memory.text(name.get<std::string>());
  to.description = memory.text(parameter == nullptr ? "" : parameter->value("doc", ""));
  to.additional_constraints = memory.text(parameter == nullptr ? "" : constraints(*parameter));
  if (parameter == nullptr) return;
  to.type = type_of(*parameter);
  to.read_only = !parameter->value("live", false);
  const Json min = limit_of(*parameter, "min", false), max = limit_of(*parameter, "max", true);
  if (min.is_null() && max.is_null()) return;
  using Limits = std::numeric_limits<double>;
  const double least = min.is_null() ? Limits::lowest() : min.get<double>();
  const double most = max.is_null() ? Limits::max() : max.get<double>();
  if (to.type != kInteger) {
    room(to.floating_point_range, 1, memory)[0] = {least, most, 0.0};
  } else {  // an integer's limits are within 2^53
    room(to.integer_range, 1, memory)[0] = {static_cast<std::int64_t>(least),
                                            static_cast<std::int64_t>(most), 0};
  }
}

/// Whether ROS 2 lists `name` for a request of these prefixes and that depth.
bool is_listed(const std::string& name, const Json& prefixes, std::uint64_t depth) {
  const auto within = [depth](std::string_view rest) {
    return depth == 0 || static_cast<std::uint64_t>(std::ranges::count(rest, '.')) < depth;
  };
  if (prefixes.empty()) return within(name);
  return std::ranges::any_of(prefixes, [&](const Json& one) {
    const auto& prefix = one.get_ref<const std::string&>();
    return name == prefix || (name.starts_with(prefix + ".") &&
                              within(std::string_view(name).substr(prefix.size() + 1)));
  });
}

void fill_result(const std::string& reason, ::rcl_interfaces_msg_dds__SetParametersResult_& to,
                 ReplyMemory& memory) {
  to.successful = reason.empty();
  to.reason = memory.text(reason);
}

}  // namespace

ParameterQuestion question_of(const ros::ListParameters_Request& request) {
  ParameterQuestion asked = about(request.prefixes);
  asked.depth = request.depth;
  return asked;
}
ParameterQuestion question_of(const ros::DescribeParameters_Request& request) {
  return about(request.names);
}
ParameterQuestion question_of(const ros::GetParameters_Request& request) {
  return about(request.names);
}
ParameterQuestion question_of(const ros::GetParameterTypes_Request& request) {
  return about(request.names);
}
ParameterQuestion question_of(const ros::SetParameters_Request& request) {
  return setting(request.parameters, true);
}
ParameterQuestion question_of(const ros::SetParametersAtomically_Request& request) {
  return setting(request.parameters, false);
}

void fill(const Json& answer, const ParameterQuestion& asked, ros::ListParameters_Response& reply,
          ReplyMemory& memory) {
  std::vector<std::string> names, prefixes;
  for (const NamedParameter& one : named_parameters(answer)) {
    if (!is_listed(one.name, asked.names, asked.depth)) continue;
    const std::string prefix = one.name.substr(0, one.name.rfind('.'));
    names.push_back(one.name);
    if (std::ranges::find(prefixes, prefix) == prefixes.end()) prefixes.push_back(prefix);
  }
  fill_texts(names, reply.result.names, memory);
  fill_texts(prefixes, reply.result.prefixes, memory);
}

void fill(const Json& answer, const ParameterQuestion& asked,
          ros::DescribeParameters_Response& reply, ReplyMemory& memory) {
  const auto all = named_parameters(answer);
  const auto places = room(reply.descriptors, asked.names.size(), memory);
  for (std::size_t i = 0; i < places.size(); ++i)
    fill_descriptor(asked.names[i], find(all, asked.names[i]), places[i], memory);
}

void fill(const Json& answer, const ParameterQuestion& asked, ros::GetParameters_Response& reply,
          ReplyMemory& memory) {
  const auto all = named_parameters(answer);
  const auto places = room(reply.values, asked.names.size(), memory);
  for (std::size_t i = 0; i < places.size(); ++i)
    fill_value(find(all, asked.names[i]), places[i], memory);
}

void fill(const Json& answer, const ParameterQuestion& asked,
          ros::GetParameterTypes_Response& reply, ReplyMemory& memory) {
  const auto all = named_parameters(answer);
  const auto places = room(reply.types, asked.names.size(), memory);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Json* parameter = find(all, asked.names[i]);
    places[i] = parameter == nullptr ? kNotSet : type_of(*parameter);
  }
}

void fill(const Json& answer, const ParameterQuestion& asked, ros::SetParameters_Response& reply,
          ReplyMemory& memory) {
  if (!answer.value("ok", false)) {  // the same of all, of however many
    ::rcl_interfaces_msg_dds__SetParametersResult_ refused{};
    fill_result(message_of(answer), refused, memory);
    std::ranges::fill(room(reply.results, asked.count, memory), refused);
    return;
  }
  const auto places = room(reply.results, asked.names.size(), memory);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& name = asked.names[i].get_ref<const std::string&>();
    fill_result(answer["results"].value(name, ""), places[i], memory);
  }
}

void fill(const Json& answer, const ParameterQuestion&,
          ros::SetParametersAtomically_Response& reply, ReplyMemory& memory) {
  fill_result(answer.value("ok", false) ? "" : message_of(answer), reply.result, memory);
}

}  // namespace tandem::apps
