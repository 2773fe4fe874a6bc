#include "runtime/run/run_log.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <set>
#include <utility>

#include "base/open_file.hpp"
#include "dds/frame_topics.hpp"
#include "hal/sim/engine_loader.hpp"

namespace tandem::runtime {

/// The commit that this program was built from, as `git describe` says; empty: not known.
extern const char* const kBuiltFrom;

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

/// "NAME SHA256 PATH" of every plugin that a host was given.
std::vector<std::string> controller_lines(const ControllerHost& host) {
  std::vector<std::string> lines;
  for (const ControllerCode& one : host.code()) {
    lines.push_back(fmt::format("{} {} {}", one.name, one.sha256, one.path));
  }
  return lines;
}

void add_parameters(const HostedController& one, std::vector<std::string>& lines) {
  for (const ParameterRow& row : one.io->parameters.rows()) {
    const std::string value = row.text();
    if (!value.empty()) lines.push_back(one.name + "." + row.name + " = " + value);
  }
}

/// Parameters as they are in force, and who leads; in the loop's thread.
log::Recorder::Beginning as_now(const ControllerHost& host) {
  log::Recorder::Beginning now;
  const ControllerSet active = host.shown().active;
  const ControllerHost::Table& loaded = host.loaded();
  for (std::size_t slot = 0; slot < loaded.size(); ++slot) {
    if (loaded[slot] == nullptr) continue;
    add_parameters(*loaded[slot], now.parameters);
    if ((active & only(slot)) != 0) now.active.push_back(loaded[slot]->name);
  }
  return now;
}

log::RunInfo info_of(const Composition& c) {
  const Experiment& e = c.experiment;
  log::RunInfo info;
  info.version = TANDEM_VERSION;
  if (*kBuiltFrom != '\0') info.version += fmt::format(" ({})", kBuiltFrom);
  info.robot = e.robot.name;
  info.hal = hal_name(e);
  for (const hal::JointConfig& joint : e.robot.joints) info.joints.push_back(joint.name);
  for (const hal::BoardConfig& board : e.robot.boards) info.boards.push_back(board.name);
  for (const hal::BusConfig& bus : e.robot.buses) info.buses.push_back(bus.name);
  for (const hal::SensorConfig& sensor : e.robot.sensors) {
    info.sensors.push_back({sensor.name, sensor.channels()});
  }
  info.seed = e.seed;
  info.options = {fmt::format("duration_s = {}", e.duration_s),
                  fmt::format("delay_cycles = {}", e.hal.delay_cycles)};
  if (e.after_stop) {
    info.options.push_back(*e.after_stop == AfterStop::kWait ? "on_fault = wait"
                                                             : "on_fault = end");
  }
  for (const std::string& one : e.settings) info.options.push_back(one);
  info.period_ns = e.loop.period_ns;
  info.operators_view = c.tele != nullptr;
  if (c.sim != nullptr) {
    info.engine = sim::engine_text(e.sim.engine);
    info.integrator = integrator_text(e);
  }
  if (c.sim != nullptr && e.plant != nullptr) {
    info.plant = e.plant->differences;
    info.ground = e.plant->ground;
  }
  info.kernel_variant = c.kernels->variant;
  info.description_hash = c.kernels->description_hash;
  info.kernel_sha256 = c.kernels.sha256();
  info.controllers = controller_lines(*c.controllers);
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr) continue;
    // Part of the program: Python, a robot's owner.
    if (one->plugin.empty()) info.controllers.push_back(one->name + " - -");
    add_parameters(*one, info.parameters);
  }
  add_place_and_time(info);
  for (const auto& file : e.files) {  // each once
    const auto same = [&](const auto& one) { return one.first == file.first; };
    if (std::ranges::none_of(info.configuration, same)) info.configuration.push_back(file);
  }
  return info;
}

/// What is logged of each topic of images.
std::vector<log::TopicShare> shares(const LogConfig& config) {
  std::vector<log::TopicShare> all{{"state", config.state_every},
                                   {"command", config.command_every},
                                   {"truth", config.truth_every},
                                   {"estimate", config.estimate_every}};
  for (const std::string& field : config.without) {
    const std::size_t dot = field.find('.');
    std::ranges::find(all, field.substr(0, dot), &log::TopicShare::name)
        ->without.push_back(field.substr(dot + 1));
  }
  return all;
}

