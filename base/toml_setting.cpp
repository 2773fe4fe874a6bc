// The text is edited, not what was parsed: so the log has what was run, and every reader of it
// finds the same values. Places come from the parser.
#include "base/toml_setting.hpp"

// As in toml_reader.cpp: texts that are no TOML must not end a build with assertions.
#define TOML_ASSERT(expr) static_assert(true)
#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>

#include "base/nearest.hpp"
#include "base/quoting.hpp"

namespace tandem {
namespace {

/// One step of a path: a name, or a number in brackets.
struct PathStep {
  std::string name;
  std::optional<std::size_t> index;
};

bool is_bare(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') ||
         (letter >= '0' && letter <= '9') || letter == '_' || letter == '-';
}

/// "push[0].impulse_Ns[0]"; empty: it is no path.
std::vector<PathStep> steps_of(std::string_view path) {
  std::vector<PathStep> steps;
  std::size_t at = 0;
  while (at < path.size()) {
    if (path[at] == '[') {
      const std::size_t close = path.find(']', at);
      if (close == std::string_view::npos || steps.empty()) return {};
      std::size_t index = 0;
      const char* const end = path.data() + close;
      const auto read = std::from_chars(path.data() + at + 1, end, index);
      if (read.ec != std::errc() || read.ptr != end) return {};
      steps.push_back({.name = {}, .index = index});
      at = close + 1;
      continue;
    }
    if (!steps.empty() && path[at++] != '.') return {};
    if (at >= path.size()) return {};
    const char quote = path[at];
    const bool quoted = quote == '"' || quote == '\'';
    const std::size_t from = quoted ? at + 1 : at;
    std::size_t to = from;
    while (to < path.size() && (quoted ? path[to] != quote : is_bare(path[to]))) ++to;
    if (to == from || (quoted && to == path.size())) return {};
    steps.push_back({.name = std::string(path.substr(from, to - from)), .index = {}});
    at = quoted ? to + 1 : to;
  }
  return steps;
}

std::string in_toml(const std::string& name) {
  return std::ranges::all_of(name, is_bare) ? name : quoted_text(name);
}

/// The byte of a place of the parser's, which counts characters.
std::size_t byte_at(std::string_view text, toml::source_position place) {
  std::size_t at = 0;
  for (toml::source_index line = 1; line < place.line && at < text.size(); ++line) {
    at = text.find('\n', at);
    at = at == std::string_view::npos ? text.size() : at + 1;
  }
  if (place.line == 1 && text.starts_with("\xEF\xBB\xBF")) at = 3;
  for (toml::source_index column = 1; column < place.column && at < text.size(); ++column) {
    do ++at;
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U);
  }
  return at;
}

std::string kind_of_node(const toml::node& node) {
  std::ostringstream out;
  out << node.type();
  return out.str();
}

std::vector<std::string> names_in(const toml::node& node) {
  std::vector<std::string> names;
  if (const toml::table* table = node.as_table()) {
    for (const auto& [key, value] : *table) names.emplace_back(key.str());
  }
  if (const toml::array* list = node.as_array()) {
    for (const toml::node& entry : *list) {
      const toml::table* table = entry.as_table();
      for (const char* key : {"name", "plugin"}) {
        const auto* name = table == nullptr ? nullptr : (*table)[key].as_string();
        if (name == nullptr) continue;
        names.push_back(name->get());
        break;
      }
    }
  }
  return names;
}

std::unexpected<Error> wrong(const TomlSetting& setting, std::string message, std::string hint) {
  return std::unexpected(Error{
      .message = std::move(message), .hint = std::move(hint), .file = setting.said, .key = {}});
}

/// Puts one value into a text.
class SettingEditor {
 public:
  SettingEditor(SetText& out, const TomlSetting& setting, const toml::table& root)
      : out_(out), setting_(setting), root_(root), steps_(steps_of(setting.key)) {
    bases_.push_back({&root_, 0});
  }

