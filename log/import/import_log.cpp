#include "log/import/import_log.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/bounds.hpp"
#include "base/open_file.hpp"
#include "base/sha256.hpp"
#include "base/utf8.hpp"
#include "log/compression.hpp"
#include "log/import/sources.hpp"
#include "log/mcap_format.hpp"
#include "log/recorder.hpp"

namespace tandem::log {
namespace {

constexpr std::size_t kMagicBytes = 8;

/// A file's bytes into `hash`, in pieces: a bag need not fit into memory.
Status hash_bytes(const ImportFile& file, Sha256& hash) {
  std::vector<std::byte> block(std::size_t{1} << 20);
  for (off_t at = 0;;) {
    const ssize_t size = ::pread(file.file->get(), block.data(), block.size(), at);
    if (size < 0) {
      return std::unexpected(Error{"reading failed", "check the disk", file.path, 0, {}});
    }
    if (size == 0) return {};
    hash.update(std::span(block).first(static_cast<std::size_t>(size)));
    at += size;
  }
}

/// Errors: there is nothing to write to, or no space.
Status write_piece(const Descriptor& out, std::span<const std::byte> piece,
                   const std::string& folder) {
  const int problem = write_all(out, {reinterpret_cast<const char*>(piece.data()), piece.size()});
  if (problem == 0) return {};
  return fail("cannot be unpacked in " + folder + ": " + std::strerror(problem),
              "free some space there, or name another folder: TMPDIR=FOLDER tandem …");
}

/// A file that is packed as a whole, as rosbag2 leaves "bag_0.mcap.zstd", becomes what is in it:
/// a file without a name, which goes with its descriptor. Errors: it is damaged or cut, holds more
/// than bounds.hpp allows, or there is no space for it.
Status unpack_file(ImportFile& file) {
  constexpr std::uint64_t kAnyPacked = std::uint64_t{256} << 20;  // bytes that any file may hold
  std::array<std::byte, 4> magic{};
  if (::pread(file.file->get(), magic.data(), magic.size(), 0) < 0) return {};  // hash_bytes() says
  const Compression compression = packed_by(magic);
  if (compression == Compression::kNone) return {};
  std::error_code ignored;
  const std::string folder = std::filesystem::temp_directory_path(ignored).string();
  Descriptor out(::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  if (!out.valid()) return fail("cannot be unpacked in " + folder + ": " + std::strerror(errno));
  std::vector<std::byte> block(std::size_t{1} << 20);
  std::uint64_t packed = 0, plain = 0;
  const auto more = [&]() -> Result<std::span<const std::byte>> {
    const ssize_t size =
        ::pread(file.file->get(), block.data(), block.size(), static_cast<off_t>(packed));
    if (size < 0) return fail("reading failed", "check the disk");
    packed += static_cast<std::uint64_t>(size);
    return std::span<const std::byte>(block).first(static_cast<std::size_t>(size));
  };
  const auto take = [&](std::span<const std::byte> piece) -> Status {
    plain += piece.size();
    if (plain > kAnyPacked && plain / bounds::kLogGrowth.most > packed)
      return std::unexpected(beyond(bounds::kLogGrowth));
    return write_piece(out, piece, folder);
  };
  Status done = unpack(compression, more, take);
  if (!done && done.error().hint.empty()) done.error().hint = "copy it again";
  if (!done) {
    done.error().file = file.path;
    return done;
  }
  file.file = std::make_shared<const Descriptor>(std::move(out));
  return {};
}

/// A table in Latin-1, as instruments write it for the sign of a degree, becomes UTF-8: its numbers
/// are the same either way. @return whether it was
bool to_utf8(std::string& text) {
  if (is_utf8(text)) return false;
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80) out += static_cast<char>(0xC0U | (byte >> 6U));
    out += byte < 0x80 ? c : static_cast<char>(0x80U | (byte & 0x3FU));
  }
  text = std::move(out);
  return true;
}

/// Checks that a table is text. Errors: bytes that no text has, such as a picture's or UTF-16's.
Status is_text(const ImportFile& file) {
  const auto control = [](char c) {
    return static_cast<unsigned char>(c) < 0x20 &&
           std::string_view("\t\n\v\f\r").find(c) == std::string_view::npos;
  };
  const auto found = std::ranges::find_if(file.text, control);
  if (found == file.text.end()) return {};
  if (file.text.starts_with("\xFF\xFE") || file.text.starts_with("\xFE\xFF")) {
    return std::unexpected(
        Error{"is in UTF-16", "convert it: iconv -f UTF-16 -t UTF-8 FILE > NEW", file.path, 0, {}});
  }
  return std::unexpected(
      Error{"is no text: byte " + std::to_string(found - file.text.begin()) + " is no character",
            "give a table in UTF-8, Latin-1 or ASCII, or a bag in MCAP",
            file.path,
            0,
            {}});
}

/// Checks that a table is no JSON. Errors: objects or lists, as a whole or one on each line.
Status is_no_json(const ImportFile& file) {
  constexpr std::string_view kSpaces = " \t\r\n";
  const std::string_view text = file.text;
  const std::size_t begin = text.find_first_not_of(kSpaces);
  if (begin == std::string_view::npos) return {};
  const std::size_t second = text.find_first_not_of(kSpaces, begin + 1);
  const char first = text[begin], next = second == std::string_view::npos ? '\0' : text[second];
  const char last = text[text.find_last_not_of(kSpaces)];
  const bool object = first == '{' && next == '"';
  const bool list = first == '[' && last == ']' && (next == '{' || next == '[');
  if (!object && !list) return {};
  return std::unexpected(
      Error{"is JSON, and no table",
            "write a line of text for each sample; of a list of objects: jq -r '(.[0] | "
            "keys_unsorted) as $k | $k, (.[] | [.[$k[]]]) | @csv' FILE > NEW; of objects one after "
            "the other: the same with -rs",
            file.path,
            0,
            {}});
}

bool begins(std::string_view text, std::string_view magic) { return text.starts_with(magic); }

/// What a file is by its first bytes. Errors: a kind that is known and not read.
Result<bool> is_bag(const ImportFile& file) {
  const std::string& path = file.path;
  std::array<char, 16> head{};
  const ssize_t size = ::pread(file.file->get(), head.data(), head.size(), 0);
  const std::string_view first(head.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  const auto refuse = [&](std::string message, std::string hint) {
    return std::unexpected(Error{std::move(message), std::move(hint), path, 0, {}});
  };
  if (begins(first, "SQLite format 3")) {
    return refuse("is a bag in SQLite",
                  "convert its folder: ros2 bag convert -i FOLDER -o NEW.yaml, where NEW.yaml says "
                  "output_bags: [{uri: NEW, storage_id: mcap, all: true}]");
  }
  if (begins(first, "#ROSBAG V")) {
    return refuse("is a bag of ROS 1", "convert it: mcap convert FILE.bag NEW.mcap");
  }
  if (begins(first, "\x1F\x8B")) return refuse("is compressed twice", "decompress it: gunzip");
  if (begins(first, "PK\x03\x04")) {
    return refuse("is a ZIP archive, as spreadsheets (.xlsx, .ods) are",
                  "unpack it: unzip; of a spreadsheet: save it as CSV");
  }
  const auto magic = std::as_bytes(std::span(head)).first(kMagicBytes);
  if (first.size() >= kMagicBytes && std::ranges::equal(magic, kMagic)) return true;
  if (path.ends_with(".mcap") || path.find(".mcap.") != std::string::npos) {
    return refuse(first.empty() ? "is empty" : "is no MCAP file: it does not begin as one",
                  "give the bag's .mcap file; a table needs another ending");
  }
  return false;
}

/// "position_rad", "command torque_nm": what the recording fills, each once.
std::vector<std::string> filled_fields(const ImportedRecording& recording) {
  std::vector<std::string> fields;
  for (const ImportedSeries& series : recording.series) {
    for (const ImportedColumn& column : series.columns) {
      const std::string name = (column.target.command ? "command " : "") + column.target.field;
      if (std::ranges::find(fields, name) == fields.end()) fields.push_back(name);
    }
  }
  return fields;
}

bool has_command(const ImportMap& map) {
  return std::ranges::any_of(map.signals, &SignalMap::command);
}

StringMap counts_of(const ImportRequest& request, const Imported& imported,
                    const ImportSummary& summary) {
  const Exclusions& out = summary.excluded;
  const auto listed = [](const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
  };
  return {{"imported_from", listed(request.files)},
          {"source_sha256", imported.sha256},
          {"source_begin_ns", std::to_string(summary.begin_ns)},
          {"excluded_invalid", std::to_string(out.invalid)},
          {"excluded_ragged", std::to_string(out.ragged)},
          {"excluded_duplicates", std::to_string(out.duplicates)},
          {"excluded_backwards", std::to_string(out.backwards)},
          {"excluded_gaps", std::to_string(out.gaps)},
          {"excluded_gap_cycles", std::to_string(out.gap_cycles)},
          {"excluded_frozen", listed(out.frozen)},
          {"ignored", listed(out.ignored)},
          {"missing_joints", listed(summary.missing)},
          {"taken", listed(summary.notes)}};
}

/// Every cycle into the log.
void write_cycles(Sampler& sampler, const hal::RobotConfig& robot, bool command, Recorder& recorder,
                  ImportSummary& summary) {
  hal::StateImage state(robot.shape());
  hal::CommandImage sent(robot.shape());
  const Recorder::Channel states =
      recorder.add_channel("/tandem/state", "tandem/msg/State", state.layout());
  const Recorder::Channel commands =
      command ? recorder.add_channel("/tandem/command", "tandem/msg/Command", sent.layout())
              : states;
  recorder.start();
  std::uint64_t missing = 0;  // cycles of the gap that is going on
  for (std::uint64_t cycle = 0; cycle < sampler.cycles(); ++cycle) {
    if (!sampler.fill(cycle, state, sent)) {
      ++missing;
      continue;
    }
    recorder.wait_for_space(3);
    if (missing > 0) {
      summary.excluded.gap_cycles += missing;
      recorder.push(Event{.cycle = cycle,
                          .time_ns = state.time_ns()[0],
                          .code = static_cast<std::uint32_t>(std::min<std::uint64_t>(missing, ~0U)),
                          .kind = EventKind::kGap});
      missing = 0;
    }
    recorder.push(states, state.time_ns()[0], state.bytes());
    if (command) recorder.push(commands, state.time_ns()[0], sent.bytes());
    ++summary.cycles;
  }
}

}  // namespace

std::expected<Imported, Diagnostics> read_recording(const ImportRequest& request,
                                                    const hal::RobotConfig& robot) {
  const auto refuse = [](Error error) { return std::unexpected(Diagnostics{std::move(error)}); };
  Imported imported;
  std::vector<ImportFile> files;
  std::vector<std::string> latin1;
  Sha256 hash;
  for (const std::string& path : request.files) {
    Result<Descriptor> open = open_to_read(path, "name the .mcap files of a bag in their order");
    if (!open) return refuse(open.error());
    ImportFile file{path, std::make_shared<const Descriptor>(std::move(*open)), {}};
    if (Status read = hash_bytes(file, hash); !read) return refuse(read.error());
    if (Status plain = unpack_file(file); !plain) return refuse(plain.error());
    const Result<bool> bag = is_bag(file);
    if (!bag) return refuse(bag.error());
    if (!files.empty() && *bag != imported.bag) {
      return refuse({"is a bag beside a table, or the other way round",
                     "import them one at a time",
                     path,
                     0,
                     {}});
    }
    imported.bag = *bag;
    if (!*bag) {
      Result<std::string> text = read_all(*file.file, path, kMostTableBytes);
      if (!text) return refuse(text.error());
      file.text = std::move(*text);
    }
    if (Status text = is_text(file); !text) return refuse(text.error());
    if (Status table = is_no_json(file); !table) return refuse(table.error());
    if (to_utf8(file.text)) latin1.push_back(path);
    files.push_back(std::move(file));
  }
  imported.sha256 = hash.finish();
  Result<std::string> map_text = read_file(request.map, "name a .toml file", kMostTomlBytes);
  if (!map_text) return refuse(map_text.error());
  imported.map_text = std::move(*map_text);
  auto map = parse_import_map(imported.map_text, request.map, robot, imported.bag);
  if (!map) return std::unexpected(map.error());
  imported.map = std::move(*map);
  auto recording = imported.bag ? read_bag_recording(files, imported.map, robot)
                                : read_csv_recording(files, imported.map, robot);
  if (!recording) return refuse(recording.error());
  imported.recording = std::move(*recording);
  for (const std::string& path : latin1)
    imported.recording.notes.push_back(path + " is no UTF-8: taken for Latin-1");
  if (Status s = clean(imported.recording, imported.map, robot); !s) return refuse(s.error());
  return imported;
}

std::expected<ImportSummary, Diagnostics> import_log(const ImportRequest& request,
                                                     const hal::RobotConfig& robot, RunInfo info,
                                                     const std::string& urdf) {
  const auto refuse = [](Error error) { return std::unexpected(Diagnostics{std::move(error)}); };
  auto imported = read_recording(request, robot);
  if (!imported) return std::unexpected(imported.error());
  auto sampler = Sampler::create(imported->recording, imported->map, robot);
  if (!sampler) return refuse(sampler.error());
  ImportSummary summary{.bag = imported->bag,
                        .cycles = 0,
                        .period_ns = imported->map.period_ns,
                        .begin_ns = sampler->begin_ns(),
                        .series = spacings(imported->recording),
                        .excluded = imported->recording.excluded,
                        .fields = filled_fields(imported->recording),
                        .missing = {},
                        .notes = imported->recording.notes,
                        .log = {}};
  for (const auto& [joint, place] : imported->map.missing) {
    summary.missing.push_back(robot.joints[joint].name);
  }
  info.period_ns = summary.period_ns;
  info.configuration.emplace_back(request.map, imported->map_text);
  RecorderOptions options;
  options.writer.compression = Compression::kLz4;
  options.viewed.urdf = urdf;
  options.viewed.followers = robot.followers;
  auto recorder = Recorder::open(request.output, info, options);
  if (!recorder) return refuse(recorder.error());
  write_cycles(*sampler, robot, has_command(imported->map), **recorder, summary);
  summary.log = (*recorder)->close(counts_of(request, *imported, summary));
  if (!summary.log.error.empty()) {
    return refuse(
        {summary.log.error, "free some space, or choose another folder", request.output, 0, {}});
  }
  return summary;
}

}  // namespace tandem::log
