// `tandem sweep --slurm` on a real Slurm, against the same sweep on this machine alone.
#include <algorithm>
#include <csignal>

#include "sweep/slurm_job.hpp"
#include "sweep/slurm_options.hpp"
#include "tests/apps/cluster.hpp"

namespace tandem::apps {
namespace {

class SlurmProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    edit("hold.toml", "[[controller]]",
         "[[expect]]\nname = \"slow\"\nalways = \"abs(velocity(joint1)) < 2rad/s\"\n"
         "[[push]]\nname = \"bump\"\nlink = \"link1\"\nat_s = 0.1\ntorque_Nm = [1, 0, 0]\n"
         "for_s = 0.1\n[[controller]]");
    // The second half takes long enough to kill what computes it.
    write_text(folder_ / "study.toml",
               "experiment = \"hold.toml\"\n[[vary]]\nkey = \"duration_s\"\n"
               "values = [0.3, " +
                   std::string(kLongPoint) +
                   "]\n"
                   "[[vary]]\nkey = \"push[0].torque_Nm[0]\"\nvalues = [0.0, 1.0, 2.0, 40.0]\n");
  }
  static constexpr const char* kLongPoint = "80";

  /// The process that computes a chunk, not those of its points; 0: none does.
  [[nodiscard]] pid_t worker_of(int chunk) const {
    const std::string words = std::string("--chunk") + '\0' + std::to_string(chunk) + '\0';
    pid_t first = 0;  // the points' are forked from it
    for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
      const std::string name = entry.path().filename().string();
      if (name.find_first_not_of("0123456789") != std::string::npos) continue;
      const std::string line = read_text(entry.path() / "cmdline");
      if (!line.contains(words) || !line.contains((folder_ / "far").string())) continue;
      const auto process = static_cast<pid_t>(std::stol(name));
      first = first == 0 ? process : std::min(first, process);
    }
    return first;
  }
  /// Whether a chunk has results of so many points.
  [[nodiscard]] bool has_result(int chunk, std::ptrdiff_t points) const {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "far/chunks", ignored)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(std::to_string(chunk) + ".") || !name.ends_with(".jsonl")) continue;
      const std::string text = read_text(entry.path());
      return std::ranges::count(text, '\n') >= points;
    }
    return false;
  }
};

