#include "log/mcap_writer.hpp"
#include "base/quoting.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/log/scratch_folder.hpp"
#include "tests/support/node.hpp"

namespace tandem::log {
namespace {

using tandem::test::kNode;

std::string ascii(std::string_view text) { return std::string(text); }

void write_sample(const std::string& path, const WriterOptions& options, int messages) {
  McapWriter writer;
  ASSERT_TRUE(writer.open(path, options));
  writer.add_metadata("run", {{"robot", "pendulum"}});
  const auto schema = writer.add_schema("tandem/msg/Value", "ros2msg", "float64 value\n");
  const auto a = writer.add_channel(schema, "/a", "cdr");
  const auto b = writer.add_channel(schema, "/b", "cdr", {{"side", "left"}});
  for (int i = 0; i < messages; ++i) {
    EXPECT_TRUE(writer.write(a, i * 1'000'000, bytes("head"), bytes("12345678")));
    if (i % 2 != 0) continue;
    EXPECT_TRUE(writer.write(b, i * 1'000'000, bytes("head"), bytes("abcdefgh")));
  }
  const Status closed = writer.close();
  ASSERT_TRUE(closed) << closed.error().to_string();
}

TEST(McapWriter, BeginsAndEndsAsTheSpecificationSays) {
  const ScratchFolder folder;
  const std::string path = folder / "a.mcap";
  write_sample(path, {}, 3);
  const std::string file = content(path);
  const std::string magic("\x89MCAP0\r\n", 8);
  EXPECT_EQ(file.substr(0, 8), magic);
  EXPECT_EQ(file.substr(file.size() - 8), magic);
  // Header: opcode 1, length 18, "ros2", "tandem".
  const std::string header("\x01\x12\0\0\0\0\0\0\0\x04\0\0\0ros2\x06\0\0\0tandem", 27);
  EXPECT_EQ(file.substr(8, 27), header);
  // Footer: opcode 2, length 20.
  EXPECT_EQ(file.substr(file.size() - 8 - 29, 9), ascii({"\x02\x14\0\0\0\0\0\0\0", 9}));
}

TEST(McapWriter, WritesTheSameFileForTheSameCalls) {
  const ScratchFolder folder;
  for (const Compression one : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    write_sample(folder / "a.mcap", {.compression = one}, 500);
    write_sample(folder / "b.mcap", {.compression = one}, 500);
    EXPECT_TRUE(content(folder / "a.mcap") == content(folder / "b.mcap"));
  }
}

TEST(McapWriter, ClosesItsFileAndNoOther) {
  const ScratchFolder folder;
  const auto open_files = [] {
    const std::filesystem::directory_iterator all("/proc/self/fd");
    return std::distance(begin(all), end(all));
  };
  const auto before = open_files();
  write_sample(folder / "a.mcap", {}, 3);
  EXPECT_EQ(open_files(), before);
}

TEST(McapWriter, ExplainsAFolderThatIsMissingOrReadOnly) {
  const ScratchFolder folder;
  McapWriter missing;
  Status opened = missing.open(folder / "none/a.mcap", {});
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().to_string().find("No such file or directory"), std::string::npos);
  EXPECT_NE(opened.error().hint.find("create the folder"), std::string::npos);

  McapWriter read_only;
  opened = read_only.open("/proc/self/tandem.mcap", {});  // refuses even the superuser
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().file, "/proc/self/tandem.mcap");
}

TEST(McapWriter, RefusesAFullDiskWhenItOpens) {
  McapWriter writer;
  const Status opened = writer.open("/dev/full", {});
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().to_string().find("No space left on device"), std::string::npos);
}

TEST(McapWriter, SatisfiesTheReaderOfTheFormatsProject) {
  const std::string tool = std::string(TANDEM_SOURCE_DIR) + "/tests/log/validate_mcap.mjs";
  if (kNode == nullptr) GTEST_SKIP() << "node is not installed";
  const std::string modules = std::string(TANDEM_SOURCE_DIR) + "/tests/log/node_modules/@mcap/core";
  if (!std::filesystem::exists(modules)) {
    GTEST_SKIP() << "@mcap/core is not installed (run `npm ci` in tests/log)";
  }
  const ScratchFolder folder;
  for (const Compression one : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    const std::string path = folder / "sample.mcap";
    write_sample(path, {.compression = one, .chunk_bytes = 4096}, 500);
    const std::string command = shell_word(kNode) + " " + shell_word(tool) + " " +
                                shell_word(path) + " 750 > " + shell_word(folder / "out") + " 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << content(folder / "out");
  }
}

}  // namespace
}  // namespace tandem::log
