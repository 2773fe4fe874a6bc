// A bit of a log is wrong: what it hits is left out and said, and the rest is read.
#include <fstream>
#include <functional>
#include <map>
#include <optional>

#include "log/compare.hpp"
#include "log/joint_motion.hpp"
#include "log/log_file.hpp"
#include "log/mcap_index.hpp"
#include "log/mcap_reader.hpp"
#include "log/mcap_writer.hpp"
#include "log/recorder.hpp"
#include "tests/log/scratch_folder.hpp"

namespace tandem::log {
namespace {

/// Everything that a reader finds in a file.
struct Found {
  std::map<std::pair<std::uint16_t, std::uint32_t>, std::string> messages;  // by channel, sequence
  std::map<std::uint16_t, std::string> topics;
  std::map<std::string, StringMap> metadata;
  std::vector<Damage> damage;
  bool truncated = false;

  [[nodiscard]] bool loses() const {
    return truncated || std::ranges::any_of(damage, &Damage::loses_messages);
  }
};

std::optional<Found> find_all(const std::string& path) {
  auto reader = McapReader::open(path);
  if (!reader) return std::nullopt;
  Found found;
  for (;;) {
    const auto message = reader->next();
    if (!message) return std::nullopt;
    if (!message->has_value()) break;
    const MessageView& view = **message;
    std::string all = std::to_string(view.time_ns) + ": ";
    all.append(reinterpret_cast<const char*>(view.data.data()), view.data.size());
    found.messages.emplace(std::pair(view.channel, view.sequence), all);
  }
  for (const auto& [id, channel] : reader->channels()) found.topics[id] = channel.topic;
  found.metadata = reader->metadata();
  found.damage = reader->damage();
  found.truncated = reader->truncated();
  return found;
}

/// One byte of a file, in its place.
void put(const std::string& path, std::size_t at, char byte) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(at)).put(byte);
}

std::string flipped(std::string bytes, std::size_t at, int bit) {
  bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
  return bytes;
}

McapIndex index_of(const std::string& path) {
  const auto file = open_to_read(path, "");
  EXPECT_TRUE(file);
  return read_index(*file, content(path).size());
}

/// 24 messages of two channels in chunks of 4 ms, between metadata, as in a run's log.
struct DamagedFile : testing::TestWithParam<Compression> {
  void SetUp() override {
    McapWriter writer;
    ASSERT_TRUE(writer.open(path, {.compression = GetParam(), .chunk_span_ns = 4'000'000}));
    writer.add_metadata("first", {{"key", "value"}, {"empty", ""}});
    const auto schema = writer.add_schema("tandem/msg/Value", "ros2msg", "float64 value\n");
    const auto a = writer.add_channel(schema, "/a", "cdr");
    const auto b = writer.add_channel(schema, "/b", "cdr");
    for (int i = 0; i < 12; ++i) {
      for (const auto channel : {a, b})
        ASSERT_TRUE(writer.write(channel, i * 1'000'000, bytes("head"), bytes("12345678")));
    }
    writer.add_metadata("last", {{"done", "yes"}});
    ASSERT_TRUE(writer.close());
    whole = content(path);
    all = *find_all(path);
    ASSERT_EQ(all.messages.size(), 24U);
    ASSERT_TRUE(all.damage.empty());
  }
  /// Reads the file with one wrong bit after the other: all of what frames records, else one of
  /// each byte. @param from  the first of them  @param size  of the file
  void read_with_wrong_bits(std::size_t from, std::size_t size,
                            const std::function<void(std::size_t, const Found&)>& look) const {
    std::vector<bool> frames(size, false);
    for (const RecordPlace& place : index_of(path).places) {
      for (std::size_t i = 0; i < 64; ++i) {
        for (const std::uint64_t at : {place.at + i, place.at + place.bytes + i})
          if (at < size) frames[at] = true;
      }
    }
    overwrite(path, whole.substr(0, size));
    for (std::size_t at = from; at < size; ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        if (!frames[at] && bit != static_cast<int>(at % 8)) continue;
        put(path, at, static_cast<char>(whole[at] ^ (1 << bit)));
        const auto found = find_all(path);
        ASSERT_TRUE(found) << "byte " << at << ", bit " << bit;
        ASSERT_NO_FATAL_FAILURE(look(at, *found)) << "byte " << at << ", bit " << bit;
      }
      put(path, at, whole[at]);
    }
  }
  /// What is found is as it was written, and what is not is said.
  void expect_honest(const Found& found) const {
    for (const auto& [key, message] : found.messages) {
      const auto written = all.messages.find(key);
      ASSERT_TRUE(written != all.messages.end() && written->second == message);
    }
    ASSERT_TRUE(found.messages.size() == all.messages.size() || found.loses());
    const bool same = found.metadata == all.metadata && found.topics == all.topics;
    ASSERT_TRUE(same || found.truncated || !found.damage.empty());
  }

  const ScratchFolder folder;
  const std::string path = folder / "a.mcap";
  std::string whole;
  Found all;
};

