// The file of a control socket, and the place where who connects waits to be served.
// Layer: apps/transport.  Thread: one.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include "base/result.hpp"

namespace tandem::apps {

/// Listens from open() to the destructor, which removes the file. Who connects while nobody serves
/// waits for who serves next: a process that serves first one thing and then another can be asked,
/// and stopped, at any moment in between.
class ControlListener {
 public:
  /// Makes the folder of a default path (mode 0700) and the socket (mode 0600). The file of a dead
  /// process is replaced.
  /// Errors: a path that is too long; a folder that is missing, another user's or one that others
  /// may change; a file that is no socket; a process that listens there.
  [[nodiscard]] static Result<std::unique_ptr<ControlListener>> open(const std::string& path);
  ~ControlListener();
  ControlListener(const ControlListener&) = delete;
  ControlListener& operator=(const ControlListener&) = delete;

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// That does not block.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }

 private:
  explicit ControlListener(std::string path);
  [[nodiscard]] Status listen();

  std::string path_;
  int descriptor_ = -1;
  dev_t device_ = 0;
  ino_t inode_ = 0;  // of the file, which is removed if it is still this one; 0: none was made
};

}  // namespace tandem::apps