  Status edit() {
    if (steps_.empty()) {
      return wrong(setting_, "'" + setting_.key + "' is no path of a key",
                   setting_.key.find(' ') == std::string::npos
                       ? "write it as push[0].impulse_Ns[0], or sim.link.torso.mass_kg"
                       : "put a name with blanks into quotes: push.\"a bump\".at_s");
    }
    const toml::node* node = &root_;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      auto next = step(*node, steps_[i]);
      if (!next) return std::unexpected(next.error());
      if (*next == nullptr) return add(*node, i);
      node = *next;
      if (const toml::table* table = node->as_table(); table != nullptr && is_written(*table, i))
        bases_.push_back({table, i + 1});
    }
    if (node->is_table() || node->is_array_of_tables()) {
      return wrong(setting_, path_ + " is " + kind_of_node(*node) + ", not a value",
                   "set a key of it: " + suggest("", names_in(*node)));
    }
    const std::size_t from = byte_at(out_.text, node->source().begin);
    out_.text.replace(from, byte_at(out_.text, node->source().end) - from, setting_.value);
    out_.who.emplace_back(path_, setting_.said);
    return {};
  }

 private:
  struct Base {
    const toml::table* table;
    std::size_t steps;  // that lead to it
  };

  /// The node below; null: the table lacks it.
  Result<const toml::node*> step(const toml::node& node, const PathStep& step) {
    const toml::array* list = node.as_array();
    if (step.index) {
      if (list == nullptr) {
        return wrong(setting_, path_ + " is no list, but " + kind_of_node(node),
                     "leave out the number in brackets");
      }
      if (*step.index >= list->size()) {
        return wrong(setting_,
                     path_ + " has " + std::to_string(list->size()) +
                         (list->size() == 1 ? " entry" : " entries"),
                     "they count from 0");
      }
      path_ += "[" + std::to_string(*step.index) + "]";
      return list->get(*step.index);
    }
    if (list != nullptr && list->is_array_of_tables()) {
      const std::vector<std::string> names = names_in(node);
      const auto it = std::ranges::find(names, step.name);
      if (it == names.end() || names.size() != list->size()) {
        return wrong(
            setting_, path_ + " has no entry '" + step.name + "'",
            names.empty() ? "give its number: " + path_ + "[0]" : suggest(step.name, names));
      }
      const auto index = static_cast<std::size_t>(it - names.begin());
      path_ += "[" + std::to_string(index) + "]";
      return list->get(index);
    }
    const toml::table* table = node.as_table();
    if (table == nullptr) {
      return wrong(setting_, path_ + " is a value, and has no '" + step.name + "' below it",
                   "set " + path_ + " itself");
    }
    path_ += (path_.empty() ? "" : ".") + step.name;
    return table->get(step.name);
  }

  /// Whether a table has a header or braces of its own: other tables follow from these or from
  /// dotted keys.
  [[nodiscard]] bool is_written(const toml::table& table, std::size_t last) const {
    if (table.is_inline()) return true;
    const std::size_t at = byte_at(out_.text, table.source().begin);
    if (at >= out_.text.size() || out_.text[at] != '[') return false;
    const std::size_t from = out_.text.find_first_not_of('[', at);
    const std::size_t to = out_.text.find(']', at);
    if (from == std::string::npos || to == std::string::npos || to < from) return false;
    std::string header = out_.text.substr(from, to - from);
    std::erase(header, ' ');
    const auto names = std::ranges::count_if(steps_.begin(),
                                             steps_.begin() + static_cast<std::ptrdiff_t>(last) + 1,
                                             [](const PathStep& one) { return !one.index; });
    return std::ssize(steps_of(header)) == by_name_as_number(names, last);
  }

