// flock() on a file that stays: the system releases it when its holder ends, however that happens.
#include "model/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace tandem::model {
namespace {

bool lock(int descriptor, int how) {
  while (flock(descriptor, how) != 0) {
    if (errno != EINTR) return false;
  }
  return true;
}

}  // namespace

Result<FileLock> FileLock::take(const std::string& file, const std::function<void()>& waiting) {
  FileLock taken(open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644));
  bool held = taken.descriptor_ >= 0 && lock(taken.descriptor_, LOCK_EX | LOCK_NB);
  if (!held && taken.descriptor_ >= 0 && errno == EWOULDBLOCK) {
    if (waiting) waiting();
    held = lock(taken.descriptor_, LOCK_EX);
  }
  if (held) return taken;
  return fail("cannot lock " + file + ": " + std::strerror(errno),
              "check the folder's permissions");
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace tandem::model
