// Which files of a log stay: by size, by age, by the disk's room, and by faults. Pure but for the
// files that it removes.
// Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "log/disk_limits.hpp"
#include "log/info.hpp"

namespace tandem::log {

/// The files of a log, the oldest first, and the present one.
///
/// Age is log time: what was logged after a file. A robot that was off for a month has grown no
/// older, and no clock that was set removes anything.
class KeptFiles {
 public:
  explicit KeptFiles(const DiskLimits& limits) : limits_(limits) {}

  /// Takes over what runs before have left in `folder`: NAME-001.mcap with its parts and branches,
  /// NAME-002.mcap and so on. A file that a run still writes, and what is no log, is left alone.
  /// A file that was cut is read whole.
  void take_over(const std::string& folder, const std::string& name);

  /// A message of the present file.
  void note(std::int64_t time_ns) noexcept;
  /// A fault in it that stops the robot: it stays, and so does what was logged
  /// `keep_before_fault_ns` before and kAfterFault_ns after.
  void note_stop(std::int64_t time_ns);
  static constexpr std::int64_t kAfterFault_ns = 10'000'000'000;
  /// For the present file's "result": by it a later run knows of its stops.
  [[nodiscard]] StringMap stops() const;
  /// From its first message [ns].
  [[nodiscard]] std::int64_t length_ns() const noexcept { return present_.length_ns(); }
  /// The present one is over: another one begins.
  void end(std::string path, std::uint64_t bytes);

  /// Removes the oldest files beyond the totals. @param bytes  of the present file and the next
  void keep_totals(std::uint64_t bytes);
  /// Removes the oldest files until the disk has `more_bytes` more than what it shall keep free.
  /// @param room  asked again after each
  /// @return false: it has less, and nothing more may be removed
  [[nodiscard]] bool keep_free(const std::function<std::optional<DiskRoom>()>& room,
                               std::uint64_t more_bytes = 0);

  /// Bytes of files of this run that ended and are there.
  [[nodiscard]] std::uint64_t ended_bytes() const noexcept { return own_bytes_; }
  /// Files of this run that were removed, and those of earlier runs.
  [[nodiscard]] std::uint64_t removed() const noexcept { return removed_; }
  [[nodiscard]] std::uint64_t earlier_removed() const noexcept { return earlier_removed_; }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  struct File {
    std::string path{};
    std::uint64_t bytes = 0;
    std::int64_t first_ns = kNever, last_ns = kNever;  // of its messages
    std::int64_t first_stop_ns = kNever, last_stop_ns = kNever;
    bool stays = false;  // for a fault
    bool earlier = false;

    [[nodiscard]] std::int64_t length_ns() const noexcept { return last_ns - first_ns; }
  };
  [[nodiscard]] static std::optional<File> look_at(const std::string& path);
  [[nodiscard]] bool remove_oldest();

  DiskLimits limits_;
  std::vector<File> ended_;
  File present_;
  std::uint64_t total_bytes_ = 0;  // of those in ended_ that may go
  std::uint64_t own_bytes_ = 0;
  std::uint64_t removed_ = 0, earlier_removed_ = 0;
};

/// The number in "NAME-012.3.mcap", of a log of `name`; 0: it is none.
[[nodiscard]] std::uint64_t run_number(const std::string& file, const std::string& name);

}  // namespace tandem::log
