// open() reads the whole file once, for its topics and the data hash; read() streams it again for
// the columns that are asked for.
#include "log/log_file.hpp"

#include <utility>

#include "base/bounds.hpp"
#include "base/nearest.hpp"
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
  std::vector<std::string> names;
  for (const LoggedTopic& topic : topics_) names.push_back(topic.name);
  return std::unexpected(at(path_, "has no topic '" + name + "'", suggest(name, names)));
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
      return std::unexpected(
          at(path_, name + " has no field '" + column.field + "'", suggest(column.field, names)));
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
