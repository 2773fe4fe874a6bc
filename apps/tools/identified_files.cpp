// Files are edited line by line, so that comments and everything else stay as they were written;
// reading them back tells whether that was enough.
#include "apps/tools/identified_files.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "apps/text/console.hpp"
#include "base/toml_reader.hpp"
#include "log/log_file.hpp"
#include "model/urdf_write.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr double kSame = 1e-9;  // of a link, relative
constexpr const char* kIdentifyMark = "Written by `tandem identify`";
constexpr const char* kIdentifyPage = ": identification</title>";

/// A file's text that says who wrote it, once.
std::string marked(const std::string& text, bool toml) {
  if (text.find(kIdentifyMark) != std::string::npos) return text;
  return toml ? fmt::format("# {}.\n{}", kIdentifyMark, text)
              : fmt::format("{}<!-- {}. -->\n", text, kIdentifyMark);
}

constexpr const char* kBlanks = " \t\r\f\v";

/// Behind `key = ` from `at` on, where something follows; npos: that does not stand there.
std::size_t behind_key(std::string_view line, std::string_view key, std::size_t at) {
  at = line.find_first_not_of(kBlanks, at);
  if (at == std::string_view::npos || !line.substr(at).starts_with(key)) return at = line.npos;
  at = line.find_first_not_of(kBlanks, at + key.size());
  if (at == std::string_view::npos || line[at] != '=') return line.npos;
  return line.find_first_not_of(kBlanks, at + 1);
}

/// Behind the text in quotes at `at`; npos: there is none.
std::size_t behind_text(std::string_view line, std::size_t at) {
  if (at >= line.size() || (line[at] != '"' && line[at] != '\'')) return line.npos;
  const std::size_t end = line.find(line[at], at + 1);
  return end == std::string_view::npos ? end : end + 1;
}

/// Replaces the text of the first `key = "…"` of a line.
std::string with_value(const std::string& line, std::string_view key, const std::string& value) {
  const std::size_t begin = behind_key(line, key, 0), end = behind_text(line, begin);
  if (end == std::string::npos) return line;
  return line.substr(0, begin) + "\"" + value + "\"" + line.substr(end);
}

/// A relative path in quotes behind `eds =`, anywhere in the line, from the old folder.
std::string with_sheet(const std::string& line, const fs::path& folder) {
  for (std::size_t at = line.find("eds"); at != std::string::npos; at = line.find("eds", at + 1)) {
    const std::size_t begin = behind_key(line, "eds", at), end = behind_text(line, begin);
    if (end == std::string::npos || end - begin < 3) continue;
    const fs::path path = line.substr(begin + 1, end - begin - 2);
    const fs::path whole = path.is_absolute() ? path : fs::absolute(folder / path);
    return line.substr(0, begin) + "\"" + whole.lexically_normal().string() + "\"" +
           line.substr(end);
  }
  return line;
}

/// The name between the brackets of a table's head, [a.b] or [[a.b]]; empty: the line is none.
std::string_view head_of(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos || line[begin] != '[') return {};
  const std::size_t name = line.find_first_not_of(" \t\r[", begin);
  const std::size_t end = line.find(']', begin);
  if (end == std::string_view::npos || name >= end) return {};
  return line.substr(name, line.find_last_not_of(" \t\r", end - 1) + 1 - name);
}

/// Whether a head is that of an actuator: [actuator.NAME], with blanks or quotes around its parts.
bool heads_actuator(std::string_view line, std::string_view name) {
  std::string plain;
  for (const char c : head_of(line))
    if (c != ' ' && c != '\t' && c != '"') plain += c;
  return plain == "actuator." + std::string(name) && line[line.find('[') + 1] != '[';
}

/// A mean of estimates, each weighted by its interval.
class Mean {
 public:
  void add(const identification::Estimate& one) {
    if (!one.identifiable || !std::isfinite(one.value)) return;
    const double weight = 1.0 / std::max(1e-24, one.ci95 * one.ci95);
    sum_ += weight * one.value;
    weight_ += weight;
  }
  [[nodiscard]] std::optional<double> value() const {
    return weight_ > 0.0 ? std::optional(sum_ / weight_) : std::nullopt;
  }
  /// Whether zero is outside of its interval.
  [[nodiscard]] bool there() const { return std::abs(sum_) > std::sqrt(weight_); }

 private:
  double sum_ = 0.0, weight_ = 0.0;
};

/// Sets `key` in the table whose head is line `head`, or adds it below the head.
void set_number(std::vector<std::string>& lines, std::ptrdiff_t head, const std::string& key,
                const std::optional<double>& value) {
  if (!value) return;
  for (auto i = static_cast<std::size_t>(head) + 1; i < lines.size(); ++i) {
    std::string& line = lines[i];
    if (const auto first = line.find_first_not_of(kBlanks);
        first != std::string::npos && line[first] == '[')
      break;
    const std::size_t begin = behind_key(line, key, 0);
    if (begin == std::string::npos || line[begin] == '#') continue;
    const std::size_t end = std::min(line.find_first_of(" \t\r#", begin), line.size());
    line = fmt::format("{}{:.6g}{}", line.substr(0, begin), *value, line.substr(end));
    return;
  }
  lines.insert(lines.begin() + head + 1, fmt::format("{} = {:.6g}", key, *value));
}

