// `tandem sweep`: prepares a study, has its points run, keeps what they come to, and sums it up.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "apps/run/commands.hpp"
#include "apps/run/prepared_study.hpp"
#include "apps/run/run_workers.hpp"
#include "apps/run/slurm_sweep.hpp"
#include "apps/run/trunks.hpp"
#include "apps/text/console.hpp"
#include "base/counted.hpp"
#include "base/temporary_folder.hpp"
#include "rt/stop_signal.hpp"
#include "sweep/page.hpp"
#include "sweep/results.hpp"
#include "sweep/summary.hpp"
#include "sweep/table.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;
using SweepClock = std::chrono::steady_clock;

std::string duration_text(double seconds) {
  if (seconds < 90.0) return fmt::format("{:.0f} s", seconds);
  if (seconds < 5400.0) return fmt::format("{:.0f} min", seconds / 60.0);
  return seconds < 129'600.0 ? fmt::format("{:.1f} h", seconds / 3600.0)
                             : fmt::format("{:.0f} days", seconds / 86'400.0);
}

std::string share_text(const sweep::PassRate& rate) {
  const sweep::Interval interval = rate.interval();
  const std::string refused = rate.refused == 0
                                  ? ""
                                  : fmt::format("{} of {} were refused; of those that ran ",
                                                rate.refused, rate.all + rate.refused);
  return fmt::format("{}{} of {} passed: {:.1f} %, {:.1f} to {:.1f} % (Wilson, 95 %)", refused,
                     rate.passed, rate.all,
                     100.0 * static_cast<double>(rate.passed) /
                         static_cast<double>(std::max<std::uint64_t>(1, rate.all)),
                     100.0 * interval.low, 100.0 * interval.high);
}

class Sweep {
 public:
  /// @param work  a folder for what its processes write
  Sweep(const SweepOptions& options, const sweep::Study& study, const sweep::Points& points,
        const PreparedStudy& prepared, sweep::SweepFolder& folder, const std::string& work)
      : options_(options),
        study_(study),
        points_(points),
        folder_(folder),
        prepared_(prepared),
        later_(options.branches ? later_keys(study) : LaterKeys()),
        trunks_(later_.rows),
        workers_(work, options.jobs, study.time_limit_s),
        out_(human_output(options.json)),
        line_(out_) {
    workers_.read_instead(prepared.texts);
  }

  Exit run() {
    announce();
    rt::install_stop_signals();
    begin_ = SweepClock::now();
    done_before_ = folder_.done();
    failed_ = static_cast<std::uint64_t>(std::ranges::count_if(
        folder_.results(), [](const auto& one) { return one && !one->passed; }));
    if (const Status ran = run_points({.end = points_.size()}); !ran) return refuse(ran.error());
    if (rt::stop_requested()) return stopped_with_tables();
    if (const Status kept = keep_logs(); !kept) return refuse(kept.error());
    return finish();
  }

  /// The results of a chunk, without tables. What killed one of their processes may be what ends
  /// this job: that is no result.
  Exit run_chunk(const sweep::Chunk& chunk) {
    rt::install_stop_signals();
    begin_ = SweepClock::now();
    done_before_ = folder_.done();
    if (const Status ran = run_points(chunk); !ran) return refuse(ran.error());
    if (const Status kept = folder_.sync(); !kept) return refuse(kept.error());
    if (rt::stop_requested()) return stopped(chunk.end - chunk.first);
    if (killed_ == 0) return Exit::kDone;
    return refuse(Error{.message = counted(killed_, "point") + " were killed by somebody else",
                        .hint = "more memory? --sbatch mem=4G",
                        .file = {},
                        .key = {}});
  }

 private:
  Exit stopped(std::uint64_t of) const {
    fmt::print(stderr, "stopped after {} of {}; the same command goes on from there\n",
               folder_.done(), counted(of, "point"));
    return interrupted(rt::stop_signal());
  }

  /// Tables and page of the points that are there.
  Exit stopped_with_tables() {
    if (folder_.done() > 0) (void)finish();
    return stopped(points_.size());
  }

  void announce() const {
    if (options_.quiet) return;
    std::string of = counted(study_.points, "sample");
    if (study_.seeds.size() > 1) of += fmt::format(" x {}", counted(study_.seeds.size(), "seed"));
    if (!study_.variants.empty())
      of += fmt::format(" x {}", counted(study_.variants.size(), "variant"));
    fmt::print(out_, "{}: {} ({}), {} at once, in {}\n", study_.file,
               counted(points_.size(), "point"), of, options_.jobs, folder_.path());
    if (folder_.done() > 0)
      fmt::print(out_, "goes on: {} are there already\n", counted(folder_.done(), "point"));
    std::fflush(out_);
  }

  Status run_points(const sweep::Chunk& chunk) {
    std::uint64_t next = chunk.first;
    const auto more = [&] {
      while (next < chunk.end && folder_.has(next)) ++next;
      return next < chunk.end && !rt::stop_requested();
    };
    if (const Status grown = grow_trunks(chunk); !grown) return grown;
    while (more() || !workers_.is_empty()) {
      if (rt::stop_requested()) return {};
      while (!workers_.is_full() && more()) {
        RunOptions run = options_of(points_.at(next));
        trunks_.begin_in(common_of(run), run);
        if (const Status started = workers_.start(next++, std::move(run)); !started) return started;
      }
      auto ended = workers_.take_ended();
      if (!ended) return std::unexpected(ended.error());
      for (const EndedRun& one : *ended)
        if (const Status taken = take(one); !taken) return taken;
      show_progress();
    }
    return {};
  }

  [[nodiscard]] RunOptions options_of(const sweep::Point& point) const {
    RunOptions run = child_options(study_.experiment);
    run.settings = point.settings;
    run.seed = point.seed;
    run.kernel_variant = prepared_.kernel_variant;
    return run;
  }

  [[nodiscard]] std::string common_of(const RunOptions& run) const {
    return later_.common(run.settings) + (run.seed ? fmt::format("{}", *run.seed) : "");
  }

  /// Simulates the beginnings that points have in common, of those that have no result yet.
  Status grow_trunks(const sweep::Chunk& chunk) {
    if (later_.rows.empty()) return {};
    constexpr std::uint64_t kMostLookedAt = 1'000;
    std::uint64_t looked = 0;
    for (std::uint64_t i = chunk.first; i < chunk.end && looked < kMostLookedAt; ++i) {
      if (folder_.has(i)) continue;
      ++looked;
      const RunOptions run = options_of(points_.at(i));
      trunks_.want(common_of(run), run);
    }
    return trunks_.grow(workers_);
  }

  Status take(const EndedRun& one) {
    const ChildRun& run = one.run;
    if (run.killed && options_.chunk) {
      ++killed_;
      return {};
    }
    failed_ += run.passed ? 0 : 1;
    return folder_.add(points_.at(one.number), {.passed = run.passed,
                                                .ended = run.ended,
                                                .reason = run.reason,
                                                .expectations = run.expectations,
                                                .seconds = one.seconds,
                                                .limit_s = run.limit_s});
  }

  void show_progress() {
    if (options_.quiet || !line_.due()) return;
    const double s = std::chrono::duration<double>(SweepClock::now() - begin_).count();
    const double rate = static_cast<double>(folder_.done() - done_before_) / s;
    const auto left = static_cast<double>(points_.size() - folder_.done());
    line_.show(fmt::format(
        "{} of {} points{}, {} failed", folder_.done(), points_.size(),
        rate > 0.0 ? fmt::format(", {:.2g} a second, {} left", rate, duration_text(left / rate))
                   : "",
        failed_));
  }

  /// The points that [keep] wants logs of, once more with a log each: a run is a function of its
  /// files, so it is the same run. The budget is for the sample first, then for the worst.
  Status keep_logs() {
    double left_MB = study_.keep.logs_MB;
    const std::string all = folder_.path() + "/logs";
    for (const std::uint64_t i : sweep::kept_points(study_.keep, folder_.results())) {
      if (left_MB <= 0.0) break;
      const sweep::Point point = points_.at(i);
      const std::string folder = all + "/" + point.name;
      std::error_code ignored;
      if (!fs::exists(folder, ignored)) {
        RunOptions run = options_of(point);
        run.no_log = false;
        run.log_folder = folder + ".part";
        if (const Status started = workers_.start(i, std::move(run)); !started) return started;
        while (!workers_.is_empty() && !rt::stop_requested()) {
          if (const auto ended = workers_.take_ended(); !ended)
            return std::unexpected(ended.error());
        }
        if (rt::stop_requested()) return {};
        fs::rename(folder + ".part", folder, ignored);
      }
      for (const fs::directory_entry& file : fs::recursive_directory_iterator(folder, ignored))
        left_MB -= static_cast<double>(file.file_size(ignored)) * 1e-6;
    }
    return {};
  }

  Exit finish() {
    const auto& results = folder_.results();
    if (const Status s = sweep::write_tables(folder_.path(), study_, points_, results); !s)
      return refuse(s.error());
    sweep::SweepSummary summary = sweep::summary_of(study_, points_, results);
    summary.folder = folder_.path();
    std::error_code ignored;
    summary.directory = fs::current_path(ignored).string();
    const std::string page = folder_.path() + "/index.html";
    if (const Status s = sweep::write_page(page, study_, points_, results, summary); !s)
      return refuse(s.error());
    print(summary);
    if (const Status s = write_json(options_.json, figures_json(summary)); !s)
      return refuse(s.error());
    const double share =
        static_cast<double>(summary.rate.passed) /
        static_cast<double>(std::max<std::uint64_t>(1, summary.rate.all + summary.rate.refused));
    return share < options_.at_least ? Exit::kFault : Exit::kDone;
  }

  void print(const sweep::SweepSummary& summary) const {
    if (options_.quiet) return;
    const double s = std::chrono::duration<double>(SweepClock::now() - begin_).count();
    const std::uint64_t now = folder_.done() - done_before_;
    fmt::print(out_, "\n{}\n", share_text(summary.rate));
    for (const sweep::PassRate& one : summary.variants)
      fmt::print(out_, "  {}: {}\n", shown(one.variant), share_text(one));
    for (const sweep::Comparison& one : summary.comparisons) {
      fmt::print(out_,
                 "  {} against {}: {} passed with {} alone, {} with {} alone; McNemar p = {:.3g}\n",
                 shown(one.other), shown(one.first), one.only_other, shown(one.other),
                 one.only_first, shown(one.first), one.p());
    }
    for (const auto& [ended, count] : summary.ends)
      fmt::print(out_, "  {} ended: {}\n", count, shown(ended));
    if (!summary.refused_why.empty())
      fmt::print(out_, "  refused, such as: {}\n", shown(summary.refused_why));
    if (!summary.ranking.empty()) {
      Table table({"margin of", "with", "rank correlation"});
      for (std::size_t i = 0; i < std::min<std::size_t>(10, summary.ranking.size()); ++i) {
        const sweep::Sensitivity& one = summary.ranking[i];
        table.add({shown(one.expectation, 48), shown(one.key, 48),
                   fmt::format("{:+.2f}", one.rank_correlation)});
      }
      fmt::print(out_, "\n");
      table.print(out_);
    }
    fmt::print(out_, "\nworst:\n");
    for (const sweep::WorstPoint& one : summary.worst) {
      fmt::print(out_, "{} {}{}{}\n  {}\n", one.passed ? "passed" : "FAILED", one.point,
                 one.more_text(study_), one.why.empty() ? "" : ": " + shown(one.why), one.command);
    }
    if (summary.seeds_alike) {
      fmt::print(out_,
                 "\nwarning: the {} change nothing: results are the same to the last bit, so each "
                 "value counts once above. Set sim.noise=true, or leave `seeds` out\n",
                 counted(study_.seeds.size(), "seed"));
    }
    fmt::print(out_, "\n{}/results.csv, results.sqlite, index.html", folder_.path());
    if (now > 0)
      fmt::print(out_, "; {} in {:.1f} s, {:.2f} a second", counted(now, "point"), s,
                 static_cast<double>(now) / s);
    fmt::print(out_, "\n");
  }

  const SweepOptions& options_;
  const sweep::Study& study_;
  const sweep::Points& points_;
  sweep::SweepFolder& folder_;
  const PreparedStudy& prepared_;
  LaterKeys later_;
  Trunks trunks_;
  RunWorkers workers_;
  std::FILE* out_;
  StatusLine line_;
  SweepClock::time_point begin_;
  std::uint64_t done_before_ = 0, failed_ = 0, killed_ = 0;
};

Exit run_chunk(const SweepOptions& options, const sweep::Study& study, const sweep::Points& points,
               const PreparedStudy& prepared) {
  const std::uint64_t size =
      options.chunk_points > 0 ? options.chunk_points : sweep::usual_chunk_points(points.size());
  const std::uint64_t count = sweep::chunks_of(points.size(), size);
  if (*options.chunk >= count) {
    return refuse(Error{.message = fmt::format("--chunk {}: there are {}, from 0", *options.chunk,
                                               counted(count, "chunk")),
                        .hint = "was the study another when it was submitted?",
                        .file = {},
                        .key = {}});
  }
  const sweep::Chunk chunk = sweep::chunk_of(*options.chunk, size, points.size());
  auto folder = sweep::SweepFolder::open_chunk(options.folder, prepared.head, points, chunk);
  if (!folder) return refuse(folder.error());
  print_warnings(folder->damaged());
  const TemporaryFolder scratch("runs");
  if (const Status made = scratch.made(); !made) return refuse(made.error());
  return Sweep(options, study, points, prepared, *folder, scratch.path()).run_chunk(chunk);
}

/// Where the study was named: names of files are relative to it.
class InDirectory {
 public:
  explicit InDirectory(const std::string& path) : before_(fs::current_path(ignored_)) {
    fs::current_path(path, ignored_);
    there_ = !ignored_;
  }
  ~InDirectory() { fs::current_path(before_, ignored_); }
  InDirectory(const InDirectory&) = delete;
  InDirectory& operator=(const InDirectory&) = delete;
  [[nodiscard]] bool there() const { return there_; }

 private:
  std::error_code ignored_;
  fs::path before_;
  bool there_ = false;
};

Exit collect_sweep(SweepOptions options) {
  std::error_code ignored;
  options.folder = fs::absolute(options.folder, ignored).lexically_normal().string();
  if (!options.json.empty() && options.json != "-")
    options.json = fs::absolute(options.json, ignored).string();
  const auto job = submitted_in(options.folder);
  if (!job) return refuse(job.error());
  const InDirectory there(job->directory);
  if (!there.there()) {
    return refuse(Error{.message = "is gone: the study was named from there",
                        .hint = "collect on a machine that has it",
                        .file = job->directory,
                        .key = {}});
  }
  const auto progress = sweep::progress_in(options.folder);
  if (!progress) return refuse(progress.error());
  if (progress->done < progress->points) {
    return refuse(
        Error{.message = counted(progress->points - progress->done, "point") + " have no result",
              .hint = "tandem sweep status FOLDER says whether they are in the queue; tandem sweep "
                      "STUDY -o FOLDER computes them here",
              .file = options.folder,
              .key = {}});
  }
  options.action = SweepOptions::Action::kRun;
  options.study = job->study;
  return sweep_command(options);
}

}  // namespace

