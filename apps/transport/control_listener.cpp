#include "apps/transport/control_listener.hpp"

#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "apps/transport/control_path.hpp"

namespace tandem::apps {
namespace {

constexpr mode_t kFolderMode = 0700;
constexpr mode_t kSocketMode = 0600;

std::string reason() { return std::strerror(errno); }

/// The folder of the default paths is made when it is missing. Refused is one that others may
/// change.
Status prepare_folder(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  if (folder != control_folder()) return check_socket_folder(path);
  if (::mkdir(folder.c_str(), kFolderMode) != 0 && errno != EEXIST) {
    return fail(fmt::format("cannot make the folder {}: {}", folder, reason()),
                "choose another place with --socket");
  }
  return check_socket_folder(path);
}

/// Removes the socket of a dead process; what is anything else stays.
Status clear_way(const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode)) {
    return fail(path + " is there, and no socket", "choose another place with --socket");
  }
  if (control_socket_alive(path)) {
    return fail("another process listens at " + path, "choose another place with --socket");
  }
  if (::unlink(path.c_str()) == 0) return {};
  return fail(fmt::format("cannot remove the stale socket {}: {}", path, reason()),
              "remove it, or choose another place with --socket");
}

}  // namespace

ControlListener::ControlListener(std::string path) : path_(std::move(path)) {}

Result<std::unique_ptr<ControlListener>> ControlListener::open(const std::string& path) {
  std::unique_ptr<ControlListener> listener(new ControlListener(path));
  if (Status listening = listener->listen(); !listening) {
    return std::unexpected(listening.error());
  }
  return listener;
}

Status ControlListener::listen() {
  const Result<sockaddr_un> address = control_address(path_);
  if (!address) return std::unexpected(address.error());
  if (Status ready = prepare_folder(path_); !ready) return ready;
  if (Status clear = clear_way(path_); !clear) return clear;
  descriptor_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  struct stat made {};
  // Nobody can connect before listen(), so the mode is right for the first who can.
  const bool listens =
      descriptor_ >= 0 &&
      ::bind(descriptor_, reinterpret_cast<const sockaddr*>(&*address), sizeof *address) == 0 &&
      ::chmod(path_.c_str(), kSocketMode) == 0 && ::stat(path_.c_str(), &made) == 0 &&
      ::listen(descriptor_, SOMAXCONN) == 0;
  if (!listens) {
    return fail(fmt::format("cannot listen at {}: {}", path_, reason()),
                "choose another place with --socket");
  }
  device_ = made.st_dev;
  inode_ = made.st_ino;
  return {};
}

ControlListener::~ControlListener() {
  struct stat found {};
  const bool ours = inode_ != 0 && ::lstat(path_.c_str(), &found) == 0 && found.st_dev == device_ &&
                    found.st_ino == inode_;
  if (ours) ::unlink(path_.c_str());
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace tandem::apps
