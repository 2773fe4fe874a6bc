// Reads one to three logs, aligns the start of their controllers, and writes figures, tables and
// page.
#include "report/report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "report/close_passive.hpp"
#include "report/gnuplot.hpp"
#include "report/page.hpp"
#include "report/replay.hpp"
#include "report/run_figures.hpp"

namespace tandem::report {
namespace {

/// What, which joint, when: of the first few, which the others mostly follow from, and of the stop.
void add_faults(const RunData& run, const std::string& side, Facts& facts) {
  std::size_t more = 0;
  for (std::size_t i = 0; i < run.faults.size(); ++i) {
    const RunFault& fault = run.faults[i];
    if (i >= kFaultsShown && &fault != run.stop()) {
      ++more;
      continue;
    }
    facts.emplace_back("fault" + side,
                       fmt::format("{}{}{}, at {:.3f} s", fault.joint,
                                   fault.joint.empty() ? "" : ": ", fault.text, fault.time_s));
  }
  if (more > 0) facts.emplace_back("fault" + side, fmt::format("{} more", more));
}

void add_payloads(const RunData& run, const std::string& side, Facts& facts) {
  for (const PayloadMark& one : run.payloads) {
    const std::string what = one.text.substr(one.text.find(' ') + 1);  // without "payload "
    facts.emplace_back("payload" + side, fmt::format("{}, at {:.3f} s", what, one.time_s));
  }
}

void add_facts(const RunData& run, const std::string& side, Facts& facts) {
  facts.emplace_back("log" + side,
                     run.path + (run.cut_reason.empty() ? "" : " (cut: " + run.cut_reason + ")"));
  for (const std::string& one : run.remarks) facts.emplace_back("log" + side, one);
  add_faults(run, side, facts);
  add_payloads(run, side, facts);
  const std::size_t passive = run.robot.passive.size();
  facts.emplace_back(
      "robot" + side,
      fmt::format("{}, {}{}", run.info.robot, counted(run.info.joints.size(), "joint"),
                  passive == 0 ? "" : fmt::format(", {} more passive", passive)));
  facts.emplace_back("backend" + side, run.info.hal);
  facts.emplace_back("seed" + side, std::to_string(run.info.seed));
  facts.emplace_back("period" + side,
                     fmt::format("{} us", static_cast<double>(run.info.period_ns) * 1e-3));
  const double start_s = run.time_s.front();
  const double ran_s = run.controllers_ran ? run.time_s[run.rows_before_stop() - 1] - start_s : 0.0;
  const bool imported = run.info.hal == "import";
  if (run.controllers_ran && !imported && run.remarks.empty()) {
    facts.emplace_back("controllers started" + side, fmt::format("{:.3f} s", start_s));
  }
  facts.emplace_back((imported ? "recorded" : "controllers ran") + side,
                     fmt::format("{:.3f} s", ran_s));
  if (!run.info.engine.empty()) facts.emplace_back("engine" + side, run.info.engine);
  facts.emplace_back("kernels" + side, run.info.kernel_variant);
  facts.emplace_back("tandem" + side, run.info.version);
  for (const auto& [key, value] : run.result) {
    if (key != "data_sha256") facts.emplace_back(key + side, value);
  }
  facts.emplace_back("data sha256" + side, run.data_sha256);
}

PageTable tracking_table(const RunData& run, const std::string& side) {
  PageTable table{"Tracking" + side,
                  "Reference minus measured link position of the joints under position control, "
                  "and the largest measured torque. The worst first.",
                  {"joint", "rms [deg]", "max [deg]", "max torque [Nm]"},
                  {}};
  if (run.stop() != nullptr) table.caption += " Until the fault that stopped it.";
  const std::vector<Tracking> joints = run.tracking();
  const bool all_slide = !joints.empty() && std::ranges::all_of(joints, &Tracking::slides);
  const bool mixed = !all_slide && std::ranges::any_of(joints, &Tracking::slides);
  if (all_slide) table.header = {"joint", "rms [mm]", "max [mm]", "max force [N]"};
  if (mixed) table.header = {"joint", "rms", "max", "max torque or force"};
  for (const Tracking& one : joints) {
    const double factor = one.slides ? 1e3 : kDegrees;
    const char* unit = !mixed ? "" : (one.slides ? " mm" : " deg");
    table.rows.push_back(
        {one.joint, fmt::format("{:.4f}{}", one.rms_rad * factor, unit),
         fmt::format("{:.4f}{}", one.max_rad * factor, unit),
         fmt::format("{:.2f}{}", one.max_torque_Nm, !mixed ? "" : (one.slides ? " N" : " Nm"))});
  }
  return table;
}

/// Table of every closed loop, by the simulation's truth; without rows when the log has none.
PageTable loops_table(const RunData& run, const std::string& side) {
  PageTable table{"Closed loops" + side,
                  "How far and how fast a loop was open at most in the simulation, which closes it "
                  "after every step: what is left is rounding.",
                  {"loop", "open [m]", "opening [m/s]"},
                  {}};
  const std::size_t loops = run.robot.loops.size();
  for (std::size_t l = 0; l < run.loop_error.size() / 2; ++l) {
    table.rows.push_back({run.robot.loops[l].name,
                          fmt::format("{:.1e}", std::ranges::max(run.loop_error[l])),
                          fmt::format("{:.1e}", std::ranges::max(run.loop_error[loops + l]))});
  }
  return table;
}

/// Table of every parameter; without rows when the log has none.
PageTable parameter_table(const RunData& run, const std::string& side) {
  PageTable table{"Parameters" + side,
                  "Of the controllers, at the run's start, and what was set last. Of a word that "
                  "was set its number among the choices is shown.",
                  {"parameter", "at the start", "set last", "times set"},
                  {}};
  for (const RunParameter& one : run.parameters)
    table.rows.push_back({one.name, one.start, one.then, std::to_string(one.changes)});
  return table;
}

/// Table of every foot, by the simulation's truth; without rows when the log has none.
PageTable feet_table(const RunData& run, const std::string& side) {
  PageTable table{"Feet" + side,
                  "Vertical force of the ground in the simulation, and the farthest that a foot "
                  "was from where it last touched down.",
                  {"foot", "mean [N]", "max [N]", "slip [mm]"},
                  {}};
  for (const FootFigures& foot : run.feet()) {
    table.rows.push_back({foot.name, fmt::format("{:.2f}", foot.mean_force_N),
                          fmt::format("{:.2f}", foot.max_force_N),
                          fmt::format("{:.3f}", foot.slip_m * 1e3)});
  }
  return table;
}

void add_tables(const RunData& run, const std::string& side, Page& page) {
  for (auto* make : {tracking_table, feet_table, loops_table, parameter_table}) {
    PageTable table = make(run, side);
    if (!table.rows.empty()) page.tables.push_back(std::move(table));
  }
}

Status create(const std::string& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (!problem) return {};
  return std::unexpected(Error{"cannot create the report's folder: " + problem.message(),
                               "name a folder that can be written with -o",
                               folder,
                               0,
                               {}});
}

constexpr const char* kSides[] = {" A", " B", " C"};

/// A run with the robot beside it: facts of the run, tables of both, and their differences.
Page parallel_page(const RunData& run, const RunData& second) {
  Page page;
  page.title = fmt::format("{}: {}, in parallel", run.info.robot,
                           std::filesystem::path(run.path).stem().string());
  page.lead = fmt::format(
      "Times count from the run's first SYNC, as in the log. A is the robot, B the one that was "
      "simulated beside it, {}, and got the same commands.",
      second.robot.file);
  add_facts(run, "", page.facts);
  page.tables.push_back(differences_table(run, second));
  add_tables(run, " A", page);
  add_tables(second, " B", page);
  return page;
}

Page page_of(const RunData& run, const OtherRuns& others, const std::vector<PageTable>& replays) {
  Page page;
  page.title =
      others.empty()
          ? fmt::format("{}: {}", run.info.robot, std::filesystem::path(run.path).stem().string())
          : fmt::format("{}: {} runs", run.info.robot, others.size() == 1 ? "two" : "three");
  const bool imported = run.info.hal == "import";
  page.lead = imported ? "Times count from the recording's start, as in the log."
                       : "Times count from the run's first SYNC, as in the log.";
  if (!imported)
    page.lead += run.controllers_ran
                     ? fmt::format(" The controllers started at {:.3f} s.", run.time_s.front())
                     : " The run ended before its controllers started.";
  add_facts(run, others.empty() ? "" : " A", page.facts);
  page.tables = replays;
  add_tables(run, others.empty() ? "" : " A", page);
  if (others.empty()) return page;
  page.lead += " A is " + run.path;
  for (std::size_t i = 0; i < others.size(); ++i)
    page.lead += fmt::format(",{} is {}", kSides[i + 1], others[i]->path);
  page.lead += ".";
  for (std::size_t i = 0; i < others.size(); ++i) {
    const double later_s = others[i]->drawn_later_s, slower = others[i]->drawn_slower;
    if (slower != 1.0)
      page.lead += fmt::format(" The times of{} are multiplied by {:.4g}.", kSides[i + 1], slower);
    if (std::abs(later_s) > 0.0) {
      page.lead += fmt::format("{} is drawn {:.3f} s {}, so that {}.", kSides[i + 1],
                               std::abs(later_s), later_s > 0.0 ? "later" : "earlier",
                               others[i]->drawn_as_replay ? "the replay lies over its recording"
                                                          : "both controllers start together");
      if (others[i]->drawn_as_replay)
        page.lead += fmt::format(" Only what is played is drawn of{}.", kSides[i + 1]);
    }
    add_facts(*others[i], kSides[i + 1], page.facts);
    add_tables(*others[i], kSides[i + 1], page);
  }
  return page;
}

/// Draws `other` where its controllers start with those of `run`; or where the replay that one of
/// them is lies over its recording, the other one. Then a table is added.
Status align(const RunData& run, RunData& other, const std::string& side,
             std::vector<PageTable>& tables) {
  other.drawn_later_s = run.time_s.front() - other.time_s.front();
  for (const bool forth : {true, false}) {
    const RunData& playing = forth ? other : run;
    const RunData& played = forth ? run : other;
    const auto replay = find_replay(playing, played);
    if (!replay) return std::unexpected(replay.error());
    if (!*replay) continue;
    other.drawn_slower = forth ? (*replay)->speed : 1.0 / (*replay)->speed;
    other.drawn_later_s = forth ? (*replay)->from_s - other.drawn_slower * (*replay)->begin_s
                                : (*replay)->begin_s - other.drawn_slower * (*replay)->from_s;
    other.drawn_as_replay = true;
    // Its way to the first place, and what of a recording is not played, has nothing to lie over.
    const double before_s = forth ? (*replay)->from_s : (*replay)->run_time_s((*replay)->from_s);
    const double after_s = forth ? (*replay)->to_s : (*replay)->run_time_s((*replay)->to_s);
    const double half_s = 0.5 * std::max(run.step_s, other.step_s);
    other.drawn_from_s = before_s - half_s;
    other.drawn_to_s = after_s + half_s;
    tables.push_back(replay_table(playing, played, **replay));
    tables.back().title += side;
    break;
  }
  return {};
}

/// The runs that are laid over `run`. Errors: more than fit; one of another robot.
/// @param tables  of those that replay each other
Result<std::vector<RunData>> read_others(const RunData& run, const std::vector<std::string>& logs,
                                         const ErrorText& error_text,
                                         std::vector<PageTable>& tables) {
  if (logs.size() > kMostOthers)
    return fail("more than three logs", "lay up to three over each other");
  std::vector<RunData> others;
  for (const std::string& log : logs) {
    Result<RunData> other = read_run(log, error_text);
    if (!other) return std::unexpected(other.error());
    if (other->info.joints != run.info.joints) {
      return std::unexpected(Error{
          "the logs are of different robots", "lay runs of one robot over each other", log, 0, {}});
    }
    if (Status s = align(run, *other, kSides[others.size() + 1], tables); !s) {
      return std::unexpected(s.error());
    }
    others.push_back(std::move(*other));
  }
  return others;
}

/// Why the figures lack something: no kernels or truth, or passive joints that cannot be closed,
/// which this tries.
std::vector<std::string> close_and_remark(const std::vector<RunData*>& all,
                                          const tandem_kernels* kernels) {
  const RunData& run = *all.front();
  if (kernels == nullptr) {
    return {
        "no inverse dynamics: there is no kernel library that fits this log; run: "
        "tandem model build " +
        shell_word(run.robot.file)};
  }
  std::vector<std::string> remarks;
  if (kernels->floating_base != 0 && !run.motion_known()) {
    remarks.emplace_back(
        "no inverse dynamics: the log lacks the base's motion and the ground's forces (no truth)");
  }
  for (RunData* one : all) {
    if (const Status closed = close_passive(*one, *kernels); !closed)
      remarks.push_back("what passive joints move is not drawn: " + closed.error().message);
  }
  return remarks;
}

/// "A: coman-squat-001, B: coman-squat-002": what the letters in a picture mean.
std::string letters_of(const RunData& run, const OtherRuns& others, bool parallel) {
  if (parallel) return "A: the robot, B: the one beside it";
  const auto stem = [](const RunData& one) {
    return std::filesystem::path(one.path).stem().string();
  };
  bool distinct = true;
  for (const RunData* one : others) distinct = distinct && stem(*one) != stem(run);
  std::string text = "A: " + (distinct ? stem(run) : run.path);
  for (std::size_t i = 0; i < others.size(); ++i)
    text += fmt::format(",{}: {}", kSides[i + 1], distinct ? stem(*others[i]) : others[i]->path);
  return text;
}

/// All figures of the report, in its order. `parallel`: the other run is the internal model.
Result<std::vector<Figure>> draw_all(const RunData& run, const OtherRuns& others, bool parallel,
                                     const tandem_kernels* kernels,
                                     std::vector<std::string>& remarks) {
  std::vector<Figure> figures = figures_of(run, others, kernels);
  if (parallel) {
    for (Figure& figure : difference_figures(run, *others.front()))
      figures.push_back(std::move(figure));
  }
  auto wrenches = wrench_figures(run);
  if (!wrenches) return std::unexpected(wrenches.error());
  auto signals = signal_figures(run, remarks);
  if (!signals) return std::unexpected(signals.error());
  for (auto* more : {&*wrenches, &*signals}) {
    figures.insert(figures.end() - 1, std::make_move_iterator(more->begin()),
                   std::make_move_iterator(more->end()));
  }
  if (!others.empty()) {
    const std::string letters = letters_of(run, others, parallel);
    for (Figure& figure : figures) figure.x_label += (figure.x_label.empty() ? "" : "; ") + letters;
  }
  for (Figure& figure : figures)
    if (!figure.equal_axes) break_at_gaps(figure);  // all but the posture are over time
  return figures;
}

}  // namespace

Result<ReportFiles> make_report(const std::string& log, const std::vector<std::string>& other_logs,
                                const std::string& folder, const FindKernels& find_kernels,
                                const ErrorText& error_text) {
  Result<RunData> run = read_run(log, error_text);
  if (!run) return std::unexpected(run.error());
  std::vector<PageTable> replays;
  Result<std::vector<RunData>> other_runs = read_others(*run, other_logs, error_text, replays);
  if (!other_runs) return std::unexpected(other_runs.error());
  Result<std::optional<RunData>> beside = std::nullopt;
  if (other_runs->empty()) beside = read_parallel(*run);
  if (!beside) return std::unexpected(beside.error());
  if (*beside) {
    (*beside)->drawn_later_s = run->time_s.front() - (*beside)->time_s.front();
    other_runs->push_back(std::move(**beside));
  }
  if (const Status s = create(folder); !s) return std::unexpected(s.error());

  ReportFiles files;
  const tandem_kernels* kernels = find_kernels(*run);
  std::vector<RunData*> all{&*run};
  for (RunData& one : *other_runs) all.push_back(&one);
  files.remarks = close_and_remark(all, kernels);
  const OtherRuns others(all.begin() + 1, all.end());
  const auto drawn = draw_all(*run, others, beside->has_value(), kernels, files.remarks);
  if (!drawn) return std::unexpected(drawn.error());
  const std::vector<Figure>& figures = *drawn;
  if (const Status s = draw(figures, folder); !s) return std::unexpected(s.error());
  const Page page = *beside ? parallel_page(*run, *others.front()) : page_of(*run, others, replays);
  if (const Status s = write_page(page, figures, folder); !s) {
    return std::unexpected(s.error());
  }
  files.page = folder + "/report.html";
  for (const Figure& figure : figures) files.images.push_back(folder + "/" + figure.name + ".png");
  files.images.push_back(folder + "/overview.png");
  for (const Figure& figure : figures) {
    std::error_code ignored;  // its drawing stands in the page
    std::filesystem::remove(folder + "/" + figure.name + ".svg", ignored);
  }
  return files;
}

}  // namespace tandem::report
