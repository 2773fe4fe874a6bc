// `tandem new`: the files of a robot from its URDF.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <map>

#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/new_source.hpp"
#include "apps/tools/right_angles.hpp"
#include "base/bundled_files.hpp"
#include "base/counted.hpp"
#include "base/file_name.hpp"
#include "base/nearest.hpp"
#include "base/open_file.hpp"
#include "base/quoting.hpp"
#include "base/utf8.hpp"
#include "hal/ethercat-can/bus_load.hpp"
#include "model/tree.hpp"
#include "robot/check.hpp"
#include "scaffold/new_robot.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kPeriod_ns = 1'000'000;

Diagnostics wrong_file(std::string message, std::string hint, std::string file) {
  return {Error{std::move(message), std::move(hint), std::move(file), 0, {}}};
}

/// A name for files and TOML: letters, digits, '_' and '-', as many as a robot's name may have;
/// "robot" of a name in other letters.
std::string plain_name(std::string name) {
  if (name.size() > kLongestFileName) name.resize(kLongestFileName);
  const auto is_plain = [](unsigned char c) { return std::isalnum(c) != 0; };
  if (std::ranges::none_of(name, is_plain)) return "robot";
  std::ranges::replace_if(
      name, [&](unsigned char c) { return !is_plain(c) && c != '-'; }, '_');
  if (name.front() == '-') name.front() = '_';
  return name;
}

/// The robot that --like names.
std::expected<scaffold::Like, Diagnostics> read_like(const std::string& name) {
  const auto file = named_file(name, Bundled::kRobot);
  if (!file) return std::unexpected(Diagnostics{file.error()});
  auto robot = robot::read_robot(*file);
  if (!robot) return std::unexpected(robot.error());
  return scaffold::Like{std::move(robot->config), std::move(robot->tree)};
}

/// Files that were there and are others now, as (name, name of the copy).
using Kept = std::vector<std::pair<std::string, std::string>>;

/// Moves a file that is there, and is not what is written now, to FILE~.
Status keep(const fs::path& old, const fs::path& next, Kept& kept) {
  std::error_code problem;
  if (!fs::exists(fs::symlink_status(old, problem))) return {};
  if (fs::is_regular_file(old, problem) &&
      robot::text_of(old.string()) == robot::text_of(next.string())) {
    return {};
  }
  fs::path copy = old.string() + "~";
  for (int i = 2; fs::exists(fs::symlink_status(copy, problem)); ++i) {
    copy = old.string() + "~" + std::to_string(i);
  }
  fs::rename(old, copy, problem);
  kept.emplace_back(old.filename().string(), copy.filename().string());
  if (!problem) return {};
  return std::unexpected(Error{"the file cannot be written: " + problem.message(),
                               "choose another folder with -o",
                               copy.string(),
                               0,
                               {}});
}

/// Every error's file as it will be.
Diagnostics placed(const Draft& draft, Diagnostics errors) {
  for (Error& error : errors) error = draft.placed(std::move(error));
  return errors;
}

/// Writes everything into the draft, and reads it back as `tandem run` would.
std::expected<robot::RobotFiles, Diagnostics> write(const scaffold::NewRobot& robot,
                                                    const NewSource& source, const Draft& draft) {
  const fs::path folder = draft.path();
  const std::string& copy = source.copy;
  for (const auto& [name, text] :
       {std::pair{copy, source.text},
        {std::string("robot.toml"), scaffold::robot_text(robot, copy, source.name)},
        {std::string("hold.toml"), scaffold::hold_text(robot)},
        {std::string("move.toml"), scaffold::move_text(robot)}}) {
    if (Status written = write_file(folder / name, text); !written)
      return std::unexpected(placed(draft, {written.error()}));
  }
  auto read = robot::read_robot((folder / "robot.toml").string());
  if (!read) return std::unexpected(placed(draft, read.error()));
  robot::Findings found = robot::check(*read, robot::use_alone(read->config, kPeriod_ns));
  if (!found.errors.empty()) return std::unexpected(placed(draft, std::move(found.errors)));
  read->warnings = placed(draft, std::move(found.warnings));
  return read;
}

