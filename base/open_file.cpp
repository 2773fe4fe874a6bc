// open(), then fstat(): never the other way round, but for devices that the mere opening touches.
#include "base/open_file.hpp"

#include <fcntl.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <vector>

#include "base/nearest.hpp"

namespace tandem {
namespace {

constexpr unsigned long kProc = 0x9FA0;                                      // <linux/magic.h>
constexpr std::array<unsigned long, 6> kKernelFiles{kProc,      0x62656572,  // sysfs
                                                    0x64626720,              // debugfs
                                                    0x74726163,              // tracefs
                                                    0x63677270, 0x27E0EB};   // cgroups
constexpr const char* kAway = "check the path and its permissions";

std::unexpected<Error> refusal(const std::string& path, std::string message, std::string hint) {
  return std::unexpected(
      Error{.message = std::move(message), .hint = std::move(hint), .file = path, .key = {}});
}

/// The reason alone; errno stays.
std::unexpected<Error> system_error(const std::string& path, int error) {
  auto failed = refusal(path, std::strerror(error), {});
  errno = error;
  return failed;
}

unsigned long file_system(int descriptor) {
  struct statfs found {};
  return ::fstatfs(descriptor, &found) == 0 ? static_cast<unsigned long>(found.f_type) : 0;
}

bool is_kernels(unsigned long file_system) {
  return std::ranges::find(kKernelFiles, file_system) != kKernelFiles.end();
}

/// What to do about a file that is not there: the nearest name of its folder, if there is one.
std::string where_else(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  std::vector<std::string> names;
  std::error_code problem;
  for (std::filesystem::directory_iterator at(folder.empty() ? "." : folder, problem), end;
       !problem && at != end && names.size() < kMostLooked; at.increment(problem)) {
    names.push_back(at->path().filename().string());
  }
  const std::string meant = nearest(file.filename().string(), names);
  return meant.empty() ? kAway : "did you mean '" + (folder / meant).string() + "'?";
}

/// Empty, or why it is not read.
std::string unreadable(const struct stat& found) {
  if (S_ISDIR(found.st_mode)) return "this is a folder";
  return S_ISREG(found.st_mode) ? "" : "this is no regular file";
}

std::string too_large(std::uint64_t bytes, std::uint64_t most) {
  return "has " + std::to_string(bytes) + " bytes, and at most " + std::to_string(most) +
         " are read";
}

/// The parts of a path, the last first.
std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts;
  std::size_t end = 0;
  for (std::size_t at = 0; at < path.size(); at = end + 1) {
    end = std::min(path.find('/', at), path.size());
    if (end > at && path.substr(at, end - at) != ".") parts.push_back(path.substr(at, end - at));
  }
  std::ranges::reverse(parts);
  return parts;
}

std::string joined(const std::string& folder, const std::string& part) {
  if (part != "..") return (folder == "/" ? "" : folder) + "/" + part;
  const std::string above = folder.substr(0, folder.rfind('/'));
  return above.empty() ? "/" : above;
}

/// What a link says.
std::string target_of(int link) {
  std::string text(PATH_MAX, '\0');
  const ssize_t size = ::readlinkat(link, "", text.data(), text.size());
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  return text;
}

/// Whose links are followed to where something is written: who may do so anyway.
Status own_links(const Place& part) {
  const uid_t owner = part.found.st_uid;
  if (!S_ISLNK(part.found.st_mode) || owner == ::geteuid() || owner == 0) return {};
  auto refused =
      refusal(part.path, "the link " + part.path + " belongs to user " + std::to_string(owner),
              "name the file that it leads to, if that is what you want");
  errno = ELOOP;
  return refused;
}

/// The kernel's own link at the end of a way, as /proc/self/fd/1: "pipe:[5]" is no path.
Result<Place> through_kernel(Place at) {
  at.itself = Descriptor(::openat(at.folder.get(), at.name.c_str(), O_PATH | O_CLOEXEC));
  if (at.itself.valid() && ::fstat(at.itself.get(), &at.found) == 0) return at;
  return system_error(at.path, errno);
}

Result<Descriptor> make(const Place& place, mode_t mode) {
  constexpr int kNew = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  Descriptor made(::openat(place.folder.get(), place.name.c_str(), kNew, mode));
  if (!made.valid()) return system_error(place.path, errno);
  return made;
}

}  // namespace

Descriptor::~Descriptor() {
  if (valid()) ::close(number_);
}

Result<Descriptor> open_to_read(const std::string& path, const std::string& hint,
                                std::uint64_t most_bytes) {
  constexpr const char* kCannot = "cannot read this file";
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0)
    return refusal(path, kCannot, errno == ENOENT ? where_else(path) : kAway);
  if (std::string why = unreadable(found); !why.empty()) return refusal(path, why, hint);
  Descriptor file(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file.valid() || ::fstat(file.get(), &found) != 0) return refusal(path, kCannot, kAway);
  std::string why = unreadable(found);
  if (why.empty() && is_kernels(file_system(file.get()))) why = "this is no regular file";
  const auto bytes = static_cast<std::uint64_t>(found.st_size);
  if (why.empty() && bytes > most_bytes) why = too_large(bytes, most_bytes);
  if (!why.empty()) return refusal(path, why, hint);
  return file;
}

