// Which numbers of a log's topic nobody had measured yet: their 0 is no measurement.
// Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "log/log_file.hpp"

namespace tandem::log {

/// The ages of the elements of a field: which element of which field has each. `of` is empty where
/// nothing tells them.
struct Ages {
  const hal::Field* field = nullptr;
  std::vector<std::uint64_t> of{};
};
/// @param field  of the layout. Its element was not measured yet where its age is more than the
/// cycle
[[nodiscard]] Ages ages_of(const hal::Layout& layout, const hal::Field& field,
                           const RunInfo& robot);

/// By what the log says of a sample's age: one that is older than the run was never measured. A
/// command's position repeats the measured one until a controller writes it, so it is none before
/// that either.
class Unmeasured {
 public:
  /// Errors: as LogFile::for_each(), of the state beside a command.
  [[nodiscard]] static Result<Unmeasured> of(const LogFile& log, const LoggedTopic& topic);

  /// Whether the field, by its number in the layout, is a measurement of which that is known.
  [[nodiscard]] bool tells(std::size_t field) const { return !rows_[field].of.empty(); }
  /// Whether its element was not measured yet in the message `body`.
  [[nodiscard]] bool is(std::size_t field, std::size_t index,
                        std::span<const std::byte> body) const;

 private:
  struct Row {                        // of a field
    const hal::Field* age = nullptr;  // null: `of` are the cycles that measured first
    std::vector<std::uint64_t> of;    // elements of `age`, by element of the field; empty: unknown
  };
  const hal::Field* cycle_ = nullptr;
  std::vector<Row> rows_;
};

}  // namespace tandem::log