/// Bytes that a cycle adds to the log at most: what is compressed takes less.
double bytes_per_cycle(const Composition& c) {
  const Experiment& e = c.experiment;
  constexpr double kMessageOverhead = 64.0;
  const std::vector<log::TopicShare> all = shares(e.log);
  double cycle_bytes = kMessageOverhead;
  const auto add = [&](const char* topic, const hal::Image& image) {
    const log::KeptImage kept(image.layout(), log::share_of(all, topic));
    if (kept.every() == 0) return;
    cycle_bytes += (static_cast<double>(kept.layout().bytes()) + kMessageOverhead) / kept.every();
  };
  const hal::StateImage state(e.robot.shape());
  const hal::TruthImage* truth = truth_of(c);
  add("state", state);
  add("command", hal::CommandImage(e.robot.shape()));
  if (truth != nullptr) add("truth", *truth);
  if (c.estimator != nullptr) add("estimate", c.estimator->image());
  for (const auto& one : c.controllers->owned()) {
    if (one == nullptr || one->io->signals.numbers() == 0) continue;
    cycle_bytes += static_cast<double>(one->io->signals.image().size()) + kMessageOverhead;
  }
  if (c.parallel != nullptr) {
    add("state", state);
    if (e.sim.ground_truth) add("truth", c.parallel->truth());
  }
  // For viewers: of each joint three numbers and a name, and its link's place with two names.
  const double view_bytes =
      e.log.viewers ? 4.0 * kMessageOverhead + 192.0 * static_cast<double>(e.robot.joints.size())
                    : 0.0;
  const auto cycles_per_view =
      std::max<std::int64_t>(1, log::RobotView::kPeriod_ns / e.loop.period_ns);
  const double whole = cycle_bytes + view_bytes / static_cast<double>(cycles_per_view);
  switch (e.log.compression) {
    case LogCompression::kNone: return whole;
    case LogCompression::kLz4: return whole / 2;  // a third and more of a robot that moves
    case LogCompression::kZstd: return whole / 3;
  }
  return whole;
}

/// What a file has beside its cycles, and one without an end at the least.
constexpr std::uint64_t kFixed_bytes = 1'000'000;

Error folder_error(const std::string& folder, std::string message) {
  return {.message = std::move(message),
          .hint = "choose another place for the log, or run without one: --log, --no-log",
          .file = folder,
          .key = {}};
}

/// Makes the folder.
Status make_folder(const std::string& folder) {
  std::error_code problem;
  fs::create_directories(folder, problem);
  if (problem) {
    return std::unexpected(
        folder_error(folder, "cannot make the log's folder: " + problem.message()));
  }
  if (access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return std::unexpected(folder_error(
      folder, std::string("cannot write into the log's folder: ") + std::strerror(errno)));
}

/// @param needed  bytes of the log
/// @param files   of runs before: the oldest are removed where there is no room, and they may go
Status make_room(const std::string& folder, std::uint64_t needed, const LogConfig& config,
                 log::KeptFiles& files) {
  const auto room = [&folder] { return log::disk_room(folder); };
  if (files.keep_free(room, needed)) return {};
  std::string free;
  if (config.keep_free_MB > 0.0)
    free += fmt::format(", and keep_free_MB = {:g}", config.keep_free_MB);
  if (config.keep_free_share > 0.0)
    free += fmt::format(", and keep_free_share = {:g}", config.keep_free_share);
  return std::unexpected(folder_error(
      folder,
      fmt::format(
          "the disk is too full for the log: it has {:.1f} MB, the run may need {:.1f} MB{}",
          static_cast<double>(room().value_or(log::DiskRoom{}).free_bytes) * 1e-6,
          static_cast<double>(needed) * 1e-6, free.empty() ? "" : free + " stay free")));
}

/// Numbers of logs whose first part has been removed, or is there.
std::set<int> taken_numbers(const std::string& folder, const std::string& name) {
  std::set<int> taken;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string file = entry.path().filename().string();
    if (!file.starts_with(name + "-") || !file.ends_with(".mcap")) continue;
    char* end = nullptr;
    const long number = std::strtol(file.c_str() + name.size() + 1, &end, 10);
    if (*end == '.') taken.insert(static_cast<int>(number));
  }
  return taken;
}

/// The first free name, taken by an empty file: of two runs that begin at once each has its own.
/// That file stays open, and is the log.
/// @param last  behind all others: their numbers then say which is older
Result<std::pair<std::string, Descriptor>> claim_file(const std::string& folder,
                                                      const std::string& name, bool last) {
  const std::set<int> taken = taken_numbers(folder, name);
  for (int number = last && !taken.empty() ? *taken.rbegin() + 1 : 1;; ++number) {
    if (taken.contains(number)) continue;
    std::string path = fmt::format("{}/{}-{:03d}.mcap", folder, name, number);
    Result<Descriptor> file = open_new(path, 0644);
    if (file) return std::pair(std::move(path), std::move(*file));
    if (errno == EEXIST) continue;
    return std::unexpected(folder_error(path, "cannot make the log: " + file.error().message));
  }
}

