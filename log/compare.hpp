// Whether two runs are the same to the last bit and, if not, where they first part.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "log/log_file.hpp"

namespace tandem::log {

/// The first number of a topic that two logs do not share.
struct FirstDifference {
  std::uint64_t message = 0;  ///< of the topic, from 0
  std::int64_t time_ns = 0;   ///< of the first log's message
  /// "position_rad.LHipSag"; "time", "length"; without a field "byte 56" of the body
  std::string signal;
  double a = 0.0, b = 0.0;  ///< its values, or the lengths [bytes]
};

struct TopicComparison {
  std::string topic;
  std::uint64_t messages_a = 0, messages_b = 0;
  std::optional<FirstDifference> first;

  [[nodiscard]] bool equal() const { return !first && messages_a == messages_b; }
};

struct Comparison {
  std::vector<TopicComparison> topics;  ///< that both logs have, in the first one's order
  std::vector<std::string> only_a, only_b;
  /// That both have and that are not compared: /tf of a run's log is made from its other topics,
  /// the base's place from the truth or, without it, from the estimate.
  std::vector<std::string> made;

  /// Every topic that both have is the same, and there is one.
  [[nodiscard]] bool equal() const;
};

/// Compares every message of every topic that both logs hold: time stamps and bytes. Events are
/// compared like the rest. Errors: a log that lost messages, since nobody knows what they were.
[[nodiscard]] Result<Comparison> compare(const LogFile& a, const LogFile& b);

}  // namespace tandem::log
