// Topic by topic, message by message, byte by byte; only the first difference is decoded to a
// signal.
#include "log/compare.hpp"

#include <algorithm>
#include <cstring>

#include "log/schema.hpp"
#include "log/signal_name.hpp"

namespace tandem::log {
namespace {

struct Message {
  std::int64_t time_ns;
  std::vector<std::byte> body;
};

/// The first element whose bytes differ. @pre one does
FirstDifference difference_in(const hal::Layout& layout, const RunInfo& info, const Message& a,
                              std::span<const std::byte> b) {
  if (a.body.size() != b.size()) {
    return {.signal = "length",
            .a = static_cast<double>(a.body.size()),
            .b = static_cast<double>(b.size())};
  }
  for (const hal::Field& field : layout.fields()) {
    const std::size_t size = hal::size_of(field.type);
    if (field.offset + field.count * size > b.size()) break;
    for (std::size_t i = 0; i < field.count; ++i) {
      const std::size_t at = field.offset + i * size;
      if (std::memcmp(a.body.data() + at, b.data() + at, size) == 0) continue;
      return {.signal = signal_name(field, i, info),
              .a = element(field, a.body, i),
              .b = element(field, b, i)};
    }
  }
  // Bytes of a type whose fields have no fixed place, such as sensor_msgs/JointState.
  const auto [in_a, in_b] = std::ranges::mismatch(a.body, b);
  return {.signal = "byte " + std::to_string(in_a - a.body.begin()),
          .a = static_cast<double>(*in_a),
          .b = static_cast<double>(*in_b)};
}

Result<std::vector<Message>> messages_of(const LogFile& file, const std::string& topic) {
  std::vector<Message> all;
  const Status read =
      file.for_each(topic, [&](std::int64_t time_ns, std::span<const std::byte> body) {
        all.push_back({time_ns, {body.begin(), body.end()}});
      });
  if (!read) return std::unexpected(read.error());
  return all;
}

Result<TopicComparison> compare_topic(const LogFile& a, const LogFile& b,
                                      const LoggedTopic& topic) {
  TopicComparison result{.topic = topic.name, .first = {}};
  const auto all = messages_of(a, topic.name);
  if (!all) return std::unexpected(all.error());
  result.messages_a = all->size();
  const Status read =
      b.for_each(topic.name, [&](std::int64_t time_ns, std::span<const std::byte> body) {
        const std::uint64_t index = result.messages_b++;
        if (result.first || index >= all->size()) return;
        const Message& message = (*all)[index];
        if (message.time_ns == time_ns && std::ranges::equal(message.body, body)) return;
        FirstDifference found{.signal = "time",
                              .a = static_cast<double>(message.time_ns) * 1e-9,
                              .b = static_cast<double>(time_ns) * 1e-9};
        if (message.time_ns == time_ns)
          found = difference_in(topic.layout, a.info(), message, body);
        found.message = index;
        found.time_ns = message.time_ns;
        result.first = found;
      });
  if (!read) return std::unexpected(read.error());
  return result;
}

}  // namespace

bool Comparison::equal() const {
  return !topics.empty() && std::ranges::all_of(topics, &TopicComparison::equal);
}

Result<Comparison> compare(const LogFile& a, const LogFile& b) {
  for (const LogFile* one : {&a, &b}) {
    if (!one->damage_loses_messages()) continue;
    return std::unexpected(Error{
        .message = "is damaged, so it is not comparable bit for bit: " + one->damage().front(),
        .hint = "copy the file again",
        .file = one->path(),
        .key = {}});
  }
  Comparison result;
  const bool runs = a.find("/tandem/state") != nullptr && b.find("/tandem/state") != nullptr;
  for (const LoggedTopic& topic : a.topics()) {
    if (b.find(topic.name) == nullptr) {
      result.only_a.push_back(topic.name);
      continue;
    }
    if (runs && topic.name == "/tf") {
      result.made.push_back(topic.name);
      continue;
    }
    auto compared = compare_topic(a, b, topic);
    if (!compared) return std::unexpected(compared.error());
    result.topics.push_back(std::move(*compared));
  }
  for (const LoggedTopic& topic : b.topics()) {
    if (a.find(topic.name) == nullptr) result.only_b.push_back(topic.name);
  }
  return result;
}

}  // namespace tandem::log
