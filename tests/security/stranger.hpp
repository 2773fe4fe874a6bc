// Another user of the machine, and what he does meanwhile.
#pragma once

#include <grp.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "tests/support/needs_root.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::test {

inline constexpr uid_t kStranger = 65534;

/// Why there is no other user here; empty: there is. Only root can be two.
inline std::string no_stranger() {
  return ::geteuid() == 0 ? "" : needs_root("to act as another user");
}

/// A process of another user, which does `work` until it returns or the object's end.
class Stranger {
 public:
  template <class Work>
  explicit Stranger(Work work, gid_t group = kStranger) : child_(::fork()) {
    if (child_ != 0) return;
    if (::setgroups(0, nullptr) != 0 || ::setresgid(group, group, group) != 0 ||
        ::setresuid(kStranger, kStranger, kStranger) != 0) {
      ::_exit(1);
    }
    try {
      work();
    } catch (...) {
      ::_exit(1);
    }
    ::_exit(0);
  }
  ~Stranger() {
    if (child_ <= 0) return;
    ::kill(child_, SIGKILL);
    (void)end();
  }
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  /// Waits. @return whether `work` has returned
  [[nodiscard]] bool end() {
    int status = 0;
    const bool ended = ::waitpid(child_, &status, 0) == child_;
    child_ = 0;
    return ended && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

 private:
  pid_t child_;
};

/// A folder that everybody may look into, and in it one of the stranger's, where that is possible.
struct SharedFolder : ScratchFolder {
  SharedFolder() {
    ::chmod(path().c_str(), 0755);
    std::filesystem::create_directory(strangers());
    if (::geteuid() == 0) (void)!::chown(strangers().c_str(), kStranger, kStranger);
  }
  [[nodiscard]] std::string strangers() const { return *this / "strangers"; }
};

/// Lets `link` lead to `target`, in one step.
inline void lead(const std::string& link, const std::string& target) {
  const std::string next = link + ".next";
  ::unlink(next.c_str());
  if (::symlink(target.c_str(), next.c_str()) == 0) ::rename(next.c_str(), link.c_str());
}

}  // namespace tandem::test
