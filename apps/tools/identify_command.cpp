// tandem identify: logs to parameters, files and a page.
#include <fmt/core.h>

#include <algorithm>

#include "apps/text/draft.hpp"
#include "apps/text/figures.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/identified_files.hpp"
#include "apps/tools/identify_page.hpp"
#include "base/process.hpp"
#include "identification/identify.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
using identification::Estimate;
using identification::Identification;
using identification::Seen;

static void figures(Figures& f, const identification::LinkResult& link) {
  const auto quantity = [&f](const char* key, const char* words, const auto& value,
                             const auto& ci95, bool identifiable, Seen seen) {
    f(key, words, [&](Figures& one) {
      one("value", value);
      one("ci95", ci95);
      one("identifiable", identifiable);
      one("seen", identification::to_string(seen));
    });
  };
  const auto numbers = [](const auto& of) { return std::vector<double>(of.begin(), of.end()); };
  const Eigen::Matrix3d& I = link.identified.about_com_kg_m2;
  quantity("mass_kg", "", link.identified.mass_kg, link.mass_ci95, link.mass_identifiable,
           link.mass_seen);
  quantity("com_m", "in the link's frame", numbers(link.identified.com_m), numbers(link.com_ci95),
           link.com_identifiable, link.com_seen);
  quantity("inertia_kg_m2", "about `com_m`, along the link's axes: ixx ixy ixz iyy iyz izz",
           std::vector{I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)},
           numbers(link.inertia_ci95), link.inertia_identifiable, link.inertia_seen);
  f("base_parameters", "names of those that have a parameter of this link", link.base_parameters);
}

static void figures(Figures& f, const identification::JointResult& joint) {
  const auto estimates = [&joint](Figures& to, double Estimate::*part) {
    const auto add = [&](const char* key, const Estimate& one) {
      to(key, known(one.identifiable, one.*part));
    };
    add("viscous_Nms_rad", joint.viscous_Nms_rad);
    add("coulomb_Nm", joint.coulomb_Nm);
    add("rotor_inertia_kg_m2", joint.rotor_inertia_kg_m2);
    add("offset_Nm", joint.offset_Nm);
  };
  estimates(f, &Estimate::value);
  f("behind_rotor", "no equation has this drive's rotor", joint.behind_rotor);
  f("rotor_from", "`data` or `description`",
    joint.rotor_inertia_kg_m2.identifiable ? "data" : "description");
  f("ci95", "of these four", [&](Figures& of) { estimates(of, &Estimate::ci95); });
  f("delay_s", "by which the torque is later than the position, as fitted", joint.delay_s);
  f("rms_Nm", "of the torque's residual on held-out data", joint.rms_Nm);
  f("relative_error", "the same over the torque, both as RMS", joint.relative_error);
  f("described_relative_error", "the same by the description", joint.described_relative_error);
}

static void figures(Figures& f, const identification::BaseParameter& one) {
  f("name", one.name);
  f("terms", "parameter and factor", one.terms);
  f("value", one.estimate.value);
  f("ci95", one.estimate.ci95);
  f("identifiable", one.estimate.identifiable);
  f("described", one.described);
}

static void figures(Figures& f, const identification::LeftOut& left) {
  f("log", left.log);
  f("what", "signal and reason", left.what);
  f("sum_s", "of all", left.sum_s);
  f("first_begin_s", "of the first, since the log's time 0", left.first_begin_s);
  f("first_end_s", left.first_end_s);
}

static void figures(Figures& f, const Identification& result) {
  f("links", "with mass", by_name(result.links));
  f("joints", by_name(result.joints));
  f("condition_number", "of the base parameters' columns, weighted, each of unit length",
    result.condition_number);
  f("base_parameters", result.base);
  f("total_mass_kg", "of the whole robot", [&](Figures& mass) {
    mass("value", result.identified_mass_kg);
    mass("ci95", "of what the equations reach, by the data alone", result.mass_kg.ci95);
    mass("identifiable", "that is within 5 %", result.mass_kg.identifiable);
    mass("described", result.described_mass_kg);
  });
  f("used_s", "of the logs", result.usable_s);
  f("held_back_s", "of that", result.held_out_s);
  f("left_out", "stretches of a signal that were not used", result.left_out);
  f("notes", "everything that was left out, assumed, or could not be written", result.remarks);
  f("warnings", "what to look at before the result is used", result.warnings);
}

static void print_result(std::FILE* out, const Identification& result, const Json& json) {
  figures_table({{"joint", ""},
                 {"rms [Nm]", "{rms_Nm:.4f}"},
                 {"left over [%]", "{relative_error:.2f}"},
                 {"by description [%]", "{described_relative_error:.2f}"}},
                json["joints"])
      .print(out);
  fmt::print(out, "\n");
  const auto in_data =
      std::ranges::count_if(result.base, [](const auto& one) { return one.estimate.identifiable; });
  Facts facts;
  add_figures(
      facts, json,
      {{"used", "{used_s:.1f s}, {held_back_s:.1f s} of them held back"},
       {"condition number", "{condition_number:.1f}"},
       {"base parameters", fmt::format("{} of {} known by the data", in_data, result.base.size())},
       {"mass", "{total_mass_kg.value:.4f kg}, described {total_mass_kg.described:.4f kg}" +
                    mass_note(result)}});
  facts.print(out);
}

std::vector<Figures::Row> identify_figures() { return Figures::rows_of<Identification>(); }

Exit identify_command(const IdentifyOptions& options) {
  Result<Draft> draft = Draft::folder(options.output);  // first: an interrupt has its word
  if (!draft) return refuse(draft.error());
  const auto robot = robot::read_robot(options.robot);
  if (!robot) return refuse(robot.error());
  if (const Status s = check_identified(*robot, options.logs, options.output); !s)
    return refuse(s.error());
  auto result =
      identification::identify(options.logs, robot->config, robot->tree, options.cutoff_Hz);
  if (!result) return refuse(result.error());
  std::FILE* out = human_output(options.json);
  print_result(out, *result, figures_json(*result));
  for (const std::string& remark : result->remarks)
    fmt::print(stderr, "note: {}\n", shown(remark, 2'000));
  for (const std::string& warning : result->warnings) say(Said::kWarning, shown(warning, 2'000));
  const auto written = write_identified(*robot, *result, options.logs, draft->path());
  if (!written) return refuse(draft->placed(written.error()));
  Facts files;
  for (const std::string& note : written->notes) {
    fmt::print(stderr, "note: {}\n", shown(note, 2'000));
    result->remarks.push_back(note);
  }
  for (const std::string& file : written->paths) files.add("written", draft->placed(file));
  if (program_exists("gnuplot")) {
    const auto page = write_identify_page(*result, robot->config.name, draft->path());
    if (!page) return refuse(draft->placed(page.error()));
    files.add("report", draft->placed(*page));
  } else {
    fmt::print(stderr, "note: no report: it needs gnuplot (apt-get install gnuplot-nox)\n");
  }
  if (const Status placed = draft->place(); !placed) return refuse(placed.error());
  files.print(out);
  return end_with_json(options.json, figures_json(*result));
}

}  // namespace tandem::apps