/// By link with mass: the mass, and whether --density made it. Links that it found none for have
/// null.
Json masses_json(const scaffold::NewRobot& robot, const NewSource& source) {
  Json masses = Json::object();
  for (const auto& [link, note] : source.masses)
    masses[link] = {{"mass_kg", nullptr}, {"from", nullptr}, {"note", note}};
  for (const model::Link& link : robot.tree.links) {
    if (!(link.inertia.mass_kg > 0.0)) continue;
    const bool guessed = masses.contains(link.name);
    masses[link.name]["mass_kg"] = link.inertia.mass_kg;
    masses[link.name]["from"] = guessed ? "density" : "urdf";
  }
  return masses;
}

Json to_json(const scaffold::NewRobot& robot, const NewSource& source, const std::string& folder) {
  Json feet = Json::array(), sensors = Json::array(), drives = Json::array();
  for (const scaffold::FoundFoot& foot : robot.feet) feet.push_back(foot.name);
  for (const scaffold::FoundSensor& sensor : robot.sensors) sensors.push_back(sensor.config.name);
  for (const scaffold::DriveSize& drive : robot.drives) drives.push_back(drive.actuator.name);
  return {{"folder", folder},
          {"robot", robot.config.name},
          {"joints", robot.config.joints.size()},
          {"mass_kg", robot.mass_kg},
          {"masses", masses_json(robot, source)},
          {"base", robot.config.model.floating_base ? "floating" : "fixed"},
          {"base_height_m", robot.stands_m},
          {"feet", feet},
          {"sensors", sensors},
          {"drives", drives},
          {"boards", robot.config.boards.size()},
          {"kept", Json::object()},
          {"warnings", errors_json(robot.warnings)}};
}

/// The limit that every joint of a kind has, when it is a round one (1, 20, 500): such figures come
/// with exporters, and not from a data sheet. 0: there is none.
double common_limit(const scaffold::NewRobot& robot, double scaffold::JointLimits::*limit,
                    bool scaffold::JointLimits::*guessed) {
  constexpr std::size_t kFewest = 4;
  std::size_t count = 0;
  double common = 0.0;
  for (std::size_t j = 0; j < robot.limits.size(); ++j) {
    const model::Joint& joint = robot.tree.joints[j];
    if (joint.follows() || joint.type == model::JointType::kPrismatic) continue;
    const scaffold::JointLimits& own = robot.limits[j];
    if (count++ == 0) common = own.*limit;
    if (own.*guessed || !(own.*limit == common)) return 0.0;
  }
  if (count < kFewest || !(common > 0.0) || !std::isfinite(common)) return 0.0;
  const double power = std::pow(10.0, std::floor(std::log10(common)));
  const double digit = common / power;
  return std::abs(digit - std::round(digit)) < 1e-9 ? common : 0.0;
}

void add_placeholders(const scaffold::NewRobot& robot, Facts& facts) {
  using Limits = scaffold::JointLimits;
  const double velocity = common_limit(robot, &Limits::velocity, &Limits::velocity_guessed);
  const double effort = common_limit(robot, &Limits::effort, &Limits::effort_guessed);
  if (velocity == 0.0 && effort == 0.0) return;
  std::string what = velocity == 0.0 ? "" : fmt::format("{:g} rad/s", velocity);
  if (effort != 0.0) what += (what.empty() ? "" : " and ") + fmt::format("{:g} Nm", effort);
  facts.add("limits", fmt::format("every joint has {}: likely a placeholder of the description; "
                                  "give each [[joint]] its own",
                                  what));
}

/// What --density has found; links that get nothing for one reason are together, for frames have no
/// shape.
void add_masses(const NewSource& source, Facts& facts) {
  std::map<std::string, std::vector<std::string>> without;
  for (const auto& [link, mass] : source.masses) {
    if (mass.starts_with("none")) {
      without[mass].push_back(link);
    } else {
      facts.add("mass", link + ": " + mass);
    }
  }
  for (const auto& [why, links] : without)
    facts.add("mass", fmt::format("{}: {}", fmt::join(links, ", "), why));
}

