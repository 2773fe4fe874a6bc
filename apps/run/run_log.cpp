#include "apps/run/run_log.hpp"

#include <fmt/core.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <utility>

#include "base/open_file.hpp"
#include "hal/sim/engine_loader.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

/// The machine, and its wall clock: what is not known stays empty.
void add_place_and_time(log::RunInfo& info) {
  std::array<char, 256> text{};
  if (::gethostname(text.data(), text.size() - 1) == 0) info.host = text.data();
  const std::time_t now = std::time(nullptr);
  std::tm utc{}, local{};
  if (::gmtime_r(&now, &utc) == nullptr || ::localtime_r(&now, &local) == nullptr) return;
  if (std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc) > 0) {
    info.started = text.data();
  }
  if (std::strftime(text.data(), text.size(), "%z %Z", &local) > 0) info.time_zone = text.data();
}

log::RunInfo info_of(const WiredComposition& c) {
  const runtime::Experiment& e = c.experiment;
  log::RunInfo info;
  info.version = TANDEM_VERSION;
  info.robot = e.robot.name;
  info.hal = hal_name(e);
  for (const hal::JointConfig& joint : e.robot.joints) info.joints.push_back(joint.name);
  for (const hal::BoardConfig& board : e.robot.boards) info.boards.push_back(board.name);
  for (const hal::BusConfig& bus : e.robot.buses) info.buses.push_back(bus.name);
  for (const hal::SensorConfig& sensor : e.robot.sensors) {
    info.sensors.push_back({sensor.name, sensor.channels()});
  }
  info.seed = e.seed;
  info.period_ns = e.loop.period_ns;
  info.operators_view = c.tele != nullptr;
  if (c.sim != nullptr) info.engine = sim::engine_text(e.sim.engine);
  info.kernel_variant = c.kernels->variant;
  info.description_hash = c.kernels->description_hash;
  info.kernel_sha256 = c.kernels.sha256();
  info.controllers = controller_lines(*c.controllers);
  add_place_and_time(info);
  for (const auto& file : e.files) {  // each once
    const auto same = [&](const auto& one) { return one.first == file.first; };
    if (std::ranges::none_of(info.configuration, same)) info.configuration.push_back(file);
  }
  return info;
}

/// Bytes that a cycle adds to the log at most: what is compressed takes less.
double bytes_per_cycle(const WiredComposition& c) {
  const runtime::Experiment& e = c.experiment;
  constexpr std::uint64_t kMessageOverhead = 64;
  std::uint64_t cycle_bytes = hal::StateImage(e.robot.shape()).bytes().size() +
                              hal::CommandImage(e.robot.shape()).bytes().size();
  if (const hal::TruthImage* truth = runtime::truth_of(c)) cycle_bytes += truth->bytes().size();
  if (c.estimator != nullptr) cycle_bytes += c.estimator->image().bytes().size();
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr || one->io->signals.numbers() == 0) continue;
    cycle_bytes += one->io->signals.image().size() + kMessageOverhead;
  }
  if (c.parallel != nullptr) {
    cycle_bytes += hal::StateImage(e.robot.shape()).bytes().size() + 2 * kMessageOverhead;
    if (e.sim.ground_truth) cycle_bytes += c.parallel->truth().bytes().size();
  }
  // Joint states and the base's frame, for viewers: three numbers and a name of each joint.
  const std::uint64_t view_bytes = 4 * kMessageOverhead + 64 * e.robot.joints.size();
  const auto cycles_per_view =
      std::max<std::int64_t>(1, log::RobotView::kPeriod_ns / e.loop.period_ns);
  const double whole = static_cast<double>(cycle_bytes + 3 * kMessageOverhead) +
                       static_cast<double>(view_bytes) / static_cast<double>(cycles_per_view);
  switch (e.log.compression) {
    case runtime::LogCompression::kNone: return whole;
    case runtime::LogCompression::kLz4: return whole / 2;  // a third and more of a robot that moves
    case runtime::LogCompression::kZstd: return whole / 3;
  }
  return whole;
}

/// What a file has beside its cycles, and one without an end at the least.
constexpr std::uint64_t kFixed_bytes = 1'000'000;

