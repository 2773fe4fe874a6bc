// Reads one to three logs, aligns the start of their controllers, and makes figures, tables and
// facts of them.
#include "report/report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/quoting.hpp"
#include "report/close_passive.hpp"
#include "report/differences.hpp"
#include "report/log_head.hpp"
#include "report/replay.hpp"
#include "report/run_facts.hpp"
#include "report/run_figures.hpp"

namespace tandem::report {
namespace {

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
  if (!imported) page.lead += " " + start_text(run);
  page.tables = replays;
  add_tables(run, others.empty() ? "" : " A", page);
  if (others.empty()) {
    add_facts(run, "", page.facts);
    return page;
  }
  const auto add_log = [&](const RunData& one) {
    page.heads.push_back(head_facts(one, run));
    add_facts(one, "", page.runs.emplace_back());
  };
  add_log(run);
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
    add_log(*others[i]);
    add_tables(*others[i], kSides[i + 1], page);
  }
  return page;
}

/// Draws `other` where its controllers start with those of `run`, if both logs have that; or where
/// the replay that one of them is lies over its recording, the other one. Then a table is added.
Status align(const RunData& run, RunData& other, const std::string& side,
             std::vector<PageTable>& tables) {
  if (run.start_known && other.start_known)
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
  const auto with_folder = [&stem](const RunData& one) {
    return (std::filesystem::path(one.path).parent_path().filename() / stem(one)).string();
  };
  bool distinct = true;
  for (const RunData* one : others) distinct = distinct && stem(*one) != stem(run);
  std::string text = "A: " + (distinct ? stem(run) : with_folder(run));
  for (std::size_t i = 0; i < others.size(); ++i)
    text += fmt::format(",{}: {}", kSides[i + 1],
                        distinct ? stem(*others[i]) : with_folder(*others[i]));
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
    if (is_over_time(figure)) break_at_gaps(figure);  // all but the posture are
  return figures;
}

/// The robot with what its description says of its joints.
hal::RobotConfig with_limits(const RunData& run) {
  hal::RobotConfig robot = run.robot;
  const auto set = [](double& limit, double described) {
    if (std::isnan(limit)) limit = described;
  };
  for (hal::JointConfig& joint : robot.joints) {
    const auto found = std::ranges::find(run.tree.joints, joint.name, &model::Joint::name);
    if (found == run.tree.joints.end()) continue;
    joint.slides = found->type == model::JointType::kPrismatic;
    set(joint.min_position_rad, found->lower);
    set(joint.max_position_rad, found->upper);
    set(joint.max_velocity_rad_s, found->velocity);
    set(joint.max_torque_Nm, found->effort);
  }
  return robot;
}

}  // namespace

Result<Report> read_report(const std::string& log, const std::vector<std::string>& other_logs,
                           const FindKernels& find_kernels, const ErrorText& error_text) {
  Result<RunData> run = read_run(log, error_text);
  if (!run) return std::unexpected(run.error());
  std::vector<PageTable> replays;
  Result<std::vector<RunData>> others = read_others(*run, other_logs, error_text, replays);
  if (!others) return std::unexpected(others.error());
  Result<std::optional<RunData>> beside = std::nullopt;
  if (others->empty()) beside = read_parallel(*run);
  if (!beside) return std::unexpected(beside.error());
  const bool parallel = beside->has_value();
  if (parallel) {
    (*beside)->drawn_later_s = run->time_s.front() - (*beside)->time_s.front();
    others->push_back(std::move(**beside));
  }

  Report report;
  const tandem_kernels* kernels = find_kernels(*run);
  std::vector<RunData*> all{&*run};
  for (RunData& one : *others) all.push_back(&one);
  report.remarks = close_and_remark(all, kernels);
  for (const RunData* one : all) {
    if (parallel && one != &*run) continue;  // it is of the same log
    if (!one->cut_reason.empty())
      report.remarks.push_back(one->path + ": it is cut: " + one->cut_reason);
    for (const std::string& remark : one->remarks)
      report.remarks.push_back(one->path + ": " + remark);
  }
  const OtherRuns beside_it(all.begin() + 1, all.end());
  auto figures = draw_all(*run, beside_it, parallel, kernels, report.remarks);
  if (!figures) return std::unexpected(figures.error());
  report.figures = std::move(*figures);
  report.page =
      parallel ? parallel_page(*run, *beside_it.front()) : page_of(*run, beside_it, replays);
  for (std::size_t i = 0; i < beside_it.size() && !parallel; ++i) {
    auto table = first_differences(run->path, beside_it[i]->path, static_cast<char>('B' + i));
    if (table)
      report.page.tables.push_back(std::move(*table));
    else
      report.remarks.push_back(table.error().to_string());
  }
  report.at_s = run->time_s.front();
  report.run = {.robot = with_limits(*run),
                .urdf = log::value_of(run->info.configuration, run->robot.model.urdf),
                .version = run->info.version,
                .experiment = others->empty() || parallel
                                  ? std::filesystem::path(run->path).filename().string()
                                  : letters_of(*run, beside_it, false),
                .run = {},
                .simulated = run->info.hal == "sim",
                .period_ns = run->info.period_ns};
  for (std::size_t i = 0; i < all.size() && (i == 0 || !parallel); ++i) {
    report.logs.push_back({.path = all[i]->path,
                           .prefix = i == 0 ? "" : std::string(1, static_cast<char>('A' + i)) + "/",
                           .later_s = all[i]->drawn_later_s,
                           .slower = all[i]->drawn_slower});
  }
  return report;
}

}  // namespace tandem::report
