#include "log/disk_limits.hpp"

#include <sys/statvfs.h>

#include <algorithm>
#include <cmath>

namespace tandem::log {
namespace {

std::optional<DiskRoom> room_of(const struct statvfs& disk) {
  if (disk.f_blocks == 0) return std::nullopt;
  return DiskRoom{static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize,
                  static_cast<std::uint64_t>(disk.f_blocks) * disk.f_frsize};
}

}  // namespace

std::optional<DiskRoom> disk_room(const std::string& folder) {
  struct statvfs disk {};
  return ::statvfs(folder.c_str(), &disk) == 0 ? room_of(disk) : std::nullopt;
}

std::optional<DiskRoom> disk_room(const Descriptor& file) {
  struct statvfs disk {};
  return ::fstatvfs(file.get(), &disk) == 0 ? room_of(disk) : std::nullopt;
}

std::uint64_t wanted_free(const DiskLimits& limits, std::uint64_t all_bytes) {
  const double share = limits.keep_free_share * static_cast<double>(all_bytes);
  return std::max(limits.keep_free_bytes, static_cast<std::uint64_t>(share));
}

std::string free_text(const DiskLimits& limits) {
  std::string text;
  if (limits.keep_free_bytes > 0)
    text = "keep_free_MB = " + std::to_string(limits.keep_free_bytes / 1'000'000);
  if (limits.keep_free_share == 0.0) return text;
  std::string share = std::to_string(std::llround(1000.0 * limits.keep_free_share));
  share.insert(0, share.size() < 3 ? 3 - share.size() : 0, '0');
  return text + (text.empty() ? "" : " and ") + "keep_free_share = 0." + share;
}

}  // namespace tandem::log
