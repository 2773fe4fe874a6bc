// `tandem log import`: a recording of another program as a log of a robot of ours.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "apps/text/draft.hpp"
#include "apps/text/figures.hpp"
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

}  // namespace

static void figures(Figures& f, const log::Spacing& one) {
  f("name", one.name);
  f("samples", one.rows);
  f("median_ns", "from one sample to the next", one.median_ns);
  f("least_ns", one.least_ns);
  f("most_ns", one.most_ns);
  f("late", "samples that came more than 1.5 medians after the one before", one.late);
}

static void figures(Figures& f, const log::ImportSummary& summary) {
  const log::Exclusions& left = summary.excluded;
  f("log", "the file that was written", summary.log.path);
  f("format", "`csv` or `mcap`", summary.bag ? "mcap" : "csv");
  f("cycles", "in the log", summary.cycles);
  f("period_ns", summary.period_ns);
  f("begin_ns", "of cycle 0, on the recording's clock", summary.begin_ns);
  f("data_sha256", "of the log's messages", summary.log.data_sha256);
  f("fields", "what the recording fills: `position_rad`, `command torque_nm`, …", summary.fields);
  f("missing_joints", "joints without data", summary.missing);
  f("taken", "how, in words: several topics, empty cells, Latin-1", summary.notes);
  f("ignored", "columns, or a bag's joints, that are not used", left.ignored);
  f("excluded", "what was left out: rows of a table, messages of a bag", [&](Figures& out) {
    out("invalid", left.invalid);
    out("ragged", left.ragged);
    out("duplicates", left.duplicates);
    out("backwards", left.backwards);
    out("gaps", left.gaps);
    out("gap_cycles", "in them", left.gap_cycles);
    out("frozen", "columns", left.frozen);
  });
  f("series", summary.series);
}

std::vector<Figures::Row> import_figures() { return Figures::rows_of<log::ImportSummary>(); }

static void print_summary(const log::ImportSummary& summary, const Json& json, std::FILE* out) {
  Facts facts;
  facts.add("log", fmt::format("{} ({}, {:.1f} MB)", summary.log.path,
                               counted(summary.log.messages, "message"),
                               static_cast<double>(summary.log.bytes) * 1e-6));
  add_figures(facts, json,
              {{"cycles", "{cycles} of {period_ns:g s}"},
               {"time 0", "{begin_ns} ns of the recording's clock"},
               {"fields", "{fields}"}});
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
  add_figures(facts, json,
              {{"frozen, left out", "{excluded.frozen}"},
               {"not used", "{ignored}"},
               {"joints without data", "{missing_joints}"}});
  facts.print(out);
  fmt::print(out, "\n");
  figures_table({{"samples of", "{name}"},
                 {"number", "{samples}"},
                 {"every [ms]", "{median_ns:.6g} ({least_ns:.6g} to {most_ns:.6g})"},
                 {"late", "{late}"}},
                json["series"])
      .print(out);
}

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
  const Json json = figures_json(*summary);
  print_summary(*summary, json, human_output(options.json));
  print_warnings(warnings_of(*summary, options.files.front()));
  return end_with_json(options.json, json);
}

}  // namespace tandem::apps
