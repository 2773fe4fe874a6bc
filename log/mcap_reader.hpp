// Reads an MCAP file record by record, also one whose writer was killed, and checks what it
// reads: lengths, checksums, ids. What is damaged is left out and said.
// Layer: log.  Thread: one at a time, non-RT.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/open_file.hpp"
#include "base/result.hpp"
#include "log/bytes.hpp"
#include "log/damage.hpp"
#include "log/mcap_format.hpp"
#include "log/mcap_index.hpp"

namespace tandem::log {

struct SchemaRecord {
  std::uint16_t id = 0;
  std::string name, encoding, text;
};

struct ChannelRecord {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic, message_encoding;
};

/// Valid until the next call of the reader.
struct MessageView {
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::int64_t time_ns = 0;
  std::span<const std::byte> data;  ///< with its CDR header
};

class McapReader {
 public:
  /// Errors: open_to_read()'s; no MCAP.
  [[nodiscard]] static Result<McapReader> open(const std::string& path);
  /// The same of a file that is open: several readers may have it. @param path  for errors
  [[nodiscard]] static Result<McapReader> open(std::shared_ptr<const Descriptor> file,
                                               const std::string& path);

  /// The next message in the file's order, or none at the end of the data. A file that ends in
  /// the middle of a record ends there, with truncated() true. A chunk or record that is damaged is
  /// passed over and added to damage(). Errors: the disk; what is beyond a bound.
  [[nodiscard]] Result<std::optional<MessageView>> next();

  /// Those met so far: the first message's are all known once it has been read.
  [[nodiscard]] const std::map<std::uint16_t, ChannelRecord>& channels() const { return channels_; }
  [[nodiscard]] const std::map<std::uint16_t, SchemaRecord>& schemas() const { return schemas_; }
  /// By name. The run's own stand before the first message, its result behind the last.
  [[nodiscard]] const std::map<std::string, StringMap>& metadata() const { return metadata_; }
  [[nodiscard]] const std::string& profile() const { return profile_; }
  /// The end of the data is missing: the run was killed, or is still being written.
  [[nodiscard]] bool truncated() const { return truncated_; }
  /// What was left out so far. At the end of a file of Tandem no wrong bit before its summary is
  /// without a word here.
  [[nodiscard]] const std::vector<Damage>& damage() const { return damage_; }
  /// Size of the whole file.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  [[nodiscard]] Status read_record();
  [[nodiscard]] Status read_placed(const RecordPlace& place);
  [[nodiscard]] Status pass_over(Damage place, std::uint64_t to, std::string what);
  [[nodiscard]] Status take_record(Opcode opcode, Damage place);
  /// False: it is shorter than its content.
  [[nodiscard]] Result<bool> take(Opcode opcode, std::span<const std::byte> content);
  [[nodiscard]] Status open_chunk(Damage place);
  [[nodiscard]] Status end(bool whole);
  [[nodiscard]] Result<std::optional<MessageView>> next_in_chunk();
  [[nodiscard]] Status note(Damage damage, std::string what);
  [[nodiscard]] Status leave_chunk(std::string what);
  [[nodiscard]] std::unexpected<Error> unreadable() const;
  [[nodiscard]] Status count_text(std::size_t bytes);
  [[nodiscard]] bool read(std::span<std::byte> into);
  [[nodiscard]] bool skip(std::uint64_t bytes);

  std::string path_, profile_;
  std::shared_ptr<const Descriptor> file_;
  McapIndex index_;
  std::size_t next_place_ = 0;
  std::uint64_t bytes_ = 0;
  std::uint64_t left_ = 0;      // bytes of the file not read yet
  std::uint64_t unpacked_ = 0;  // bytes of chunks so far
  std::size_t texts_ = 0;       // bytes of schemas, channels and metadata so far
  bool ended_ = false, truncated_ = false;
  bool ours_ = false;             // Tandem wrote it: then it is known which records there can be
  std::uint32_t crc_ = 0;         // of what was read so far
  std::uint32_t record_crc_ = 0;  // up to the record that is read
  std::vector<Damage> damage_;
  Bytes ahead_;  // read from the file and not taken yet, from ahead_at_ on
  std::size_t ahead_at_ = 0;
  Bytes record_, chunk_;
  Damage chunk_place_;  // of the chunk that is open
  std::size_t chunk_at_ = 0;
  std::map<std::uint16_t, SchemaRecord> schemas_;
  std::map<std::uint16_t, ChannelRecord> channels_;
  std::map<std::string, StringMap> metadata_;
};

}  // namespace tandem::log
