// A log that cannot be written is found before anything runs.
#include <unistd.h>

#include "tests/apps/bad_input.hpp"
#include "tests/support/needs_root.hpp"

namespace tandem::apps {
namespace {

/// A memory disk in `folder` for as long as this lives; root only.
class Mount {
 public:
  Mount(std::filesystem::path folder, const std::string& options) : folder_(std::move(folder)) {
    std::filesystem::create_directory(folder_);
    mounted_ = run("mount -t tmpfs -o " + options + " tmpfs");
  }
  ~Mount() {
    if (mounted_) {
      EXPECT_TRUE(run("umount"));
    }
  }
  Mount(const Mount&) = delete;
  Mount& operator=(const Mount&) = delete;
  [[nodiscard]] bool mounted() const { return mounted_; }

 private:
  [[nodiscard]] bool run(const std::string& command) const {
    return std::system((command + " " + shell_word(folder_.string()) + " 2>/dev/null").c_str()) ==
           0;
  }
  std::filesystem::path folder_;
  bool mounted_ = false;
};

class BadDisk : public BadInput {};

TEST_F(BadDisk, ALogFolderThatCannotBeMadeIsRefused) {
  expect_refused({"/proc/tandem", "log's folder", "--log"},
                 "run hold.toml --duration 0.05 --log /proc/tandem");
}

TEST_F(BadDisk, ALogFolderThatIsAFileIsRefused) {
  expect_refused({"hold.toml", "log's folder"}, "run hold.toml --duration 0.05 --log hold.toml");
}

TEST_F(BadDisk, AReadOnlyLogFolderIsRefused) {
  if (geteuid() != 0) {
    std::filesystem::create_directory(folder_ / "locked");
    std::filesystem::permissions(folder_ / "locked", std::filesystem::perms::owner_read);
    expect_refused({"locked", "cannot write"}, "run hold.toml --duration 0.05 --log locked");
    return;
  }
  // Permissions do not stop root: a file system that is mounted read-only does.
  const Mount disk(folder_ / "locked", "ro");
  if (!disk.mounted()) GTEST_SKIP() << test::needs_root("to mount a read-only disk");
  expect_refused({"locked", "log"}, "run hold.toml --duration 0.05 --log locked");
}

TEST_F(BadDisk, AFullDiskIsRefused) {
  const Mount disk(folder_ / "disk", "size=64k");
  if (!disk.mounted()) GTEST_SKIP() << test::needs_root("to mount a small disk");
  expect_refused({"disk", "too full"}, "run hold.toml --log disk");
}

// "the run may need 49.6 MB", of which the oldest go while it runs.
TEST_F(BadDisk, ARunWhoseOldFilesGoBeginsOnADiskThatCannotHaveThemAll) {
  const Mount disk(folder_ / "disk", "size=9m");
  if (!disk.mounted()) GTEST_SKIP() << test::needs_root("to mount a small disk");
  write_text(folder_ / "long.toml",
             read_text(folder_ / "hold.toml") +
                 "\n[log]\nfile_MB = 4\ntotal_MB = 8\nkeep_free_MB = 2\ncompression = 'none'\n");
  const Outcome run = tandem("run long.toml --duration 40 -q --log disk --json j.json");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_GT(json("j.json")["log"]["files_removed"].get<int>(), 0);
}

// A robot whose own logs have filled its disk starts in the morning; one whose disk others have
// filled says so.
TEST_F(BadDisk, ARunBeginsOnADiskThatLogsOfRunsBeforeHaveFilled) {
  const Mount disk(folder_ / "disk", "size=12m");
  if (!disk.mounted()) GTEST_SKIP() << test::needs_root("to mount a small disk");
  write_text(folder_ / "hold.toml",
             read_text(folder_ / "hold.toml") +
                 "\n[log]\nfile_MB = 4\ntotal_MB = 100\nkeep_free_share = 0.05\nbudget = "
                 "'experiment'\ncompression = 'none'\n");
  for (const int number : {1, 2}) {
    const Outcome run = tandem("run hold.toml --duration 40 -q --log disk --json j.json");
    EXPECT_EQ(run.status, 0) << number << run.err;
  }
  EXPECT_GT(json("j.json")["log"]["earlier_files_removed"].get<int>(), 0);
  write_text(folder_ / "disk/others", std::string(20'000'000, 'x'));  // as much as there is room
  for (const auto& file : std::filesystem::directory_iterator(folder_ / "disk"))
    if (file.path().extension() == ".mcap") std::filesystem::remove(file.path());
  write_text(folder_ / "disk/more", std::string(20'000'000, 'x'));
  expect_refused({"disk", "too full", "keep_free_share = 0.05"},
                 "run hold.toml --duration 40 --log disk");
}

}  // namespace
}  // namespace tandem::apps