TEST(SlurmJob, DividesPointsAndKeepsIndicesBelowTheLimit) {
  EXPECT_EQ(sweep::usual_chunk_points(81), 1U);
  EXPECT_EQ(sweep::usual_chunk_points(10'000), 100U);
  EXPECT_EQ(sweep::usual_chunk_points(1'000'000), 1000U);
  EXPECT_EQ(sweep::chunks_of(10, 3), 4U);
  EXPECT_EQ(sweep::chunk_of(3, 3, 10).first, 9U);
  EXPECT_EQ(sweep::chunk_of(3, 3, 10).end, 10U);
  const auto arrays = sweep::arrays_of({0, 1, 2, 4, 1000, 1001, 2002, 2005}, 1001);
  ASSERT_EQ(arrays.size(), 3U);
  EXPECT_EQ(arrays[0].list(), "0-2,4,1000");
  EXPECT_EQ(arrays[1].offset, 1001U);
  EXPECT_EQ(arrays[1].list(), "0");
  EXPECT_EQ(arrays[2].offset, 2002U);
  EXPECT_EQ(arrays[2].list(), "0,3");
}

TEST(SlurmOptions, RefuseWhatTheSweepSetsItself) {
  const auto said = [](const std::string& option) {
    const Status right = sweep::check_sbatch({option});
    return right ? std::string() : right.error().to_string();
  };
  EXPECT_EQ(said("array=0-7"),
            "--sbatch array=0-7: the sweep sets it: an element for each chunk of points "
            "(--chunk-points N makes larger ones)");
  EXPECT_EQ(said("cpus-per-task=8"),
            "--sbatch cpus-per-task=8: the sweep sets it (the points at once are the cores: -j N)");
  for (const char* option : {"wrap=ls", "output=x", "error=x", "ntasks=2", "chdir=/", "test-only",
                             "wait", "--mem=4G", "-p long", "P=3", "time=soon", "time", "nodes=2"})
    EXPECT_NE(said(option), "") << option;
  for (const char* option : {"partition=long", "mem=4G", "time=2:00:00", "begin=now+1hour",
                             "account=me", "exclusive", "constraint=avx2&ssd"})
    EXPECT_EQ(said(option), "");
  EXPECT_FALSE(sweep::check_sbatch({"mem=4G", "mem=8G"}));
  EXPECT_EQ(sweep::slurm_minutes("90"), 90.0);
  EXPECT_EQ(sweep::slurm_minutes("1:30"), 1.5);
  EXPECT_EQ(sweep::slurm_minutes("1:30:00"), 90.0);
  EXPECT_EQ(sweep::slurm_minutes("2-12"), 3600.0);
  EXPECT_EQ(sweep::slurm_minutes("1-00:00:30"), 1440.5);
  EXPECT_EQ(sweep::slurm_minutes("infinite"), std::numeric_limits<double>::infinity());
  for (const char* text : {"", "soon", "1:", "-3", "1:2:3:4"})
    EXPECT_EQ(sweep::slurm_minutes(text), std::nullopt) << text;
}

// It needed a controller that answers, for a script that it only prints.
TEST_F(SlurmProgram, ADryRunNeedsNoController) {
  std::filesystem::create_directories(folder_ / "bin");
  for (const char* name : {"sbatch", "squeue", "scancel", "scontrol", "sinfo"}) {
    write_text(folder_ / "bin" / name,
               "#!/bin/sh\necho 'Unable to contact slurm controller' >&2\n"
               "exit 1\n");
    std::filesystem::permissions(folder_ / "bin" / name, std::filesystem::perms::owner_all);
  }
  const std::string path = "PATH=\"$PWD/bin:$PATH\"";
  const Outcome script = tandem("sweep study.toml --slurm --dry-run -o far", path);
  EXPECT_EQ(script.status, 0) << script.err;
  EXPECT_NE(script.out.find("#SBATCH --requeue"), std::string::npos) << script.out;
  EXPECT_NE(script.out.find("Unable to contact slurm controller"), std::string::npos) << script.out;
  EXPECT_EQ(tandem("sweep study.toml --slurm -o far", path).status, 2);
  EXPECT_EQ(tandem("sweep study.toml --slurm --dry-run --sbatch array=1 -o far", path).status, 2);

  // A partition of half an hour, though four points of a minute would need five.
  write_text(folder_ / "bin/scontrol", "#!/bin/sh\necho 'MaxArraySize = 1001'\n");
  write_text(folder_ / "bin/sinfo", "#!/bin/sh\necho 'short* 2:00'\necho 'long 1-00:00:00'\n");
  write_text(folder_ / "bin/squeue", "#!/bin/sh\n");
  const std::string dry = "sweep study.toml --slurm --dry-run -o far --chunk-points 4";
  const Outcome clamped = tandem(dry, path);
  EXPECT_NE(clamped.out.find("#SBATCH --time=2\n"), std::string::npos) << clamped.out;
  EXPECT_NE(clamped.err.find("a chunk takes up to 5 minutes by time_limit_s, and a job of this "
                             "partition has 2"),
            std::string::npos)
      << clamped.err;
  EXPECT_NE(tandem(dry + " --sbatch partition=long", path).out.find("#SBATCH --time=5\n"),
            std::string::npos);
  const Outcome long_time = tandem(dry + " --sbatch time=1:00:00", path);
  EXPECT_EQ(long_time.status, 2);
  EXPECT_NE(long_time.err.find("a job of this partition has 2 minutes at most"), std::string::npos)
      << long_time.err;
  const Outcome typo = tandem("sweep study.toml --slurm --sbatch partition=lnog -o far", path);
  EXPECT_EQ(typo.status, 2);
  EXPECT_NE(typo.err.find("it has short, long"), std::string::npos) << typo.err;
}

TEST_F(SlurmProgram, WithoutSlurmItSaysSoAndShowsTheScript) {
  const Outcome none = tandem("sweep study.toml --slurm -o far", "PATH=/nowhere");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("there is no sbatch in $PATH"), std::string::npos) << none.err;
  const Outcome script = tandem(
      "sweep study.toml --slurm --dry-run -o far --chunk-points 3 --sbatch partition=long -j 2",
      "PATH=/nowhere");
  EXPECT_EQ(script.status, 0) << script.err;
  for (const char* line : {"#!/bin/bash\n", "#SBATCH --job-name=tandem-study\n",
                           "#SBATCH --requeue\n", "#SBATCH --cpus-per-task=2\n",
                           "#SBATCH --time=3\n", "#SBATCH --partition=long\n", "--array=0-2 "})
    EXPECT_NE(script.out.find(line), std::string::npos) << line << script.out;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "far"));
  EXPECT_EQ(tandem("sweep study.toml --slurm --sbatch --wait").status, 2);
  EXPECT_EQ(tandem("sweep status .").status, 2);
  EXPECT_EQ(tandem("sweep").status, 2);
}