/// The same of the name that was asked for: what is there is nobody's to overwrite.
Result<std::pair<std::string, Descriptor>> claim_named(const std::string& path) {
  Result<Descriptor> file = open_new(path, 0644);
  if (file) return std::pair(path, std::move(*file));
  return std::unexpected(folder_error(path, "cannot make the log: " + file.error().message));
}

std::vector<log::ViewedLink> viewed_links(const dds::FrameTree& frames) {
  std::vector<log::ViewedLink> links;
  const auto add = [&links](const dds::FrameEdge& edge, int joint) {
    const Eigen::Vector3d& p = edge.at_zero.p;
    const Eigen::Quaterniond q(edge.at_zero.R);
    links.push_back({.parent = edge.parent,
                     .name = edge.child,
                     .xyz_m = {p.x(), p.y(), p.z()},
                     .quaternion = {q.x(), q.y(), q.z(), q.w()},
                     .axis = {edge.axis.x(), edge.axis.y(), edge.axis.z()},
                     .slides = edge.type == model::JointType::kPrismatic,
                     .joint = joint,
                     .multiplier = edge.multiplier,
                     .offset = edge.offset});
  };
  for (const dds::FrameEdge& edge : frames.moving) add(edge, static_cast<int>(edge.joint));
  for (const dds::FrameEdge& edge : frames.fixed) add(edge, -1);
  return links;
}

/// What viewers want of the robot; nothing when the experiment says so.
log::ViewedRobot viewed(const Experiment& e) {
  log::ViewedRobot robot;
  if (!e.log.viewers) return robot;
  const model::Tree& tree = e.description->tree;
  robot.urdf = robot::text_in(e.files, e.robot.model.urdf);
  robot.followers = e.robot.followers;
  (tree.floating_base ? robot.base_link : robot.fixed_root) = tree.links.front().name;
  robot.links = viewed_links(dds::frame_tree(tree, e.robot));
  return robot;
}

log::RecorderOptions recorder_options(const Composition& c) {
  const Experiment& e = c.experiment;
  const auto bytes = [](double megabytes) { return static_cast<std::uint64_t>(megabytes * 1e6); };
  const auto ns = [](double seconds) { return static_cast<std::int64_t>(seconds * 1e9); };
  log::RecorderOptions options{.limits = {.file_bytes = bytes(e.log.file_MB),
                                          .total_bytes = bytes(e.log.total_MB),
                                          .keep_free_bytes = bytes(e.log.keep_free_MB),
                                          .keep_free_share = e.log.keep_free_share,
                                          .file_ns = ns(e.log.file_s),
                                          .total_ns = ns(e.log.total_s),
                                          .keep_before_fault_ns = ns(e.log.keep_before_fault_s)},
                               .shares = shares(e.log),
                               .viewed = viewed(e)};
  switch (e.log.compression) {
    case LogCompression::kNone: options.writer.compression = log::Compression::kNone; break;
    case LogCompression::kLz4: options.writer.compression = log::Compression::kLz4; break;
    case LogCompression::kZstd: options.writer.compression = log::Compression::kZstd; break;
  }
  return options;
}

/// Bytes of the log for which there must be room as it begins.
std::uint64_t needed_bytes(const Composition& c, const log::DiskLimits& limits) {
  const double per_ns = bytes_per_cycle(c) / static_cast<double>(c.experiment.loop.period_ns);
  const auto least = [per_ns](std::uint64_t bytes, std::int64_t ns) {
    const auto time_bytes = static_cast<std::uint64_t>(per_ns * static_cast<double>(ns));
    return bytes == 0 || (ns > 0 && time_bytes < bytes) ? time_bytes : bytes;
  };
  const std::uint64_t whole =
      kFixed_bytes +
      static_cast<std::uint64_t>(static_cast<double>(c.experiment.cycles()) * bytes_per_cycle(c));
  if (!limits.remove_oldest()) return whole;
  // Its oldest files go, before the disk has less, too.
  const bool file_by_file = limits.keep_free_bytes > 0 || limits.keep_free_share > 0.0 ||
                            c.experiment.log.budget == LogBudget::kExperiment;
  return std::min(whole, file_by_file ? least(limits.file_bytes, limits.file_ns)
                                      : least(limits.total_bytes, limits.total_ns));
}

/// What the names of its logs begin with.
std::string log_name(const Composition& c) {
  return c.experiment.robot.name + "-" + fs::path(c.experiment.file).stem().string();
}

/// Makes the folder, and room for the log in it. `options` gets the files of runs before.
Status find_room(const Composition& c, const std::string& folder, log::RecorderOptions& options) {
  if (Status made = make_folder(folder); !made) return made;
  options.earlier.emplace(options.limits);
  if (c.experiment.log.budget == LogBudget::kExperiment)
    options.earlier->take_over(folder, log_name(c));
  return make_room(folder, needed_bytes(c, options.limits), c.experiment.log, *options.earlier);
}

