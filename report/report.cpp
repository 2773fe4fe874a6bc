// Reads one or two logs, aligns the start of their controllers, and writes figures, tables and
// page.
#include "report/report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "base/counted.hpp"
#include "report/close_passive.hpp"
#include "report/gnuplot.hpp"
#include "report/page.hpp"
#include "report/parallel_figures.hpp"
#include "report/run_figures.hpp"

namespace tandem::report {
namespace {

/// What, which joint, when: of the first few, which the others mostly follow from.
void add_faults(const RunData& run, const std::string& side, Facts& facts) {
  constexpr std::size_t kMost = 5;
  for (std::size_t i = 0; i < std::min(kMost, run.faults.size()); ++i) {
    const RunFault& fault = run.faults[i];
    facts.emplace_back("fault" + side,
                       fmt::format("{}{}{}, at {:.3f} s", fault.joint,
                                   fault.joint.empty() ? "" : ": ", fault.text, fault.time_s));
  }
  if (run.faults.size() > kMost) {
    facts.emplace_back("fault" + side, fmt::format("{} more", run.faults.size() - kMost));
  }
}

void add_facts(const RunData& run, const std::string& side, Facts& facts) {
  facts.emplace_back(
      "log" + side,
      run.path + (run.truncated ? " (cut: its run was killed, or the copy is not whole)" : ""));
  add_faults(run, side, facts);
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
  const double ran_s =
      run.controllers_ran ? run.time_s[run.rows_before_fault() - 1] - start_s : 0.0;
  if (run.controllers_ran) {
    facts.emplace_back("controllers started" + side, fmt::format("{:.3f} s", start_s));
  }
  facts.emplace_back("controllers ran" + side, fmt::format("{:.3f} s", ran_s));
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
  if (!run.faults.empty()) table.caption += " Until the first fault.";
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

/// Of every closed loop, by the simulation's truth; without rows when the log has none.
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

/// Of every foot, by the simulation's truth; without rows when the log has none.
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
  page.tables.push_back(tracking_table(run, side));
  PageTable feet = feet_table(run, side);
  if (!feet.rows.empty()) page.tables.push_back(std::move(feet));
  PageTable loops = loops_table(run, side);
  if (!loops.rows.empty()) page.tables.push_back(std::move(loops));
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

Page page_of(const RunData& run, const RunData* other) {
  Page page;
  page.title = other == nullptr ? fmt::format("{}: {}", run.info.robot,
                                              std::filesystem::path(run.path).stem().string())
                                : fmt::format("{}: two runs", run.info.robot);
  page.lead = "Times count from the run's first SYNC, as in the log.";
  page.lead += run.controllers_ran
                   ? fmt::format(" The controllers started at {:.3f} s.", run.time_s.front())
                   : " The run ended before its controllers started.";
  add_facts(run, other == nullptr ? "" : " A", page.facts);
  add_tables(run, other == nullptr ? "" : " A", page);
  if (other == nullptr) return page;
  page.lead += " A is " + run.path + ", B is " + other->path + ".";
  if (std::abs(other->drawn_later_s) > 0.0) {
    page.lead += fmt::format(" B is drawn {:.3f} s {}, so that both controllers start together.",
                             std::abs(other->drawn_later_s),
                             other->drawn_later_s > 0.0 ? "later" : "earlier");
  }
  add_facts(*other, " B", page.facts);
  add_tables(*other, " B", page);
  return page;
}

}  // namespace

Result<ReportFiles> make_report(const std::string& log, const std::string& other,
                                const std::string& folder, const FindKernels& find_kernels,
                                const ErrorText& error_text) {
  Result<RunData> run = read_run(log, error_text);
  if (!run) return std::unexpected(run.error());
  Result<RunData> second = other.empty() ? Result<RunData>(RunData{}) : read_run(other, error_text);
  if (!second) return std::unexpected(second.error());
  RunData* over = other.empty() ? nullptr : &*second;
  Result<std::optional<RunData>> beside = std::nullopt;
  if (over == nullptr) beside = read_parallel(*run);
  if (!beside) return std::unexpected(beside.error());
  if (*beside) over = &**beside;
  if (over != nullptr && over->info.joints != run->info.joints) {
    return std::unexpected(Error{"the two logs are of different robots",
                                 "lay runs of one robot over each other",
                                 other,
                                 0,
                                 {}});
  }
  if (const Status s = create(folder); !s) return std::unexpected(s.error());

  ReportFiles files;
  const tandem_kernels* kernels = find_kernels(*run);
  if (kernels == nullptr) {
    files.remarks.push_back(
        "no inverse dynamics: there is no kernel library that fits this log; run: "
        "tandem model build " +
        run->robot.file);
  } else if (kernels->floating_base != 0 && !run->motion_known()) {
    files.remarks.push_back(
        "no inverse dynamics: the log lacks the base's motion and the ground's forces (no truth)");
  }
  for (RunData* one : {&*run, over}) {
    if (one == nullptr) continue;
    if (const Status closed = kernels == nullptr ? Status{} : close_passive(*one, *kernels);
        !closed) {
      files.remarks.push_back("what passive joints move is not drawn: " + closed.error().message);
    }
  }
  if (over != nullptr) over->drawn_later_s = run->time_s.front() - over->time_s.front();
  std::vector<Figure> figures = figures_of(*run, over, kernels);
  if (*beside) {
    for (Figure& figure : difference_figures(*run, *over)) figures.push_back(std::move(figure));
  }
  if (const Status s = draw(figures, folder); !s) return std::unexpected(s.error());
  if (const Status s =
          write_page(*beside ? parallel_page(*run, *over) : page_of(*run, over), figures, folder);
      !s) {
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
