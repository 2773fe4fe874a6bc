// tandem controller: what it asks a running run, and its answer.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "apps/clients/asked.hpp"
#include "apps/text/console.hpp"
#include "base/open_file.hpp"
#include "base/toml_reader.hpp"

namespace tandem::apps {
namespace {

/// Where the first table of a TOML file begins, behind which no line belongs to its top level; its
/// end, when it has none or is no TOML (the run then says where it is wrong).
std::size_t end_of_top_level(const std::string& text, const std::string& file) {
  const auto document = TomlDocument::parse(text, file);
  if (!document) return text.size();
  std::size_t end = text.size();
  for (const std::string& key : document->root().keys()) {
    std::size_t begin = 0;
    for (int line = document->root().line(key); line > 1; --line)
      begin = text.find('\n', begin) + 1;
    const std::size_t first = text.find_first_not_of(" \t", begin);
    if (text[first] == '[') end = std::min(end, begin);  // and not KEY = VALUE
  }
  return end;
}

std::string without_blanks(const std::string& text) {
  const std::size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? ""
                                    : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// A number, true or false, a list, else a word: the run says whether it fits.
Json value_of(const std::string& text) {
  if (text.starts_with('[')) {
    Json list = Json::parse(text, nullptr, false);
    return list.is_array() ? list : Json(text);
  }
  if (text == "true" || text == "false") return text == "true";
  double number = 0.0;
  const char* last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error == std::errc() && end == last && std::isfinite(number)) return number;
  return text;
}

std::string shown_value(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_array()) {
    std::string all;
    for (const Json& one : value) all += (all.empty() ? "" : ", ") + shown_value(one);
    return all;
  }
  return value.is_string()   ? value.get<std::string>()
         : value.is_number() ? fmt::format("{:g}", value.get<double>())
                             : value.dump();
}

/// "0 to 500", "> 0".
std::string shown_limits(const Json& one) {
  const Json &min = one["min"], &max = one["max"];
  const std::string above = one.value("above_min", false) ? "> " : "";
  if (!min.is_null() && !max.is_null()) return above + shown_value(min) + " to " + shown_value(max);
  if (!min.is_null()) return (above.empty() ? ">= " : above) + shown_value(min);
  return max.is_null() ? "" : "<= " + shown_value(max);
}

/// "0 to 500, whole", "stiff, compliant".
std::string shown_range(const Json& one) {
  if (one["choices"].size() > 0)
    return fmt::format("{}", fmt::join(one["choices"].get<std::vector<std::string>>(), ", "));
  const std::string limits = shown_limits(one);
  if (one.value("type", "") != "integer") return limits;
  return limits.empty() ? "whole" : limits + ", whole";
}

/// A list as one parameter where its elements are alike, else each of them.
std::vector<Json> rows_of(const Json& parameter) {
  const Json& elements = parameter["elements"];
  std::vector<Json> rows;
  bool alike = true;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    Json& row = rows.emplace_back(parameter);
    row["name"] = parameter.value("name", "") + "." + elements[i].get<std::string>();
    for (const char* key : {"min", "max", "default", "value"}) {
      row[key] = parameter[key][i];
      alike = alike && parameter[key][i] == parameter[key][0];
    }
  }
  if (rows.empty()) return {parameter};
  if (!alike) return rows;
  rows.resize(1);
  rows[0]["name"] = parameter["name"];
  rows[0]["doc"] = fmt::format("{} ({} elements)", parameter.value("doc", ""), elements.size());
  return rows;
}

}  // namespace

/// The parameters are the file with what --set adds to it, below its own keys: the lines of errors
/// in those stay.
Status ask_for_load(const AskedOptions& options, Json& question) {
  std::string text, added;
  const std::string file = question.value("parameters_file", "");
  if (!file.empty()) {
    Result<std::string> read = read_file(file, "name a .toml file", kMostTomlBytes);
    if (!read) return std::unexpected(read.error());
    text = std::move(*read) + '\n';
  }
  for (const Json& line : options.given.value("set", Json::array())) {
    added += line.get<std::string>() + '\n';
  }
  text.insert(end_of_top_level(text, file), added);
  if (!text.empty()) question["parameters"] = text;
  const auto plugin = question["plugin"].get<std::string>();
  if (plugin.find('/') != std::string::npos) {
    question["plugin"] = std::filesystem::absolute(plugin).string();
  }
  return {};
}

/// "kp=40", "mode = torque".
Status ask_for_set(const AskedOptions& options, Json& question) {
  question["name"] = options.given["controller"];
  Json& parameters = question["parameters"] = Json::object();
  for (const Json& one : options.given["values"]) {
    const auto word = one.get<std::string>();
    const std::size_t equals = word.find('=');
    const std::string name = without_blanks(word.substr(0, equals));
    if (equals == std::string::npos || name.empty()) {
      return fail("'" + word + "' is not NAME=VALUE", "write kp=40");
    }
    if (parameters.contains(name)) return fail_at(name, "is named twice", "name it once");
    parameters[name] = value_of(without_blanks(word.substr(equals + 1)));
  }
  return {};
}