void add_facts(const scaffold::NewRobot& robot, const NewSource& source, Facts& facts) {
  facts.add("robot", fmt::format("{}: {}, {:.2f} kg", robot.config.name,
                                 counted(robot.config.joints.size(), "joint"), robot.mass_kg));
  for (const std::string& remark : robot.remarks) facts.add("", remark);
  add_masses(source, facts);
  for (std::size_t f = 0; f < robot.feet.size(); ++f) {
    const scaffold::FoundFoot& foot = robot.feet[f];
    facts.add("foot " + foot.name, fmt::format("{}, {}{}", robot.tree.links[foot.link].name,
                                               counted(foot.points.size(), "contact point"),
                                               foot.guess.empty() ? "" : " (guess)"));
  }
  if (robot.stands_m > 0.0) facts.add("stands", fmt::format("root at {:.3f} m", robot.stands_m));
  for (const scaffold::FoundSensor& sensor : robot.sensors) {
    const bool wrench = sensor.config.type == hal::SensorType::kForceTorque;
    facts.add("sensor " + sensor.config.name,
              (wrench ? "force/torque at " + sensor.config.joint : "IMU at " + sensor.config.link) +
                  (sensor.guess.empty() ? "" : " (guess)"));
  }
  add_placeholders(robot, facts);
  for (const scaffold::DriveSize& drive : robot.drives) {
    facts.add("drive " + drive.actuator.name,
              fmt::format("{}, {}", counted(drive.joints.size(), "joint"), drive.remark));
  }
  if (const auto loads = hal::can::bus_loads(robot.config, kPeriod_ns)) {
    for (const hal::can::BusLoad& load : *loads) {
      const auto boards = std::ranges::count(robot.config.boards, load.bus, &hal::BoardConfig::bus);
      facts.add("bus " + load.bus, fmt::format("{}, load {:.0f} %",
                                               counted(static_cast<std::uint64_t>(boards), "board"),
                                               100.0 * load.load));
    }
  }
}

void print_next(const std::string& folder, std::FILE* out) {
  fmt::print(out,
             "\nNext:\n  tandem run {} --report\n  tandem run {} --report\n"
             "Look for `guess` in {}/robot.toml: replace each by your own figure.\n",
             shell_word(folder + "/hold.toml"), shell_word(folder + "/move.toml"), folder);
}

/// What makes the robot again, with what is added to it, in the same folder.
std::string command_again(const NewOptions& options) {
  std::string command = "tandem new " + shell_word(options.urdf);
  const auto add = [&command](const char* option, const std::string& value) {
    if (!value.empty()) command += fmt::format(" {} {}", option, shell_word(value));
  };
  add("-o", options.output);
  add("--like", options.like);
  add("--base", options.base);
  for (const std::string& word : options.lock) add("--lock", word);
  for (const std::string& word : options.drop) add("--drop", word);
  if (options.density_kg_m3 != 0.0) add("--density", fmt::format("{:g}", options.density_kg_m3));
  if (options.dynamics) command += " --dynamics";
  return command + " --force";
}

/// What can be said of the input before it is read as XML.
Diagnostics check_input(const std::string& file) {
  if (!is_utf8(fs::path(file).filename().string())) {
    return wrong_file("the file's name is not UTF-8, which robot.toml must be", "rename it", file);
  }
  if (fs::path(file).extension() != ".toml") {
    std::error_code ignored;
    if (!fs::exists(file, ignored)) return {};  // its reader says so
    const Result<Descriptor> opened = open_to_read(file, "name a .urdf file", kMostUrdfBytes);
    return opened ? Diagnostics() : Diagnostics{opened.error()};
  }
  if (robot::is_robot(file)) {
    return wrong_file("this is a robot.toml already: `tandem new` makes one, from a URDF",
                      "`tandem check " + shell_word(file) +
                          "` reads it, `tandem run` takes the experiments beside "
                          "it; or name the URDF that a new folder is to be made from",
                      file);
  }
  return wrong_file("this is a TOML file: `tandem new` starts from a URDF",
                    "`tandem run " + shell_word(file) + "` runs an experiment", file);
}

