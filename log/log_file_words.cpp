// In words: what of a run a log does not have and why, and which topic a name means.
#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <utility>

#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "log/log_file.hpp"

namespace tandem::log {
namespace {

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

/// "1.234"
std::string seconds_text(std::int64_t time_ns) {
  std::array<char, 32> number{};
  std::snprintf(number.data(), number.size(), "%.3f", static_cast<double>(time_ns) * 1e-9);
  return number.data();
}

std::unexpected<Error> refusal(const std::string& file, std::string message, std::string hint) {
  return std::unexpected(
      Error{.message = std::move(message), .hint = std::move(hint), .file = file, .key = {}});
}

}  // namespace

std::string LogFile::cut_reason() const {
  return reason_of_cut(std::ranges::any_of(parts_, &LogPart::being_written));
}

std::string LogFile::cut_remark() const {
  if (!parts_.back().truncated) return {};  // what an earlier part lacks is one of gaps()
  const std::string text = "the log is cut: " + cut_reason();
  if (messages() == 0) return text + "; no message can be read";
  return text + "; what can be read ends at " + seconds_text(parts_.back().last_ns) + " s";
}

std::vector<std::string> LogFile::damage() const {
  constexpr std::size_t kSaid = 5;
  std::vector<std::string> all;
  std::size_t more = 0;
  for (const LogPart& part : parts_) {
    for (const Damage& one : part.damage) {
      if (all.size() == kSaid && ++more > 0) continue;
      all.push_back((parts_.size() > 1 ? part.path + ": " : "") + to_string(one));
    }
  }
  if (more > 0) all.push_back(std::to_string(more) + " more damaged places");
  return all;
}

bool LogFile::damage_loses_messages() const {
  return std::ranges::any_of(parts_, [](const LogPart& part) {
    return std::ranges::any_of(part.damage, &Damage::loses_messages);
  });
}

StringMap LogFile::shown_result() const {
  StringMap all;
  for (const auto& [key, value] : result_) {
    if (key == "data_sha256") continue;
    const std::string here = std::to_string(messages());
    if (key == "messages" && value != here) {
      all.emplace_back(key, here + " of " + value);
      continue;
    }
    for (std::size_t begin = 0; begin <= value.size();) {
      const std::size_t end = std::min(value.find('\n', begin), value.size());
      all.emplace_back(key, value.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  return all;
}

std::vector<std::string> LogFile::remarks() const {
  std::vector<std::string> all = gaps();
  for (std::string& one : damage()) all.push_back(std::move(one));
  return all;
}

std::vector<std::string> LogFile::gaps() const {
  if (info_.part > 0) {
    const auto name = part_of(path_);
    return {"this is part " + std::to_string(info_.part) + " of a log in several files" +
            (name ? ": " + name->all + " opens all of them" : "")};
  }
  std::vector<std::string> all;
  if (!info_.reduced.empty()) all.push_back("this log is reduced " + info_.reduced);
  if (!missing_.empty()) {
    std::string text;
    for (const MissingParts& one : missing_) text += (text.empty() ? "" : ", ") + to_string(one);
    text = "the log lacks " + text + "; what is here is from ";
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const bool follows = i > 0 && parts_[i - 1].number + 1 == parts_[i].number;
      if (!follows)
        text += (i == 0 ? "" : " and from ") + seconds_text(parts_[i].first_ns) + " s to ";
      const bool ends = i + 1 == parts_.size() || parts_[i].number + 1 != parts_[i + 1].number;
      if (ends) text += seconds_text(parts_[i].last_ns) + " s";
    }
    all.push_back(std::move(text));
  }
  for (std::size_t i = 0; i + 1 < parts_.size(); ++i) {  // the last one's end is truncated()
    if (!parts_[i].truncated) continue;
    all.push_back(parts_[i].path + " is cut: nothing is here from " +
                  seconds_text(parts_[i].last_ns) + " s to " +
                  seconds_text(parts_[i + 1].first_ns) + " s");
  }
  return all;
}

Status LogFile::require_samples() const {
  if (info_.reduced.empty()) return {};
  return refusal(path_, "this log lacks samples: it is reduced " + info_.reduced,
                 "give the log that it was made of");
}

Result<const LoggedTopic*> LogFile::require(const std::string& name) const {
  if (const LoggedTopic* topic = find(name)) return topic;
  if (truncated()) {
    return refusal(path_,
                   "the log is cut after " + std::to_string(bytes()) +
                       " bytes, before a message of '" + name + "'",
                   hint_of_cut(std::ranges::any_of(parts_, &LogPart::being_written)));
  }
  const std::string why = left_out(name);
  return refusal(path_, "has no topic '" + name + "'" + (why.empty() ? "" : ": " + why),
                 why.empty() ? suggest_topic(name, topics_) : "");
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

}  // namespace tandem::log