TEST_F(SlurmProgram, PointsKeepTheKernelsThatTheFirstHad) {
  write_text(folder_ / "short.toml",
             "experiment = \"hold.toml\"\n[[vary]]\nkey = \"duration_s\"\nvalues = [0.1]\n");
  ASSERT_EQ(tandem("sweep short.toml -o base -q --kernel-variant baseline").status, 0);
  EXPECT_EQ(tandem("sweep short.toml -o base -q").status, 0);  // whatever this CPU would take
  ASSERT_EQ(tandem("sweep status base --json status.json").status, 0);
  EXPECT_EQ(json("status.json")["done"], 1);
  EXPECT_EQ(json("status.json")["submitted"], false);
  EXPECT_EQ(json("status.json")["running_chunks"], nlohmann::json());
  const Outcome other = tandem("sweep short.toml -o base -q --kernel-variant x87");
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("no variant 'x87'"), std::string::npos) << other.err;
}

TEST_F(SlurmProgram, KilledOnAClusterItComesToTheBytesOfThisMachine) {
  if (!Cluster::installed()) GTEST_SKIP() << "no Slurm: scripts/install-dependencies test";
  ASSERT_EQ(tandem("sweep study.toml -j 2 -o near -q").status, 0);

  Cluster cluster(2);  // so three chunks are two arrays
  const std::string submit = "sweep study.toml --slurm -o far --chunk-points 3";
  const Outcome submitted = tandem(submit);
  ASSERT_EQ(submitted.status, 0) << submitted.err;
  EXPECT_EQ(sweep::slurm_job_in(folder_ / "far")->value().arrays.size(), 2U);
  const Outcome twice = tandem(submit);
  EXPECT_EQ(twice.status, 0) << twice.err;

  // Killed before its last point has ended, and the node's daemon with it.
  ASSERT_TRUE(test::eventually([&] { return has_result(1, 2); })) << cluster.queue();
  const pid_t worker = worker_of(1);
  ASSERT_GT(worker, 0);
  EXPECT_EQ(::kill(worker, SIGKILL), 0);
  cluster.kill_node();
  cluster.start_node();
  ASSERT_TRUE(test::eventually([&] { return cluster.queue().empty(); })) << cluster.queue();

  const Outcome status = tandem("sweep status far");
  EXPECT_NE(status.out.find("1 chunk ended early, such as 1: no word"), std::string::npos)
      << status.out;
  const Outcome early = tandem("sweep collect far");
  EXPECT_EQ(early.status, 2);
  EXPECT_NE(early.err.find(" have no result"), std::string::npos) << early.err;

  ASSERT_EQ(tandem(submit).status, 0);
  ASSERT_TRUE(test::eventually([&] { return cluster.queue().empty(); })) << cluster.queue();
  const Outcome collected = tandem("sweep collect far --json far.json");
  ASSERT_EQ(collected.status, 0) << collected.err << tandem("sweep status far").out;
  EXPECT_EQ(json("far.json")["points"], 8);
  for (const char* file : {"results.csv", "results.sqlite", "index.html"})
    EXPECT_TRUE(read_text(folder_ / "near" / file) == read_text(folder_ / "far" / file)) << file;

  // A job that waits, cancelled; and one that finds other files than it was submitted with.
  const Outcome later = tandem("sweep study.toml --slurm -o other --sbatch begin=now+1hour");
  ASSERT_EQ(later.status, 0) << later.err;
  EXPECT_NE(tandem("sweep status other").out.find("0 chunks run, 8 wait"), std::string::npos);
  EXPECT_EQ(tandem("sweep cancel other").out, "8 chunks cancelled; what is done stays done\n");
  EXPECT_TRUE(test::eventually([&] { return cluster.queue().empty(); })) << cluster.queue();
  edit("robot.toml", "[model]", "# other\n[model]");
  const Outcome mixed = tandem("sweep study.toml -o other --chunk 0 --chunk-points 1");
  EXPECT_EQ(mixed.status, 2);
  EXPECT_NE(mixed.err.find("its points are of another robot.toml"), std::string::npos) << mixed.err;
}

}  // namespace
}  // namespace tandem::apps
