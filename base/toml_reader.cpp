// Every key that is read is noted; finish() reports those that nobody asked for, with the nearest
// known name. All tables of a document collect their errors in one list.
#include "base/toml_reader.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "base/bounds.hpp"
#include "base/file_name.hpp"
#include "base/nearest.hpp"
#include "base/open_file.hpp"
#include "base/quoting.hpp"
#include "base/toml_shared.hpp"

namespace tandem {

namespace {

const toml::table kEmpty;   // stands for an optional table that is not there
const toml::table kBroken;  // stands for a table whose absence or type was reported

constexpr double kLargest = 1e30;  // so that no product of a few overflows

constexpr const char* kMissing = "this key is missing";

std::string kind(const toml::node& node) {
  std::ostringstream out;
  out << node.type();
  return out.str();
}

/// A dotted path as a table's header has it: without the numbers of arrays.
std::string header_of(std::string path) {
  for (std::size_t at = path.find('['); at != std::string::npos; at = path.find('[')) {
    path.erase(at, path.find(']', at) + 1 - at);
  }
  return path;
}

/// What an entry of an array of tables is called; empty: by no name that can be shown.
/// @param named_by  key of the name of one that has no `name`
std::string name_of(const toml::table& entry, std::string_view named_by) {
  const bool named = entry.contains("name");
  const auto* text = entry[named ? "name" : named_by].as_string();
  if (text == nullptr || !shown_name_problem(text->get()).empty()) return {};
  const bool path = !named && text->get().find('/') != std::string::npos;
  return path ? std::string() : text->get();
}

std::string number_text(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

}  // namespace

TomlTable::TomlTable(std::shared_ptr<Shared> shared, const toml::table* table, std::string path,
                     int line)
    : shared_(std::move(shared)),
      table_(table),
      path_(std::move(path)),
      line_(line),
      defaults_(&kEmpty) {}

void TomlTable::inherit(const TomlTable& defaults) {
  defaults_ = defaults.table_;
  defaults_path_ = defaults.path_;
}

std::string TomlTable::dotted(std::string_view key) const {
  if (key.empty()) return path_;
  const bool inherited = !table_->contains(key) && defaults_->contains(key);
  const std::string& path = inherited ? defaults_path_ : path_;
  return path.empty() ? std::string(key) : path + "." + std::string(key);
}

const toml::node* TomlTable::get(std::string_view key) const {
  const toml::node* own = table_->get(key);
  return own != nullptr ? own : defaults_->get(key);
}

const toml::node* TomlTable::find(std::string_view key) {
  asked_.emplace(key);
  return get(key);
}

const toml::node* TomlTable::require(std::string_view key) {
  const toml::node* node = find(key);
  const bool misspelt = shared_->meant.contains(dotted(key)) ||
                        shared_->meant.contains(defaults_path_ + "." + std::string(key));
  if (node == nullptr && !misspelt && !partial_ && table_ != &kBroken && defaults_ != &kBroken) {
    error(key, kMissing,
          "add it to the table" +
              (defaults_path_.empty() ? "" : ", or to [" + defaults_path_ + "] for all"));
  }
  return node;
}

bool TomlTable::has(std::string_view key) const {
  looked_for_.emplace(key);
  return get(key) != nullptr;
}

bool TomlTable::is_text(std::string_view key) const {
  const toml::node* node = get(key);
  return node != nullptr && node->is_string();
}

int TomlTable::line() const { return line_; }

int TomlTable::line(std::string_view key) const {
  const toml::node* node = key.empty() ? nullptr : get(key);
  return node == nullptr ? line()
                         : shared_->set.line_of_file(static_cast<int>(node->source().begin.line));
}

Error TomlTable::error_at(std::string_view key, std::string message, std::string hint) const {
  const std::string said = shared_->set.said_of(dotted(key));
  return {.message = std::move(message),
          .hint = std::move(hint),
          .file = said.empty() ? shared_->file : said,
          .line = said.empty() ? line(key) : 0,
          .key = shared_->shown(dotted(key))};
}

void TomlTable::error(std::string_view key, std::string message, std::string hint) {
  Error error = error_at(key, std::move(message), std::move(hint));
  const bool known = std::ranges::any_of(shared_->diagnostics, [&](const Error& other) {
    return other.line == error.line && other.key == error.key && other.message == error.message;
  });
  if (!known) add_error(shared_->diagnostics, std::move(error));
}

bool TomlTable::has_errors() const {
  const std::string path = shared_->shown(path_);
  return std::ranges::any_of(shared_->diagnostics, [&](const Error& error) {
    return error.key == path || error.key.starts_with(path + ".") ||
           (!defaults_path_.empty() && error.key.starts_with(defaults_path_ + "."));
  });
}

bool TomlTable::has_errors(std::string_view key) const {
  return std::ranges::any_of(
      shared_->diagnostics,
      [path = shared_->shown(dotted(key)), line = error_at(key, {}).line](const Error& error) {
        return error.key == path && error.line == line;
      });
}

void TomlTable::report_unknown(std::string_view key, const std::vector<std::string>& known) {
  if (shared_->diagnostics.size() > bounds::kErrors.most) return error(key, "unknown key");
  error(key, "unknown key", suggest(key, known));
  const std::string meant = nearest(key, known);
  if (meant.empty()) return;
  shared_->meant.insert(dotted(meant));
  std::erase_if(shared_->diagnostics, [&](const Error& other) {
    return other.message == kMissing && other.key == shared_->shown(dotted(meant)) &&
           other.line == line();
  });
}

void TomlTable::finish() {
  std::set<std::string, std::less<>> all = asked_;
  all.insert(looked_for_.begin(), looked_for_.end());
  const std::vector<std::string> known(all.begin(), all.end());
  for (const auto& [key, node] : *table_) {
    if (!asked_.contains(key.str()) && !has_errors(key.str())) report_unknown(key.str(), known);
  }
}

bool TomlTable::holds_only(const std::vector<std::string>& known) {
  bool no_table = true;
  for (const auto& [key, node] : *table_) {
    if (std::ranges::find(known, key.str()) != known.end()) continue;
    report_unknown(key.str(), known);
    no_table = no_table && !node.is_table() && !node.is_array_of_tables();
  }
  return no_table;
}

bool TomlTable::holds_tables() {
  const toml::node* first = nullptr;
  std::string_view outside;
  for (const auto& [key, node] : *table_) {
    if (node.is_table()) continue;
    if (first != nullptr && first->source().begin.line < node.source().begin.line) continue;
    first = &node;
    outside = key.str();
  }
  if (first != nullptr) {
    error(outside, "belongs in a table with a name",
          "write [" + header_of(path_) + ".NAME] above it");
  }
  return first == nullptr && table_ != &kBroken;
}

bool TomlTable::check_number(std::string_view key, const toml::node& node, Range range,
                             double& out) {
  if (!node.is_number()) {
    error(key, "must be a number, not " + kind(node));
    return false;
  }
  const std::optional<double> exact = node.value<double>();
  if (!exact) {
    error(key, "no double is exactly this integer", "write it with a decimal point");
    return false;
  }
  const double value = *exact;
  if (!std::isfinite(value)) {
    error(key, "must be finite");
    return false;
  }
  const bool too_large =
      range.max < kAnyNumber.max && value > range.max;  // its own limit says more
  const bool far = std::abs(value) > kLargest || std::abs(value) < 1.0 / kLargest;
  if (value != 0.0 && far && !too_large) {
    error(key, number_text(value) + " is far out of range", "give 0, or a size of 1e-30 to 1e30");
    return false;
  }
  if (value < range.min || (range.open_min && value <= range.min) || value > range.max) {
    std::string want = range.open_min ? "greater than " + number_text(range.min)
                                      : "at least " + number_text(range.min);
    if (range.min <= kAnyNumber.min) want.clear();
    if (range.max < kAnyNumber.max) {
      want += (want.empty() ? "" : " and ") + std::string("at most ") + number_text(range.max);
    }
    error(key, number_text(value) + " is out of range", "must be " + want);
    return false;
  }
  out = value;
  return true;
}

double TomlTable::number(std::string_view key, Range range) {
  double value = 0.0;
  if (const toml::node* node = require(key)) check_number(key, *node, range, value);
  return value;
}

double TomlTable::number_or(std::string_view key, double value, Range range) {
  if (const toml::node* node = find(key)) check_number(key, *node, range, value);
  return value;
}

std::int64_t TomlTable::integer(std::string_view key, std::int64_t min, std::int64_t max) {
  return require(key) == nullptr ? 0 : integer_or(key, 0, min, max);
}

std::int64_t TomlTable::integer_or(std::string_view key, std::int64_t value, std::int64_t min,
                                   std::int64_t max) {
  const toml::node* node = find(key);
  if (node == nullptr) return value;
  if (!node->is_integer()) {
    error(key, "must be an integer, not " + kind(*node));
    return value;
  }
  const std::int64_t found = *node->value<std::int64_t>();
  if (found < min || found > max) {
    error(key, std::to_string(found) + " is out of range",
          "must be " + std::to_string(min) + " to " + std::to_string(max));
    return value;
  }
  return found;
}

bool TomlTable::boolean_or(std::string_view key, bool value) {
  const toml::node* node = find(key);
  if (node == nullptr) return value;
  if (!node->is_boolean()) {
    error(key, "must be true or false, not " + kind(*node));
    return value;
  }
  return *node->value<bool>();
}

std::string TomlTable::text(std::string_view key) {
  return require(key) == nullptr ? std::string() : text_or(key, {});
}

std::string TomlTable::text_or(std::string_view key, std::string value) {
  const toml::node* node = find(key);
  if (node == nullptr) return value;
  if (!node->is_string()) {
    error(key, "must be a text in quotes, not " + kind(*node));
    return value;
  }
  std::string found = *node->value<std::string>();
  if (found.empty()) error(key, "must not be empty");
  return found;
}

std::string TomlTable::choice(std::string_view key, const std::vector<std::string>& allowed) {
  const std::size_t errors = shared_->diagnostics.size();
  if (require(key) != nullptr) return choice_or(key, {}, allowed);
  if (shared_->diagnostics.size() > errors) {
    std::string& hint = shared_->diagnostics.back().hint;
    for (const std::string& one : allowed) hint += (&one == &allowed.front() ? ": " : ", ") + one;
  }
  return {};
}

std::string TomlTable::choice_or(std::string_view key, std::string value,
                                 const std::vector<std::string>& allowed) {
  std::string found = text_or(key, value);
  if (found == value) return value;
  if (found.empty()) {  // which text_or() has said
    Diagnostics& said = shared_->diagnostics;
    if (!said.empty() && said.back().key == shared_->shown(dotted(key)))
      said.back().hint = suggest(found, allowed);
    return value;
  }
  for (const std::string& one : allowed) {
    if (found == one) return found;
  }
  error(key, "'" + found + "' is not one of the choices", suggest(found, allowed));
  return value;
}

std::vector<double> TomlTable::numbers(std::string_view key, std::size_t size, Range range) {
  if (require(key) == nullptr) return std::vector<double>(size, 0.0);
  return numbers_or(key, std::vector<double>(size, 0.0), range, size);
}

std::vector<double> TomlTable::numbers_or(std::string_view key, std::vector<double> value,
                                          Range range, std::size_t size) {
  const toml::node* node = find(key);
  if (node == nullptr) return value;
  const toml::array* array = node->as_array();
  const std::string exactly = size == 0 ? "" : "give exactly " + std::to_string(size);
  if (array == nullptr) {
    error(key, "must be a list of numbers in brackets, not " + kind(*node), exactly);
    return value;
  }
  if (size != 0 && array->size() != size) {
    error(key, "has " + std::to_string(array->size()) + " numbers", exactly);
    return value;
  }
  std::vector<double> found;
  for (const toml::node& element : *array) {
    double number = 0.0;
    check_number(key, element, range, number);
    found.push_back(number);
  }
  return found;
}

std::vector<std::string> TomlTable::texts_or(std::string_view key, std::vector<std::string> value) {
  const toml::node* node = find(key);
  if (node == nullptr) return value;
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    error(key, "must be a list of texts, not " + kind(*node));
    return value;
  }
  std::vector<std::string> found;
  for (const toml::node& element : *array) {
    if (!element.is_string()) {
      error(key, "must hold texts only, not " + kind(element));
      continue;
    }
    found.push_back(*element.value<std::string>());
  }
  return found;
}

std::vector<std::string> TomlTable::value_texts(std::string_view key) {
  const toml::node* node = require(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  const bool values =
      array != nullptr && !array->empty() && std::ranges::none_of(*array, [](const auto& one) {
        return one.is_table() ||
               (one.is_floating_point() && !std::isfinite(**one.as_floating_point()));
      });
  if (!values) {
    error(key, "must be a list of values in brackets", "such as [1, 2.5], or [\"a\", \"b\"]");
    return {};
  }
  std::vector<std::string> found;
  for (const toml::node& element : *array) found.push_back(value_text(element));
  return found;
}

std::vector<std::vector<double>> TomlTable::rows(std::string_view key, std::size_t columns) {
  const toml::node* node = require(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    error(key, "must be a list of lists of numbers, not " + kind(*node));
    return {};
  }
  std::vector<std::vector<double>> found;
  for (const toml::node& element : *array) {
    const toml::array* row = element.as_array();
    if (columns == 0 && row != nullptr) columns = row->size();
    if (row == nullptr || row->size() != columns) {
      error(key, "each row must be a list of " + std::to_string(columns) + " numbers");
      continue;
    }
    std::vector<double>& out = found.emplace_back();
    for (const toml::node& one : *row) {
      double number = 0.0;
      check_number(key, one, kAnyNumber, number);
      out.push_back(number);
    }
  }
  return found;
}

TomlTable TomlTable::table(std::string_view key) {
  if (require(key) == nullptr) return {shared_, &kBroken, dotted(key), line()};
  return table_or_empty(key);
}

TomlTable TomlTable::table_or_empty(std::string_view key) {
  const toml::node* node = find(key);
  if (node == nullptr) {
    return {shared_, table_ == &kBroken ? &kBroken : &kEmpty, dotted(key), line()};
  }
  if (const toml::table* found = node->as_table()) {
    return {shared_, found, dotted(key), line(key)};
  }
  error(key, "must be a table, not " + kind(*node), "write [" + header_of(dotted(key)) + "]");
  return {shared_, &kBroken, dotted(key), line(key)};
}

std::string TomlTable::json(std::string_view key) {
  const toml::node* node = require(key);
  if (node == nullptr) return {};
  const toml::table* found = node->as_table();
  if (found == nullptr) {
    error(key, "must be a table, not " + kind(*node), "write { key = value }");
    return {};
  }
  return json_text(*found);
}

/// Errors call an entry by a name that no other of the list has, and else by its number.
std::vector<TomlTable> TomlTable::tables(std::string_view key, std::string_view named_by) {
  const toml::node* node = find(key);
  if (node == nullptr) return {};
  const toml::array* array = node->as_array();
  if (array == nullptr || !array->is_homogeneous<toml::table>()) {
    error(key, "must be an array of tables", "write [[" + header_of(dotted(key)) + "]]");
    return {};
  }
  if (array->size() > bounds::kTomlTables.most) {
    Error many = beyond(bounds::kTomlTables);
    error(key, std::move(many.message), std::move(many.hint));
    return {};
  }
  std::vector<std::string> names;
  for (const toml::node& entry : *array) names.push_back(name_of(*entry.as_table(), named_by));
  std::vector<TomlTable> found;
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::table* table = array->get(i)->as_table();
    const std::string path = dotted(key) + "[" + std::to_string(i) + "]";
    if (!names[i].empty() && std::ranges::count(names, names[i]) == 1) {
      shared_->names[path] = names[i];
    }
    const auto line = static_cast<int>(table->source().begin.line);
    found.push_back(TomlTable(shared_, table, path, shared_->set.line_of_file(line)));
  }
  return found;
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, node] : *table_) names.emplace_back(key.str());
  return names;
}

std::map<std::string, std::string> TomlTable::values() const {
  std::map<std::string, std::string> all;
  add_values(*table_, {}, all);
  return all;
}

std::string TomlTable::folder() const {
  const std::string folder = std::filesystem::path(shared_->file).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace tandem
