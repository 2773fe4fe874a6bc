// What is written goes to the file that was made for it, and through nobody else's link.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "base/open_file.hpp"
#include "log/recorder.hpp"
#include "tests/apps/program.hpp"
#include "tests/security/stranger.hpp"

namespace tandem::test {
namespace {

namespace fs = std::filesystem;

using apps::read_text;
using apps::write_text;

TEST(WrittenFiles, ALogStaysInTheFileThatWasMadeForIt) {
  const SharedFolder folder;
  const std::string path = folder / "run-001.mcap", victim = folder / "victim";
  write_text(victim, "precious");
  for (const bool before : {true, false}) {
    fs::remove(path);
    Result<Descriptor> file = open_new(path, 0644);
    ASSERT_TRUE(file) << file.error().to_string();
    if (before) lead(path, victim);  // between the making and the writing
    auto recorder = log::Recorder::open(std::move(*file), path, {}, {});
    EXPECT_EQ(recorder.has_value(), !before);
    if (recorder) {
      (*recorder)->start();
      lead(path, victim);
      EXPECT_NE((*recorder)->close().error, "") << "the file is deleted";
    }
    EXPECT_EQ(read_text(victim), "precious");
  }
}

TEST(WrittenFiles, NothingThatIsThereIsMadeNew) {
  const SharedFolder folder;
  write_text(folder / "old", "precious");
  fs::create_symlink(folder / "old", folder / "link");
  for (const char* name : {"old", "link"}) {
    EXPECT_FALSE(open_new(folder / name)) << name;
    EXPECT_EQ(errno, EEXIST);
  }
  EXPECT_EQ(read_text(folder / "old"), "precious");
}

TEST(WrittenFiles, OwnLinksAndPipesAreWrittenThrough) {
  const SharedFolder folder;
  fs::create_symlink("real", folder / "link");
  for (const char* text : {"first, and longer", "second"}) {
    const Result<Descriptor> file = open_output(folder / "link");
    ASSERT_TRUE(file) << file.error().to_string();
    EXPECT_EQ(write_all(*file, text), 0);
  }
  EXPECT_EQ(read_text(folder / "real"), "second");
  EXPECT_TRUE(open_output("/dev/null"));
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const Descriptor in(ends[0]), out(ends[1]);
  const Result<Descriptor> again = open_output("/proc/self/fd/" + std::to_string(out.get()));
  ASSERT_TRUE(again) << again.error().to_string();
  EXPECT_EQ(write_all(*again, "to the pipe"), 0);
}

TEST(WrittenFiles, NothingIsWrittenThroughAStrangersLink) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  const SharedFolder folder;
  const std::string his = folder.strangers() + "/";
  fs::create_directory(folder / "own");
  write_text(folder / "own/victim", "precious");
  ASSERT_TRUE(Stranger([&] {
                (void)!::symlink((folder / "own/victim").c_str(), (his + "file").c_str());
                (void)!::symlink((folder / "own").c_str(), (his + "folder").c_str());
                (void)!::symlink((folder / "own/new").c_str(), (his + "new").c_str());
                write_text(his + "his", "text");
              }).end());
  const Descriptor given(::open((his + "his").c_str(), O_WRONLY | O_CLOEXEC));
  EXPECT_TRUE(open_output("/proc/self/fd/" + std::to_string(given.get()))) << "as /dev/stdout";
  for (const char* name : {"file", "folder/victim", "new", "folder/new", "his"}) {
    const Result<Descriptor> file = open_output(his + name);
    ASSERT_FALSE(file) << name;
    EXPECT_TRUE(file.error().message.ends_with("belongs to user 65534")) << file.error().message;
    EXPECT_FALSE(open_new(his + name)) << name;
  }
  EXPECT_EQ(read_text(folder / "own/victim"), "precious");
  EXPECT_FALSE(fs::exists(folder / "own/new"));
}

// What was tried: root's log, report and JSON in another's folder, who puts a link to a file of
// root's in the place of each file that appears.
struct StrangersFolder : apps::Program {};

TEST_F(StrangersFolder, CostsNoFileOfOurs) {
  if (!no_stranger().empty()) GTEST_SKIP() << no_stranger();
  const SharedFolder folder;
  const std::string victim = folder / "victim";
  write_text(victim, "precious");
  const Stranger stranger([&] {
    for (;;) {
      std::error_code ignored;
      for (const auto& entry : fs::directory_iterator(folder.strangers(), ignored)) {
        if (entry.is_symlink(ignored)) {
          ::unlink(entry.path().c_str());
        } else {
          lead(entry.path().string(), victim);
        }
      }
    }
  });
  for (int i = 0; i < 25; ++i) {
    (void)tandem("run hold.toml --duration 0.05 --no-build --log '" + folder.strangers() +
                 "' --json '" + folder.strangers() + "/run.json' --trace '" + folder.strangers() +
                 "/trace.json'");
    ASSERT_EQ(read_text(victim), "precious") << "run " << i;
  }
}

}  // namespace
}  // namespace tandem::test
