// Logs whose numbers ask for more than they hold.
#include <filesystem>
#include <fstream>

#include "base/bounds.hpp"
#include "log/compression.hpp"
#include "log/info.hpp"
#include "log/log_file.hpp"
#include "log/mcap_format.hpp"
#include "log/mcap_reader.hpp"
#include "log/schema.hpp"
#include "tests/log/scratch_folder.hpp"
#include "tests/support/little_room.hpp"

namespace tandem::log {
namespace {

Bytes record(Opcode opcode, const Bytes& content) {
  Bytes out;
  append(out, static_cast<std::uint8_t>(opcode));
  append(out, static_cast<std::uint64_t>(content.size()));
  append(out, std::span<const std::byte>(content));
  return out;
}

Bytes chunk_of(const Bytes& records) {
  Bytes packed, content;
  compress(Compression::kZstd, records, packed);
  for (int i = 0; i < 2; ++i) append(content, std::uint64_t{0});
  append(content, static_cast<std::uint64_t>(records.size()));
  append(content, std::uint32_t{0});
  append(content, std::string_view("zstd"));
  append(content, static_cast<std::uint64_t>(packed.size()));
  append(content, std::span<const std::byte>(packed));
  return record(Opcode::kChunk, content);
}

struct LogBounds : testing::Test {
  void write(std::initializer_list<Bytes> parts) const {
    std::ofstream out(path, std::ios::binary);
    const auto put = [&](std::span<const std::byte> bytes) {
      out.write(reinterpret_cast<const char*>(bytes.data()),
                static_cast<std::streamsize>(bytes.size()));
    };
    put(kMagic);
    for (const Bytes& part : parts) put(part);
  }
  [[nodiscard]] std::string opened() const {
    const auto log = LogFile::open(path);
    return log ? "" : log.error().message;
  }
  ScratchFolder folder;
  std::string path = folder / "log.mcap";
};

TEST_F(LogBounds, RefuseARecordThatALargeFileWithNothingInItClaims) {
  Bytes head = record(Opcode::kMessage, {});
  store(head.data() + 1, std::uint64_t{10} << 30);
  write({head});
  std::filesystem::resize_file(path, std::uint64_t{11} << 30);  // takes no space on the disk
  EXPECT_IN_LITTLE_ROOM(opened() == "has more than 134217728 bytes in a record or chunk");
}

TEST_F(LogBounds, PassOverARecordThatNobodyReads) {
  Bytes attachment = record(static_cast<Opcode>(0x09), {});
  store(attachment.data() + 1, std::uint64_t{10} << 30);
  write({attachment});
  std::filesystem::resize_file(path, (std::uint64_t{10} << 30) + attachment.size() + kMagic.size());
  std::ofstream more(path, std::ios::binary | std::ios::app);
  Bytes metadata;
  append(metadata, std::string_view("result"));
  append(metadata, std::uint32_t{0});
  const Bytes last = record(Opcode::kMetadata, metadata);
  more.write(reinterpret_cast<const char*>(last.data()), static_cast<std::streamsize>(last.size()));
  more.close();
  EXPECT_IN_LITTLE_ROOM(opened().empty());
}

TEST_F(LogBounds, RefuseWhatUnpacksToFarMoreThanItIs) {
  Bytes zeros(16 << 20, std::byte{0});
  const Bytes chunk = chunk_of(record(static_cast<Opcode>(0x70), zeros));
  Bytes many;
  for (int i = 0; i < 40; ++i) append(many, std::span<const std::byte>(chunk));
  write({many});
  EXPECT_IN_LITTLE_ROOM(opened() == "has more than 500 times its size when unpacked");
}

TEST_F(LogBounds, RefuseTextsWithoutEnd) {
  Bytes schema;
  append(schema, std::uint16_t{1});
  append(schema, std::string_view("name"));
  append(schema, std::string_view("ros2msg"));
  append(schema, std::string_view(std::string(20 << 20, 'x')));
  const Bytes one = record(Opcode::kSchema, schema);
  Bytes four;
  for (int i = 0; i < 4; ++i) append(four, std::span<const std::byte>(one));
  write({chunk_of(four)});
  EXPECT_IN_LITTLE_ROOM(opened() ==
                        "has more than 67108864 bytes of schemas, channels and metadata");
}

TEST_F(LogBounds, OfAMessagesDefinition) {
  std::string many, large;
  for (int i = 0; i < 1'001; ++i) many += "uint8 f" + std::to_string(i) + "\n";
  for (int i = 0; i < 3; ++i) large += "float64[40000] f" + std::to_string(i) + "\n";
  EXPECT_EQ(layout_of(many).error().message, "has more than 1000 fields of a message");
  EXPECT_EQ(layout_of(large).error().message, "has more than 100000 numbers in a message");
}

TEST_F(LogBounds, OfWhatALogSaysOfItsRun) {
  std::string joints;
  for (int i = 0; i < 20'000; ++i) joints += "j\n";
  const RunInfo info =
      info_from({{"joints", joints}, {"sensors", "s 18446744073709551615\n"}, {"period_ns", "1"}});
  EXPECT_EQ(info.joints.size(), bounds::kLogNames.most);
  EXPECT_EQ(info.sensors.at(0).channels, bounds::kLogNames.most);
  EXPECT_EQ(info.period_ns, 0);
}

}  // namespace
}  // namespace tandem::log
