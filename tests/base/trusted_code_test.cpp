// Code that others could have put there is not loaded, damaged code neither.
#include "base/trusted_code.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/support/needs_root.hpp"

namespace tandem::test {
namespace {

namespace fs = std::filesystem;

struct TrustedCode : ::testing::Test {
  TrustedCode() {
    char name[] = "/tmp/tandem-code-XXXXXX";  // below a folder that everybody may write to
    folder = ::mkdtemp(name);
    file = folder / "inner/code.so";
    fs::create_directory(folder / "inner");
    std::ofstream(file) << "some code";
    ::chmod(file.c_str(), 0644);
    ::chmod((folder / "inner").c_str(), 0755);
  }
  ~TrustedCode() override { fs::remove_all(folder); }
  [[nodiscard]] std::string error() const {
    const Result<tandem::TrustedCode> code = tandem::TrustedCode::open(file.string());
    return code ? "" : code.error().message;
  }
  fs::path folder, file;
};

TEST_F(TrustedCode, IsThisUsersAlone) { EXPECT_EQ(error(), ""); }

// In a bare chroot: `tandem check` had looked at "/" for ever.
TEST_F(TrustedCode, IsJudgedWithoutProc) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(60);
    const bool own = ::unshare(CLONE_NEWNS) == 0 || ::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0;
    if (!own || ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("none", "/proc", "tmpfs", 0, nullptr) != 0) {
      ::_exit(77);
    }
    if (check_trusted_folder("/")) ::_exit(0);
    ::_exit(1);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status)) << "it looked until signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << test::needs_root("another /proc");
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(TrustedCode, IsAFile) {
  fs::remove(file);
  EXPECT_EQ(error(), "there is no such file");
  fs::create_directory(file);
  EXPECT_EQ(error(), "there is no such file");
}

TEST_F(TrustedCode, IsNothingThatEverybodyMayChange) {
  ::chmod(file.c_str(), 0666);
  EXPECT_EQ(error(), "may be changed by everybody");
  ::chmod(file.c_str(), 0644);
  ::chmod((folder / "inner").c_str(), 0777);
  EXPECT_EQ(error(), "its folder " + (folder / "inner").string() + " may be changed by everybody");
}

TEST_F(TrustedCode, LiesInAFolderThatMayBeAskedFor) {
  EXPECT_TRUE(check_trusted_folder((folder / "inner").string()));
  EXPECT_EQ(check_trusted_folder((folder / "none").string()).error().message,
            "there is no such folder");
  ::chmod(folder.c_str(), 0777);
  const Status refused = check_trusted_folder((folder / "inner").string());
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().file, folder.string());
  EXPECT_EQ(refused.error().message, "may be changed by everybody (its mode is 777)");
}

TEST_F(TrustedCode, IsNoOtherUsers) {
  if (::geteuid() != 0) GTEST_SKIP() << test::needs_root("to give a file away");
  ASSERT_EQ(::chown(file.c_str(), 65534, 0), 0);
  EXPECT_EQ(error(), "belongs to user 65534");
  ASSERT_EQ(::chown(file.c_str(), 0, 65534), 0);
  ::chmod(file.c_str(), 0664);
  EXPECT_TRUE(error().starts_with("may be changed by group 65534: ")) << error();
  ASSERT_EQ(::chown(file.c_str(), 0, 0), 0);
  EXPECT_EQ(error(), "");
  ASSERT_EQ(::chown((folder / "inner").c_str(), 65534, 0), 0);
  EXPECT_EQ(error(), "its folder " + (folder / "inner").string() + " belongs to user 65534");
}

TEST_F(TrustedCode, IsJudgedWhereALinkLeads) {
  const fs::path link = folder / "link.so";
  fs::create_symlink(file, link);
  EXPECT_TRUE(tandem::TrustedCode::open(link.string()).has_value());
  ::chmod(file.c_str(), 0666);
  EXPECT_FALSE(tandem::TrustedCode::open(link.string()).has_value());
}

TEST_F(TrustedCode, SealTellsEveryChange) {
  const auto check_seal = [&] { return tandem::TrustedCode::open(file.string())->check_seal(); };
  EXPECT_NE(check_seal().error().message.find("not made by tandem"), std::string::npos);
  ASSERT_TRUE(seal_library(file.string()).has_value());
  EXPECT_TRUE(check_seal().has_value());
  const auto size = fs::file_size(file);
  for (std::uintmax_t at = 0; at < size; ++at) {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekg(static_cast<std::streamoff>(at));
    const char was = static_cast<char>(bytes.get());
    bytes.seekp(static_cast<std::streamoff>(at));
    bytes.put(static_cast<char>(was ^ 4)).flush();
    EXPECT_FALSE(check_seal().has_value()) << at;
    bytes.seekp(static_cast<std::streamoff>(at));
    bytes.put(was).flush();
  }
  EXPECT_TRUE(check_seal().has_value());
  for (std::uintmax_t left = size; left-- > 0;) {
    fs::resize_file(file, left);
    EXPECT_FALSE(check_seal().has_value()) << left;
  }
}

}  // namespace
}  // namespace tandem::test
