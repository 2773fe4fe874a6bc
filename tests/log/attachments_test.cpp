// Files within a log: written, found without reading the messages, and checked.
#include "log/attachments.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "log/mcap_reader.hpp"
#include "log/mcap_writer.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

Bytes bytes_of(std::string_view text) {
  const auto all = bytes(text);
  return {all.begin(), all.end()};
}

/// Two attachments, of which the second is after the only message.
std::string written(const ScratchFolder& folder) {
  const std::string path = (folder / "attached.mcap");
  McapWriter writer;
  EXPECT_TRUE(writer.open(path, {}));
  writer.add_metadata("first", {{"key", "value"}});
  const auto schema = writer.add_schema("type", "ros2msg", "uint8 one");
  const auto channel = writer.add_channel(schema, "/topic", "cdr");
  writer.add_attachment("one", 5, bytes_of("the first"));
  writer.write(channel, 7, bytes_of("head"), bytes_of("body"));
  writer.add_attachment("other", 9, Bytes(100'000, std::byte{3}));
  EXPECT_TRUE(writer.close());
  return path;
}

TEST(Attachments, AreFoundAndReadBack) {
  const ScratchFolder folder;
  const std::string path = written(folder);
  const auto all = attachments_of(path);
  ASSERT_TRUE(all) << all.error().to_string();
  ASSERT_EQ(all->size(), 2U);
  EXPECT_EQ((*all)[0].name, "one");
  EXPECT_EQ((*all)[0].time_ns, 5);
  EXPECT_EQ(read_attachment((*all)[0]), bytes_of("the first"));
  EXPECT_EQ((*all)[1].name, "other");
  EXPECT_EQ(read_attachment((*all)[1]), Bytes(100'000, std::byte{3}));

  auto reader = McapReader::open(path);
  ASSERT_TRUE(reader);
  const auto message = reader->next();
  ASSERT_TRUE(message && message->has_value());
  EXPECT_EQ((*message)->time_ns, 7);
  ASSERT_TRUE(reader->next());
  EXPECT_TRUE(reader->damage().empty()) << reader->damage()[0].what;
}

TEST(Attachments, OfWhichOneIsDamagedAreTheOthers) {
  const ScratchFolder folder;
  const std::string path = written(folder);
  std::string text = content(path);
  text[text.find("the first")] = 'T';
  overwrite(path, text);
  const auto all = attachments_of(path);
  ASSERT_TRUE(all && all->size() == 2U);
  const auto wrong = read_attachment((*all)[0]);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().message, "the attachment 'one' is damaged");
  EXPECT_TRUE(read_attachment((*all)[1]));
}

TEST(Attachments, OfAFileThatWasCutAreThoseBefore) {
  const ScratchFolder folder;
  const std::string path = written(folder);
  std::filesystem::resize_file(path, 50'000);
  const auto all = attachments_of(path);
  ASSERT_TRUE(all) << all.error().to_string();
  ASSERT_EQ(all->size(), 1U);
  EXPECT_EQ((*all)[0].name, "one");
  overwrite(path, "no log");
  const auto none = attachments_of(path);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message, "this is no MCAP file");
}

}  // namespace
}  // namespace tandem::log
