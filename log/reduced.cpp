#include "log/reduced.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <utility>

#include "log/mcap_reader.hpp"

namespace tandem::log {
namespace {

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// One topic of the copy.
struct CopiedTopic {
  bool wanted = true;
  bool thins = false;
  bool latched = false;  ///< also what was before from_s
  std::uint16_t channel = 0;
  std::int64_t slot = std::numeric_limits<std::int64_t>::min();  ///< of the last message kept
  std::int64_t kept_ns = 0;                                      ///< its time
  bool lost_some = false;
};

class Copy {
 public:
  Copy(const LogFile& log, const Reduction& how, McapWriter& writer)
      : log_(log), how_(how), writer_(writer) {}

  Status take(const McapReader& reader, const MessageView& message) {
    const ChannelRecord& channel = reader.channels().at(message.channel);
    if (!topics_.contains(channel.topic)) add_topics(reader);
    CopiedTopic& topic = topics_.at(channel.topic);
    if (!topic.wanted || !keeps(topic, message.time_ns)) return {};
    hash_.add(topic.channel, message.time_ns, message.data);
    if (!writer_.write(topic.channel, message.time_ns, {}, message.data))
      return fail(writer_.error());  // close() says more
    ++done_.messages;
    found_ = found_ || !topic.latched;
    return {};
  }
  [[nodiscard]] bool found() const { return found_; }

  Reduced finish() {
    for (const auto& [name, topic] : topics_)
      if (topic.lost_some) done_.thinned.push_back(name);
    done_.data_sha256 = hash_.finish();
    return std::move(done_);
  }

 private:
  /// All that the file has named so far, in its order, also those without a message yet.
  void add_topics(const McapReader& reader) {
    for (const auto& [id, channel] : reader.channels()) {
      if (topics_.contains(channel.topic)) continue;
      CopiedTopic& topic = topics_[channel.topic];
      const LoggedTopic* logged = log_.find(channel.topic);
      topic.thins = logged != nullptr && can_be_thinned(*logged);
      topic.latched = channel.topic == "/robot_description" || channel.topic == "/tf_static";
      const auto named = std::ranges::find(how_.topics, channel.topic);
      topic.wanted = how_.topics.empty() || named != how_.topics.end();
      if (!topic.wanted) continue;
      const SchemaRecord& schema = reader.schemas().at(channel.schema_id);
      const auto [known, added] = schemas_.try_emplace({schema.name, schema.text});
      if (added) known->second = writer_.add_schema(schema.name, schema.encoding, schema.text);
      topic.channel = writer_.add_channel(known->second, channel.topic, channel.message_encoding);
    }
  }

  bool keeps(CopiedTopic& topic, std::int64_t time_ns) const {
    const double time_s = static_cast<double>(time_ns) * 1e-9;
    constexpr double kHalfNanosecond = 0.5e-9;
    const bool early = how_.from_s && time_s < *how_.from_s - kHalfNanosecond;
    if (early && !topic.latched) return false;
    if (how_.to_s && time_s > *how_.to_s + kHalfNanosecond) return false;
    if (!topic.thins) return true;
    // The share of a slot is for numbers such as 0.3 s, which no double is.
    const auto slot = static_cast<std::int64_t>(std::floor(time_s * how_.rate_Hz + 1e-6));
    if (slot == topic.slot && time_ns != topic.kept_ns) {
      topic.lost_some = true;
      return false;
    }
    topic.slot = slot;  // what is of one time stays together
    topic.kept_ns = time_ns;
    return true;
  }

