// Files are edited line by line, so that comments and everything else stay as they were written;
// reading them back tells whether that was enough.
#include "apps/tools/identified_files.hpp"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <regex>
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

/// Replaces the text of the first `key = "…"` of a line.
std::string with_value(const std::string& line, const std::string& key, const std::string& value) {
  const std::regex pattern("^(\\s*" + key + "\\s*=\\s*)(\"[^\"]*\"|'[^']*')");
  std::smatch match;
  if (!std::regex_search(line, match, pattern)) return line;
  return match[1].str() + "\"" + value + "\"" + match.suffix().str();
}

/// A relative path in quotes behind `eds =`, anywhere in the line, from the old folder.
std::string with_sheet(const std::string& line, const fs::path& folder) {
  static const std::regex pattern("(eds\\s*=\\s*)[\"']([^\"']+)[\"']");
  std::smatch match;
  if (!std::regex_search(line, match, pattern)) return line;
  const fs::path path = match[2].str();
  const fs::path whole = path.is_absolute() ? path : fs::absolute(folder / path);
  return match.prefix().str() + match[1].str() + "\"" + whole.lexically_normal().string() + "\"" +
         match.suffix().str();
}

Status check_read_back(const std::string& file, const identification::Identification& result) {
  const auto read = read_robot(file);
  if (!read) return std::unexpected(read.error().front());
  for (const identification::LinkResult& link : result.links) {
    const int index = read->tree.link_index(link.name);
    if (index < 0) continue;
    const model::Inertia& got = read->tree.links[static_cast<std::size_t>(index)].inertia;
    const model::Inertia& want = link.identified;
    const double off =
        std::abs(got.mass_kg - want.mass_kg) / want.mass_kg + (got.com_m - want.com_m).norm() +
        (got.about_com_kg_m2 - want.about_com_kg_m2).norm() / (1e-12 + want.about_com_kg_m2.norm());
    if (off < kSame) continue;
    return std::unexpected(
        Error{"what was written does not give link '" + link.name + "' the identified inertia",
              "put it there by hand: report.html has the figures",
              file,
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

std::string moved_robot(const std::string& text, const std::string& folder, const std::string& name,
                        const std::string& urdf) {
  std::istringstream in(text);
  std::string out, line, table;
  while (std::getline(in, line)) {
    static const std::regex header(R"(^\s*\[+\s*([^\]]+?)\s*\]+)");
    std::smatch match;
    if (std::regex_search(line, match, header)) table = match[1].str();
    if (table.starts_with("model.link")) continue;
    if (table.empty()) line = with_value(line, "name", name);
    if (table == "model") line = with_value(line, "urdf", urdf);
    out += with_sheet(line, folder) + "\n";
  }
  return out;
}

Result<std::vector<std::string>> write_identified(const RobotFiles& robot,
                                                  const identification::Identification& result,
                                                  const std::vector<std::string>& logs,
                                                  const std::string& folder) {
  const hal::RobotConfig& config = robot.config;
  std::vector<std::pair<std::string, model::Inertia>> inertias;
  for (const identification::LinkResult& link : result.links)
    inertias.emplace_back(link.name, link.identified);
  const Result<std::string> urdf = model::with_inertias(text_of(config.model.urdf), inertias);
  if (!urdf) return std::unexpected(urdf.error());
  const std::string description = fs::path(config.model.urdf).filename().string();
  const std::string name =
      config.name.ends_with("_identified") ? config.name : config.name + "_identified";
  std::vector<std::pair<std::string, std::string>> files{
      {"robot.toml", moved_robot(text_of(config.file), fs::path(config.file).parent_path().string(),
                                 name, description)},
      {description, *urdf}};
  for (auto& experiment : experiments_of(logs)) files.push_back(std::move(experiment));
  std::vector<std::string> written;
  for (const auto& [file, text] : files) {
    written.push_back(folder + "/" + file);
    if (const Status s = write_file(written.back(), text); !s) return std::unexpected(s.error());
  }
  if (const Status s = check_read_back(written.front(), result); !s)
    return std::unexpected(s.error());
  return written;
}

}  // namespace tandem::apps
