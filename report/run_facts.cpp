// What the page says of a run: facts by name, and tables.
#include "report/run_facts.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "base/counted.hpp"
#include "report/figure.hpp"

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
  for (const RunMark& one : run.marks) {
    if (!one.kind.starts_with("payload")) continue;
    const std::string what = one.text.substr(one.text.find(' ') + 1);  // without "payload "
    facts.emplace_back("payload" + side, fmt::format("{}, at {:.3f} s", what, one.time_s));
  }
}

/// Which times a log has that is not whole, and the first few that it lacks between them.
std::string covers_text(const RunData& run) {
  constexpr std::size_t kSaid = 3;
  std::string text = fmt::format("{:.3f} to {:.3f} s", run.first_s, run.last_s);
  for (std::size_t i = 0; i < std::min(kSaid, run.gaps_s.size()); ++i) {
    text += fmt::format("{} {:.3f} to {:.3f} s", i == 0 ? ", without" : ",", run.gaps_s[i].first,
                        run.gaps_s[i].second);
  }
  if (run.gaps_s.size() > kSaid) text += fmt::format(", {} more", run.gaps_s.size() - kSaid);
  return text;
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

/// Table of what the run expected; without rows when it expected nothing.
PageTable expectation_table(const RunData& run, const std::string& side) {
  PageTable table{"Expectations" + side,
                  "What the experiment expects, and how far that was from failing.",
                  {"expected", "result"},
                  {}};
  for (const auto& [key, value] : run.result) {  // "NAME: passed, margin 3 Nm at 1.200 s"
    const std::size_t end = std::min({value.rfind(": passed"), value.rfind(": failed")});
    if (key == log::kExpectedKey && end != std::string::npos)
      table.rows.push_back({value.substr(0, end), value.substr(end + 2)});
  }
  return table;
}

/// Table of what `tandem run` says of a plant that is not the model; without rows when it was.
PageTable plant_table(const RunData& run, const std::string& side) {
  PageTable table{
      "The simulated robot is other than the model" + side,
      "What the experiment changes of the plant alone: controllers and inverse dynamics "
      "do not know of it.",
      {"what", "is"},
      {}};
  for (const std::string& one : run.info.plant) {  // "link trunk: mass_kg = 3", "payload box, 1 kg"
    const std::size_t end = std::min(one.find_first_of(":,"), one.size());
    const std::size_t rest = std::min(one.find_first_not_of(' ', end + 1), one.size());
    table.rows.push_back({one.substr(0, end), one.substr(rest)});
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
                  "Of the controllers, at the run's start, and what was set last.",
                  {"parameter", "at the start", "set last", "times set"},
                  {}};
  for (const RunParameter& one : run.parameters)
    table.rows.push_back({one.name, one.start, one.then, std::to_string(one.changes)});
  return table;
}

/// Table of what the marks in the figures are of; payloads are in the facts.
PageTable marks_table(const RunData& run, const std::string& side) {
  constexpr std::size_t kMost = 20;
  PageTable table{"Set and limited" + side,
                  "What was set, and where a limit first changed a command: marks in the figures.",
                  {"what", "time [s]"},
                  {}};
  std::size_t more = 0;
  for (const RunMark& one : run.marks) {
    if (one.kind.starts_with("payload")) continue;
    if (table.rows.size() < kMost)
      table.rows.push_back({one.text, fmt::format("{:.3f}", one.time_s)});
    else
      ++more;
  }
  if (more > 0) table.caption += fmt::format(" {} more are not listed.", more);
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

}  // namespace

std::string start_text(const RunData& run) {
  if (!run.cut_reason.empty()) {
    return fmt::format("The log is cut after {:.3f} s: {}.", run.last_s, run.cut_reason);
  }
  if (!run.controllers_ran) return "The run ended before its controllers started.";
  if (!run.start_known) {
    return fmt::format("The log begins at {:.3f} s, and does not have the controllers' start.",
                       run.first_s);
  }
  return fmt::format("The controllers started at {:.3f} s.", run.time_s.front());
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
  const bool imported = run.info.hal == "import";
  const bool whole = run.cut_reason.empty() && run.remarks.empty();
  if (!whole) facts.emplace_back("covers" + side, covers_text(run));
  if (run.controllers_ran && !imported && run.start_known)
    facts.emplace_back("controllers started" + side, fmt::format("{:.3f} s", start_s));
  facts.emplace_back((imported ? "recorded" : "controllers ran") + side,
                     fmt::format("{:.3f} s{}", run.ran_s(), whole ? "" : " of what is here"));
  if (!run.info.engine.empty()) facts.emplace_back("engine" + side, run.info.engine);
  if (!run.info.integrator.empty()) facts.emplace_back("integrator" + side, run.info.integrator);
  facts.emplace_back("kernels" + side, run.info.kernel_variant);
  facts.emplace_back("tandem" + side, run.info.version);
  for (const auto& [key, value] : run.result) {
    if (key != log::kExpectedKey) facts.emplace_back(key + side, value);
  }
  facts.emplace_back("data sha256" + side, run.data_sha256);
}

void add_tables(const RunData& run, const std::string& side, Page& page) {
  for (auto* make : {expectation_table, plant_table, tracking_table, feet_table, loops_table,
                     parameter_table, marks_table}) {
    PageTable table = make(run, side);
    if (!table.rows.empty()) page.tables.push_back(std::move(table));
  }
}

}  // namespace tandem::report
