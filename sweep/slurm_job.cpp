#include "sweep/slurm_job.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "apps/text/draft.hpp"
#include "apps/text/json_reader.hpp"
#include "base/quoting.hpp"
#include "sweep/slurm_options.hpp"

namespace tandem::sweep {
namespace {

using apps::Json;

constexpr int kSlurmFormat = 1;

std::string slurm_file(const std::string& folder) { return folder + "/slurm.json"; }

std::optional<std::uint64_t> whole_number(const Json& object, const char* key) {
  const auto it = object.is_object() ? object.find(key) : object.end();
  if (it == object.end() || !it->is_number_unsigned()) return std::nullopt;
  return it->get<std::uint64_t>();
}

/// A job's name: what no shell, pattern or table takes for something else.
std::string job_name(const std::string& study) {
  std::string name = "tandem-" + std::filesystem::path(study).stem().string();
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-'; },
      '_');
  return name;
}

}  // namespace

Result<std::optional<SlurmJob>> slurm_job_in(const std::string& folder) {
  const std::string file = slurm_file(folder);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::nullopt;
  const auto text = read_file(file, "", kMostOtherBytes);
  if (!text) return std::unexpected(text.error());
  const auto json = apps::read_json_object(*text);
  const std::unexpected<Error> unknown(Error{.message = "does not say what was submitted",
                                             .hint = "remove it; results stay where they are",
                                             .file = file,
                                             .key = {}});
  if (!json || whole_number(*json, "slurm") != kSlurmFormat) return unknown;
  const auto directory = json->find("directory"), study = json->find("study"),
             arrays = json->find("arrays");
  const auto points = whole_number(*json, "chunk_points");
  if (directory == json->end() || !directory->is_string() || study == json->end() ||
      !study->is_string() || arrays == json->end() || !arrays->is_array() ||
      points.value_or(0) == 0)
    return unknown;
  SlurmJob job{.directory = directory->get<std::string>(),
               .study = study->get<std::string>(),
               .chunk_points = *points};
  for (const Json& one : *arrays) {
    const auto id = whole_number(one, "id"), offset = whole_number(one, "offset");
    if (!id || !offset) return unknown;
    job.arrays.push_back({.id = *id, .offset = *offset});
  }
  return job;
}

Status write_slurm_job(const std::string& folder, const SlurmJob& job) {
  Json arrays = Json::array();
  for (const SlurmJob::Array& one : job.arrays)
    arrays.push_back({{"id", one.id}, {"offset", one.offset}});
  apps::Draft draft = apps::Draft::file(slurm_file(folder));
  const Status written =
      apps::write_file(draft.path(), apps::json_text({{"slurm", kSlurmFormat},
                                                      {"directory", job.directory},
                                                      {"study", job.study},
                                                      {"chunk_points", job.chunk_points},
                                                      {"arrays", arrays}},
                                                     2) +
                                         "\n");
  if (!written) return std::unexpected(draft.placed(written.error()));
  return draft.place();
}

std::uint64_t usual_chunk_points(std::uint64_t points) {
  return std::clamp<std::uint64_t>(chunks_of(points, 100), 1, 1000);
}

std::string ArrayOfChunks::list() const {
  std::string text;
  for (std::size_t i = 0; i < indices.size();) {
    std::size_t last = i;
    while (last + 1 < indices.size() && indices[last + 1] == indices[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", indices[i]);
    if (last > i) text += fmt::format("-{}", indices[last]);
    i = last + 1;
  }
  return text;
}

std::vector<ArrayOfChunks> arrays_of(const std::vector<std::uint64_t>& chunks,
                                     std::uint64_t max_array_size) {
  std::vector<ArrayOfChunks> arrays;
  for (const std::uint64_t chunk : chunks) {
    const std::uint64_t offset = chunk / max_array_size * max_array_size;
    if (arrays.empty() || arrays.back().offset != offset)
      arrays.push_back({.offset = offset, .indices = {}});
    arrays.back().indices.push_back(chunk - offset);
  }
  return arrays;
}

double SlurmScript::needed_minutes() const {
  const double rounds = std::ceil(static_cast<double>(job.chunk_points) /
                                  static_cast<double>(std::max<std::size_t>(1, cpus)));
  return std::ceil(rounds * time_limit_s / 60.0) + 1.0;
}

std::string SlurmScript::text() const {
  std::string directives;
  if (!sbatch_value(options, "time")) {
    directives += fmt::format("#SBATCH --time={:.0f}\n",
                              std::max(1.0, std::floor(std::min(needed_minutes(), most_minutes))));
  }
  for (const std::string& option : options) directives += "#SBATCH --" + option + "\n";
  const std::string chunks = shell_word(folder + "/chunks/");
  return fmt::format(R"(#!/bin/bash
# A chunk of a sweep's points for each element of an array. `tandem sweep --slurm` has written this,
# and submits it: the argument is the chunk of element 0.
#SBATCH --job-name={}
#SBATCH --output=/dev/null
#SBATCH --requeue
#SBATCH --ntasks=1
#SBATCH --cpus-per-task={}
{}
chunk=$(($1 + SLURM_ARRAY_TASK_ID))
exec < /dev/null > {}"$chunk.txt" 2>&1 || exit
cd {} || exit
exec {} sweep {} --quiet --jobs {} --output {} \
  --chunk "$chunk" --chunk-points {}
)",
                     job_name(job.study), cpus, directives, chunks, shell_word(job.directory),
                     shell_word(program), shell_word(job.study), cpus, shell_word(folder),
                     job.chunk_points);
}

}  // namespace tandem::sweep
