// tandem identify: logs to parameters, files and a page.
#include <fmt/core.h>

#include <cmath>

#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/identified_files.hpp"
#include "apps/tools/identify_page.hpp"
#include "base/process.hpp"
#include "identification/identify.hpp"
#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

using identification::Estimate;
using identification::Identification;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

template <class Vector>
Json numbers(const Vector& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}

Json links_json(const Identification& result) {
  Json links = Json::object();
  for (const identification::LinkResult& link : result.links) {
    const Eigen::Matrix3d& I = link.identified.about_com_kg_m2;
    const double moments[] = {I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)};
    links[link.name] = {{"mass_kg",
                         {{"value", link.identified.mass_kg},
                          {"ci95", number(link.mass_ci95)},
                          {"identifiable", link.mass_identifiable},
                          {"seen", identification::to_string(link.mass_seen)}}},
                        {"com_m",
                         {{"value", numbers(link.identified.com_m)},
                          {"ci95", numbers(link.com_ci95)},
                          {"identifiable", link.com_identifiable},
                          {"seen", identification::to_string(link.com_seen)}}},
                        {"inertia_kg_m2",
                         {{"value", numbers(moments)},
                          {"ci95", numbers(link.inertia_ci95)},
                          {"identifiable", link.inertia_identifiable},
                          {"seen", identification::to_string(link.inertia_seen)}}},
                        {"base_parameters", link.base_parameters}};
  }
  return links;
}

Json joints_json(const Identification& result) {
  const auto known = [](const Estimate& one) {
    return one.identifiable ? number(one.value) : Json(nullptr);
  };
  const auto interval = [](const Estimate& one) {
    return one.identifiable ? number(one.ci95) : Json(nullptr);
  };
  Json joints = Json::object();
  for (const identification::JointResult& joint : result.joints) {
    joints[joint.name] = {
        {"viscous_Nms_rad", known(joint.viscous_Nms_rad)},
        {"coulomb_Nm", known(joint.coulomb_Nm)},
        {"rotor_inertia_kg_m2", known(joint.rotor_inertia_kg_m2)},
        {"offset_Nm", known(joint.offset_Nm)},
        {"behind_rotor", joint.behind_rotor},
        {"rotor_from", joint.rotor_inertia_kg_m2.identifiable ? "data" : "description"},
        {"ci95",
         {{"viscous_Nms_rad", interval(joint.viscous_Nms_rad)},
          {"coulomb_Nm", interval(joint.coulomb_Nm)},
          {"rotor_inertia_kg_m2", interval(joint.rotor_inertia_kg_m2)},
          {"offset_Nm", interval(joint.offset_Nm)}}},
        {"delay_s", number(joint.delay_s)},
        {"rms_Nm", number(joint.rms_Nm)},
        {"relative_error", number(joint.relative_error)},
        {"described_relative_error", number(joint.described_relative_error)}};
  }
  return joints;
}

Json base_json(const Identification& result) {
  Json base = Json::array();
  for (const identification::BaseParameter& one : result.base) {
    Json terms = Json::object();
    for (const auto& [name, factor] : one.terms) terms[name] = factor;
    base.push_back({{"name", one.name},
                    {"terms", terms},
                    {"value", one.estimate.value},
                    {"ci95", one.estimate.ci95},
                    {"identifiable", one.estimate.identifiable},
                    {"described", one.described}});
  }
  return base;
}

Json left_out_json(const Identification& result) {
  Json list = Json::array();
  for (const auto& [log, left] : result.left_out) {
    list.push_back({{"log", log},
                    {"what", left.what},
                    {"sum_s", left.sum_s},
                    {"first_begin_s", left.first_begin_s},
                    {"first_end_s", left.first_end_s}});
  }
  return list;
}

Json result_json(const Identification& result, const std::vector<std::string>& file_notes) {
  std::vector<std::string> notes = result.remarks;
  notes.insert(notes.end(), file_notes.begin(), file_notes.end());
  return {{"links", links_json(result)},
          {"joints", joints_json(result)},
          {"condition_number", number(result.condition_number)},
          {"base_parameters", base_json(result)},
          {"total_mass_kg",
           {{"value", result.identified_mass_kg},
            {"ci95", number(result.mass_kg.ci95)},
            {"identifiable", result.mass_kg.identifiable},
            {"described", result.described_mass_kg}}},
          {"used_s", result.usable_s},
          {"held_back_s", result.held_out_s},
          {"left_out", left_out_json(result)},
          {"notes", notes},
          {"warnings", result.warnings}};
}

void print_result(std::FILE* out, const Identification& result) {
  Table table({"joint", "rms [Nm]", "left over [%]", "by description [%]"});
  for (const identification::JointResult& joint : result.joints) {
    const auto percent = [](double part) {
      return std::isfinite(part) ? fmt::format("{:.2f}", 100.0 * part) : "-";
    };
    table.add({joint.name, std::isfinite(joint.rms_Nm) ? fmt::format("{:.4f}", joint.rms_Nm) : "-",
               percent(joint.relative_error), percent(joint.described_relative_error)});
  }
  table.print(out);
  fmt::print(out, "\n");
  Facts facts;
  facts.add("used", fmt::format("{:.1f} s, {:.1f} s of them held back", result.usable_s,
                                result.held_out_s));
  facts.add("condition number", fmt::format("{:.1f}", result.condition_number));
  std::size_t known = 0;
  for (const identification::BaseParameter& one : result.base)
    known += one.estimate.identifiable ? 1 : 0;
  facts.add("base parameters",
            fmt::format("{} of {} known by the data", known, result.base.size()));
  facts.add("mass", fmt::format("{:.4f} kg, described {:.4f} kg{}", result.identified_mass_kg,
                                result.described_mass_kg, mass_note(result)));
  facts.print(out);
}

}  // namespace

Exit identify_command(const IdentifyOptions& options) {
  Result<Draft> draft = Draft::folder(options.output);  // first: an interrupt has its word
  if (!draft) return refuse(draft.error());
  const auto robot = robot::read_robot(options.robot);
  if (!robot) return refuse(robot.error());
  if (const Status s = check_identified(*robot, options.logs, options.output); !s)
    return refuse(s.error());
  const auto result =
      identification::identify(options.logs, robot->config, robot->tree, options.cutoff_Hz);
  if (!result) return refuse(result.error());
  std::FILE* out = human_output(options.json);
  print_result(out, *result);
  for (const std::string& remark : result->remarks)
    fmt::print(stderr, "note: {}\n", shown(remark, 2'000));
  for (const std::string& warning : result->warnings)
    fmt::print(stderr, "warning: {}\n", shown(warning, 2'000));
  const auto written = write_identified(*robot, *result, options.logs, draft->path());
  if (!written) return refuse(draft->placed(written.error()));
  Facts files;
  for (const std::string& note : written->notes)
    fmt::print(stderr, "note: {}\n", shown(note, 2'000));
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
  if (const Status s = write_json(options.json, result_json(*result, written->notes)); !s)
    return refuse(s.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
