#include "apps/run/slurm_sweep.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <set>

#include "apps/run/slurm.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "sweep/slurm_options.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

/// Elements of a sweep's arrays that are in the queue.
struct InQueue {
  std::set<std::uint64_t> chunks, jobs;
  std::uint64_t running = 0;
};

Result<InQueue> queue_of(const sweep::SlurmJob& job) {
  InQueue queue;
  if (job.arrays.empty()) return queue;
  const auto elements = queued_elements();
  if (!elements) return std::unexpected(elements.error());
  for (const QueuedElement& one : *elements) {
    const auto array = std::ranges::find(job.arrays, one.job, &sweep::SlurmJob::Array::id);
    if (array == job.arrays.end()) continue;
    queue.chunks.insert(array->offset + one.index);
    queue.jobs.insert(one.job);
    queue.running += one.runs ? 1 : 0;
  }
  return queue;
}

/// The chunks of which a point has no result.
std::vector<std::uint64_t> open_chunks(const std::vector<bool>& there, std::uint64_t size) {
  std::vector<std::uint64_t> chunks;
  for (std::uint64_t index = 0; index < there.size(); ++index) {
    const std::uint64_t chunk = index / size;
    if (!there[index] && (chunks.empty() || chunks.back() != chunk)) chunks.push_back(chunk);
  }
  return chunks;
}

/// Where chunks of another size are there, this one's would overlap them.
Result<sweep::SlurmJob> job_for(const SweepOptions& options, const sweep::Points& points) {
  const auto before = sweep::slurm_job_in(options.folder);
  if (!before) return std::unexpected(before.error());
  sweep::SlurmJob job;
  if (*before) job = **before;
  const std::uint64_t wanted = options.chunk_points;
  if (*before && !job.arrays.empty() && wanted != 0 && wanted != job.chunk_points) {
    return std::unexpected(Error{
        .message =
            fmt::format("what was submitted has {} a chunk", counted(job.chunk_points, "point")),
        .hint = "leave --chunk-points out; or cancel it, remove slurm.json, and submit anew: what "
                "is done stays done",
        .file = options.folder,
        .key = {}});
  }
  if (wanted != 0) job.chunk_points = wanted;
  if (wanted == 0 && !*before) job.chunk_points = sweep::usual_chunk_points(points.size());
  std::error_code ignored;
  job.directory = fs::current_path(ignored).string();
  job.study = options.study;
  return job;
}

std::string again_command(const sweep::SlurmJob& job, const std::string& folder) {
  return fmt::format("tandem sweep {} --slurm -o {}", shell_word(job.study), shell_word(folder));
}

/// What is to be submitted.
struct SlurmPlan {
  sweep::SlurmJob job;
  std::optional<sweep::SweepFolder> folder;  ///< held meanwhile; none: it is not there yet
  std::vector<sweep::ArrayOfChunks> arrays;
  std::uint64_t queued = 0;  ///< chunks that wait or run already
  std::uint64_t max_array_size = 1001;
  double most_minutes = std::numeric_limits<double>::infinity();  ///< of the partition
  std::string unknown;  ///< why the cluster says nothing; empty: it does
};

/// What the cluster alone knows. Errors: it does not answer; --sbatch asks for what it has not.
Status ask_cluster(const SweepOptions& options, std::vector<std::uint64_t>& chunks,
                   SlurmPlan& plan) {
  const auto queue = queue_of(plan.job);
  if (!queue) return std::unexpected(queue.error());
  const auto most = max_array_size();
  if (!most) return std::unexpected(most.error());
  const auto minutes =
      partition_minutes(sweep::sbatch_value(options.sbatch, "partition").value_or(""));
  if (!minutes) return std::unexpected(minutes.error());
  plan.queued = queue->chunks.size();
  std::erase_if(chunks, [&](std::uint64_t chunk) { return queue->chunks.contains(chunk); });
  plan.max_array_size = *most;
  plan.most_minutes = *minutes;
  return {};
}

/// Whether the time that somebody wants is one that the partition gives.
Status check_time(const SweepOptions& options, double most_minutes) {
  const auto time = sweep::sbatch_value(options.sbatch, "time");
  if (!time || sweep::slurm_minutes(*time).value_or(0.0) <= most_minutes) return {};
  return fail(fmt::format("--sbatch time={}: a job of this partition has {:g} minutes at most",
                          shown(*time), most_minutes),
              "leave it out, or name another: --sbatch partition=NAME");
}

