#include "apps/tools/identify_page.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "report/gnuplot.hpp"
#include "report/page.hpp"

namespace tandem::apps {
namespace {

using identification::Estimate;
using identification::Identification;
using identification::JointResult;
using identification::LinkResult;

std::string with_interval(double value, double ci95, const char* format = "{:.4g}") {
  if (!std::isfinite(value)) return "-";
  const std::string number = fmt::format(fmt::runtime(format), value);
  return std::isfinite(ci95) ? number + fmt::format(" ± {:.2g}", ci95) : number + " ± ?";
}

std::string of(const Estimate& one) {
  return one.identifiable ? with_interval(one.value, one.ci95) : "-";
}

std::string percent(double part) {
  return std::isfinite(part) ? fmt::format("{:.2f}", 100.0 * part) : "-";
}

/// Times to draw: of one log its own; of several, side by side with a gap between them.
std::vector<double> drawn_times(const JointResult& joint) {
  std::vector<double> drawn = joint.time_s;
  const double between_s = std::max(2.0, 2.0 * report::kGapSteps * report::usual_step(drawn));
  for (std::size_t l = 0; joint.first_of_log.size() > 1 && l < joint.first_of_log.size(); ++l) {
    const std::size_t begin = joint.first_of_log[l];
    const bool last = l + 1 == joint.first_of_log.size();
    const std::size_t end = last ? drawn.size() : joint.first_of_log[l + 1];
    const double from_s = begin == 0 ? 0.0 : drawn[begin - 1] + between_s;
    for (std::size_t i = begin; i < end; ++i)
      drawn[i] = from_s + joint.time_s[i] - joint.time_s[begin];
  }
  return drawn;
}

report::Figure figure_of(const JointResult& joint, std::size_t index) {
  const std::vector<double> time_s = drawn_times(joint);
  report::Figure figure{
      .name = fmt::format("joint_{:02}", index + 1),
      .title = fmt::format("{}: left over {} % by the description, {} % identified", joint.name,
                           percent(joint.described_relative_error), percent(joint.relative_error)),
      .x_label = joint.first_of_log.size() > 1 ? "held-out data, log after log [s]" : "time [s]",
      .y_label = joint.slides ? "force [N]" : "torque [Nm]"};
  using report::CurveStyle;
  figure.curves.push_back({"measured", CurveStyle::kMeasured, time_s, joint.measured_Nm});
  figure.curves.push_back({"description", CurveStyle::kThird, time_s, joint.described_Nm});
  figure.curves.push_back({"identified", CurveStyle::kComputed, time_s, joint.identified_Nm});
  break_at_gaps(figure);
  for (report::Curve& curve : figure.curves) curve = report::decimated(curve, 2000);
  return figure;
}

report::PageTable joints_table(const Identification& result) {
  report::PageTable table{
      "Joints",
      "Residual on held-out data, by the description and identified; friction and offset between "
      "the motor's current and the link's motion. -: the data say nothing of it.",
      {"joint", "rms described [Nm]", "rms [Nm]", "described [%]", "identified [%]",
       "viscous [Nms/rad]", "Coulomb [Nm]", "rotor [kg m2]", "offset [Nm]", "delay [ms]"},
      {}};
  for (const JointResult& joint : result.joints) {
    const auto rms = [](double Nm) { return std::isfinite(Nm) ? fmt::format("{:.3f}", Nm) : "-"; };
    table.rows.push_back({joint.name, rms(joint.described_rms_Nm), rms(joint.rms_Nm),
                          percent(joint.described_relative_error), percent(joint.relative_error),
                          of(joint.viscous_Nms_rad), of(joint.coulomb_Nm),
                          of(joint.rotor_inertia_kg_m2), of(joint.offset_Nm),
                          fmt::format("{:.2f}", 1e3 * joint.delay_s)});
  }
  return table;
}

/// Names of the known base parameters that a link's numbers are in; empty when all are known.
std::string sums_of(const LinkResult& link, const Identification& result) {
  using identification::Seen;
  const bool sums = (!link.mass_identifiable && link.mass_seen == Seen::kInSums) ||
                    (!link.com_identifiable && link.com_seen == Seen::kInSums) ||
                    (!link.inertia_identifiable && link.inertia_seen == Seen::kInSums);
  std::string names;
  for (const std::string& name : link.base_parameters) {
    const auto base = std::ranges::find(result.base, name, &identification::BaseParameter::name);
    if (!sums || base == result.base.end() || !base->estimate.identifiable) continue;
    names += (names.empty() ? "" : ", ") + name;
  }
  return names;
}

report::PageTable links_table(const Identification& result) {
  report::PageTable table{
      "Links",
      "In the axes of each link, with 95 % intervals from the data and from a description that is "
      "doubted. Δ: difference from the description. What is marked (d) is not determined by the "
      "data alone; the value follows from the description and from physical consistency. Most such "
      "numbers are no "
      "fault of the log: the robot's joints show them only in sums with those of other links. The "
      "last column has the known sums: the next table has their values.",
      {"link", "mass [kg]", "Δ mass [kg]", "com [mm]", "Δ com [mm]", "Ixx Iyy Izz [g m2]",
       "Δ [g m2]", "in sums only"},
      {}};
  for (const LinkResult& link : result.links) {
    const auto mark = [](bool identifiable) { return identifiable ? "" : " (d)"; };
    const model::Inertia& now = link.identified;
    const model::Inertia& was = link.described;
    const auto three = [](const auto& v, double factor) {
      return fmt::format("{:.2f} {:.2f} {:.2f}", factor * v[0], factor * v[1], factor * v[2]);
    };
    const Eigen::Vector3d moments = now.about_com_kg_m2.diagonal();
    const Eigen::Vector3d change = moments - was.about_com_kg_m2.diagonal();
    table.rows.push_back({link.name + (link.changed ? "" : " (as described)"),
                          with_interval(now.mass_kg, link.mass_ci95) + mark(link.mass_identifiable),
                          fmt::format("{:+.4f}", now.mass_kg - was.mass_kg),
                          three(now.com_m, 1e3) + mark(link.com_identifiable),
                          three(Eigen::Vector3d(now.com_m - was.com_m), 1e3),
                          three(moments, 1e3) + mark(link.inertia_identifiable), three(change, 1e3),
                          sums_of(link, result)});
  }
  return table;
}

report::PageTable base_table(const Identification& result) {
  report::PageTable table{
      "Base parameters",
      "The combinations of parameters that the motion shows, each with its 95 % interval. What is "
      "not in them has no effect on any torque.",
      {"combination", "described", "identified", "difference / interval"},
      {}};
  for (const identification::BaseParameter& one : result.base) {
    std::string terms;
    for (std::size_t i = 0; i < one.terms.size() && i < 6; ++i) {
      const auto& [name, factor] = one.terms[i];
      terms += i == 0 && factor == 1.0 ? name : fmt::format(" {:+.4g} {}", factor, name);
    }
    if (one.terms.size() > 6) terms += fmt::format(" … ({} more)", one.terms.size() - 6);
    table.rows.push_back(
        {terms, fmt::format("{:.5g}", one.described),
         with_interval(one.estimate.value, one.estimate.ci95, "{:.5g}"),
         fmt::format("{:+.1f}", (one.estimate.value - one.described) / one.estimate.ci95)});
  }
  return table;
}

report::PageTable text_table(const char* title, const std::vector<std::string>& sentences) {
  report::PageTable table{title, "", {""}, {}};
  for (const std::string& one : sentences) table.rows.push_back({one});
  return table;
}

}  // namespace

std::string mass_note(const Identification& result) {
  return result.mass_kg.identifiable ? "" : ", not known: these data do not show it";
}

Result<std::string> write_identify_page(const Identification& result, const std::string& robot,
                                        const std::string& folder) {
  std::vector<report::Figure> figures;
  for (std::size_t j = 0; j < result.joints.size(); ++j)
    if (!result.joints[j].time_s.empty()) figures.push_back(figure_of(result.joints[j], j));
  report::Page page;
  page.by = "tandem identify";
  page.title = robot + ": identification";
  page.lead =
      "Measured torque of every joint on data that was held back, beside what the "
      "description and the identified robot say it should be.";
  page.facts = {
      {"used", fmt::format("{:.1f} s", result.usable_s)},
      {"held back", fmt::format("{:.1f} s", result.held_out_s)},
      {"condition number", fmt::format("{:.1f}", result.condition_number)},
      {"base parameters", std::to_string(result.base.size())},
      {"mass described", fmt::format("{:.4f} kg", result.described_mass_kg)},
      {"mass identified", fmt::format("{:.4f} kg", result.identified_mass_kg) + mass_note(result)}};
  if (!result.warnings.empty()) page.tables.push_back(text_table("Warnings", result.warnings));
  if (!result.remarks.empty())
    page.tables.push_back(text_table("Left out, and assumed", result.remarks));
  page.tables.push_back(joints_table(result));
  page.tables.push_back(links_table(result));
  page.tables.push_back(base_table(result));
  if (const Status s = report::draw(figures, folder); !s) return std::unexpected(s.error());
  if (const Status s = report::write_page(page, figures, folder); !s)
    return std::unexpected(s.error());
  for (const report::Figure& figure : figures) {
    std::error_code ignored;  // its drawing stands in the page
    std::filesystem::remove(folder + "/" + figure.name + ".svg", ignored);
  }
  return folder + "/report.html";
}

}  // namespace tandem::apps