/// Errors of a text that the options have changed, and that is nowhere to be read: their lines
/// would be taken for the file's.
Diagnostics without_lines(Diagnostics errors) {
  for (Error& error : errors) error.line = 0;
  return errors;
}

/// Whether the robot may be written to `folder`.
Diagnostics check_folder(const std::string& folder, bool force) {
  std::error_code ignored;
  const bool exists = fs::exists(folder, ignored);
  if (exists && !fs::is_directory(folder, ignored)) {
    return wrong_file("this is a file, and the robot needs a folder", "give another one with -o",
                      folder);
  }
  if (exists && !force) {
    return wrong_file(
        "this exists already",
        "give another folder with -o; or --force, which keeps files that differ as FILE~", folder);
  }
  return {};
}

Diagnostics run(const NewOptions& options) {
  const std::string name = plain_name(robot_stem(options.urdf));
  const std::string folder = options.output.empty() ? name : options.output;
  if (Diagnostics wrong = check_input(options.urdf); !wrong.empty()) return wrong;
  if (Diagnostics wrong = check_folder(folder, options.force); !wrong.empty()) return wrong;
  std::optional<scaffold::Like> like;
  if (!options.like.empty()) {
    auto read = read_like(options.like);
    if (!read) return read.error();
    like = std::move(*read);
  }
  auto source = read_source(options);
  if (!source) return {source.error()};
  scaffold::Request request;
  request.urdf = options.urdf;
  request.text = source->text;
  request.lock = source->lock;
  request.dynamics = options.dynamics;
  request.command = command_again(options);
  request.name = plain_name(fs::path(folder).lexically_normal().filename().string());
  request.base = options.base == "floating" ? scaffold::Base::kFloating
                 : options.base == "fixed"  ? scaffold::Base::kFixed
                                            : scaffold::Base::kAuto;
  request.like = like ? &*like : nullptr;
  auto robot = scaffold::make_robot(request);
  if (!robot) {
    return of_options(source->changed ? without_lines(robot.error()) : robot.error(), *source);
  }
  if (source->changed) {  // lines are those of the copy
    for (Error& warning : robot->warnings)
      if (warning.file == options.urdf) warning.file = (fs::path(folder) / source->copy).string();
  }
  robot->remarks.insert(robot->remarks.end(), source->remarks.begin(), source->remarks.end());
  Result<Draft> draft = Draft::folder(folder);
  if (!draft) return {draft.error()};
  const auto written = write(*robot, *source, *draft);
  if (!written) return written.error();
  Facts facts;
  add_facts(*robot, *source, facts);
  Json json = to_json(*robot, *source, folder);
  if (Status counted = add_right_angles(*written, facts, json); !counted) return {counted.error()};
  Kept kept;
  if (Status done = draft->place(
          [&kept](const fs::path& old, const fs::path& next) { return keep(old, next, kept); });
      !done) {
    return {done.error()};
  }
  print_warnings(robot->warnings);
  print_warnings(written->warnings);
  std::FILE* const out = human_output(options.json);
  for (const auto& [old, copy] : kept) {
    facts.add("kept", fmt::format("{} that was there is {} now", old, copy));
    json["kept"][old] = copy;
  }
  facts.print(out);
  print_next(folder, out);
  if (Status saved = write_json(options.json, json); !saved) return {saved.error()};
  return {};
}

}  // namespace

Exit new_command(const NewOptions& options) {
  const Diagnostics errors = run(options);
  print_errors(errors);
  return errors.empty() ? Exit::kDone : Exit::kUsage;
}

}  // namespace tandem::apps
