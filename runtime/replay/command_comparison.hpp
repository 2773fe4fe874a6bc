// What a replay commands against what was recorded: the first number that differs, and how far
// each joint's numbers part.
// Layer: runtime/replay.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/image.hpp"
#include "log/info.hpp"
#include "runtime/replay/recorded_robot.hpp"

namespace tandem::runtime {

/// One number of a command.
struct CommandDifference {
  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::string joint;  ///< empty: of no joint
  std::string field;  ///< "position_rad"
  double recorded = 0.0, replayed = 0.0;
  std::string controller{};  ///< who has the joint in the replay; empty: nobody
};

/// How far one number of the commands parts in a whole replay.
struct CommandSpread {
  std::string joint, field;
  double largest = 0.0;       ///< of the absolute difference; NaN where one of them is
  std::int64_t time_ns = 0;   ///< of that
  std::uint64_t cycles = 0;   ///< in which they differ
  std::int64_t first_ns = 0;  ///< the first of them
};

class CommandComparison {
 public:
  /// @param log     layout of the recorded commands; outlives it
  /// @param shape   of the images that are compared
  CommandComparison(const hal::Layout& log, const hal::ImageShape& shape, const log::RunInfo& info);

  /// Compares one cycle's, every bit. @return the index of the first joint that differs; -1: none
  /// does, or it is of no joint
  std::int32_t take(const hal::CommandImage& replayed, std::span<const std::byte> recorded,
                    std::int64_t time_ns);

  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }  ///< that were compared
  [[nodiscard]] std::uint64_t differ() const { return differ_; }  ///< of them
  [[nodiscard]] std::optional<CommandDifference>& first() { return first_; }
  /// Numbers that differ anywhere, by joint.
  [[nodiscard]] std::vector<CommandSpread> spreads() const;
  /// Fields that the log lacks, which are not compared.
  [[nodiscard]] const std::vector<std::string>& missing() const { return copy_.missing(); }

 private:
  void look(const hal::Field& field, std::size_t index, std::int64_t time_ns);

  const log::RunInfo& info_;
  hal::CommandImage recorded_, replayed_;
  ImageCopy copy_;
  std::uint64_t cycles_ = 0, differ_ = 0;
  std::int32_t joint_ = -1;  // the first of this cycle
  std::optional<CommandDifference> first_;
  std::vector<std::vector<CommandSpread>> spreads_;  // by field and element
};

}  // namespace tandem::runtime
