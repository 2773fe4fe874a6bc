// What a log has by name, and why it lacks what is asked for.
#include <algorithm>
#include <iterator>
#include <utility>

#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "log/log_file.hpp"

namespace tandem::log {
namespace {

Error of_log(const std::string& file, std::string message, std::string hint) {
  return {.message = std::move(message), .hint = std::move(hint), .file = file, .key = {}};
}

/// What [log] of the experiment leaves out, in its own words; empty: not this.
std::string left_out_by(TomlTable log, std::string_view topic, std::string_view field) {
  constexpr std::string_view kViewers[] = {"joint_states", "tf", "tf_static", "robot_description"};
  if (!field.empty()) {
    const std::string whole = std::string(topic) + "." + std::string(field);
    const auto without = log.texts_or("without", {});
    return std::ranges::find(without, whole) != without.end() ? "without = [\"" + whole + "\"]"
                                                              : "";
  }
  if (std::ranges::find(kViewers, topic) != std::end(kViewers))
    return log.boolean_or("viewers", true) ? "" : "viewers = false";
  const std::string key = std::string(topic) + "_every";
  return log.has(key) && log.integer_or(key, 1, 0, 1'000'000) == 0 ? key + " = 0" : "";
}

/// The names of topics that end in "/`end`".
std::vector<std::string> ending_in(const std::vector<LoggedTopic>& topics, std::string_view end) {
  std::vector<std::string> names;
  for (const LoggedTopic& topic : topics)
    if (topic.name.ends_with("/" + std::string(end))) names.push_back(topic.name);
  return names;
}

/// The topics that `name` may have meant.
std::string suggest_topic(const std::string& name, const std::vector<LoggedTopic>& topics) {
  std::string_view end = name;
  for (const std::string_view lead : {"/tandem/", "/"})
    if (end.starts_with(lead)) end.remove_prefix(lead.size());
  std::vector<std::string> names = ending_in(topics, end), ends, all;
  for (const LoggedTopic& topic : topics) {
    all.push_back(topic.name);
    for (auto at = topic.name.find('/'); at != std::string::npos; at = topic.name.find('/', at + 1))
      ends.push_back(topic.name.substr(at + 1));
  }
  if (names.empty()) names = ending_in(topics, nearest(end, ends));
  if (names.size() == 1) return "did you mean '" + names.front() + "'?";
  return suggest(name, names.empty() ? all : names);
}

}  // namespace

const LoggedTopic* LogFile::find(std::string_view name) const {
  for (const LoggedTopic& topic : topics_) {
    if (topic.name == name) return &topic;
  }
  return nullptr;
}

Status LogFile::require_samples() const {
  if (info_.reduced.empty()) return {};
  return std::unexpected(of_log(path_, "this log lacks samples: it is reduced " + info_.reduced,
                                "give the log that it was made of"));
}

Result<const LoggedTopic*> LogFile::require(const std::string& name) const {
  if (const LoggedTopic* topic = find(name)) return topic;
  if (truncated()) {
    const bool grows = std::ranges::any_of(parts_, &LogPart::being_written);
    return std::unexpected(
        of_log(path_,
               "the log is cut after " + std::to_string(bytes()) + " bytes, before a message of '" +
                   name + "'",
               cut_reason() + (grows ? ": wait for its end" : ": copy it again")));
  }
  const std::string why = left_out(name);
  return std::unexpected(of_log(path_,
                                "has no topic '" + name + "'" + (why.empty() ? "" : ": " + why),
                                why.empty() ? suggest_topic(name, topics_) : ""));
}

std::string LogFile::full_name(const std::string& name) const {
  if (find(name) != nullptr || name.starts_with('/')) return name;
  for (const std::string lead : {"/tandem/", "/"})
    if (find(lead + name) != nullptr) return lead + name;
  const std::vector<std::string> names = ending_in(topics_, name);
  return names.size() == 1 ? names.front() : "/tandem/" + name;
}

std::string LogFile::left_out(std::string_view topic, std::string_view field) const {
  const bool some = info_.reduced.contains("to some topics");
  if (some && field.empty()) return "this log is reduced " + info_.reduced;
  for (const auto& [file, text] : info_.configuration) {
    if (!file.ends_with(".toml")) continue;
    const Result<TomlDocument> document = TomlDocument::parse(text, file);
    if (!document || !document->root().has("robot")) continue;
    const std::string_view last = topic.substr(topic.rfind('/') + 1);
    const std::string key = left_out_by(document->root().table_or_empty("log"), last, field);
    return key.empty() ? "" : "this log leaves it out ([log] " + key + ")";
  }
  return {};
}

Error same_data(const std::string& path, const std::string& other) {
  return {
      .message = "has the same data as " + other + ", bit by bit",
      .hint =
          "leave one of them out; a simulated robot without noise does the same with every seed",
      .file = path,
      .key = {}};
}

}  // namespace tandem::log
