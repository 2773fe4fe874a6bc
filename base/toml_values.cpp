// Values of parsed TOML as text: for comparing, and as JSON.
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>

#include "base/quoting.hpp"
#include "base/toml_shared.hpp"

namespace tandem {
namespace {

std::string shortest(double value) {
  std::array<char, 32> out{};
  const auto end = std::to_chars(out.data(), out.data() + out.size(), value);
  return {out.data(), end.ptr};
}

}  // namespace

std::string value_text(const toml::node& node) {
  if (const auto* text = node.as_string()) return quoted_text(text->get());
  if (const auto* number = node.as_floating_point()) {
    return shortest(number->get());
  }
  std::ostringstream out;
  if (const auto* list = node.as_array()) {
    out << '[';
    for (const toml::node& one : *list)
      out << (&one == &list->front() ? "" : ", ") << value_text(one);
    out << ']';
  } else {
    node.visit([&out](const auto& value) {
      if constexpr (!toml::is_container<decltype(value)>) out << std::boolalpha << value.get();
    });
  }
  return out.str();
}

void add_values(const toml::node& node, const std::string& key,
                std::map<std::string, std::string>& values) {
  if (const toml::table* table = node.as_table()) {
    if (table->empty() && !key.empty()) values[key] = "{}";
    for (const auto& [name, value] : *table)
      add_values(value, (key.empty() ? "" : key + ".") + std::string(name.str()), values);
    return;
  }
  const toml::array* list = node.as_array();
  const bool of_tables = list != nullptr && list->is_array_of_tables();
  if (!of_tables) values[key] = value_text(node);
  for (std::size_t i = 0; of_tables && i < list->size(); ++i)
    add_values((*list)[i], key + "[" + std::to_string(i) + "]", values);
}

std::string json_text(const toml::node& node) {
  std::string text;
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) {
      text += (text.empty() ? "" : ", ") +
              json_text(toml::value<std::string>(std::string(key.str()))) + ": " + json_text(value);
    }
    return "{" + text + "}";
  }
  if (const toml::array* list = node.as_array()) {
    for (const toml::node& one : *list) text += (text.empty() ? "" : ", ") + json_text(one);
    return "[" + text + "]";
  }
  if (const auto* number = node.as_floating_point(); number && std::isfinite(number->get())) {
    text = shortest(number->get());
    return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
  }
  std::ostringstream out;
  out << toml::json_formatter(node, toml::format_flags::quote_dates_and_times |
                                        toml::format_flags::quote_infinities_and_nans);
  return out.str();
}

}  // namespace tandem
