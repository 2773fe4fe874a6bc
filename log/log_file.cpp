// open() reads the whole file once, for its topics and the data hash; read() streams it again for
// the columns that are asked for.
#include "log/log_file.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/bounds.hpp"
#include "base/nearest.hpp"
#include "base/toml_reader.hpp"
#include "log/data_hash.hpp"
#include "log/mcap_reader.hpp"
#include "log/schema.hpp"

namespace tandem::log {
namespace {

LoggedTopic topic_of(const McapReader& reader, const ChannelRecord& channel) {
  LoggedTopic topic;
  topic.name = channel.topic;
  topic.encoding = channel.message_encoding;
  const auto schema = reader.schemas().find(channel.schema_id);
  if (schema == reader.schemas().end()) return topic;
  topic.type = schema->second.name;
  if (schema->second.encoding != "ros2msg" || topic.encoding != "cdr") return topic;
  if (auto layout = layout_of(schema->second.text)) topic.layout = std::move(*layout);
  return topic;
}

StringMap metadata_of(const McapReader& reader, const std::string& name) {
  const auto found = reader.metadata().find(name);
  return found == reader.metadata().end() ? StringMap{} : found->second;
}

Error at(const std::string& file, std::string message, std::string hint = {}) {
  return {.message = std::move(message), .hint = std::move(hint), .file = file, .key = {}};
}

/// Whether the topic's messages can be a period apart, some of them being left out.
bool fits(const LoggedTopic& topic, std::int64_t period_ns) {
  const double apart_ns = static_cast<double>(topic.last_ns) - static_cast<double>(topic.first_ns);
  const double cycles = apart_ns / static_cast<double>(period_ns);
  return topic.messages < 2 || cycles / static_cast<double>(topic.messages) <=
                                   static_cast<double>(bounds::kReplayCycles.most);
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

constexpr char kCutHint[] = "its run was killed, or the copy is not whole: copy it again";

}  // namespace

Result<LogFile> LogFile::open(const std::string& path) {
  Result<Descriptor> file = open_to_read(path, "name a log of `tandem run`");
  if (!file) return std::unexpected(file.error());
  LogFile log;
  log.path_ = path;
  log.file_ = std::make_shared<const Descriptor>(std::move(*file));
  auto reader = McapReader::open(log.file_, path);
  if (!reader) return std::unexpected(reader.error());
  std::map<std::uint16_t, LoggedTopic> by_channel;
  DataHash hash;
  for (;;) {
    auto message = reader->next();
    if (!message) return std::unexpected(message.error());
    if (!message->has_value()) break;
    const MessageView& view = **message;
    auto [topic, added] = by_channel.try_emplace(view.channel);
    if (added) {
      topic->second = topic_of(*reader, reader->channels().at(view.channel));
      topic->second.first_ns = view.time_ns;
    }
    topic->second.last_ns = view.time_ns;
    ++topic->second.messages;
    hash.add(view.channel, view.time_ns, view.data);
  }
  for (const auto& [id, channel] : reader->channels()) {
    if (!by_channel.contains(id)) by_channel[id] = topic_of(*reader, channel);
  }
  for (auto& [id, topic] : by_channel) log.topics_.push_back(std::move(topic));
  log.info_ = info_from(metadata_of(*reader, kInfoRecord));
  for (const LoggedTopic& topic : log.topics_)
    if (topic.name == "/tandem/state" && !fits(topic, log.info_.period_ns)) log.info_.period_ns = 0;
  log.info_.configuration = metadata_of(*reader, kConfigurationRecord);
  log.result_ = metadata_of(*reader, kResultRecord);
  log.truncated_ = reader->truncated();
  log.bytes_ = reader->bytes();
  if (log.truncated_ && log.topics_.empty() && reader->metadata().empty()) {
    return std::unexpected(at(
        path,
        "the log is cut after " + std::to_string(log.bytes_) + " bytes, before anything of its run",
        kCutHint));
  }
  log.data_sha256_ = hash.finish();
  return log;
}

const LoggedTopic* LogFile::find(std::string_view name) const {
  for (const LoggedTopic& topic : topics_) {
    if (topic.name == name) return &topic;
  }
  return nullptr;
}

std::uint64_t LogFile::messages() const {
  std::uint64_t count = 0;
  for (const LoggedTopic& topic : topics_) count += topic.messages;
  return count;
}

Result<const LoggedTopic*> LogFile::require(const std::string& name) const {
  if (const LoggedTopic* topic = find(name)) return topic;
  if (truncated_) {
    return std::unexpected(at(path_,
                              "the log is cut after " + std::to_string(bytes_) +
                                  " bytes, before a message of '" + name + "'",
                              kCutHint));
  }
  const std::string why = left_out(name);
  return std::unexpected(at(path_, "has no topic '" + name + "'" + (why.empty() ? "" : ": " + why),
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

Status LogFile::for_each(
    const std::string& name,
    const std::function<void(std::int64_t, std::span<const std::byte>)>& visit) const {
  const auto topic = require(name);
  if (!topic) return std::unexpected(topic.error());
  auto reader = McapReader::open(file_, path_);
  if (!reader) return std::unexpected(reader.error());
  for (;;) {
    auto message = reader->next();
    if (!message) return std::unexpected(message.error());
    if (!message->has_value()) return {};
    const MessageView& view = **message;
    if (reader->channels().at(view.channel).topic != name) continue;
    const std::size_t expected = (*topic)->layout.bytes();
    if (view.data.size() < kCdrHeader.size() + expected) {
      return std::unexpected(at(path_, "a message of " + name + " is shorter than its type"));
    }
    visit(view.time_ns, view.data.subspan(kCdrHeader.size()));
  }
}

Result<TimeSeries> LogFile::read(const std::string& name, const std::vector<Column>& columns,
                                 std::size_t every) const {
  const auto topic = require(name);
  if (!topic) return std::unexpected(topic.error());
  std::vector<const hal::Field*> fields;
  for (const Column& column : columns) {
    const hal::Field* field = (*topic)->layout.find(column.field);
    if (field == nullptr) {
      std::vector<std::string> names;
      for (const hal::Field& one : (*topic)->layout.fields()) names.push_back(one.name);
      const std::string why = left_out(name, column.field);
      return std::unexpected(
          at(path_, name + " has no field '" + column.field + "'" + (why.empty() ? "" : ": " + why),
             why.empty() ? suggest(column.field, names) : ""));
    }
    if (column.index >= field->count) {
      return std::unexpected(at(path_, column.field + " of " + name + " has only " +
                                           std::to_string(field->count) + " elements"));
    }
    fields.push_back(field);
  }
  TimeSeries table;
  table.columns.resize(columns.size());
  std::size_t count = 0;
  const Status done = for_each(name, [&](std::int64_t time_ns, std::span<const std::byte> body) {
    if (count++ % every != 0) return;
    table.time_s.push_back(static_cast<double>(time_ns) * 1e-9);
    for (std::size_t i = 0; i < columns.size(); ++i) {
      table.columns[i].push_back(element(*fields[i], body, columns[i].index));
    }
  });
  if (!done) return std::unexpected(done.error());
  return table;
}

Result<std::vector<EventText>> LogFile::events() const {
  std::vector<EventText> events;
  Status decoded;
  const Status done = for_each("/tandem/event", [&](std::int64_t, std::span<const std::byte> body) {
    auto event = decode_event(body);
    if (!event) {
      decoded = std::unexpected(event.error());
      return;
    }
    events.push_back(std::move(*event));
  });
  if (!done) return std::unexpected(done.error());
  if (!decoded) return std::unexpected(decoded.error());
  return events;
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
