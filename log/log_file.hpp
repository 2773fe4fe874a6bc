// A run's log, opened for reading: its information, its topics, and columns of numbers.
// Start here to read logs. Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/open_file.hpp"
#include "base/result.hpp"
#include "hal/image.hpp"
#include "log/data_hash.hpp"
#include "log/event.hpp"
#include "log/info.hpp"
#include "log/log_parts.hpp"

namespace tandem::log {

class McapReader;
struct MessageView;

/// A topic of the file.
struct LoggedTopic {
  std::string name;      ///< "/tandem/state"
  std::string type;      ///< "tandem/msg/State"
  std::string encoding;  ///< "cdr"
  std::uint64_t messages = 0;
  std::int64_t first_ns = 0;  ///< times of the first and the last message
  std::int64_t last_ns = 0;
  hal::Layout layout;  ///< empty when the type is not all fixed-size numbers
};

/// One number of each message: element `index` of `field`.
struct Column {
  std::string field;
  std::size_t index = 0;
};

/// Columns over time.
struct TimeSeries {
  std::vector<double> time_s;
  std::vector<std::vector<double>> columns;  ///< as asked for
};

/// A log in one file, or all files of one that `[log] file_MB` has split.
class LogFile {
 public:
  /// Reads it once to count. Of a log in several files the first one's name, "arm-001.mcap", opens
  /// all that are there, also where the first one is gone; "arm-001.3.mcap" is that part alone, and
  /// "arm-001.1.mcap" the first one alone. What is in each file once for viewers, the description
  /// and what does not move, is in the whole once.
  /// A chunk that is damaged is left out: damage().
  /// Errors: as McapReader; a file that is cut before anything of a run.
  [[nodiscard]] static Result<LogFile> open(const std::string& path);
  /// Whether open() would find a log, without reading it.
  [[nodiscard]] static Status check(const std::string& path);

  /// As it was opened.
  [[nodiscard]] const std::string& path() const { return path_; }
  /// Its files, in the order of the run; one at least.
  [[nodiscard]] const std::vector<LogPart>& parts() const { return parts_; }
  /// What of the run is in files that are not here.
  [[nodiscard]] const std::vector<MissingParts>& missing() const { return missing_; }
  /// The same in words, with the time of what is here. Empty: the log is whole, or was cut.
  [[nodiscard]] std::vector<std::string> gaps() const;
  /// What was left out of its files because it is damaged, in words, the first few one by one.
  [[nodiscard]] std::vector<std::string> damage() const;
  /// Whether messages of the log may be lost by that. What needs all of them refuses then.
  [[nodiscard]] bool damage_loses_messages() const;
  /// gaps(), then damage(): for whoever computes with it.
  [[nodiscard]] std::vector<std::string> remarks() const;
  /// An error of a reduced copy, for who needs every sample of a run.
  [[nodiscard]] Status require_samples() const;
  [[nodiscard]] const RunInfo& info() const { return info_; }
  /// The metadata record "result"; empty when the run was killed. Of several files the last one's,
  /// with the messages of all.
  [[nodiscard]] const StringMap& result() const { return result_; }
  /// The same for people: a row for each line of a value, "N of M" messages where some are not
  /// here, and without `data_sha256`, which is of what was written.
  [[nodiscard]] StringMap shown_result() const;
  [[nodiscard]] const std::vector<LoggedTopic>& topics() const { return topics_; }
  [[nodiscard]] const LoggedTopic* find(std::string_view topic) const;
  /// The same. Error: the log has no such topic, leaves it out, or is cut before its first message.
  [[nodiscard]] Result<const LoggedTopic*> require(const std::string& topic) const;
  /// The topic that `name` names: leading parts may be left out, of "/tandem/" first, where what is
  /// left names one alone. One that the log does not have: as below /tandem.
  [[nodiscard]] std::string full_name(const std::string& name) const;
  /// "this log leaves it out ([log] state_every = 0)"; empty: its experiment does not say so.
  /// @param field  of the topic; empty: the topic as a whole
  [[nodiscard]] std::string left_out(std::string_view topic, std::string_view field = {}) const;
  /// True when the run was killed: the data, or those of a part, end where its last chunk ended.
  [[nodiscard]] bool truncated() const;
  /// Why it is truncated: "its run is still writing it", or "its run was killed, or …".
  [[nodiscard]] std::string cut_reason() const;
  /// The same with where what can be read ends, for whoever computes with it. Empty: its end is
  /// there.
  [[nodiscard]] std::string cut_remark() const;
  /// The files' size.
  [[nodiscard]] std::uint64_t bytes() const;
  [[nodiscard]] std::uint64_t messages() const;
  /// SHA-256 over the messages in their order, as RecordingResult defines it: of several files the
  /// same as of one.
  [[nodiscard]] const std::string& data_sha256() const { return data_sha256_; }

  /// The columns of every message of `topic`, or of every `every`-th.
  /// Errors: no such topic, field (the nearest is suggested) or index; a message that is too short.
  [[nodiscard]] Result<TimeSeries> read(const std::string& topic,
                                        const std::vector<Column>& columns,
                                        std::size_t every = 1) const;
  [[nodiscard]] Result<std::vector<EventText>> events() const;

  /// Calls `visit` for each message of all its files, in order, with the reader of its file. The
  /// first error that it returns ends it.
  [[nodiscard]] Status visit(
      const std::function<Status(const McapReader&, const MessageView&)>& visit) const;
  /// Calls `visit(time_ns, CDR body)` for each message of `topic`, in order.
  [[nodiscard]] Status for_each(
      const std::string& topic,
      const std::function<void(std::int64_t, std::span<const std::byte>)>& visit) const;

 private:
  /// How a file begins: of which part, of which run.
  struct Beginning;
  [[nodiscard]] static Result<Beginning> begin(const std::string& path);
  [[nodiscard]] Status add(Beginning file, DataHash& hash);
  [[nodiscard]] Status add_siblings(const std::string& name, DataHash& hash);
  void finish(DataHash& hash);

  std::string path_;
  std::vector<std::shared_ptr<const Descriptor>> files_;  // read again and again: always the same
  std::vector<LogPart> parts_;                            // of those
  std::vector<MissingParts> missing_;
  RunInfo info_;
  StringMap result_;
  std::vector<LoggedTopic> topics_;
  std::string data_sha256_;
};

/// Error for a log whose data are another's to the last bit: it teaches nothing, and would make the
/// look better known than it is.
[[nodiscard]] Error same_data(const std::string& path, const std::string& other);

}  // namespace tandem::log
