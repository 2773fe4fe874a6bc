// What a crash of the machine leaves of a robot's compiled dynamics is compiled again.
#include <vector>

#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

struct KernelStore : Program {};

// What was tried: after a power cut an object may be empty, and its stamp whole; the linker failed
// at it for ever.
TEST_F(KernelStore, CompilesAgainWhatIsDamaged) {
  const auto build = [&] { return tandem("model build robot.toml -o k.so"); };
  ASSERT_EQ(build().status, 0) << build().err;
  const std::filesystem::path store = folder_ / "k.so.build";
  std::vector<std::filesystem::path> objects;
  for (const auto& entry : std::filesystem::directory_iterator(store)) {
    if (entry.path().extension() == ".o") objects.push_back(entry.path());
  }
  ASSERT_GE(objects.size(), 3U);
  std::filesystem::resize_file(objects[0], 0);
  std::filesystem::resize_file(objects[1], std::filesystem::file_size(objects[1]) / 2);
  write_text(objects[2], std::string(std::filesystem::file_size(objects[2]), '\0'));
  std::filesystem::remove(folder_ / "k.so");
  Outcome outcome = build();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE((outcome.out + outcome.err).find("3 files compiled"), std::string::npos)
      << outcome.out << outcome.err;
  for (const auto& object : objects) EXPECT_GT(std::filesystem::file_size(object), 0U);
  EXPECT_NE(build().out.find("up to date"), std::string::npos);

  std::filesystem::resize_file(store / "library.stamp", 0);  // and of the stamps
  for (const auto& object : objects) std::filesystem::resize_file(object.string() + ".stamp", 0);
  EXPECT_EQ(build().status, 0);
}

TEST_F(KernelStore, LinksNothingThatOthersMayChange) {
  std::filesystem::create_directory(folder_ / "k.so.build");
  std::filesystem::permissions(folder_ / "k.so.build", std::filesystem::perms::all);
  const Outcome outcome = tandem("model build robot.toml -o k.so");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("k.so.build: may be changed by everybody"), std::string::npos)
      << outcome.err;
}

// Where every file that a user makes is for the group to change.
TEST_F(KernelStore, IsForNoGroupToChange) {
  ASSERT_EQ(tandem("model build robot.toml -o k.so", "umask 0;").status, 0);
  const auto others = std::filesystem::perms::group_write | std::filesystem::perms::others_write;
  for (const char* name : {"k.so", "k.so.build", "k.so.build/library.stamp"}) {
    const auto mode = std::filesystem::status(folder_ / name).permissions();
    EXPECT_EQ(mode & others, std::filesystem::perms::none) << name;
  }
}

}  // namespace
}  // namespace tandem::apps
