#include "apps/clients/topic_print.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <type_traits>

#include "base/nearest.hpp"

namespace tandem::apps {
namespace {

using dds::Value;
using List = Value::List;
using Message = Value::Message;

std::string number(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0.0 ? ".inf" : "-.inf";
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

/// Quoted where YAML would read something else than the text itself.
std::string quoted(const std::string& text) {
  const bool plain = !text.empty() && std::isalpha(static_cast<unsigned char>(text.front())) != 0 &&
                     text.back() != ' ' && text.back() != ':' &&
                     text.find_first_of("\n'\"#\\\t") == std::string::npos &&
                     text.find(": ") == std::string::npos;
  const bool word = text == "true" || text == "false" || text == "null" || text == "yes" ||
                    text == "no" || text == "on" || text == "off";
  if (plain && !word) return text;
  if (text.find_first_of("\n\t\\") == std::string::npos) {
    std::string out = "'";
    for (const char c : text) out.append(c == '\'' ? 2 : 1, c);
    return out + "'";
  }
  return json_text(text);  // YAML reads JSON's
}

/// "3", "[]": what stands on one line; empty when it takes lines of its own.
std::string in_line(const Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, bool>) {
          return v ? "true" : "false";
        } else if constexpr (std::is_same_v<T, double>) {
          return number(v);
        } else if constexpr (std::is_same_v<T, std::string>) {
          return quoted(v);
        } else if constexpr (std::is_same_v<T, List>) {
          return v.empty() ? "[]" : "";
        } else if constexpr (std::is_same_v<T, Message>) {
          return "";
        } else {
          return std::to_string(v);
        }
      },
      value.of);
}

void print(const Value& value, std::size_t indent, std::string& out);

/// What follows "name:" or "-".
void print_after(const std::string& key, const Value& value, std::size_t indent, std::string& out) {
  out += key;
  if (const std::string text = in_line(value); !text.empty()) {
    out += " " + text + "\n";
    return;
  }
  out += '\n';
  print(value, indent, out);
}

void print(const Value& value, std::size_t indent, std::string& out) {
  const std::string space(indent, ' ');
  if (const auto* message = std::get_if<Message>(&value.of)) {
    for (const dds::Member& member : *message) {
      const bool list = std::holds_alternative<List>(member.value.of);
      print_after(space + std::string(member.name) + ":", member.value, indent + (list ? 0 : 2),
                  out);
    }
  } else if (const auto* list = std::get_if<List>(&value.of)) {
    for (const Value& item : *list) {
      if (!std::holds_alternative<Message>(item.of)) {
        print_after(space + "-", item, indent + 2, out);
        continue;
      }
      const std::size_t begin = out.size();  // its first member stands behind the dash
      print(item, indent + 2, out);
      if (out.size() > begin) out[begin + indent] = '-';
    }
  } else {
    out += space + in_line(value) + "\n";
  }
}

}  // namespace

std::string to_yaml(const Value& value) {
  std::string out;
  print(value, 0, out);
  return out.empty() ? "[]\n" : out;
}

Json to_json(const Value& value) {
  return std::visit(
      [](const auto& v) -> Json {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, List>) {
          Json list = Json::array();
          for (const Value& item : v) list.push_back(to_json(item));
          return list;
        } else if constexpr (std::is_same_v<T, Message>) {
          Json object = Json::object();
          for (const dds::Member& member : v)
            object[std::string(member.name)] = to_json(member.value);
          return object;
        } else if constexpr (std::is_same_v<T, double>) {
          return std::isfinite(v) ? Json(v) : Json(nullptr);
        } else {
          return v;
        }
      },
      value.of);
}

Result<const Value*> select(const Value& value, const std::string& path) {
  const Value* at = &value;
  std::string_view rest = path;
  while (!rest.empty()) {
    if (rest.front() == '.') rest.remove_prefix(1);
    if (rest.starts_with('[')) {
      std::size_t index = 0;
      const auto [end, problem] =
          std::from_chars(rest.data() + 1, rest.data() + rest.size(), index);
      const auto* list = std::get_if<List>(&at->of);
      const std::size_t size = list == nullptr ? 0 : list->size();
      if (problem != std::errc() || end == rest.data() + rest.size() || *end != ']' ||
          index >= size) {
        return fail(fmt::format("'{}' is no element: the list has {}", path, size),
                    "indices begin at 0: --field position[0]");
      }
      at = &(*list)[index];
      rest.remove_prefix(static_cast<std::size_t>(end - rest.data()) + 1);
      continue;
    }
    const std::string name(rest.substr(0, rest.find_first_of(".[")));
    const Value* member = dds::find(*at, name);
    if (member == nullptr) {
      std::vector<std::string> known;
      if (const auto* message = std::get_if<Message>(&at->of)) {
        for (const dds::Member& one : *message) known.emplace_back(one.name);
      }
      return fail("there is no field '" + name + "' in it",
                  known.empty() ? "it has no fields" : suggest(name, known));
    }
    at = member;
    rest.remove_prefix(name.size());
  }
  return at;
}

}  // namespace tandem::apps