Result<SlurmPlan> plan_of(const SweepOptions& options, const sweep::Points& points,
                          const PreparedStudy& prepared) {
  SlurmPlan plan;
  const Status installed = find_slurm();
  if (!installed && !options.dry_run) return std::unexpected(installed.error());
  auto job = job_for(options, points);
  if (!job) return std::unexpected(job.error());
  plan.job = std::move(*job);
  std::vector<bool> there(static_cast<std::size_t>(points.size()));
  std::error_code ignored;
  if (!options.dry_run || fs::exists(options.folder, ignored)) {
    auto folder = sweep::SweepFolder::open(options.folder, prepared.head, points);
    if (!folder) return std::unexpected(folder.error());
    print_warnings(folder->damaged());
    plan.folder = std::move(*folder);
    for (std::uint64_t i = 0; i < points.size(); ++i) there[i] = plan.folder->has(i);
  }
  std::vector<std::uint64_t> chunks = open_chunks(there, plan.job.chunk_points);
  if (const Status asked = installed ? ask_cluster(options, chunks, plan) : installed; !asked) {
    if (!options.dry_run) return std::unexpected(asked.error());
    plan.unknown = asked.error().message;
  }
  if (const Status fits = check_time(options, plan.most_minutes); !fits)
    return std::unexpected(fits.error());
  plan.arrays = sweep::arrays_of(chunks, plan.max_array_size);
  return plan;
}

std::string script_file(const sweep::SlurmScript& script) { return script.folder + "/job.sh"; }

void print_slurm_plan(const SlurmPlan& plan, const sweep::SlurmScript& script) {
  fmt::print("{}\n", script.text());
  for (const sweep::ArrayOfChunks& one : plan.arrays)
    fmt::print("# sbatch --array={} {} {}\n", one.list(), shell_word(script_file(script)),
               one.offset);
  if (!plan.unknown.empty())
    fmt::print("# {}\n# MaxArraySize is taken for {}; neither queue nor partition is known\n",
               plan.unknown, plan.max_array_size);
}

/// Submits it; each array is noted at once.
template <class Say>
Status submit_plan(const SlurmPlan& plan, const sweep::SlurmScript& script, const Say& say) {
  std::error_code ignored;
  fs::create_directories(script.folder + "/chunks", ignored);
  const std::string file = script_file(script);
  if (const Status written = write_file(file, script.text()); !written) return written;
  sweep::SlurmJob submitted = plan.job;
  for (const sweep::ArrayOfChunks& one : plan.arrays) {
    const auto id = submit_array(file, one.list(), one.offset);
    if (!id) return std::unexpected(id.error());
    submitted.arrays.push_back({.id = *id, .offset = one.offset});
    if (const Status noted = sweep::write_slurm_job(script.folder, submitted); !noted) return noted;
    say(fmt::format("job {}: {}", *id, counted(one.indices.size(), "chunk")));
  }
  return {};
}

/// What chunks that are not done have left as their last words, and how many have left the same.
std::map<std::string, std::vector<std::uint64_t>> last_words(
    const std::string& folder, const std::vector<std::uint64_t>& chunks) {
  constexpr const char* kNone = "no word: cancelled, killed, or the node lacks this folder";
  std::map<std::string, std::vector<std::uint64_t>> said;
  for (const std::uint64_t chunk : chunks) {
    const std::string file = fmt::format("{}/chunks/{}.txt", folder, chunk);
    std::error_code ignored;
    const auto text = fs::exists(file, ignored) ? read_file(file, "", kMostOtherBytes)
                                                : Result<std::string>(std::string());
    std::string words = text ? *text : std::string();
    while (words.ends_with('\n')) words.pop_back();
    const std::size_t line = words.rfind('\n');
    if (line != std::string::npos) words = words.substr(line + 1);
    said[words.empty() ? kNone : words].push_back(chunk);
  }
  return said;
}

}  // namespace

Result<sweep::SlurmJob> submitted_in(const std::string& folder) {
  const auto job = sweep::slurm_job_in(folder);
  if (!job) return std::unexpected(job.error());
  if (*job) return **job;
  return std::unexpected(Error{.message = "nothing was submitted from here",
                               .hint = "name the folder of a `tandem sweep STUDY --slurm`",
                               .file = folder,
                               .key = {}});
}

Exit submit_sweep(const SweepOptions& given, const sweep::Study& study, const sweep::Points& points,
                  const PreparedStudy& prepared) {
  SweepOptions options = given;
  std::error_code ignored;
  options.folder = fs::absolute(options.folder, ignored).lexically_normal().string();
  if (const Status right = sweep::check_sbatch(options.sbatch); !right)
    return refuse(right.error());
  const auto plan = plan_of(options, points, prepared);
  if (!plan) return refuse(plan.error());
  const sweep::SlurmScript script{.job = plan->job,
                                  .program = program_file(),
                                  .folder = options.folder,
                                  .cpus = std::max<std::size_t>(1, options.jobs),
                                  .time_limit_s = study.time_limit_s,
                                  .options = options.sbatch,
                                  .most_minutes = plan->most_minutes};
  if (!sweep::sbatch_value(options.sbatch, "time") &&
      script.needed_minutes() > plan->most_minutes) {
    fmt::print(stderr,
               "note: a chunk takes up to {:.0f} minutes by time_limit_s, and a job of this "
               "partition has {:g}: what is not done then, the same command submits again. Fewer "
               "points a chunk take less: --chunk-points\n",
               script.needed_minutes(), plan->most_minutes);
  }
  if (options.dry_run) {
    print_slurm_plan(*plan, script);
    return Exit::kDone;
  }
  std::FILE* out = human_output(options.json);
  const auto say = [&](const std::string& text) {
    if (!options.quiet) fmt::print(out, "{}\n", text);
  };
  say(fmt::format("{}: {}, {} a chunk, in {}", study.file, counted(points.size(), "point"),
                  plan->job.chunk_points, options.folder));
  const std::string folder = shell_word(given.folder);
  if (plan->arrays.empty()) {
    say(plan->queued == 0
            ? "nothing is left to submit: tandem sweep collect " + folder
            : "nothing to submit: " + counted(plan->queued, "chunk") + " in the queue");
    return Exit::kDone;
  }
  if (const Status sent = submit_plan(*plan, script, say); !sent) return refuse(sent.error());
  say(fmt::format("tandem sweep status {0}; when it is done: tandem sweep collect {0}", folder));
  return Exit::kDone;
}