/// What of the joints robot.toml cannot say, in a sentence each.
std::vector<std::string> not_carried(const robot::RobotFiles& written,
                                     const identification::Identification& result,
                                     const std::vector<ActuatorFigures>& figures) {
  std::vector<std::string> notes;
  std::string names, drives;
  for (const identification::JointResult& joint : result.joints) {
    const auto there = [](const identification::Estimate& one) {
      return one.identifiable && std::abs(one.value) > one.ci95;
    };
    if (there(joint.offset_Nm) || there(joint.link_coulomb_Nm))
      names += (names.empty() ? "" : ", ") + joint.name;
  }
  for (const ActuatorFigures& one : figures) {
    for (const hal::ActuatorConfig& got : written.config.actuators) {
      if (got.name != one.name) continue;
      const bool there =
          (!one.inertia_kg_m2 || std::abs(got.inertia_kg_m2 / *one.inertia_kg_m2 - 1.0) < 1e-4) &&
          (!one.damping_Nms_rad || std::abs(got.damping_Nms_rad - *one.damping_Nms_rad) <
                                       1e-4 * (1.0 + std::abs(*one.damping_Nms_rad))) &&
          (!one.friction_Nm ||
           std::abs(got.friction_Nm - *one.friction_Nm) < 1e-4 * (1.0 + *one.friction_Nm));
      if (!there) drives += (drives.empty() ? "" : ", ") + one.name;
    }
  }
  if (!names.empty()) {
    notes.push_back(
        "robot.toml has no torque offsets and no friction behind a torque's measurement: those of "
        "these joints are in the report and in JSON only: " +
        names);
  }
  if (!drives.empty()) {
    notes.push_back(
        "the figures of these actuators could not be put into robot.toml, which "
        "writes them in another way than [actuator.NAME]: " +
        drives);
  }
  return notes;
}

Status check_read_back(const robot::RobotFiles& read,
                       const identification::Identification& result) {
  for (const identification::LinkResult& link : result.links) {
    const int index = read.tree.link_index(link.name);
    if (index < 0) continue;
    const model::Inertia& got = read.tree.links[static_cast<std::size_t>(index)].inertia;
    const model::Inertia& want = link.identified;
    const double off =
        std::abs(got.mass_kg - want.mass_kg) / want.mass_kg + (got.com_m - want.com_m).norm() +
        (got.about_com_kg_m2 - want.about_com_kg_m2).norm() / (1e-12 + want.about_com_kg_m2.norm());
    if (off < kSame) continue;
    return std::unexpected(
        Error{"what was written does not give link '" + link.name + "' the identified inertia",
              "put it there by hand: report.html has the figures",
              read.config.file,
              0,
              {}});
  }
  return {};
}

/// The experiments that the logs carry, to run again with the identified robot.
std::vector<std::pair<std::string, std::string>> experiments_of(
    const std::vector<std::string>& logs) {
  std::vector<std::pair<std::string, std::string>> found;
  std::set<std::string> names;
  for (const std::string& log : logs) {
    const auto file = log::LogFile::open(log);
    if (!file) continue;
    for (const auto& [path, text] : file->info().configuration) {
      if (!path.ends_with(".toml")) continue;
      const Result<TomlDocument> document = TomlDocument::parse(text, path);
      if (!document || !document->root().has("robot")) continue;
      const std::string name = fs::path(path).filename().string();
      if (name == "robot.toml" || !names.insert(name).second) continue;
      std::istringstream in(text);
      std::string out, line;
      bool first = true;
      while (std::getline(in, line)) {
        const std::string edited = first ? with_value(line, "robot", "robot.toml") : line;
        first = first && edited == line;
        out += edited + "\n";
      }
      found.emplace_back(name, std::move(out));
    }
  }
  return found;
}

}  // namespace

Status check_identified(const robot::RobotFiles& robot, const std::vector<std::string>& logs,
                        const std::string& folder) {
  const std::string urdf = robot.config.model.urdf;
  std::vector<std::string> names{"robot.toml", fs::path(urdf).filename().string(), "report.html"};
  for (const auto& [name, text] : experiments_of(logs)) names.push_back(name);
  for (const std::string& name : names) {
    const std::string file = folder + "/" + name;
    std::error_code none;
    if (!fs::is_regular_file(file, none)) continue;
    const std::string text = robot::text_of(file);
    const bool ours = text.empty() || text.find(kIdentifyMark) != std::string::npos ||
                      (name == "report.html" && text.find(kIdentifyPage) != std::string::npos);
    const bool source =
        fs::equivalent(file, robot.config.file, none) || fs::equivalent(file, urdf, none);
    if (ours && !source) continue;
    return std::unexpected(Error{
        source ? "this file describes the robot that is identified: it would be lost"
               : "this file is there, and `tandem identify` did not write it: it would be lost",
        "name another folder with --out",
        file,
        0,
        {}});
  }
  return {};
}

