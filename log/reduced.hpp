// A reduced copy of a log: its images at a lower rate, for viewers that cannot show a message a
// cycle.
// Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "log/log_file.hpp"
#include "log/mcap_writer.hpp"

namespace tandem::log {

struct Reduction {
  double rate_Hz = 100.0;                  ///< of each image: the first one of every 1/rate_Hz
  std::vector<std::string> topics{};       ///< full names; empty: all
  std::optional<double> from_s{}, to_s{};  ///< of the log's time; empty: from its begin, to its end
};

struct Reduced {
  std::uint64_t messages = 0;        ///< of the copy
  std::vector<std::string> thinned;  ///< topics that have fewer messages
  std::string data_sha256;           ///< of the copy
};

/// Whether the messages of a topic are samples of something that goes on, which a lower rate shows,
/// too: images, signals, joint states and transforms. All else is kept whole: events, words,
/// inputs, marks, and what is there once.
[[nodiscard]] bool can_be_thinned(const LoggedTopic& topic);
/// The most messages a second of a topic's images, on the average; 0: there are none.
[[nodiscard]] double image_rate_Hz(const LogFile& log);

/// Writes the copy into `writer`, which is open, and closes it. What the log says of its run goes
/// over; RunInfo::reduced says of what it is a copy.
/// Errors: a rate that is not above 0, or above the log's; nothing from from_s to to_s; damaged
/// data; a full disk.
[[nodiscard]] Result<Reduced> write_reduced(const LogFile& log, const Reduction& how,
                                            McapWriter& writer);

}  // namespace tandem::log
