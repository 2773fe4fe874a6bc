#include "apps/tools/new_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/counted.hpp"
#include "base/open_file.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "base/temporary_folder.hpp"
#include "model/shape_mass.hpp"
#include "model/urdf_write.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

bool is_xacro(const std::string& file) { return fs::path(file).extension() == ".xacro"; }

std::unexpected<Error> failed(const std::string& file, std::string message, std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), file, 0, {}});
}

/// The last line that has something on it.
std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) return {};
  const std::size_t begin = text.find_last_of('\n', end);
  return shown(text.substr(begin + 1, end - begin));  // npos + 1 is 0
}

/// What the installed program makes of the file. No shell reads its name.
Result<std::string> expanded(const std::string& file) {
  const std::string command =
      "xacro " + shell_word(file) + " > " + shell_word(robot_stem(file) + ".urdf");
  if (auto readable = open_to_read(file, "name a .xacro file"); !readable)
    return std::unexpected(readable.error());
  if (!program_exists("xacro")) {
    return failed(file, "this is xacro, and no program xacro is installed to expand it",
                  "where ROS is: " + command + "; or pip install xacro");
  }
  const TemporaryFolder scratch("new");
  if (const Status made = scratch.made(); !made)
    return failed(file, made.error().message, made.error().hint);
  const std::string output = scratch.below("robot.urdf"), said = scratch.below("said");
  const auto child =
      spawn({.command = {"xacro", fs::absolute(file).string(), "-o", output}, .output = said});
  if (!child) return failed(file, "xacro cannot be started: " + child.error().message, command);
  if (const int status = wait_for(*child); status != 0) {
    const std::string why = last_line(read_file(said, {}, kMostTomlBytes).value_or(""));
    return failed(file,
                  fmt::format("xacro ends with status {}{}", status, why.empty() ? "" : ": ") + why,
                  "its arguments, where it needs any: " + command);
  }
  return read_file(output, "xacro has written nothing", kMostUrdfBytes);
}

/// "JOINT" or "JOINT=0.5".
Result<std::pair<std::string, double>> read_lock(const std::string& word) {
  const std::size_t sign = word.rfind('=');
  if (sign == std::string::npos) return std::pair{word, 0.0};
  const std::string number = word.substr(sign + 1);
  double position = 0.0;
  const auto read = std::from_chars(number.data(), number.data() + number.size(), position);
  if (read.ec == std::errc{} && read.ptr == number.data() + number.size() &&
      std::isfinite(position)) {
    return std::pair{word.substr(0, sign), position};
  }
  return fail_at("--lock " + word, "'" + shown(number) + "' is no number",
                 "JOINT=POSITION, in rad (m where it slides)");
}

Status add_masses(const NewOptions& options, NewSource& source) {
  if (options.density_kg_m3 == 0.0) return {};
  const model::ShapeMasses found =
      model::masses_from_shapes(source.text, options.urdf, options.density_kg_m3);
  if (!found.errors.empty()) {
    Error error = found.errors.front();
    if (source.changed) error.line = 0;  // of a text that is nowhere to be read
    return std::unexpected(std::move(error));
  }
  std::vector<std::pair<std::string, model::Inertia>> inertias;
  for (const model::ShapeMass& one : found.links) {
    inertias.emplace_back(one.link, one.inertia);
    source.masses.emplace_back(one.link,
                               fmt::format("{:.4g} kg (guess: {})", one.inertia.mass_kg, one.from));
  }
  for (const auto& [link, why] : found.without)
    source.masses.emplace_back(link, fmt::format("none, for {}", why));
  if (inertias.empty()) {
    const auto shaped = std::ranges::find_if(
        found.without, [](const auto& one) { return one.second != model::kNoShape; });
    if (shaped == found.without.end()) return {};  // frames; a joint that needs more says so
    return failed(options.urdf, "no link gets a mass by --density: " + shaped->second,
                  "give boxes, cylinders, spheres or STL meshes as <collision>");
  }
  auto text = model::with_inertias(source.text, inertias);
  if (!text) return std::unexpected(text.error());
  source.text = std::move(*text);
  source.changed = true;
  source.remarks.push_back(fmt::format(
      "{} in the URDF beside this file: from shapes, at {:g} kg/m^3 (a guess).",
      counted(inertias.size(), "mass", "masses") + (inertias.size() == 1 ? " is" : " are"),
      options.density_kg_m3));
  return {};
}

}  // namespace

std::string robot_stem(const std::string& file) {
  fs::path stem = fs::path(file).stem();
  if (is_xacro(file) && stem.extension() == ".urdf") stem = stem.stem();
  return stem.string();
}

Result<NewSource> read_source(const NewOptions& options) {
  NewSource source{.name = fs::path(options.urdf).filename().string(), .copy = {}, .text = {}};
  const bool xacro = is_xacro(options.urdf);
  auto text =
      xacro ? expanded(options.urdf) : read_file(options.urdf, "name a .urdf file", kMostUrdfBytes);
  if (!text) return std::unexpected(text.error());
  source.copy = xacro ? robot_stem(options.urdf) + ".urdf" : source.name;
  source.text = std::move(*text);
  source.changed = xacro;
  if (xacro) source.remarks.push_back(source.copy + " is what xacro makes of " + source.name + ".");
  for (const std::string& word : options.lock) {
    auto lock = read_lock(word);
    if (!lock) return std::unexpected(lock.error());
    source.lock.push_back(std::move(*lock));
  }
  if (!options.drop.empty()) {
    std::vector<std::string> still;
    for (const auto& [joint, position] : source.lock) still.push_back(joint);
    auto rest = model::without_limbs(source.text, options.drop, still);
    if (!rest) {
      Error error = rest.error();
      error.file = options.urdf;
      error.key = "--drop";
      return std::unexpected(std::move(error));
    }
    source.text = std::move(*rest);
    source.changed = true;
    std::string names;
    for (const std::string& name : options.drop) names += (names.empty() ? "" : ", ") + name;
    source.remarks.push_back("Left out by --drop, with what hangs on it: " + names + ".");
  }
  if (Status done = add_masses(options, source); !done) return std::unexpected(done.error());
  return source;
}

Diagnostics of_options(Diagnostics errors, const NewSource& source) {
  constexpr std::string_view kKey = "model.lock.";
  for (Error& error : errors) {
    for (const auto& [link, mass] : source.masses) {
      if (!mass.starts_with("none")) continue;
      const std::size_t begin = error.hint.find("'" + link + "' mass");
      const std::size_t option = error.hint.find("--density, ");
      if (begin == std::string::npos || option == std::string::npos) continue;
      error.message += ": --density gives link '" + link + "' " + mass;
      error.hint.erase(option, std::string_view("--density, ").size());
    }
    if (!error.key.starts_with(kKey)) continue;
    error.key = "--lock " + error.key.substr(kKey.size());
    if (error.hint.find("[model.lock]") != std::string::npos) error.hint = "leave --lock out";
  }
  return errors;
}

}  // namespace tandem::apps
