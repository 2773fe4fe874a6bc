// Processes that run a study's points: each is forked from one that has loaded everything, so a
// point costs its simulation, and a crash costs one point.
// Layer: apps/run.  Thread: main, while no other is there.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "apps/run/child_run.hpp"
#include "apps/run/prepared_study.hpp"
#include "base/open_file.hpp"
#include "sweep/study.hpp"

namespace tandem::apps {

/// A point whose process goes on.
class PointWorkers {
 public:
  /// Called with each point that has ended.
  using Take = std::function<Status(const sweep::Point&, const ChildRun&, double seconds)>;

  /// @param folder  for what the processes write; it is emptied.
  /// @param prepared  outlives this
  PointWorkers(const sweep::Study& study, std::string folder, const PreparedStudy& prepared);
  ~PointWorkers();  ///< ends those that go on
  PointWorkers(const PointWorkers&) = delete;
  PointWorkers& operator=(const PointWorkers&) = delete;

  [[nodiscard]] std::size_t going() const { return going_.size(); }
  /// @param log_folder  of its log; empty: none is written
  /// Errors: no process can be made; the folder cannot be written.
  [[nodiscard]] Status start(const sweep::Point& point, const std::string& log_folder = {});
  /// Waits for one to end, a tenth of a second at most; ends those that are too slow.
  [[nodiscard]] Status wait(const Take& take);

 private:
  struct Going {
    sweep::Point point;
    pid_t child = 0;
    Descriptor ended;  // can be read when it has
    std::chrono::steady_clock::time_point begin;
    bool late = false;
  };
  [[nodiscard]] std::string file_of(const sweep::Point& point, const char* ending) const;
  [[nodiscard]] Status take_one(Going& one, int status, const Take& take);

  const sweep::Study& study_;
  std::string folder_;
  const PreparedStudy& prepared_;
  std::vector<Going> going_;
};

}  // namespace tandem::apps
