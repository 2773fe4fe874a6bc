#include "apps/transport/control_path.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "base/quoting.hpp"
#include "base/trusted_code.hpp"

namespace tandem::apps {
namespace {

/// Folder of the user, in a place that every process of theirs has.
std::string temporary_folder() { return fmt::format("/tmp/tandem-{}", ::geteuid()); }

/// Null: it is not set.
const char* only_folder() {
  const char* only = std::getenv("TANDEM_SOCKETS");
  return only != nullptr && *only != '\0' ? only : nullptr;
}

}  // namespace

bool one_control_folder() { return only_folder() != nullptr; }

std::string control_folder() {
  if (const char* only = only_folder()) return std::filesystem::absolute(only).string();
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  std::error_code error;
  if (runtime != nullptr && std::filesystem::is_directory(runtime, error)) {
    return (std::filesystem::path(runtime) / "tandem").string();
  }
  return temporary_folder();
}

std::vector<std::string> control_folders() {
  std::vector<std::string> folders{control_folder()};
  if (one_control_folder()) return folders;
  for (const std::string& other : {fmt::format("/run/user/{}/tandem", ::geteuid()),
                                   temporary_folder(), std::string("/run/tandem/tandem")}) {
    if (std::ranges::find(folders, other) == folders.end()) folders.push_back(other);
  }
  return folders;
}

std::vector<std::string> listening_paths(const std::string& table) {
  constexpr unsigned long kAccepts = 0x10000;  // __SO_ACCEPTCON: listen() was called
  std::vector<std::string> paths;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    std::string number, references, protocol, flags, type, state, inode, path;
    fields >> number >> references >> protocol >> flags >> type >> state >> inode >> std::ws;
    if (!fields || !std::getline(fields, path) || !path.starts_with('/')) continue;
    if ((std::strtoul(flags.c_str(), nullptr, 16) & kAccepts) != 0) paths.push_back(path);
  }
  return paths;
}

Status check_private_folder(const std::string& folder) {
  struct stat found {};
  if (::lstat(folder.c_str(), &found) != 0) {
    return fail(fmt::format("cannot look at {}: {}", folder, std::strerror(errno)),
                "choose another place with --socket");
  }
  if (S_ISDIR(found.st_mode) && found.st_uid == ::geteuid() && (found.st_mode & 0077) == 0) {
    return {};
  }
  return fail(
      fmt::format("{} is no folder of this user alone (its owner is user {}, its mode {:o})",
                  folder, found.st_uid, found.st_mode & 07777),
      found.st_uid == ::geteuid() && S_ISDIR(found.st_mode)
          ? "chmod 700 " + shell_word(folder)
          : "remove it, set XDG_RUNTIME_DIR, or choose another place with --socket");
}

Status check_socket_folder(const std::string& path, std::optional<uid_t> partner) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  if (folder == control_folder()) return check_private_folder(folder);
  std::error_code error;
  if (!folder.empty() && !std::filesystem::exists(folder, error)) return {};
  const Status ours = check_trusted_folder(folder, partner);
  if (ours) return {};
  return fail(
      fmt::format("the socket's folder {} {}: somebody else's socket could take the place of "
                  "{}, and receive its emergency stops",
                  ours.error().file, ours.error().message, path),
      ours.error().hint + "; or choose another folder with --socket");
}

std::int64_t peer_user(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  const bool known = ::getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  return known ? static_cast<std::int64_t>(peer.uid) : -1;
}

std::string default_control_path(const std::string& kind) {
  return fmt::format("{}/{}-{}.sock", control_folder(), kind, ::getpid());
}

Result<sockaddr_un> control_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty()) return fail("the socket's path is empty", "name a file with --socket");
  if (path.size() >= sizeof address.sun_path) {
    return fail(fmt::format("the socket's path has {} bytes, {} are possible: {}", path.size(),
                            sizeof address.sun_path - 1, path),
                "choose a shorter one with --socket");
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

bool control_socket_alive(const std::string& path) {
  const Result<sockaddr_un> address = control_address(path);
  if (!address) return false;
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return false;
  const auto* raw = reinterpret_cast<const sockaddr*>(&*address);
  const int error = ::connect(fd, raw, sizeof *address) == 0 ? 0 : errno;
  ::close(fd);
  return error == 0 || error == EAGAIN;  // EAGAIN: it listens, and others wait before us
}

}  // namespace tandem::apps
