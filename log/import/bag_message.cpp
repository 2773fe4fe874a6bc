// CDR and ROS 1 are dds/'s; JSON is put into the same values by the message's definition.
#include "log/import/bag_message.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/bounds.hpp"
#include "log/compression.hpp"

namespace tandem::log {
namespace {

using Json = nlohmann::json;

/// What a field is called in JSON: ROS 1 and others have their own names for a time's parts.
const Json* member_of(const Json& object, const std::string& name) {
  static const std::pair<std::string, std::vector<std::string>> kOthers[] = {
      {"sec", {"secs"}}, {"nanosec", {"nsec", "nsecs"}}};
  if (const auto found = object.find(name); found != object.end()) return &*found;
  for (const auto& [ours, theirs] : kOthers) {
    for (const std::string& one : theirs) {
      if (ours != name) continue;
      if (const auto found = object.find(one); found != object.end()) return &*found;
    }
  }
  return nullptr;
}

/// Values of a definition from JSON; the first thing that does not fit sticks.
class JsonReader {
 public:
  dds::Value message(const Json& json, const dds::MessageDefinition& definition) {
    dds::Value::Message out;
    if (!json.is_object()) refuse(definition.name + " is no object");
    for (const dds::MessageField& field : definition.fields) {
      const Json* found = json.is_object() ? member_of(json, field.name) : nullptr;
      out.push_back({field.name, found == nullptr ? none_of(field) : value_of(*found, field)});
    }
    return {std::move(out)};
  }
  [[nodiscard]] const std::string& reason() const { return reason_; }

 private:
  void refuse(std::string reason) {
    if (reason_.empty()) reason_ = std::move(reason);
  }

  /// What stands for a field that is not there.
  dds::Value none_of(const dds::MessageField& field) {
    dds::MessageField one = field;
    one.repeat = dds::Repeat::kOne;
    if (field.repeat == dds::Repeat::kArray) {
      return {dds::Value::List(field.capacity, element(Json(), one))};
    }
    if (field.repeat != dds::Repeat::kOne) return {dds::Value::List{}};
    return element(Json(), field);
  }

  dds::Value value_of(const Json& json, const dds::MessageField& field) {
    if (field.repeat == dds::Repeat::kOne) return element(json, field);
    if (json.is_null()) return none_of(field);
    const bool fits = field.repeat != dds::Repeat::kArray || json.size() == field.capacity;
    if (!json.is_array() || !fits) {
      refuse("'" + field.name + "' is no list of its length");
      return none_of(field);
    }
    dds::Value::List list;
    for (const Json& one : json) list.push_back(element(one, field));
    return {std::move(list)};
  }

  /// @param json  null: it is not there
  dds::Value element(const Json& json, const dds::MessageField& field) {
    using dds::MessageFieldType;
    switch (field.type) {
      case MessageFieldType::kMessage:
        return message(json.is_null() ? Json::object() : json, *field.message);
      case MessageFieldType::kString:
      case MessageFieldType::kBoundedString:
        if (!json.is_null() && !json.is_string()) refuse("'" + field.name + "' is no text");
        return {json.is_string() ? json.get<std::string>() : std::string()};
      case MessageFieldType::kFloat32:
      case MessageFieldType::kFloat64: return {real(json, field.name)};
      case MessageFieldType::kBool: return {json.is_boolean() && json.get<bool>()};
      case MessageFieldType::kInt8:
      case MessageFieldType::kInt16:
      case MessageFieldType::kInt32:
      case MessageFieldType::kInt64: return {std::int64_t{whole(json, field.name)}};
      default: return {static_cast<std::uint64_t>(whole(json, field.name))};
    }
  }

  double real(const Json& json, const std::string& name) {
    if (json.is_number()) return json.get<double>();
    const bool none = json.is_null() || (json.is_string() && (json == "NaN" || json == "nan"));
    if (!none) refuse("'" + name + "' is no number");
    return std::numeric_limits<double>::quiet_NaN();
  }

  /// Times and counts: from 0, within 32 bits.
  std::int64_t whole(const Json& json, const std::string& name) {
    if (json.is_null()) return 0;
    const double value = json.is_number() ? json.get<double>() : -1.0;
    if (value >= 0.0 && value < 4294967296.0) return static_cast<std::int64_t>(value);
    refuse("'" + name + "' is no whole number");
    return 0;
  }

  std::string reason_;
};

Result<dds::Value> decode_json(const dds::MessageDefinition& definition,
                               std::span<const std::byte> bytes) {
  std::optional<Error> broken;
  std::size_t values = 0;
  const auto within = [&](int depth, Json::parse_event_t event, const Json&) {
    if (depth > static_cast<int>(bounds::kJsonDepth.most)) broken = beyond(bounds::kJsonDepth);
    const bool value = event == Json::parse_event_t::value;
    if (value && ++values > bounds::kJsonValues.most) broken = beyond(bounds::kJsonValues);
    return !broken.has_value();
  };
  const auto* first = reinterpret_cast<const char*>(bytes.data());
  const Json json = Json::parse(first, first + bytes.size(), within, /*allow_exceptions=*/false);
  if (broken) return std::unexpected(*broken);
  if (json.is_discarded()) return fail(std::to_string(bytes.size()) + " bytes are no JSON");
  JsonReader reader;
  dds::Value value = reader.message(json, definition);
  if (!reader.reason().empty()) return fail("no " + definition.name + ": " + reader.reason());
  return value;
}

/// One message that was compressed by itself.
Result<Bytes> unpacked(Compression compression, std::span<const std::byte> bytes) {
  Bytes out;
  const auto more = [&]() -> Result<std::span<const std::byte>> {
    return std::exchange(bytes, {});
  };
  const auto take = [&](std::span<const std::byte> piece) -> Status {
    append(out, piece);
    if (out.size() <= bounds::kBagMessage.most) return {};
    return std::unexpected(beyond(bounds::kBagMessage));
  };
  if (Status done = unpack(compression, more, take); !done) return std::unexpected(done.error());
  return out;
}

}  // namespace

std::string ros_name(std::string_view type) {
  std::string name(type);
  for (auto at = name.find("::"); at != std::string::npos; at = name.find("::")) {
    name.replace(at, 2, "/");
  }
  if (const auto at = name.find("/dds_/"); at != std::string::npos) {
    name.erase(at, std::string_view("/dds_").size());
    if (name.ends_with('_')) name.pop_back();
  }
  const auto slash = name.find('/');
  if (slash != std::string::npos && name.find('/', slash + 1) == std::string::npos) {
    name.insert(slash, "/msg");
  }
  return name;
}

bool reads_encoding(std::string_view encoding) {
  return encoding == "cdr" || encoding == "ros1" || encoding == "json";
}

Result<dds::Value> decode_message(std::string_view encoding, std::string_view wanted,
                                  std::span<const std::byte> bytes) {
  const dds::MessageDefinition& definition = *dds::find_definition(wanted);
  if (encoding == "json") return decode_json(definition, bytes);
  if (encoding == "ros1") return dds::decode_ros1(definition, bytes);
  const Compression compression = packed_by(bytes);  // plain CDR begins with 0
  if (compression == Compression::kNone || compression == Compression::kGzip)
    return dds::decode(definition, bytes);
  const Result<Bytes> plain = unpacked(compression, bytes);
  if (!plain) return std::unexpected(plain.error());
  return dds::decode(definition, *plain);
}

}  // namespace tandem::log