void figures(Figures& f, const EndedEarly& one) {
  f("words", "that they left last", one.words);
  f("chunks", "how many left them", one.chunks);
  f("first", "one of them", one.first);
}

void figures(Figures& f, const SweepStatus& s) {
  f("folder", "of the sweep", s.folder);
  f("points", "of the study", s.points);
  f("done", "points that have a result", s.done);
  f("failed", "of them", s.failed);
  f("submitted", "to a cluster, from here", s.submitted);
  f("queue_known", "this machine can ask Slurm: else the figures below are null", s.queue_known);
  f("running_chunks", "", s.running);
  f("waiting_chunks", "", s.waiting);
  f("points_a_second", "with one core for each chunk that runs", s.points_a_second);
  f("left_s", "until the last point, by that", s.left_s);
  f("ended_early", "chunks that miss points and are not in the queue", s.ended_early);
  f("again", "the command that submits them; empty: nothing is missing", s.again);
}

Result<SweepStatus> status_of_sweep(const std::string& folder) {
  const auto progress = sweep::progress_in(folder);
  if (!progress) return std::unexpected(progress.error());
  SweepStatus status{.folder = folder,
                     .points = progress->points,
                     .done = progress->done,
                     .failed = progress->failed};
  const auto job = sweep::slurm_job_in(folder);
  if (!job) return std::unexpected(job.error());
  status.submitted = job->has_value() && !(*job)->arrays.empty();
  if (!*job || !find_slurm()) return status;
  const auto queue = queue_of(**job);
  if (!queue) return std::unexpected(queue.error());
  status.queue_known = true;
  status.running = queue->running;
  status.waiting = queue->chunks.size() - queue->running;
  if (queue->running > 0 && progress->seconds > 0.0) {
    status.points_a_second = static_cast<double>(queue->running) *
                             static_cast<double>(progress->done) / progress->seconds;
    status.left_s =
        static_cast<double>(progress->points - progress->done) / *status.points_a_second;
  }
  std::vector<std::uint64_t> ended = open_chunks(progress->there, (*job)->chunk_points);
  std::erase_if(ended, [&](std::uint64_t chunk) { return queue->chunks.contains(chunk); });
  for (const auto& [words, chunks] : last_words(folder, ended))
    status.ended_early.push_back({words, chunks.size(), chunks.front()});
  if (!ended.empty()) status.again = again_command(**job, folder);
  return status;
}

Exit sweep_status(const SweepOptions& options) {
  const auto status = status_of_sweep(options.folder);
  if (!status) return refuse(status.error());
  std::FILE* out = human_output(options.json);
  fmt::print(out, "{}: {} of {}, {} failed\n", status->folder, status->done,
             counted(status->points, "point"), status->failed);
  if (status->submitted && !status->queue_known)
    fmt::print(out, "Slurm is not here: whether it runs is not known\n");
  if (status->queue_known) {
    fmt::print(out, "{} run, {} wait\n", counted(*status->running, "chunk"), *status->waiting);
    if (status->left_s)
      fmt::print(out, "about {:.2g} points a second, {:.0f} s left, with one core each\n",
                 *status->points_a_second, *status->left_s);
    if (status->done == status->points)
      fmt::print(out, "done: tandem sweep collect {}\n", shell_word(options.folder));
  }
  constexpr std::size_t kMostWords = 5;
  for (std::size_t i = 0; i < std::min(kMostWords, status->ended_early.size()); ++i) {
    const EndedEarly& one = status->ended_early[i];
    fmt::print(out, "{} ended early, such as {}: {}\n", counted(one.chunks, "chunk"), one.first,
               shown(one.words, 400));
  }
  if (!status->again.empty()) fmt::print(out, "submit again what is missing: {}\n", status->again);
  return end_with_json(options.json, figures_json(*status), Exit::kDone);
}

Exit cancel_sweep(const SweepOptions& options) {
  const auto job = submitted_in(options.folder);
  if (!job) return refuse(job.error());
  if (const Status installed = find_slurm(); !installed) return refuse(installed.error());
  const auto queue = queue_of(*job);
  if (!queue) return refuse(queue.error());
  if (!queue->jobs.empty()) {
    if (const Status ended = cancel_jobs({queue->jobs.begin(), queue->jobs.end()}); !ended)
      return refuse(ended.error());
  }
  fmt::print("{} cancelled; what is done stays done\n", counted(queue->chunks.size(), "chunk"));
  return Exit::kDone;
}

}  // namespace tandem::apps