/// "2.5 h", "12 min", "40 s": as long as that is.
std::string time_text(double seconds) {
  constexpr double kMinute_s = 60.0, kHour_s = 3600.0;
  if (seconds >= kHour_s) return fmt::format("{:.1f} h", seconds / kHour_s);
  if (seconds >= kMinute_s) return fmt::format("{:.0f} min", seconds / kMinute_s);
  return fmt::format("{:.0f} s", seconds);
}

}  // namespace

std::string log_growth(const Composition& c, const std::string& path) {
  const double rate = bytes_per_cycle(c) * 1e9 / static_cast<double>(c.experiment.loop.period_ns);
  const LogConfig& config = c.experiment.log;
  std::string room;
  if (const auto disk = log::disk_room(path)) {
    const std::uint64_t kept = log::wanted_free(recorder_options(c).limits, disk->all_bytes);
    const std::uint64_t free = disk->free_bytes > kept ? disk->free_bytes - kept : 0;
    room = fmt::format("; the disk has room for {} of it",
                       time_text(static_cast<double>(free) / rate));
  }
  const double total_s = config.total_MB > 0.0 ? 1e6 * config.total_MB / rate : config.total_s;
  const bool by_time = config.total_s > 0.0 && config.total_s <= total_s;
  if (by_time) room = fmt::format("; the last {} are kept", time_text(config.total_s));
  if (config.total_MB > 0.0 && !by_time)
    room = fmt::format("; the last {:g} MB, {}, are kept", config.total_MB, time_text(total_s));
  return fmt::format("at most {:.2f} MB for each second{}", rate * 1e-6, room);
}

std::string wire_name(const hal::RobotConfig& robot) {
  const bool line =
      !robot.buses.empty() && std::ranges::all_of(robot.buses, [](const hal::BusConfig& bus) {
        return bus.kind == hal::BusKind::kEthercat;
      });
  return line ? "EtherCAT" : "CAN";
}

std::string integrator_name(const Experiment& e) {
  if (e.sim.integrator == sim::Integrator::kRungeKutta4) return "Runge-Kutta 4";
  if (e.hal.backend != BackendKind::kSim || e.sim.engine == sim::kOwnEngine) return "leapfrog";
  const Result<const sim::EnginePlugin*> engine = sim::load_engine(e.sim.engine);
  return engine ? (*engine)->integrator : "";
}

std::string integrator_text(const Experiment& e) {
  return fmt::format("{}, {} us steps", integrator_name(e),
                     static_cast<double>(e.sim.substep_ns) * 1e-3);
}

std::string hal_name(const Experiment& e) {
  const HalOptions& hal = e.hal;
  if (hal.backend == BackendKind::kSim) return "sim";
  const std::string wire = wire_name(e.robot) == "CAN" ? "can" : "ethercat";
  const std::string name = hal.backend == BackendKind::kWire ? wire : "dds";
  return hal.lockstep ? name + " lockstep" : name;
}

log::StringMap loaded_later(const ControllerHost& host, std::size_t known) {
  std::string later;
  const std::vector<std::string> code = controller_lines(host);
  for (std::size_t i = known; i < code.size(); ++i) later += (later.empty() ? "" : "\n") + code[i];
  if (later.empty()) return {};
  return {{"loaded_controllers", later}};
}

Status make_log_room(const Composition& c, const std::string& folder) {
  log::RecorderOptions options = recorder_options(c);
  return find_room(c, folder, options);
}

Result<std::unique_ptr<log::Recorder>> open_log(const Composition& c, const std::string& folder,
                                                const std::string& file_name,
                                                const log::Branch& branch) {
  log::RecorderOptions options = recorder_options(c);
  const bool all_runs = c.experiment.log.budget == LogBudget::kExperiment;
  const std::string name = log_name(c);
  if (const Status s = find_room(c, folder, options); !s) return std::unexpected(s.error());
  auto claimed = file_name.empty() ? claim_file(folder, name, all_runs)
                                   : claim_named(fs::path(folder) / file_name);
  if (!claimed) return std::unexpected(claimed.error());
  auto& [path, file] = *claimed;
  log::RunInfo info = info_of(c);
  info.branch = branch;
  auto recorder = log::Recorder::open(std::move(file), path, info, options);
  if (recorder) {
    (*recorder)->name_beginnings([host = c.controllers.get()] { return as_now(*host); });
  }
  if (recorder && c.sim != nullptr) {
    (*recorder)->name_pushes([names = c.experiment.pushes](std::uint32_t number) {
      return number <= names.size() ? names[number - 1] : std::to_string(number);
    });
    (*recorder)->name_payloads(
        [sim = c.sim](std::uint32_t number) { return sim->robot().payload_text(number); });
  }
  return recorder;
}

}  // namespace tandem::runtime
