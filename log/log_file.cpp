// open() reads every file once, for its topics and the data hash; read() streams them again for the
// columns that are asked for.
#include "log/log_file.hpp"

#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/bounds.hpp"
#include "base/nearest.hpp"
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

/// What writes it has a lock on it (McapWriter::open).
bool is_being_written(const Descriptor& file) {
  if (::flock(file.get(), LOCK_SH | LOCK_NB) != 0) return errno == EWOULDBLOCK;
  ::flock(file.get(), LOCK_UN);
  return false;
}

/// Topics that each file has once for viewers: the whole log has them once, too.
bool is_repeated(const std::string& topic) {
  return topic == "/robot_description" || topic == "/tf_static";
}

/// Whether both files say the same of their run.
bool is_same_run(RunInfo a, const RunInfo& b) {
  a.part = b.part;
  return to_map(a) == to_map(b);
}

StringMap without(StringMap map, std::string_view key) {
  std::erase_if(map, [key](const auto& one) { return one.first == key; });
  return map;
}

}  // namespace

struct LogFile::Beginning {
  std::string path;
  std::shared_ptr<const Descriptor> file;
  McapReader reader;
  std::optional<MessageView> first;  // valid until the reader's next
  RunInfo info;
};

Result<LogFile::Beginning> LogFile::begin(const std::string& path) {
  Result<Descriptor> file = open_to_read(path, "name a log of `tandem run`");
  if (!file) return std::unexpected(file.error());
  auto shared = std::make_shared<const Descriptor>(std::move(*file));
  auto reader = McapReader::open(shared, path);
  if (!reader) return std::unexpected(reader.error());
  Beginning begun{path, std::move(shared), std::move(*reader), {}, {}};
  auto first = begun.reader.next();
  if (!first) return std::unexpected(first.error());
  begun.first = *first;
  begun.info = info_from(metadata_of(begun.reader, kInfoRecord));
  return begun;
}

/// Counts one more file, to its end.
Status LogFile::add(Beginning file, DataHash& hash) {
  McapReader& reader = file.reader;
  LogPart part{.number = file.info.part, .path = file.path, .bytes = reader.bytes()};
  std::map<std::uint16_t, LoggedTopic> by_channel;
  for (Result<std::optional<MessageView>> message = file.first; message->has_value();) {
    const MessageView& view = **message;
    auto [topic, added] = by_channel.try_emplace(view.channel);
    if (added) {
      topic->second = topic_of(reader, reader.channels().at(view.channel));
      topic->second.first_ns = view.time_ns;
    }
    topic->second.last_ns = view.time_ns;
    if (part.messages++ == 0) part.first_ns = view.time_ns;
    part.last_ns = std::max(part.last_ns, view.time_ns);
    if (parts_.empty() || !is_repeated(topic->second.name)) {
      ++topic->second.messages;
      hash.add(view.channel, view.time_ns, view.data);
    }
    message = reader.next();
    if (!message) return std::unexpected(message.error());
  }
  for (const auto& [id, channel] : reader.channels()) {
    if (!by_channel.contains(id)) by_channel[id] = topic_of(reader, channel);
  }
  for (auto& [id, topic] : by_channel) {
    const auto known = std::ranges::find(topics_, topic.name, &LoggedTopic::name);
    if (parts_.empty() || known == topics_.end()) {
      topics_.push_back(std::move(topic));
    } else if (topic.messages > 0) {
      if (known->messages == 0) known->first_ns = topic.first_ns;
      known->last_ns = topic.last_ns;
      known->messages += topic.messages;
    }
  }
  if (parts_.empty()) {
    info_ = info_from(metadata_of(reader, kInfoRecord));
    info_.configuration = metadata_of(reader, kConfigurationRecord);
  }
  result_ = metadata_of(reader, kResultRecord);
  part.damage = reader.damage();
  part.truncated = reader.truncated();
  part.being_written = part.truncated && is_being_written(*file.file);
  if (part.truncated && by_channel.empty() && reader.metadata().empty()) {
    return std::unexpected(at(
        file.path,
        "the log is cut after " + std::to_string(part.bytes) + " bytes, before anything of its run",
        hint_of_cut(part.being_written)));
  }
  parts_.push_back(std::move(part));
  files_.push_back(std::move(file.file));
  return {};
}