Exit sweep_command(const SweepOptions& given) {
  using Action = SweepOptions::Action;
  if (given.action == Action::kStatus) return sweep_status(given);
  if (given.action == Action::kCollect) return collect_sweep(given);
  if (given.action == Action::kCancel) return cancel_sweep(given);
  SweepOptions options = given;
  if (options.jobs == 0)
    options.jobs = options.slurm ? 1 : std::max(1U, std::thread::hardware_concurrency());
  if (options.folder.empty()) options.folder = "sweeps/" + fs::path(options.study).stem().string();
  const auto study = sweep::read_study(options.study);
  if (!study) return refuse(study.error());
  const sweep::Points points(*study);
  if (options.kernel_variant.empty()) {
    const auto before = kernel_variant_in(options.folder);
    if (!before) return refuse(before.error());
    options.kernel_variant = *before;
  }
  auto prepared = prepare_study(*study, points, options.kernel_variant, options.quiet);
  if (!prepared) return refuse(prepared.error());
  if (prepared->worlds.front()->experiment.expectations.empty()) {
    return refuse(Error{.message = "has no [[expect]]: every point would come to nothing",
                        .hint = "say what is expected: docs/expectations.md",
                        .file = study->experiment,
                        .key = {}});
  }
  if (options.slurm) return submit_sweep(options, *study, points, *prepared);
  if (options.chunk) return run_chunk(options, *study, points, *prepared);
  auto folder = sweep::SweepFolder::open(options.folder, prepared->head, points);
  if (!folder) return refuse(folder.error());
  print_warnings(folder->damaged());
  return Sweep(options, *study, points, *prepared, *folder, folder->path() + "/work").run();
}

}  // namespace tandem::apps