  /// Names that the header has: an entry of an array that is called by name has none.
  [[nodiscard]] std::ptrdiff_t by_name_as_number(std::ptrdiff_t names, std::size_t last) const {
    const toml::node* node = &root_;
    for (std::size_t i = 0; i <= last && node != nullptr; ++i) {
      if (const toml::table* table = node->as_table()) {
        node = table->get(steps_[i].name);
        continue;
      }
      const toml::array* list = node->as_array();
      if (list == nullptr) break;
      if (steps_[i].index) {
        node = list->get(*steps_[i].index);
        continue;
      }
      --names;
      const std::vector<std::string> known = names_in(*node);
      node = list->get(
          static_cast<std::size_t>(std::ranges::find(known, steps_[i].name) - known.begin()));
    }
    return names;
  }

  /// Adds what the table `node` lacks: the key `missing`, or a table of that name with the rest.
  Status add(const toml::node& node, std::size_t missing) {
    const toml::table& table = *node.as_table();
    const bool is_key = missing + 1 == steps_.size();
    const bool of_tables =
        missing > 0 && !table.empty() &&
        std::ranges::all_of(table, [](const auto& one) { return one.second.is_table(); });
    const std::string name = steps_[missing].name;
    if (of_tables && !is_key) {  // a name that nothing uses would change nothing
      return wrong(setting_, "there is no " + path_, suggest(name, names_in(node)));
    }
    const std::string created = path_;
    for (std::size_t i = missing + 1; i < steps_.size(); ++i) {
      if (steps_[i].index) {
        return wrong(setting_, "there is no " + path_, suggest(name, names_in(node)));
      }
      path_ += "." + steps_[i].name;
    }
    const Base base = bases_.back();
    std::string line;
    for (std::size_t i = base.steps; i < steps_.size(); ++i)
      line += (line.empty() ? "" : ".") + in_toml(steps_[i].name);
    line += " = " + setting_.value;
    if (base.table->is_inline()) {
      const std::size_t at = byte_at(out_.text, base.table->source().begin) + 1;
      out_.text.insert(at, " " + line + (base.table->empty() ? " " : ","));
    } else if (!put_line(base, line, missing)) {
      return wrong(setting_, path_ + " cannot be added to the file's table",
                   "write the key into the file, then set it");
    }
    out_.who.emplace_back(path_, setting_.said);
    if (created != path_) out_.who.emplace_back(created, setting_.said);
    return {};
  }

  /// A line of its own, below the header; where a table is only the parent of others that have
  /// headers, below one of its own at the end.
  bool put_line(const Base& base, const std::string& line, std::size_t missing) {
    const bool at_root = base.steps == 0;
    const int above = at_root ? 0 : static_cast<int>(base.table->source().begin.line);
    const toml::source_position place{static_cast<toml::source_index>(above + 1), 1};
    std::string text = out_.text;
    std::size_t at = byte_at(text, place);
    if (at > 3 && text[at - 1] != '\n') text.insert(at++, "\n");
    text.insert(at, line + "\n");
    if (is_toml(text)) {
      out_.text = std::move(text);
      for (int& other : out_.added_lines) other += other > above ? 1 : 0;
      out_.added_lines.push_back(above + 1);
      std::ranges::sort(out_.added_lines);
      return true;
    }
    if (!at_root || missing + 1 != steps_.size()) return false;
    text = out_.text + "\n[";
    for (std::size_t i = 0; i < missing; ++i) {
      if (steps_[i].index) return false;
      text += (i == 0 ? "" : ".") + in_toml(steps_[i].name);
    }
    text += "]\n" + in_toml(steps_[missing].name) + " = " + setting_.value + "\n";
    if (!is_toml(text)) return false;
    out_.text = std::move(text);
    return true;
  }

  static bool is_toml(const std::string& text) {
    try {
      (void)toml::parse(text);
      return true;
    } catch (const toml::parse_error&) {
      return false;
    }
  }