// One bit made the whole log unreadable.
TEST_P(DamagedFile, OfWhoseChunksOneIsWrongIsReadWithoutIt) {
  std::vector<RecordPlace> chunks;
  for (const RecordPlace& place : index_of(path).places)
    if (place.opcode == Opcode::kChunk) chunks.push_back(place);
  ASSERT_EQ(chunks.size(), 3U);
  for (const RecordPlace& chunk : chunks) {  // the first one has the schemas and the channels, too
    overwrite(path, flipped(whole, chunk.at + chunk.bytes - 9, 3));
    const auto found = find_all(path);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->topics, all.topics);
    EXPECT_EQ(found->metadata, all.metadata);
    EXPECT_LT(found->messages.size(), 24U);
    EXPECT_GE(found->messages.size(), 14U);
    expect_honest(*found);
    ASSERT_EQ(found->damage.size(), 1U);
    const Damage& damage = found->damage[0];
    EXPECT_TRUE(damage.chunk && damage.loses_messages);
    EXPECT_EQ(damage.at, chunk.at);
    EXPECT_EQ(damage.bytes, chunk.bytes);
    EXPECT_EQ(damage.first_ns, chunk.first_ns);
    EXPECT_EQ(damage.last_ns, chunk.last_ns);
    for (const auto& [key, message] : all.messages) {
      const std::int64_t time_ns = std::stoll(message);
      const bool outside = time_ns < chunk.first_ns || time_ns > chunk.last_ns;
      EXPECT_TRUE(!outside || found->messages.contains(key));
    }
  }
}

/// In every record: nothing false is read, and nothing is lost without a word.
TEST_P(DamagedFile, IsReadHonestlyWhicheverBitIsWrong) {
  const McapIndex index = index_of(path);
  ASSERT_GT(index.data_end, 0U);
  const std::size_t header_end = index.places.at(0).at;
  read_with_wrong_bits(0, whole.size(), [&](std::size_t at, const Found& found) {
    ASSERT_NO_FATAL_FAILURE(expect_honest(found));
    ASSERT_FALSE(found.truncated);
    ASSERT_GE(found.messages.size(), 14U) << "no bit costs more than its chunk";
    ASSERT_TRUE(at < index.data_end || found.messages.size() == 24U);
    ASSERT_TRUE(at < header_end || at >= index.data_end || !found.damage.empty());
  });
}

/// The same of a run that was killed: nothing at the file's end says where its records are.
TEST_P(DamagedFile, IsReadHonestlyWithoutItsEndToo) {
  read_with_wrong_bits(kMagic.size(), index_of(path).places.back().end - 5,
                       [&](std::size_t, const Found& found) {
                         ASSERT_NO_FATAL_FAILURE(expect_honest(found));
                         ASSERT_TRUE(found.loses());
                       });
}

INSTANTIATE_TEST_SUITE_P(Packed, DamagedFile,
                         testing::Values(Compression::kNone, Compression::kLz4, Compression::kZstd),
                         [](const auto& one) {
                           return one.param == Compression::kNone
                                      ? std::string("Not")
                                      : std::string(mcap_name(one.param));
                         });

