// Owner and mode; and who is in a group that may write.
#include "base/file_owner.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <vector>

#include "base/process.hpp"

namespace tandem {
namespace {

constexpr std::size_t kEntryBytes = std::size_t{1} << 20;  // of a group with many members

/// Somebody who is in `group` and not trusted; empty: nobody. A member without an account is
/// nobody.
std::string strange_member(gid_t group) {
  std::vector<char> names(kEntryBytes), one(kEntryBytes);
  struct group entry {
  }, *found = nullptr;
  if (::getgrgid_r(group, &entry, names.data(), names.size(), &found) != 0) return "too many";
  if (found == nullptr) return {};
  for (char** name = entry.gr_mem; *name != nullptr; ++name) {
    passwd account{}, *user = nullptr;
    (void)::getpwnam_r(*name, &account, one.data(), one.size(), &user);
    if (user != nullptr && !is_trusted_user(account.pw_uid)) return *name;
  }
  return {};
}

/// Who is in a group that is not a trusted user's alone; empty: it is.
std::string stranger_in(gid_t group) {
  if (std::string member = strange_member(group); !member.empty()) return member + " is in it";
  static std::mutex one_list;  // of all accounts is read at a time
  const std::lock_guard lock(one_list);
  std::vector<char> names(kEntryBytes);
  passwd account{}, *user = nullptr;
  bool own = false;
  std::string stranger;
  ::setpwent();
  while (stranger.empty() && ::getpwent_r(&account, names.data(), names.size(), &user) == 0) {
    if (account.pw_gid != group) continue;
    own = own || is_trusted_user(account.pw_uid);
    if (!is_trusted_user(account.pw_uid)) stranger = account.pw_name;
  }
  ::endpwent();
  if (!stranger.empty()) return stranger + " is in it";
  return own ? "" : "it is not the own group of this user, root or the program's owner";
}

/// Without the group's right to write no entry of an access list has it.
bool has_access_list(int descriptor) {
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  if (::getxattr(link.c_str(), "system.posix_acl_access", nullptr, 0) >= 0) return true;
  return errno != ENODATA && errno != ENOTSUP;
}

}  // namespace

bool is_trusted_user(uid_t user) {
  struct stat own {};
  const bool known = ::stat(program_file().c_str(), &own) == 0;
  return user == ::geteuid() || user == 0 || (known && user == own.st_uid);
}

std::string who_else_may_change(int descriptor, const struct stat& found,
                                std::optional<uid_t> partner) {
  if (!is_trusted_user(found.st_uid) && found.st_uid != partner)
    return "belongs to user " + std::to_string(found.st_uid);
  if (S_ISLNK(found.st_mode)) return {};  // its mode says nothing
  if (S_ISDIR(found.st_mode) && (found.st_mode & S_ISVTX) != 0) return {};
  if ((found.st_mode & S_IWOTH) != 0) return "may be changed by everybody";
  if ((found.st_mode & S_IWGRP) == 0) return {};
  if (has_access_list(descriptor)) return "may be changed by those of its access list (getfacl)";
  const std::string stranger = stranger_in(found.st_gid);
  if (stranger.empty()) return {};
  return "may be changed by group " + std::to_string(found.st_gid) + ": " + stranger;
}

}  // namespace tandem
