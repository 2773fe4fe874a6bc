#include "apps/text/toml_text.hpp"

namespace tandem::apps {
namespace {

/// TOML writes texts, numbers, true and false as JSON does.
Status append(const Json& value, std::string& out) {
  if (value.is_null()) return fail("a parameter is null", "leave it out");
  const char* between = "";
  if (value.is_object()) {
    out += "{";
    for (const auto& [key, part] : value.items()) {
      out += between + json_text(key) + " = ";
      if (Status appended = append(part, out); !appended) return appended;
      between = ", ";
    }
    out += "}";
  } else if (value.is_array()) {
    out += "[";
    for (const Json& part : value) {
      out += between;
      if (Status appended = append(part, out); !appended) return appended;
      between = ", ";
    }
    out += "]";
  } else {
    out += json_text(value);
  }
  return {};
}

}  // namespace

Result<std::string> toml_of(const Json& object) {
  std::string text;
  for (const auto& [key, value] : object.items()) {
    text += json_text(key) + " = ";
    if (Status appended = append(value, text); !appended) {
      return fail(key + ": " + appended.error().message, appended.error().hint);
    }
    text += "\n";
  }
  return text;
}

}  // namespace tandem::apps
