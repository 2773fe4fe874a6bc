// What a log may take of the disk, and what there is of it.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/open_file.hpp"

namespace tandem::log {

/// What a recording may take of the disk. 0: no limit.
struct DiskLimits {
  /// Messages of one file, about; the next ones go to another. NAME.mcap is followed by
  /// NAME.2.mcap, NAME.3.mcap: each a whole log.
  std::uint64_t file_bytes = 0;
  std::uint64_t total_bytes = 0;      ///< of all its files: the oldest are removed
  std::uint64_t keep_free_bytes = 0;  ///< on the disk: the oldest are removed if total_bytes or
                                      ///< total_ns says so, else nothing more is logged
  double keep_free_share = 0.0;       ///< the same as a share of the disk; the larger one counts
  std::int64_t file_ns = 0;           ///< log time of one file, about: as file_bytes
  std::int64_t total_ns = 0;          ///< log time after which a file is removed
  std::int64_t keep_before_fault_ns = 0;  ///< what is logged before a stop is never removed

  [[nodiscard]] bool in_several_files() const { return file_bytes > 0 || file_ns > 0; }
  [[nodiscard]] bool remove_oldest() const { return total_bytes > 0 || total_ns > 0; }
};

/// Bytes of a disk, for this user.
struct DiskRoom {
  std::uint64_t free_bytes = 0;
  std::uint64_t all_bytes = 0;
};
/// The disk that a folder or an open file is on. Nothing: it does not say.
[[nodiscard]] std::optional<DiskRoom> disk_room(const std::string& folder);
[[nodiscard]] std::optional<DiskRoom> disk_room(const Descriptor& file);
/// What `limits` want free there.
[[nodiscard]] std::uint64_t wanted_free(const DiskLimits& limits, std::uint64_t all_bytes);

/// The same in the words of the experiment: "keep_free_MB = 500 and keep_free_share = 0.05".
[[nodiscard]] std::string free_text(const DiskLimits& limits);

}  // namespace tandem::log
