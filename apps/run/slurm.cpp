// Their exit status alone does not tell: an answer that is not understood is an error, too.
#include "apps/run/slurm.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <sstream>

#include "base/open_file.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "sweep/slurm_options.hpp"

namespace tandem::apps {
namespace {

/// What a program prints. Errors: it cannot be started; it fails, with what it says.
Result<std::string> answer_of(const std::vector<std::string>& words, const std::string& hint) {
  const Descriptor memory(::memfd_create("answer", MFD_CLOEXEC));
  const Result<pid_t> child =
      spawn({.command = words, .output = fmt::format("/proc/self/fd/{}", memory.get())});
  if (!child) return std::unexpected(child.error());
  const int status = wait_for(*child);
  auto text = read_all(memory, words.front(), kMostOtherBytes);
  if (!text || status == 0) return text;
  while (text->ends_with('\n')) text->pop_back();
  return fail(fmt::format("{} ended with status {}: {}", words.front(), status,
                          text->empty() ? "it says nothing" : *text),
              hint);
}

std::optional<std::uint64_t> number_at_the_begin(std::string_view text) {
  std::uint64_t number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  return read.ec == std::errc() ? std::optional(number) : std::nullopt;
}

}  // namespace

Status find_slurm() {
  for (const char* program : {"sbatch", "squeue", "scancel", "scontrol"}) {
    if (!program_exists(program))
      return fail(
          fmt::format("there is no {} in $PATH: Slurm's programs are not installed here", program),
          "do this on a machine that submits to the cluster; without it, leave --slurm "
          "out, or look at the job's script: --slurm --dry-run");
  }
  return {};
}

Result<std::uint64_t> max_array_size() {
  const auto config = answer_of({"scontrol", "show", "config"}, "does slurmctld run?");
  if (!config) return std::unexpected(config.error());
  std::istringstream lines(*config);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t equal = line.find('=');
    if (!line.starts_with("MaxArraySize") || equal == std::string::npos) continue;
    std::istringstream value(line.substr(equal + 1));
    std::uint64_t size = 0;
    if (value >> size && size > 0) return size;
    return fail("this site has no job arrays (MaxArraySize is 0)", "ask who runs it");
  }
  return fail("scontrol names no MaxArraySize", "is this Slurm?");
}

Result<double> partition_minutes(const std::string& partitions) {
  if (!program_exists("sinfo")) return std::numeric_limits<double>::infinity();
  const auto said = answer_of({"sinfo", "--noheader", "--format", "%P %l"}, "does slurmctld run?");
  if (!said) return std::unexpected(said.error());
  std::istringstream lines(*said);
  std::string known;
  double most = 0.0;
  for (std::string name, time; lines >> name >> time;) {
    const bool is_default = name.ends_with('*');
    if (is_default) name.pop_back();
    known += (known.empty() ? "" : ", ") + name;
    const bool wanted =
        partitions.empty() ? is_default : ("," + partitions + ",").contains("," + name + ",");
    if (!wanted) continue;
    most = std::max(most,
                    sweep::slurm_minutes(time).value_or(std::numeric_limits<double>::infinity()));
  }
  if (most > 0.0) return most;
  if (partitions.empty()) return std::numeric_limits<double>::infinity();
  return fail("this site has no partition '" + shown(partitions) + "'", "it has " + known);
}

Result<std::uint64_t> submit_array(const std::string& script, const std::string& list,
                                   std::uint64_t argument) {
  const auto said = answer_of(
      {"sbatch", "--parsable", "--array=" + list, script, std::to_string(argument)},
      "where the site takes fewer elements: larger chunks (--chunk-points), or the same command "
      "again when these have ended; its script is " +
          script);
  if (!said) return std::unexpected(said.error());
  std::istringstream lines(*said);  // warnings may come before
  for (std::string line; std::getline(lines, line);) {
    const auto id = number_at_the_begin(line);
    if (id && *id > 0) return *id;
  }
  return fail("sbatch names no job: " + shown(*said), "look with squeue before you try again");
}

Result<std::vector<QueuedElement>> queued_elements() {
  const auto said = answer_of({"squeue", "--noheader", "--array", "--user",
                               std::to_string(::getuid()), "--format", "%F %K %T"},
                              "does slurmctld run?");
  if (!said) return std::unexpected(said.error());
  std::vector<QueuedElement> elements;
  std::istringstream lines(*said);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    QueuedElement element;
    std::string state;
    if (!(words >> element.job >> element.index >> state)) continue;  // another job's
    element.runs = state == "RUNNING" || state == "COMPLETING";
    elements.push_back(element);
  }
  return elements;
}

Status cancel_jobs(const std::vector<std::uint64_t>& jobs) {
  std::vector<std::string> words{"scancel"};
  for (const std::uint64_t job : jobs) words.push_back(std::to_string(job));
  const auto said = answer_of(words, "does slurmctld run?");
  return said ? Status() : std::unexpected(said.error());
}

}  // namespace tandem::apps
