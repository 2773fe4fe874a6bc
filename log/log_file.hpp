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
#include "log/event.hpp"
#include "log/info.hpp"

namespace tandem::log {

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

class LogFile {
 public:
  /// Reads the whole file once to count. Errors: as McapReader; a file that is cut before anything
  /// of a run.
  [[nodiscard]] static Result<LogFile> open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const RunInfo& info() const { return info_; }
  /// The metadata record "result"; empty when the run was killed.
  [[nodiscard]] const StringMap& result() const { return result_; }
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
  /// True when the run was killed: the data end where its last chunk ended.
  [[nodiscard]] bool truncated() const { return truncated_; }
  /// The file's size.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t messages() const;
  /// SHA-256 over the messages as they stand in the file, as RecordingResult defines it.
  [[nodiscard]] const std::string& data_sha256() const { return data_sha256_; }

  /// The columns of every message of `topic`, or of every `every`-th.
  /// Errors: no such topic, field (the nearest is suggested) or index; damaged data.
  [[nodiscard]] Result<TimeSeries> read(const std::string& topic,
                                        const std::vector<Column>& columns,
                                        std::size_t every = 1) const;
  [[nodiscard]] Result<std::vector<EventText>> events() const;

  /// Calls `visit(time_ns, CDR body)` for each message of `topic`, in order.
  [[nodiscard]] Status for_each(
      const std::string& topic,
      const std::function<void(std::int64_t, std::span<const std::byte>)>& visit) const;

 private:
  std::string path_;
  std::shared_ptr<const Descriptor> file_;  // read again and again: always the same
  RunInfo info_;
  StringMap result_;
  std::vector<LoggedTopic> topics_;
  bool truncated_ = false;
  std::uint64_t bytes_ = 0;
  std::string data_sha256_;
};

/// Error for a log whose data are another's to the last bit: it teaches nothing, and would make the
/// look better known than it is.
[[nodiscard]] Error same_data(const std::string& path, const std::string& other);

}  // namespace tandem::log
