#include "log/mcap_reader.hpp"

#include <fstream>
#include <iterator>

#include "log/mcap_writer.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

/// 100 messages of 12 bytes, a chunk every 10 ms.
void write_sample(const std::string& path, Compression compression = Compression::kLz4) {
  McapWriter writer;
  ASSERT_TRUE(writer.open(path, {.compression = compression, .chunk_span_ns = 10'000'000}));
  writer.add_metadata("first", {{"key", "value"}, {"empty", ""}});
  const auto schema = writer.add_schema("tandem/msg/Value", "ros2msg", "float64 value\n");
  const auto channel = writer.add_channel(schema, "/a", "cdr");
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(writer.write(channel, i * 1'000'000, bytes("head"), bytes("12345678")));
  }
  writer.add_metadata("last", {{"done", "yes"}});
  ASSERT_TRUE(writer.close());
}

/// Messages until the end, or -1 after an error.
int count(McapReader& reader) {
  for (int found = 0;; ++found) {
    const auto message = reader.next();
    if (!message) return -1;
    if (!message->has_value()) return found;
    EXPECT_EQ((*message)->sequence, static_cast<std::uint32_t>(found));
    EXPECT_EQ((*message)->time_ns, found * 1'000'000);
    EXPECT_EQ((*message)->data.size(), 12U);
  }
}

TEST(McapReader, ReadsEveryMessageSchemaChannelAndMetadata) {
  const ScratchFolder folder;
  for (const Compression one : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    const std::string path = folder / "a.mcap";
    write_sample(path, one);
    auto reader = McapReader::open(path);
    ASSERT_TRUE(reader);
    EXPECT_EQ(count(*reader), 100);
    EXPECT_FALSE(reader->truncated());
    EXPECT_EQ(reader->profile(), "ros2");
    ASSERT_EQ(reader->channels().size(), 1U);
    EXPECT_EQ(reader->channels().at(0).topic, "/a");
    EXPECT_EQ(reader->schemas().at(1).text, "float64 value\n");
    EXPECT_EQ(reader->metadata().at("first"), (StringMap{{"key", "value"}, {"empty", ""}}));
    EXPECT_EQ(reader->metadata().at("last"), (StringMap{{"done", "yes"}}));
  }
}

TEST(McapReader, ReadsAFileThatIsCutAnywhere) {
  const ScratchFolder folder;
  const std::string path = folder / "a.mcap";
  write_sample(path);
  const std::string whole = content(path);
  int most = 0;
  for (std::size_t size = 8; size < whole.size(); size += 7) {
    overwrite(path, whole.substr(0, size));
    auto reader = McapReader::open(path);
    ASSERT_TRUE(reader);
    const int found = count(*reader);
    ASSERT_GE(found, most) << size;  // a longer file never gives fewer messages, nor an error
    most = found;
    EXPECT_TRUE(found == 100 || reader->truncated()) << size;
  }
  EXPECT_EQ(most, 100);
}

TEST(McapReader, NamesAFileThatIsMissingOrNoMcap) {
  const ScratchFolder folder;
  EXPECT_EQ(McapReader::open(folder / "none.mcap").error().file, folder / "none.mcap");
  overwrite(folder / "text.mcap", "hello, world");
  EXPECT_NE(McapReader::open(folder / "text.mcap").error().message.find("no MCAP"),
            std::string::npos);
  EXPECT_FALSE(McapReader::open(folder.path()));
}

}  // namespace
}  // namespace tandem::log