  const LogFile& log_;
  const Reduction& how_;
  McapWriter& writer_;
  std::map<std::string, CopiedTopic> topics_;
  std::map<std::pair<std::string, std::string>, std::uint16_t> schemas_;
  DataHash hash_;
  Reduced done_;
  bool found_ = false;
};

/// "to 100 Hz, of squat-001.mcap (data_sha256 …)": with what that log lacks itself.
std::string reduced_text(const LogFile& log, const Reduction& how) {
  std::string text = "to " + short_number(how.rate_Hz) + " Hz";
  if (how.from_s) text += ", from " + short_number(*how.from_s) + " s";
  if (how.to_s) text += ", to " + short_number(*how.to_s) + " s";
  if (!how.topics.empty()) text += ", to some topics";
  text += ", of " + std::filesystem::path(log.path()).filename().string() + " (data_sha256 " +
          log.data_sha256() + ")";
  if (log.truncated()) text += "; that is cut: " + log.cut_reason();
  for (const std::string& remark : log.remarks()) text += "; " + remark;
  return text;
}

Status check(const LogFile& log, const Reduction& how) {
  if (!(how.rate_Hz > 0.0) || !std::isfinite(how.rate_Hz))
    return fail("the rate is not above 0", "give one in Hz: 100");
  const double most_Hz = image_rate_Hz(log);
  if (most_Hz == 0.0)
    return fail("it has no images that a lower rate could thin", "open the log itself");
  if (how.rate_Hz > most_Hz * 1.001) {
    return fail("the rate " + short_number(how.rate_Hz) + " Hz is above the log's, " +
                    short_number(std::round(most_Hz * 100.0) / 100.0) + " Hz",
                "give a lower one, or open the log itself");
  }
  for (const std::string& topic : how.topics)
    if (const auto found = log.require(topic); !found) return std::unexpected(found.error());
  if (how.from_s && how.to_s && *how.from_s > *how.to_s)
    return fail("from is behind to", "give an earlier one");
  return {};
}

}  // namespace

bool can_be_thinned(const LoggedTopic& topic) {
  if (topic.name == "/joint_states" || topic.name == "/tf") return true;
  return !topic.layout.fields().empty() && !topic.name.starts_with("/tandem/input/");
}

double image_rate_Hz(const LogFile& log) {
  double most_Hz = 0.0;
  for (const LoggedTopic& topic : log.topics()) {
    if (!can_be_thinned(topic) || topic.layout.fields().empty()) continue;
    if (topic.messages < 2 || topic.last_ns <= topic.first_ns) continue;
    const double apart_s = static_cast<double>(topic.last_ns - topic.first_ns) * 1e-9;
    most_Hz = std::max(most_Hz, static_cast<double>(topic.messages - 1) / apart_s);
  }
  return most_Hz;
}

Result<Reduced> write_reduced(const LogFile& log, const Reduction& how, McapWriter& writer) {
  if (Status fits = check(log, how); !fits) {
    if (fits.error().file.empty()) fits.error().file = log.path();
    return std::unexpected(fits.error());
  }
  RunInfo info = log.info();
  info.part = 0;
  info.reduced = reduced_text(log, how);
  writer.add_metadata(kInfoRecord, to_map(info));
  writer.add_metadata(kConfigurationRecord, info.configuration);
  Copy copy(log, how, writer);
  const Status copied =
      log.visit([&](const McapReader& reader, const MessageView& message) -> Status {
        return copy.take(reader, message);
      });
  if (!copied && writer.failed()) return std::unexpected(writer.close().error());
  if (!copied) return std::unexpected(copied.error());
  if (!copy.found()) {
    return std::unexpected(Error{"it has nothing of these topics in this time",
                                 "tandem log info lists its topics and their times",
                                 log.path(),
                                 0,
                                 {}});
  }
  Reduced done = copy.finish();
  StringMap result;
  for (const auto& [key, value] : log.result()) {
    const bool other =
        key == "messages" || key == "data_sha256" || key == "continued" || key == "removed_parts";
    if (!other) result.emplace_back(key, value);
  }
  result.emplace_back("data_sha256", done.data_sha256);
  result.emplace_back("messages", std::to_string(done.messages));
  writer.add_metadata(kResultRecord, result);
  if (Status closed = writer.close(); !closed) return std::unexpected(closed.error());
  return done;
}

}  // namespace tandem::log