std::string moved_robot(const std::string& text, const std::string& folder, const std::string& name,
                        const std::string& urdf) {
  std::istringstream in(text);
  std::string out, line, table;
  while (std::getline(in, line)) {
    if (const std::string_view head = head_of(line); !head.empty()) table = head;
    if (table.starts_with("model.link")) continue;
    if (table.empty()) line = with_value(line, "name", name);
    if (table == "model") line = with_value(line, "urdf", urdf);
    out += with_sheet(line, folder) + "\n";
  }
  return out;
}

std::vector<ActuatorFigures> actuator_figures(const hal::RobotConfig& robot,
                                              const identification::Identification& result) {
  std::vector<ActuatorFigures> all;
  for (const hal::ActuatorConfig& actuator : robot.actuators) {
    Mean inertia, friction, coulomb;
    for (std::size_t j = 0; j < robot.joints.size() && j < result.joints.size(); ++j) {
      if (robot.actuator_of(robot.joints[j]).name != actuator.name) continue;
      const identification::JointResult& joint = result.joints[j];
      inertia.add(joint.rotor_inertia_kg_m2);
      const bool motors = actuator.order < 2 && !joint.behind_rotor;  // torques are the motors'
      friction.add(motors ? joint.viscous_Nms_rad : joint.motor_viscous_Nms_rad);
      coulomb.add(motors ? joint.coulomb_Nm : joint.motor_coulomb_Nm);
    }
    const double per_A = actuator.torque_per_A();
    const double back_emf =  // of a data sheet that has less, less
        std::min(per_A * per_A / actuator.resistance_ohm, actuator.damping_Nms_rad);
    ActuatorFigures figures{actuator.name, inertia.value(), friction.value(), coulomb.value()};
    if (figures.inertia_kg_m2 && !(*figures.inertia_kg_m2 > 0.0)) figures.inertia_kg_m2.reset();
    if (figures.damping_Nms_rad)
      *figures.damping_Nms_rad = std::max(0.0, *figures.damping_Nms_rad) + back_emf;
    if (!coulomb.there()) figures.friction_Nm.reset();  // as described
    if (figures.friction_Nm) *figures.friction_Nm = std::max(0.0, *figures.friction_Nm);
    all.push_back(std::move(figures));
  }
  return all;
}

std::string with_actuators(const std::string& text, const std::vector<ActuatorFigures>& figures) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  for (const ActuatorFigures& one : figures) {
    const auto begin = std::ranges::find_if(
        lines, [&](const std::string& line) { return heads_actuator(line, one.name); });
    if (begin == lines.end()) continue;
    const auto at = begin - lines.begin();
    set_number(lines, at, "inertia_kg_m2", one.inertia_kg_m2);
    set_number(lines, at, "damping_Nms_rad", one.damping_Nms_rad);
    set_number(lines, at, "friction_Nm", one.friction_Nm);
  }
  std::string out;
  for (const std::string& line : lines) out += line + "\n";
  return out;
}

Result<IdentifiedFiles> write_identified(const robot::RobotFiles& robot,
                                         const identification::Identification& result,
                                         const std::vector<std::string>& logs,
                                         const std::string& folder) {
  const hal::RobotConfig& config = robot.config;
  std::vector<std::pair<std::string, model::Inertia>> inertias;
  for (const identification::LinkResult& link : result.links)
    inertias.emplace_back(link.name, link.identified);
  const Result<std::string> urdf =
      model::with_inertias(robot::text_in(robot.files, config.model.urdf), inertias);
  if (!urdf) return std::unexpected(urdf.error());
  const std::string description = fs::path(config.model.urdf).filename().string();
  const std::string name =
      config.name.ends_with("_identified") ? config.name : config.name + "_identified";
  const std::vector<ActuatorFigures> figures = actuator_figures(config, result);
  std::vector<std::pair<std::string, std::string>> files{
      {"robot.toml",
       with_actuators(moved_robot(robot::text_in(robot.files, config.file),
                                  fs::path(config.file).parent_path().string(), name, description),
                      figures)},
      {description, *urdf}};
  for (auto& experiment : experiments_of(logs)) files.push_back(std::move(experiment));
  IdentifiedFiles written;
  for (const auto& [file, text] : files) {
    written.paths.push_back(folder + "/" + file);
    const std::string whole = marked(text, file.ends_with(".toml"));
    if (const Status s = write_file(written.paths.back(), whole); !s)
      return std::unexpected(s.error());
  }
  const auto read = robot::read_robot(written.paths.front());
  if (!read) return std::unexpected(read.error().front());
  if (const Status s = check_read_back(*read, result); !s) return std::unexpected(s.error());
  written.notes = not_carried(*read, result, figures);
  return written;
}

}  // namespace tandem::apps