/// Two joints at 100 Hz for a second, in chunks of 200 ms.
struct DamagedLog : testing::Test {
  void SetUp() override {
    for (const std::string& one : {path, other}) {
      auto recorder = Recorder::open(
          one,
          {.robot = "two", .hal = "import", .joints = {"hip", "knee"}, .period_ns = 10'000'000},
          {});
      ASSERT_TRUE(recorder);
      hal::Layout layout;
      for (const char* name : {"position_rad", "velocity_rad_s", "torque_nm", "age_cycles"})
        layout.add(name, hal::FieldType::kF64, 2, "");
      const auto state = (*recorder)->add_channel("/tandem/state", "tandem/msg/State", layout);
      (*recorder)->start();
      for (int i = 0; i <= 100; ++i) {
        const double numbers[8] = {0.1 * i, 0.2 * i};
        (*recorder)->push(state, i * 10'000'000LL, std::as_bytes(std::span(numbers)));
      }
      EXPECT_EQ((*recorder)->close({{"loaded_controllers", "late 1\nlate 2"}}).messages, 101U);
    }
    for (const RecordPlace& place : index_of(path).places)
      if (place.opcode == Opcode::kChunk) chunks.push_back(place);
    ASSERT_GE(chunks.size(), 4U);
  }
  LogFile damaged(const RecordPlace& chunk) const {
    overwrite(path, flipped(content(other), chunk.at + chunk.bytes - 9, 3));
    auto log = LogFile::open(path);
    EXPECT_TRUE(log);
    return std::move(*log);
  }
  std::string motion_refusal(const LogFile& log, std::optional<double> to_s) const {
    const auto motion = read_joint_motion(
        log, {.joints = {"hip"}, .source = MotionSource::kState, .from_s = {}, .to_s = to_s});
    return motion ? "" : motion.error().message;
  }
  const ScratchFolder folder;
  const std::string path = folder / "run.mcap", other = folder / "whole.mcap";
  std::vector<RecordPlace> chunks;
};

TEST_F(DamagedLog, SaysWhatOfItIsLeftOut) {
  const LogFile log = damaged(chunks[2]);
  EXPECT_FALSE(log.truncated());
  EXPECT_TRUE(log.damage_loses_messages());
  EXPECT_EQ(log.remarks(),
            (std::vector<std::string>{
                "chunk of " + std::to_string(chunks[2].bytes) + " bytes at byte " +
                std::to_string(chunks[2].at) +
                ", 0.420 to 0.620 s: its checksum is wrong; its messages are left out"}));
  // Its run's count had stood there alone, and the two lines as one.
  const StringMap shown = log.shown_result();
  EXPECT_EQ(value_of(shown, "messages"), "80 of 101");
  EXPECT_EQ(std::ranges::count(shown, std::string("loaded_controllers"),
                               [](const auto& one) { return one.first; }),
            2);
  EXPECT_EQ(value_of(shown, "loaded_controllers"), "late 1");
  EXPECT_EQ(value_of(LogFile::open(other)->shown_result(), "messages"), "101");
  const auto table = log.read("/tandem/state", {{"position_rad", 0}});
  ASSERT_TRUE(table);
  EXPECT_EQ(table->time_s.size(), 80U);
  EXPECT_EQ(table->columns[0].back(), 10.0);
  const LogFile first = damaged(chunks[0]);
  EXPECT_EQ(first.find("/tandem/state")->messages, 80U) << "what its topics are stood there";
  EXPECT_EQ(LogFile::open(other)->remarks(), std::vector<std::string>());
}

TEST_F(DamagedLog, IsNotComparedBitForBit) {
  const auto whole = LogFile::open(other);
  ASSERT_TRUE(whole);
  const LogFile log = damaged(chunks[2]);
  for (const auto& compared : {compare(log, *whole), compare(*whole, log), compare(log, log)}) {
    ASSERT_FALSE(compared);
    EXPECT_EQ(compared.error().file, path);
    EXPECT_TRUE(compared.error().message.starts_with(
        "is damaged, so it is not comparable bit for bit: chunk of "))
        << compared.error().message;
  }
  // All messages are here: these are compared.
  overwrite(path, flipped(content(other), content(other).find("two"), 1));
  const auto metadata = LogFile::open(path);
  ASSERT_TRUE(metadata);
  EXPECT_EQ(metadata->remarks().at(0), "a bit outside of the messages is wrong; they are all here");
  const auto compared = compare(*metadata, *whole);
  ASSERT_TRUE(compared);
  EXPECT_TRUE(compared->equal());
}

TEST_F(DamagedLog, IsPlayedWhereItIsWholeAlone) {
  EXPECT_EQ(motion_refusal(*LogFile::open(other), {}), "");
  const LogFile last = damaged(chunks.back());
  EXPECT_TRUE(motion_refusal(last, {}).starts_with("the log is damaged: chunk of "))
      << motion_refusal(last, {});
  EXPECT_EQ(motion_refusal(last, 0.7), "");
  const LogFile middle = damaged(chunks[2]);
  EXPECT_TRUE(motion_refusal(middle, 0.9).starts_with("joint 'hip' has a gap"))
      << motion_refusal(middle, 0.9);
}

}  // namespace
}  // namespace tandem::log