Result<std::string> read_all(const Descriptor& file, const std::string& path,
                             std::uint64_t most_bytes) {
  std::string text;
  struct stat found {};
  if (::fstat(file.get(), &found) == 0) text.reserve(static_cast<std::size_t>(found.st_size));
  std::vector<char> block(std::size_t{1} << 16);
  for (;;) {
    const ssize_t size =
        ::pread(file.get(), block.data(), block.size(), static_cast<off_t>(text.size()));
    if (size == 0) return text;
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return refusal(path, "reading failed", "check the disk");
    text.append(block.data(), static_cast<std::size_t>(size));
    if (text.size() > most_bytes) {
      return refusal(path, too_large(text.size(), most_bytes), "it grows while it is read");
    }
  }
}

namespace {
thread_local const TextsInstead::Texts* texts_instead = nullptr;
}  // namespace

TextsInstead::TextsInstead(const Texts& texts) noexcept { texts_instead = &texts; }
TextsInstead::~TextsInstead() { texts_instead = nullptr; }

Result<std::string> read_file(const std::string& path, const std::string& hint,
                              std::uint64_t most_bytes) {
  if (texts_instead != nullptr) {
    const auto found =
        std::ranges::find(*texts_instead, path, &std::pair<std::string, std::string>::first);
    if (found != texts_instead->end()) return found->second;
  }
  const Result<Descriptor> file = open_to_read(path, hint, most_bytes);
  if (!file) return std::unexpected(file.error());
  return read_all(*file, path, most_bytes);
}

Result<Descriptor> open_new(const std::string& path, mode_t mode) {
  const Result<Place> place = walk_path(path, own_links);
  if (!place) return std::unexpected(place.error());
  return make(*place, mode);
}

Result<Descriptor> open_output(const std::string& path, mode_t mode) {
  const Result<Place> place = walk_path(path, own_links);
  if (!place) return std::unexpected(place.error());
  if (!place->itself.valid()) return make(*place, mode);
  Descriptor file(::openat(place->folder.get(), place->name.c_str(), O_WRONLY | O_CLOEXEC));
  struct stat found {};
  if (!file.valid() || ::fstat(file.get(), &found) != 0) return system_error(path, errno);
  if (found.st_dev != place->found.st_dev || found.st_ino != place->found.st_ino) {
    return system_error(path, ESTALE);  // somebody has exchanged it
  }
  if (!S_ISREG(found.st_mode)) return file;
  const bool is_open =
      file_system(place->folder.get()) == kProc;  // as /dev/stdout: we were given it
  if (!is_open && found.st_uid != ::geteuid() && found.st_uid != 0) {
    auto refused = refusal(path, "the file belongs to user " + std::to_string(found.st_uid),
                           "remove it, or name another");
    errno = EPERM;
    return refused;
  }
  if (::ftruncate(file.get(), 0) != 0) return system_error(path, errno);
  return file;
}

Result<Descriptor> open_folder(const std::string& path) {
  Result<Place> place = walk_path(path, own_links);
  if (!place) return std::unexpected(place.error());
  if (!place->itself.valid()) return system_error(path, ENOENT);
  if (!S_ISDIR(place->found.st_mode)) return system_error(path, ENOTDIR);
  return std::move(place->itself);
}

int write_all(const Descriptor& file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t size = ::write(file.get(), text.data(), text.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return errno;  // which stays
    text.remove_prefix(static_cast<std::size_t>(size));
  }
  return 0;
}

Result<Place> walk_path(const std::string& path, const JudgePart& judge) {
  constexpr int kAnchor = O_PATH | O_DIRECTORY | O_CLOEXEC, kPart = O_PATH | O_NOFOLLOW | O_CLOEXEC;
  constexpr int kMostLinks = 40;  // as Linux
  if (path.empty()) return system_error(path, ENOENT);
  std::vector<std::string> left = parts_of(path);
  Place at;
  at.path = at.name = path.starts_with('/') ? "/" : ".";
  at.folder = Descriptor(::open(at.path.c_str(), kAnchor));
  at.itself = Descriptor(::open(at.path.c_str(), kAnchor));
  for (int links = 0;;) {
    if (!at.itself.valid() || ::fstat(at.itself.get(), &at.found) != 0) {
      return system_error(at.path, errno);
    }
    if (Status judged = judge(at); !judged) return std::unexpected(judged.error());
    if (S_ISLNK(at.found.st_mode)) {
      if (left.empty() && file_system(at.itself.get()) == kProc)
        return through_kernel(std::move(at));
      const std::string target = target_of(at.itself.get());
      if (++links > kMostLinks || target.empty()) return system_error(at.path, ELOOP);
      const std::vector<std::string> parts = parts_of(target);
      left.insert(left.end(), parts.begin(), parts.end());
      const bool from_root = target.starts_with('/');
      at.itself = from_root ? Descriptor(::open("/", kAnchor)) : std::move(at.folder);
      at.path = from_root ? "/" : joined(at.path, "..");
      continue;
    }
    if (left.empty()) return at;
    if (!S_ISDIR(at.found.st_mode)) return system_error(at.path, ENOTDIR);
    at.folder = std::move(at.itself);
    at.name = std::move(left.back());
    left.pop_back();
    at.path = joined(at.path, at.name);
    at.itself = Descriptor(::openat(at.folder.get(), at.name.c_str(), kPart));
    if (!at.itself.valid() && errno == ENOENT && left.empty()) return at;
  }
}

}  // namespace tandem