Status ask_for_show(const AskedOptions& options, Json& question) {
  question["name"] = options.given["controller"];
  return {};
}

Status ask_for_start(const AskedOptions& options, Json& question) {
  const auto names = options.given.find("names");
  if (names != options.given.end()) question = {{"do", "controller.switch"}, {"start", *names}};
  return {};
}

Status ask_for_stop(const AskedOptions& options, Json& question) {
  question = {{"do", "controller.switch"}, {"stop", options.given["names"]}};
  return {};
}

void print_controllers(const Json& answer) {
  Table table(
      {"controller", "state", "joints", "plugin", "p50 [us]", "p99 [us]", "max [us]", "overruns"});
  table.align_left();
  for (const Json& one : answer["controllers"]) {
    const bool active = one.value("active", false);
    const char* state = one.value("shadow", false)     ? "shadow"
                        : !active                      ? "inactive"
                        : one.value("finished", false) ? "done"
                                                       : "active";
    std::vector<std::string> joints;
    for (const Json& claim : one["claims"]) joints.push_back(claim.value("joint", ""));
    const std::size_t count = joints.size();
    if (count > 4) joints.resize(3);
    std::string text = fmt::format("{}", fmt::join(joints, ", "));
    if (count > joints.size()) text += fmt::format(" and {} more", count - joints.size());
    const Json times = one.value("call_ns", Json());
    const auto us = [&](const char* which) {
      return times.is_null() ? std::string("-")
                             : fmt::format("{:.1f}", 1e-3 * times.value(which, 0.0));
    };
    table.add({one.value("name", ""), state, text,
               std::filesystem::path(one.value("plugin", "")).filename().string(), us("p50"),
               us("p99"), us("max"), fmt::format("{}", one.value("overruns", 0))});
  }
  table.print(stdout);
}

void print_controller(const Json& answer) {
  for (const Json& one : answer["controllers"]) {
    print_controllers({{"controllers", Json::array({one})}});
    if (one["parameters"].empty()) {
      fmt::print("it declares no parameters\n");
      continue;
    }
    Table table({"parameter", "value", "unit", "range", "default", "set", ""});
    table.align_left();
    for (const Json& parameter : one["parameters"]) {
      for (const Json& row : rows_of(parameter)) {
        const bool required = row.value("required", false);
        table.add({row.value("name", ""), shown_value(row["value"]), row.value("unit", ""),
                   shown_range(row), required ? "required" : shown_value(row["default"]),
                   row.value("live", false) ? "live" : "at load", row.value("doc", "")});
      }
    }
    fmt::print("\n");
    table.print(stdout);
  }
}

void print_set(const Json& answer) {
  tell_done(answer);
  Facts facts;
  for (const auto& [name, value] : answer["values"].items()) facts.add(name, shown_value(value));
  facts.print(stdout);
}

/// "done in cycle 1200; active: squat"; "selected in cycle 1200: squat; not started yet: …".
void print_switched(const Json& answer) {
  const std::vector<std::string> active =
      answer.value("active", Json::array()).get<std::vector<std::string>>();
  const std::string names =
      active.empty() ? "none" : shown(fmt::format("{}", fmt::join(active, ", ")), 2'000);
  const std::string note = shown(answer.value("note", ""), 2'000);
  if (answer.value("done", false) && !note.empty()) {
    fmt::print("selected in cycle {}: {}; {}\n", answer.value("cycle", 0), names, note);
  } else if (answer.value("done", false)) {
    fmt::print("done in cycle {}; active: {}\n", answer.value("cycle", 0), names);
  } else {
    fmt::print("{}; active so far: {}\n", note, names);
  }
}

/// "nod: the new build goes on in cycle 1200 with the state of the former one".
void print_reloaded(const Json& answer) {
  const std::string name = shown(answer.value("name", ""), 2'000);
  const char* build = answer.value("changed", true) ? "the new build" : "the same build as before";
  if (!answer.value("done", false)) {
    fmt::print("{}: {}\n", name, shown(answer.value("note", ""), 2'000));
  } else if (answer.value("carried", false)) {
    fmt::print("{}: {} goes on in cycle {} with the state of the former one\n", name, build,
               answer.value("cycle", 0));
  } else {
    fmt::print("{}: {} starts afresh in cycle {}: {}\n", name, build, answer.value("cycle", 0),
               shown(answer.value("afresh", ""), 2'000));
  }
  for (const Json& one : answer.value("left", Json::array()))
    fmt::print("  {}\n", shown(one.get<std::string>(), 2'000));
}

Result<Exit> tell_loaded(Asked& asked) {
  if (asked.has("start")) {
    const std::string name = asked.answer.value("name", "");
    Result<Json> started = asked.run.ask({{"do", "controller.start"}, {"name", name}});
    if (!started) return std::unexpected(started.error());
    asked.answer = std::move(*started);
  }
  if (asked.prints()) print_switched(asked.answer);
  return Exit::kDone;
}

}  // namespace tandem::apps
