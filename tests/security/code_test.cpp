// Code is judged and loaded by its descriptor; a group may write where nobody else is in it.
#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/xattr.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stop_token>
#include <thread>

#include "base/file_owner.hpp"
#include "base/trusted_code.hpp"
#include "controllers/plugin_loader.hpp"
#include "tests/apps/program.hpp"
#include "tests/security/stranger.hpp"

namespace tandem::test {
namespace {

namespace fs = std::filesystem;

const std::string kHold = TANDEM_BINARY_DIR "/lib/controllers/hold.so";
const std::string kMarks = TANDEM_BINARY_DIR "/tests/test_plugins/marks.so";

void put_copy(const std::string& from, const std::string& to, mode_t mode) {
  fs::copy_file(from, to, fs::copy_options::overwrite_existing);
  ::chmod(to.c_str(), mode);
}

/// The name that a loaded controller has, and the path that the loader has of it.
std::pair<std::string, std::string> loaded_as(void* library) {
  using Entry = const ControllerPlugin* (*)();
  void* const entry = ::dlsym(library, "tandem_controller_plugin");
  if (entry == nullptr) return {};
  Dl_info info{};
  ::dladdr(entry, &info);
  return {reinterpret_cast<Entry>(entry)()->name, info.dli_fname};
}

TEST(StrangersCode, IsNotLoadedInThePlaceOfWhatWasJudged) {
  const SharedFolder folder;
  const std::string good = folder / "good.so", bad = folder / "bad.so", link = folder / "link.so";
  put_copy(kHold, good, 0755);
  put_copy(kMarks, bad, 0755);
  lead(link, good);
  const Result<TrustedCode> judged = TrustedCode::open(link);
  ASSERT_TRUE(judged) << judged.error().to_string();
  lead(link, bad);  // between the look and the load
  fs::rename(good, folder / "moved.so");
  put_copy(kMarks, good, 0755);
  const Result<void*> library = judged->load(RTLD_NOW | RTLD_LOCAL);
  ASSERT_TRUE(library) << library.error().to_string();
  EXPECT_EQ(loaded_as(*library).first, "hold");
  EXPECT_EQ(loaded_as(*library).second, good) << "debuggers and traces name the library by it";
  ::dlclose(*library);
}

TEST(StrangersCode, MayNeedALibraryOfItsOwnFolder) {
  const std::string file = TANDEM_BINARY_DIR "/tests/test_plugins/needs_beside.so";
  const Result<LoadedController> loaded = load_controller(file, {});
  ASSERT_TRUE(loaded) << loaded.error().to_string();
  EXPECT_STREQ(loaded->plugin().name, "marks");
}

TEST(StrangersCode, IsNotLoadedByItsNameWhereThereIsNoProc) {
  const Result<TrustedCode> code = TrustedCode::open(kHold);
  ASSERT_TRUE(code);
  const pid_t child = ::fork();
  if (child == 0) {
    const bool own = ::unshare(CLONE_NEWNS) == 0 || ::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0;
    if (!own || ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("none", "/proc", "tmpfs", 0, nullptr) != 0) {
      ::_exit(77);
    }
    const Result<void*> library = code->load(RTLD_NOW | RTLD_LOCAL);
    ::_exit(!library && library.error().message == "cannot be loaded without /proc" ? 0 : 1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "this machine gives nobody another /proc";
  EXPECT_EQ(status, 0);
}

// The loader takes two libraries of one name for one, and a descriptor's number comes again.
TEST(StrangersCode, OfTwoLibrariesEachIsItself) {
  const SharedFolder folder;
  const std::string hold = folder / "one.so", marks = folder / "two.so";
  put_copy(kHold, hold, 0755);
  put_copy(kMarks, marks, 0755);
  const auto load = [](const std::string& file) {
    const Result<TrustedCode> code = TrustedCode::open(file);
    return code ? code->load(RTLD_NOW | RTLD_LOCAL).value_or(nullptr) : nullptr;
  };
  void *first = load(hold), *second = load(marks), *again = load(hold);
  ASSERT_TRUE(first != nullptr && second != nullptr);
  EXPECT_EQ(loaded_as(first), std::pair(std::string("hold"), hold));
  EXPECT_EQ(loaded_as(second), std::pair(std::string("marks"), marks));
  EXPECT_EQ(again, first);
  for (void* one : {first, second, again}) ::dlclose(one);
}

/// Loads 3000 times through a link in `place` that `flips` leads now to a library of ours, now to
/// `bad`, which may be changed by another user. Nothing of that may ever run.
/// @param both  goes on until each has been met
struct Tries {
  int loaded = 0, refused = 0;
};
template <class Flips>
Tries load_while(Flips flips, bool both, const std::string& link, const std::string& mark) {
  Tries tries;
  ::setenv("TANDEM_TEST_MARK", mark.c_str(), 1);
  const auto flipping = flips();
  for (int i = 0; i < 3000 || (both && (tries.loaded == 0 || tries.refused == 0)); ++i) {
    const Result<LoadedController> one = load_controller(link, {});
    EXPECT_STREQ(one ? one->plugin().name : "hold", "hold");
    ++(one ? tries.loaded : tries.refused);
  }
  ::unsetenv("TANDEM_TEST_MARK");
  EXPECT_FALSE(fs::exists(mark)) << "another user's code has run";
  return tries;
}

TEST(StrangersCode, IsNotLoadedThroughALinkThatFlips) {
  const SharedFolder folder;
  const std::string good = folder / "good.so", bad = folder / "bad.so", link = folder / "link.so";
  put_copy(kHold, good, 0755);
  put_copy(kMarks, bad, 0757);
  const auto flips = [&] {
    return std::jthread([&](const std::stop_token& ends) {
      for (bool to_good = true; !ends.stop_requested(); to_good = !to_good) {
        lead(link, to_good ? good : bad);
      }
    });
  };
  const Tries tries = load_while(flips, true, link, folder / "mark");
  EXPECT_GT(tries.loaded, 0);
  EXPECT_GT(tries.refused, 0);
}

// What was tried: his link beside an experiment, now to a library of root's, now to his own.
TEST(StrangersCode, IsNotLoadedThroughHisLinkThatFlips) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  const SharedFolder folder;
  const std::string good = folder / "good.so", link = folder.strangers() + "/link.so";
  const std::string bad = folder.strangers() + "/bad.so";
  put_copy(kHold, good, 0755);
  put_copy(kMarks, bad, 0755);
  ASSERT_EQ(::chown(bad.c_str(), kStranger, kStranger), 0);
  const auto flips = [&] {
    return std::make_unique<Stranger>([&] {
      for (;;) {
        lead(link, good);
        lead(link, bad);
      }
    });
  };
  EXPECT_EQ(load_while(flips, false, link, folder / "mark").loaded, 0);
}

// The same through the program, as it was found: at the third `tandem check`.
struct StrangersExperiment : apps::Program {};

TEST_F(StrangersExperiment, RunsNoCodeOfHis) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  const SharedFolder folder;
  const std::string bad = folder.strangers() + "/bad.so", link = folder.strangers() + "/link.so";
  const std::string good = folder / "good.so", mark = folder / "mark";
  put_copy(kHold, good, 0755);
  put_copy(kMarks, bad, 0755);
  edit("hold.toml", "\"hold\"", "\"" + link + "\"");
  const Stranger stranger([&] {
    for (;;) {
      lead(link, good);
      lead(link, bad);
    }
  });
  for (int i = 0; i < 30; ++i) {
    const apps::Outcome outcome = tandem("check hold.toml", "TANDEM_TEST_MARK=" + mark);
    EXPECT_EQ(outcome.status, 2);
    ASSERT_FALSE(fs::exists(mark)) << "another user's code has run at check " << i;
  }
}

TEST(StrangersCode, IsNotLoadedThroughHisFolderOrLink) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  const SharedFolder folder;
  const std::string good = folder / "good.so", link = folder / "link.so";
  put_copy(kHold, good, 0755);
  fs::create_symlink(good, folder.strangers() + "/link.so");
  const auto error = [](const std::string& path) {
    const Result<TrustedCode> code = TrustedCode::open(path);
    return code ? std::string() : code.error().message;
  };
  EXPECT_EQ(error(folder.strangers() + "/link.so"),
            "its folder " + folder.strangers() + " belongs to user 65534");
  EXPECT_EQ(error(folder.strangers() + "/../good.so"),
            "its folder " + folder.strangers() + " belongs to user 65534");
  fs::create_symlink(good, link);
  EXPECT_EQ(error(link), "");
  ASSERT_EQ(::lchown(link.c_str(), kStranger, kStranger), 0);
  EXPECT_EQ(error(link), "the link " + link + " belongs to user 65534");
}

/// Does `work` in a child that has lists of users and groups of its own. @return its exit status;
/// 77: this machine gives nobody such lists
template <class Work>
int with_accounts(const std::string& users, const std::string& groups, Work work) {
  const ScratchFolder lists;
  std::ofstream(lists / "passwd") << users;
  std::ofstream(lists / "group") << groups;
  const pid_t child = ::fork();
  if (child == 0) {
    const bool own = ::unshare(CLONE_NEWNS) == 0 &&
                     ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
    for (const std::string& list : {std::string("passwd"), std::string("group")}) {
      if (!own || ::mount((lists / list).c_str(), ("/etc/" + list).c_str(), nullptr, MS_BIND,
                          nullptr) != 0) {
        ::_exit(77);
      }
    }
    ::_exit(work());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// What is said of a file of user 4001 and `group` that its group may write, asked as user 4001.
std::string said_of_group(gid_t group) {
  const ScratchFolder folder;
  const std::string file = folder / "code.so";
  std::ofstream(file) << "code";
  if (::chown(file.c_str(), 4001, group) != 0 || ::chmod(file.c_str(), 0664) != 0) return "?";
  const Descriptor open(::open(file.c_str(), O_PATH | O_CLOEXEC));
  struct stat found {};
  ::fstat(open.get(), &found);
  if (::seteuid(4001) != 0) return "?";
  const std::string said = who_else_may_change(open.get(), found);
  return ::seteuid(0) == 0 ? said : "?";
}

TEST(StrangersGroup, MayNotWriteWhatIsLoaded) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  const std::string users =
      "root:x:0:0::/:/bin/sh\nann:x:4001:4001::/:/bin/sh\nbob:x:4002:4010::/:/bin/sh\n"
      "eve:x:4003:4011::/:/bin/sh\nann2:x:4001:4011::/:/bin/sh\n";
  const std::string groups =
      "root:x:0:gone\nann:x:4001:root,ann\nstaff:x:4010:\nlab:x:4011:\nteam:x:4012:ann,bob\n"
      "empty:x:4013:\n";
  const int status = with_accounts(users, groups, [] {
    const std::string by = "may be changed by group ";
    EXPECT_EQ(said_of_group(4001), "") << "ann's own, and root's";
    EXPECT_EQ(said_of_group(0), "") << "a member that has no account is nobody";
    EXPECT_EQ(said_of_group(4010), by + "4010: bob is in it") << "his own group";
    EXPECT_EQ(said_of_group(4011), by + "4011: eve is in it") << "hers, and ann's";
    EXPECT_EQ(said_of_group(4012), by + "4012: bob is in it") << "a member";
    for (const gid_t group : {4013U, 4999U}) {
      EXPECT_TRUE(said_of_group(group).starts_with(by + std::to_string(group) + ": it is not"));
    }
    return testing::Test::HasFailure() ? 1 : 0;
  });
  if (status == 77) GTEST_SKIP() << "this machine gives nobody other lists of users";
  EXPECT_EQ(status, 0);
}

// What was tried: root's library, of a group that another user is in, who puts his own there.
TEST(StrangersGroup, OverwritesALibraryThatIsThenRefused) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  constexpr gid_t kTeam = 4012;
  const SharedFolder folder;
  const std::string file = folder / "hold.so", mark = folder / "mark";
  put_copy(kHold, file, 0775);
  ASSERT_EQ(::chown(file.c_str(), 0, kTeam), 0);
  ASSERT_EQ(::setegid(kTeam), 0);  // root's own group here, as it was then
  EXPECT_TRUE(Stranger([&] { apps::write_text(file, apps::read_text(kMarks)); }, kTeam).end());
  ASSERT_EQ(fs::file_size(file), fs::file_size(kMarks)) << "he could not write it";
  ::setenv("TANDEM_TEST_MARK", mark.c_str(), 1);
  const Result<LoadedController> loaded = load_controller(file, {});
  ::unsetenv("TANDEM_TEST_MARK");
  ASSERT_EQ(::setegid(0), 0);
  ASSERT_FALSE(loaded);
  EXPECT_TRUE(loaded.error().message.starts_with("may be changed by group 4012: "))
      << loaded.error().message;
  EXPECT_FALSE(fs::exists(mark));
}

TEST(StrangersGroup, OfAnAccessListIsSeen) {
  const ScratchFolder folder;
  const std::string file = folder / "code.so";
  std::ofstream(file) << "code";
  // <linux/posix_acl_xattr.h>: owner rw, user 65534 rw, group r, mask rw, others r
  struct Entry {
    std::uint16_t tag, right;
    std::uint32_t who;
  };
  constexpr std::uint32_t kNobody = 0xFFFFFFFF;
  const struct {
    std::uint32_t version = 2;
    Entry entries[5]{
        {1, 6, kNobody}, {2, 6, kStranger}, {4, 4, kNobody}, {16, 6, kNobody}, {32, 4, kNobody}};
  } list;
  if (::setxattr(file.c_str(), "system.posix_acl_access", &list, sizeof list, 0) != 0) {
    GTEST_SKIP() << "no access lists here: " << std::strerror(errno);
  }
  const Result<TrustedCode> code = TrustedCode::open(file);
  ASSERT_FALSE(code);
  EXPECT_EQ(code.error().message, "may be changed by those of its access list (getfacl)");
}

}  // namespace
}  // namespace tandem::test