Error folder_error(const std::string& folder, std::string message) {
  return {.message = std::move(message),
          .hint = "choose another folder with --log, or run with --no-log",
          .file = folder,
          .key = {}};
}

Status check_folder(const std::string& folder, std::uint64_t needed) {
  std::error_code problem;
  fs::create_directories(folder, problem);
  if (problem) {
    return std::unexpected(
        folder_error(folder, "cannot make the log's folder: " + problem.message()));
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    return std::unexpected(folder_error(
        folder, std::string("cannot write into the log's folder: ") + std::strerror(errno)));
  }
  struct statvfs disk {};
  if (statvfs(folder.c_str(), &disk) != 0) return {};
  const std::uint64_t room = static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize;
  if (room >= needed) return {};
  return std::unexpected(folder_error(
      folder, fmt::format("the disk is too full for the log: it has {:.1f} MB, the run may need "
                          "{:.1f} MB",
                          static_cast<double>(room) * 1e-6, static_cast<double>(needed) * 1e-6)));
}

/// The first free name, taken by an empty file: of two runs that begin at once each has its own.
/// That file stays open, and is the log.
Result<std::pair<std::string, Descriptor>> claim_file(const std::string& folder,
                                                      const std::string& name) {
  for (int number = 1;; ++number) {
    std::string path = fmt::format("{}/{}-{:03d}.mcap", folder, name, number);
    Result<Descriptor> file = open_new(path, 0644);
    if (file) return std::pair(std::move(path), std::move(*file));
    if (errno == EEXIST) continue;
    return std::unexpected(folder_error(path, "cannot make the log: " + file.error().message));
  }
}

log::RecorderOptions recorder_options(const WiredComposition& c) {
  const runtime::Experiment& e = c.experiment;
  log::RecorderOptions options;
  options.viewed.urdf = robot::text_in(e.files, e.robot.model.urdf);
  options.viewed.followers = e.robot.followers;
  if (e.description->tree.floating_base)
    options.viewed.base_link = e.description->tree.links.front().name;
  switch (e.log.compression) {
    case runtime::LogCompression::kNone:
      options.writer.compression = log::Compression::kNone;
      break;
    case runtime::LogCompression::kLz4: options.writer.compression = log::Compression::kLz4; break;
    case runtime::LogCompression::kZstd:
      options.writer.compression = log::Compression::kZstd;
      break;
  }
  return options;
}

}  // namespace

std::string log_growth(const WiredComposition& c, const std::string& path) {
  const double rate = bytes_per_cycle(c) * 1e9 / static_cast<double>(c.experiment.loop.period_ns);
  struct statvfs disk {};
  std::string room;
  if (statvfs(path.c_str(), &disk) == 0) {
    const double free = static_cast<double>(disk.f_bavail) * static_cast<double>(disk.f_frsize);
    room = fmt::format("; the disk has room for {:.1f} h of it", free / rate / 3600.0);
  }
  return fmt::format("at most {:.2f} MB for each second{}", rate * 1e-6, room);
}

std::vector<std::string> controller_lines(const runtime::ControllerHost& host) {
  std::vector<std::string> lines;
  for (const runtime::ControllerCode& one : host.code()) {
    lines.push_back(fmt::format("{} {} {}", one.name, one.sha256, one.path));
  }
  return lines;
}

Result<std::unique_ptr<log::Recorder>> open_log(const WiredComposition& c,
                                                const std::string& folder) {
  const auto cycles = static_cast<double>(c.experiment.cycles());
  const std::uint64_t needed =
      static_cast<std::uint64_t>(cycles * bytes_per_cycle(c)) + kFixed_bytes;
  if (const Status s = check_folder(folder, needed); !s) return std::unexpected(s.error());
  const std::string name =
      c.experiment.robot.name + "-" + fs::path(c.experiment.file).stem().string();
  auto claimed = claim_file(folder, name);
  if (!claimed) return std::unexpected(claimed.error());
  auto& [path, file] = *claimed;
  return log::Recorder::open(std::move(file), path, info_of(c), recorder_options(c));
}

}  // namespace tandem::apps