/// All files of the run that have the name of all; but those that are here already. One that was
/// removed meanwhile, cannot be read, or is of another run, is none.
Status LogFile::add_siblings(const std::string& name, DataHash& hash) {
  for (const auto& [number, path] : parts_of(name)) {
    if (!parts_.empty() && number <= parts_.back().number) continue;
    auto file = begin(path);
    if (!file || file->info.part != number) continue;  // missing_of() says so
    if (!parts_.empty() && !is_same_run(info_, file->info)) continue;
    if (parts_.size() == bounds::kLogParts.most)
      return std::unexpected(beyond(bounds::kLogParts, name));
    if (Status added = add(std::move(*file), hash); !added) return added;
  }
  return {};
}

/// What is said of all files together.
void LogFile::finish(DataHash& hash) {
  for (const LoggedTopic& topic : topics_)
    if (topic.name == "/tandem/state" && !fits(topic, info_.period_ns)) info_.period_ns = 0;
  if (parts_.size() > 1 && !result_.empty()) {
    result_ = without(without(result_, "data_sha256"), "messages");
    result_.emplace_back("messages", std::to_string(messages()));
  }
  data_sha256_ = hash.finish();
}

Result<LogFile> LogFile::open(const std::string& path) {
  LogFile log;
  log.path_ = path;
  DataHash hash;
  auto file = begin(path);
  const auto part = part_of(path);
  bool all = true;
  if (!file && part && part->number == 1) {  // the first file alone
    auto first = begin(part->all);
    if (first && first->info.part == 1) file = std::move(first), all = false;
  }
  if (file) {
    all = all && file->info.part == 1;
    if (Status added = log.add(std::move(*file), hash); !added)
      return std::unexpected(added.error());
  }
  if (!file || all) {
    if (Status added = log.add_siblings(path, hash); !added) return std::unexpected(added.error());
    if (log.parts_.empty()) return std::unexpected(file.error());
    log.info_.part = 0;
    const bool goes_on = !value_of(log.result_, "continued").empty();
    log.missing_ = missing_of(log.parts_, goes_on);
  }
  log.finish(hash);
  return log;
}

Status LogFile::check(const std::string& path) {
  const auto file = begin(path);
  if (file) return {};
  const auto part = part_of(path);
  if (part && part->number == 1 && begin(part->all)) return {};
  for (const auto& [number, sibling] : parts_of(path)) {
    if (begin(sibling)) return {};
  }
  return std::unexpected(file.error());
}

bool LogFile::truncated() const { return std::ranges::any_of(parts_, &LogPart::truncated); }

std::uint64_t LogFile::bytes() const {
  std::uint64_t bytes = 0;
  for (const LogPart& part : parts_) bytes += part.bytes;
  return bytes;
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

Status LogFile::visit(
    const std::function<Status(const McapReader&, const MessageView&)>& visit) const {
  for (std::size_t i = 0; i < files_.size(); ++i) {
    auto reader = McapReader::open(files_[i], parts_[i].path);
    if (!reader) return std::unexpected(reader.error());
    for (;;) {
      auto message = reader->next();
      if (!message) return std::unexpected(message.error());
      if (!message->has_value()) break;
      if (i > 0 && is_repeated(reader->channels().at((*message)->channel).topic)) continue;
      if (Status visited = visit(*reader, **message); !visited) {
        if (visited.error().file.empty()) visited.error().file = parts_[i].path;
        return visited;
      }
    }
  }
  return {};
}

Status LogFile::for_each(
    const std::string& name,
    const std::function<void(std::int64_t, std::span<const std::byte>)>& each) const {
  const auto topic = require(name);
  if (!topic) return std::unexpected(topic.error());
  const std::size_t expected = kCdrHeader.size() + (*topic)->layout.bytes();
  return visit([&](const McapReader& reader, const MessageView& view) -> Status {
    if (reader.channels().at(view.channel).topic != name) return {};
    if (view.data.size() < expected)
      return fail("a message of " + name + " is shorter than its type");
    each(view.time_ns, view.data.subspan(kCdrHeader.size()));
    return {};
  });
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