  SetText& out_;
  const TomlSetting& setting_;
  const toml::table& root_;
  std::vector<PathStep> steps_;
  std::vector<Base> bases_;  // the tables on the way that are written as such
  std::string path_;         // so far, as the reader has it
};

/// The text of the one value of `x = VALUE`; empty: it is none.
std::string value_alone(const std::string& value) {
  const std::string text = "x = " + value;
  try {
    const toml::table table = toml::parse(text);
    const toml::node* node = table.get("x");
    if (table.size() != 1 || node == nullptr) return {};
    const std::size_t from = byte_at(text, node->source().begin);
    return text.substr(from, byte_at(text, node->source().end) - from);
  } catch (const toml::parse_error&) {
    return {};
  }
}

std::string trimmed_setting(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t");
  if (from == std::string_view::npos) return {};
  return std::string(text.substr(from, text.find_last_not_of(" \t") + 1 - from));
}

bool is_below(const std::string& path, const std::string& above) {
  return path == above ||
         (path.starts_with(above) && (path[above.size()] == '.' || path[above.size()] == '['));
}

}  // namespace

Result<TomlSetting> read_setting(std::string_view text) {
  const std::size_t equals = text.find('=');
  TomlSetting setting{.key = trimmed_setting(text.substr(0, equals)),
                      .value = {},
                      .said = "--set " + std::string(text)};
  if (equals == std::string_view::npos || setting.key.empty())
    return wrong(setting, "has no KEY=VALUE", "write --set 'push[0].impulse_Ns[0]=-6'");
  const std::string value = trimmed_setting(text.substr(equals + 1));
  setting.said = "--set " + setting.key + "=" + value;
  const bool one_line = value.find_first_of("\r\n") == std::string::npos;
  if (one_line) setting.value = value_alone(value);
  const bool word = !value.empty() && std::ranges::all_of(value, [](char letter) {
    return is_bare(letter) || letter == '.' || letter == '/';
  });
  const bool begins = word && !(value[0] >= '0' && value[0] <= '9') && value[0] != '-';
  if (setting.value.empty() && begins) setting.value = quoted_text(value);
  if (!setting.value.empty()) return setting;
  return wrong(setting, "is no value of TOML in one line",
               "a number, true, false, \"text\" in quotes or a list in brackets");
}

int SetText::line_of_file(int line) const {
  const auto before = std::ranges::count_if(added_lines, [line](int one) { return one <= line; });
  return std::max(1, line - static_cast<int>(before));
}

std::string SetText::said_of(const std::string& path) const {
  for (const auto& [set, said] : who) {
    const bool element = set.starts_with(path) && set.size() > path.size() &&
                         set[path.size()] == '[' && set.find('.', path.size()) == std::string::npos;
    if (!path.empty() && (element || is_below(path, set))) return said;
  }
  return {};
}

Result<SetText> with_settings(std::string_view text, const std::vector<TomlSetting>& settings) {
  SetText out{.text = std::string(text), .added_lines = {}, .who = {}};
  for (const TomlSetting& setting : settings) {
    try {
      const toml::table root = toml::parse(out.text);
      if (const Status done = SettingEditor(out, setting, root).edit(); !done)
        return std::unexpected(done.error());
    } catch (const toml::parse_error&) {
      if (&setting == &settings.front()) break;  // the file is none: who parses it says so
      return wrong(setting, "what was set before it makes the file no TOML", "set one at a time");
    }
  }
  return out;
}

std::vector<TomlSetting> take_below(std::string_view key, std::vector<TomlSetting>& settings) {
  std::vector<TomlSetting> below;
  const std::string start = std::string(key) + ".";
  for (TomlSetting& one : settings) {
    if (!one.key.starts_with(start)) continue;
    below.push_back(one);
    below.back().key.erase(0, start.size());
  }
  std::erase_if(settings, [&](const TomlSetting& one) { return one.key.starts_with(start); });
  return below;
}

}  // namespace tandem
