// Files are opened once: what is judged is the descriptor, and the descriptor is what is read,
// written or loaded. A name may lead elsewhere a moment later.
// Layer: base.  Thread: any, not RT.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.hpp"

namespace tandem {

/// A file descriptor, closed at the end. -1: none.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor();

  [[nodiscard]] int get() const noexcept { return number_; }
  [[nodiscard]] bool valid() const noexcept { return number_ >= 0; }
  [[nodiscard]] int release() noexcept { return std::exchange(number_, -1); }

 private:
  int number_;
};

// --- to read ---

/// Largest sizes of what is read as a whole [bytes] (docs/security.md).
inline constexpr std::uint64_t kMostTomlBytes = std::uint64_t{16} << 20;
inline constexpr std::uint64_t kMostUrdfBytes = std::uint64_t{64} << 20;
inline constexpr std::uint64_t kMostTableBytes = std::uint64_t{4} << 30;  ///< of a CSV file
inline constexpr std::uint64_t kMostOtherBytes = std::uint64_t{1} << 30;  ///< libraries, drawings
inline constexpr std::uint64_t kAnySize = UINT64_MAX;  ///< of logs, which are read in pieces

/// Opens a file that a user named. Only regular files: a device or a pipe may have no end, and may
/// make the caller wait.
/// @param hint  of every error but a missing file: "name a .toml file"
/// Errors: it cannot be opened; it is a folder, no regular file (pipe, device, socket, a file of
/// /proc or /sys), or larger than `most_bytes`.
[[nodiscard]] Result<Descriptor> open_to_read(const std::string& path, const std::string& hint,
                                              std::uint64_t most_bytes = kAnySize);
/// Its whole content. @param path  for errors
/// Errors: reading fails; it has grown beyond `most_bytes`.
[[nodiscard]] Result<std::string> read_all(const Descriptor& file, const std::string& path,
                                           std::uint64_t most_bytes);
/// Both. Errors: theirs.
[[nodiscard]] Result<std::string> read_file(const std::string& path, const std::string& hint,
                                            std::uint64_t most_bytes);

/// While one lives, read_file() of its thread answers these texts instead of what is in the files
/// of those paths, whether they are there or not. One at a time a thread; outlived by the texts.
class TextsInstead {
 public:
  using Texts = std::vector<std::pair<std::string, std::string>>;  ///< path, text
  explicit TextsInstead(const Texts& texts) noexcept;
  ~TextsInstead();
  TextsInstead(const TextsInstead&) = delete;
  TextsInstead& operator=(const TextsInstead&) = delete;
};

// --- to write ---

/// Makes a file that is not there yet. Links on the way must belong to this user or root. Error:
/// its message is the reason alone ("Permission denied"), which is in errno, too.
[[nodiscard]] Result<Descriptor> open_new(const std::string& path, mode_t mode = 0666);
/// Makes a file, or empties the one that is there, if it belongs to this user or root; a pipe or
/// device, as /dev/stdout, is opened as it is. Error: as open_new().
[[nodiscard]] Result<Descriptor> open_output(const std::string& path, mode_t mode = 0666);
/// A folder to write to (O_PATH). Links on the way as of open_new(). Error: as open_new().
[[nodiscard]] Result<Descriptor> open_folder(const std::string& path);
/// Writes all of `text`. @return 0, or the errno of what failed
[[nodiscard]] int write_all(const Descriptor& file, std::string_view text);

// --- by which way ---

/// Where a path leads.
struct Place {
  Descriptor folder;     ///< O_PATH; of the last part of the path
  std::string name;      ///< that part
  Descriptor itself;     ///< O_PATH; none: nothing is there
  struct stat found {};  ///< of `itself`
  std::string path;      ///< without links
};
/// Called with the beginning of a path ("/", or "." of a relative one), and with every folder, link
/// and end on the way. What it looks at is what is passed: each part is opened in the folder
/// before.
using JudgePart = std::function<Status(const Place& part)>;
/// Errors: `judge`'s; as open_new()'s.
[[nodiscard]] Result<Place> walk_path(const std::string& path, const JudgePart& judge);

}  // namespace tandem
