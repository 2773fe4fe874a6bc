// `tandem log import`: a recording of another program as a log of a robot of ours.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "base/counted.hpp"
#include "log/import/import_log.hpp"
#include "model/generate.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

log::RunInfo info_of(const robot::RobotFiles& robot) {
  log::RunInfo info;
  info.version = TANDEM_VERSION;
  info.robot = robot.config.name;
  info.hal = "import";
  for (const hal::JointConfig& joint : robot.config.joints) info.joints.push_back(joint.name);
  for (const hal::SensorConfig& sensor : robot.config.sensors) {
    info.sensors.push_back({sensor.name, sensor.channels()});
  }
  info.description_hash = model::description_hash(robot.tree, robot.spec);
  info.configuration = robot.files;
  return info;
}

/// runs/ROBOT-STEM.mcap, or what -o says. Errors: a file that is there; a folder that cannot be
/// made.
Result<std::string> output_of(const LogOptions& options, const std::string& robot) {
  std::string path = options.output;
  if (path.empty())
    path = "runs/" + robot + "-" + fs::path(options.files.front()).stem().string() + ".mcap";
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return path;
  return std::unexpected(
      Error{"is there already", "name another file with -o, or remove this one", path, 0, {}});
}

std::string spacing_text(const log::Spacing& one) {
  return fmt::format("{:.6g} ({:.6g} to {:.6g})", static_cast<double>(one.median_ns) * 1e-6,
                     static_cast<double>(one.least_ns) * 1e-6,
                     static_cast<double>(one.most_ns) * 1e-6);
}

void print_summary(const log::ImportSummary& summary, std::FILE* out) {
  Facts facts;
  facts.add("log", fmt::format("{} ({}, {:.1f} MB)", summary.log.path,
                               counted(summary.log.messages, "message"),
                               static_cast<double>(summary.log.bytes) * 1e-6));
  const double period_s = static_cast<double>(summary.period_ns) * 1e-9;
  facts.add("cycles", fmt::format("{} of {:g} s", summary.cycles, period_s));
  facts.add("time 0", fmt::format("{} ns of the recording's clock", summary.begin_ns));
  facts.add("fields", fmt::format("{}", fmt::join(summary.fields, ", ")));
  const log::Exclusions& left = summary.excluded;
  for (const std::string& note : summary.notes) facts.add("taken", note);
  const auto rows = [&](const char* what, std::uint64_t count) {
    const char* of = summary.bag ? "message" : "row";
    if (count > 0) facts.add("left out", counted(count, of) + ": " + what);
  };
  rows(summary.bag ? "a value is not finite, or a joint is there twice"
                   : "a cell is empty or not finite",
       left.invalid);
  rows("too few or too many cells", left.ragged);
  rows(summary.bag ? "the same time as the one before" : "the same time as the row before",
       left.duplicates);
  rows("time goes back", left.backwards);
  if (left.gaps > 0) {
    facts.add("left out", counted(left.gap_cycles, "cycle") + " in " + counted(left.gaps, "gap"));
  }
  const auto names = [&](const char* what, const std::vector<std::string>& list) {
    if (!list.empty()) facts.add(what, fmt::format("{}", fmt::join(list, ", ")));
  };
  names("frozen, left out", left.frozen);
  names("not used", left.ignored);
  names("joints without data", summary.missing);
  facts.print(out);
  Table table({"samples of", "number", "every [ms]", "late"});
  for (const log::Spacing& one : summary.series) {
    table.add({one.name, std::to_string(one.rows), spacing_text(one), std::to_string(one.late)});
  }
  fmt::print(out, "\n");
  table.print(out);
}

/// One, of the series with the largest share of late samples.
Diagnostics warnings_of(const log::ImportSummary& summary, const std::string& file) {
  const auto share = [](const log::Spacing& one) {
    return static_cast<double>(one.late) / static_cast<double>(one.rows);
  };
  const auto worst = std::ranges::max_element(summary.series, {}, share);
  if (worst == summary.series.end() || !worst->jitters()) return {};
  const auto ms = [](std::int64_t ns) { return static_cast<double>(ns) * 1e-6; };
  return {
      {.message = fmt::format("{} of {} samples came late, more than {:g} periods of {:.6g} ms "
                              "after the one before, the worst after {:.6g} ms: velocities and "
                              "accelerations of these cycles are those of lines between samples",
                              worst->late, worst->rows, log::Spacing::kLateSteps,
                              ms(worst->median_ns), ms(worst->most_ns)),
       .hint = "record on a real-time thread, with the times at which the samples were taken",
       .file = file,
       .key = worst->name}};
}

Json summary_json(const log::ImportSummary& summary) {
  Json json;
  json["log"] = summary.log.path;
  json["format"] = summary.bag ? "mcap" : "csv";
  json["cycles"] = summary.cycles;
  json["period_ns"] = summary.period_ns;
  json["begin_ns"] = summary.begin_ns;
  json["data_sha256"] = summary.log.data_sha256;
  json["fields"] = summary.fields;
  json["missing_joints"] = summary.missing;
  const log::Exclusions& left = summary.excluded;
  json["taken"] = summary.notes;
  json["ignored"] = left.ignored;
  json["excluded"] = {
      {"invalid", left.invalid},     {"ragged", left.ragged}, {"duplicates", left.duplicates},
      {"backwards", left.backwards}, {"gaps", left.gaps},     {"gap_cycles", left.gap_cycles},
      {"frozen", left.frozen}};
  json["series"] = Json::array();
  for (const log::Spacing& one : summary.series) {
    json["series"].push_back({{"name", one.name},
                              {"samples", one.rows},
                              {"median_ns", one.median_ns},
                              {"least_ns", one.least_ns},
                              {"most_ns", one.most_ns},
                              {"late", one.late}});
  }
  return json;
}

}  // namespace

Exit log_import_command(const LogOptions& options) {
  const auto robot = robot::read_robot(options.robot);
  if (!robot) return refuse(robot.error());
  const Result<std::string> output = output_of(options, robot->config.name);
  if (!output) return refuse(output.error());
  Draft draft = Draft::file(*output);
  auto summary =
      log::import_log({options.files, options.map, draft.path()}, robot->config, info_of(*robot),
                      robot::text_in(robot->files, robot->config.model.urdf));
  if (!summary) {
    for (Error& error : summary.error()) error = draft.placed(std::move(error));
    return refuse(summary.error());
  }
  if (const Status placed = draft.place(); !placed) return refuse(placed.error());
  summary->log.path = *output;
  print_summary(*summary, human_output(options.json));
  print_warnings(warnings_of(*summary, options.files.front()));
  if (const Status written = write_json(options.json, summary_json(*summary)); !written) {
    return refuse(written.error());
  }
  return Exit::kDone;
}

}  // namespace tandem::apps
