// Answers what will happen: takes a snapshot of the run, and runs a copy of it ahead.
// Layer: internal_model.  Thread: made, attach(), close() main's; predict() any but the loop's; the
// interfaces' calls the loop's. The copy runs on a thread of this class' own.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/archive.hpp"
#include "base/result.hpp"
#include "base/triple_buffer.hpp"
#include "hal/predictor.hpp"
#include "hal/truth.hpp"
#include "internal_model/parallel_robot.hpp"
#include "runtime/robot_cycle.hpp"
#include "runtime/snapshot_port.hpp"

namespace tandem::internal_model {

/// A second whole run that never began: what a snapshot is restored into and run ahead.
struct Fork {
  virtual ~Fork() = default;
  runtime::RobotCycle* cycle = nullptr;    ///< in simulated time, as fast as it goes
  const hal::TruthImage* truth = nullptr;  ///< of its plant
  std::vector<std::string> unarchived;     ///< controllers that lack an archive(), by name
  [[nodiscard]] virtual bool diverged() const = 0;
};
/// Errors: whatever keeps it from being made.
using MakeFork = std::function<Result<std::unique_ptr<Fork>>()>;

/// An answer to a tool.
struct Answer {
  hal::Prediction prediction;
  std::vector<runtime::FaultReport> faults;  ///< that will come
  /// Controllers whose copies began anew instead of where the run's are: they lack an archive().
  std::vector<std::string> unarchived;
  std::size_t loop_bytes = 0;  ///< that the loop wrote down for it
  std::int64_t loop_ns = 0;    ///< and the time that this took, between two cycles
};

/// What a copy of a controller gets that is part of a prediction: no answer, ever.
class NoPredictor final : public hal::Predictor {
 public:
  [[nodiscard]] Status prepare(std::int64_t) override { return {}; }
  bool ask(std::int64_t) noexcept TANDEM_RT override { return true; }
  [[nodiscard]] const hal::Prediction* newest() noexcept TANDEM_RT override { return nullptr; }
};

class PredictionService final : public hal::Predictor, public runtime::SnapshotPort {
 public:
  explicit PredictionService(std::int64_t period_ns) : period_ns_(period_ns) {}
  ~PredictionService() override { close(); }

  /// Before the first cycle: what is predicted, and by what.
  /// @param parallel  the internal model; null: the run's own robot, which is a simulation
  /// @param fork      makes the copy when it is first needed. All outlive close().
  void attach(runtime::RobotCycle& cycle, ParallelRobot* parallel, MakeFork fork);
  /// Whether a controller asks for predictions, which no snapshot has.
  [[nodiscard]] bool is_prepared() const noexcept { return prepared_ns_ > 0; }
  /// The run is over: whoever waits gets an error, and the thread ends.
  void close();

  /// For a tool: blocks until the answer is there; one at a time is worked at.
  /// Errors: a horizon of less than a cycle or more than kMostHorizon_ns; no cycle comes (time
  /// stands, the run is over); other controllers than the experiment's are loaded; whatever keeps
  /// the copy from being made; a run that ends meanwhile.
  [[nodiscard]] Result<Answer> predict(std::int64_t horizon_ns);

  // hal::Predictor
  [[nodiscard]] Status prepare(std::int64_t horizon_ns) override;
  bool ask(std::int64_t horizon_ns) noexcept TANDEM_RT override;
  [[nodiscard]] const hal::Prediction* newest() noexcept TANDEM_RT override;

  // runtime::SnapshotPort
  [[nodiscard]] bool wanted() const noexcept TANDEM_RT override {
    if (parallel_ != nullptr && parallel_->snapshot_pending()) return false;
    return controller_wants() || tool_.stage.load(std::memory_order_acquire) == Stage::kWanted;
  }
  [[nodiscard]] bool whole() const noexcept TANDEM_RT override { return parallel_ == nullptr; }
  [[nodiscard]] Archive& archive() noexcept TANDEM_RT override;
  void taken(std::uint64_t next_cycle, std::int64_t took_ns) noexcept override;

 private:
  /// A snapshot on its way from the loop to the worker.
  enum class Stage : std::uint8_t {
    kIdle,
    kWanted,  ///< of a tool: the loop's turn
    kTaken,   ///< the worker's turn
  };
  struct HandOver {
    std::atomic<Stage> stage{Stage::kIdle};
    std::unique_ptr<Archive> archive;
    std::uint64_t next_cycle = 0;
    std::int64_t took_ns = 0;
  };
  /// A tool's question.
  struct Question {
    std::int64_t horizon_ns;
    Result<Answer> answer;
    bool done = false;
  };

  [[nodiscard]] bool controller_wants() const noexcept TANDEM_RT {
    return asked_ != snapped_ && controller_.stage.load(std::memory_order_acquire) == Stage::kIdle;
  }
  [[nodiscard]] bool controller_waits() const noexcept {
    return controller_.stage.load(std::memory_order_acquire) == Stage::kTaken;
  }
  [[nodiscard]] bool closing() const noexcept { return closing_.load(std::memory_order_acquire); }
  [[nodiscard]] Status check_horizon(std::int64_t horizon_ns) const;
  [[nodiscard]] Status wait_for_loop();

  // The worker's.
  void run();
  void answer_controller();
  [[nodiscard]] Result<Answer> answer_tool(std::int64_t horizon_ns);
  [[nodiscard]] Status restore(HandOver& from);
  void run_ahead(hal::Prediction& out, std::int64_t horizon_ns,
                 const std::function<bool()>& cancelled);

  std::int64_t period_ns_;
  runtime::RobotCycle* cycle_ = nullptr;
  ParallelRobot* parallel_ = nullptr;
  MakeFork make_fork_;
  std::unique_ptr<Fork> fork_;  // the worker's
  bool simulated_ = false;      // time: the loop waits for its controllers' predictions

  HandOver controller_, tool_;

  // The loop's: how often controllers have asked, and how many of those have had their snapshot.
  std::uint64_t asked_ = 0, snapped_ = 0;
  std::int64_t asked_ns_ = 0;
  bool any_answer_ = false;
  bool for_controller_ = false;  // the snapshot that is being written

  std::int64_t prepared_ns_ = 0;
  // Handed over with a controller's snapshot.
  std::int64_t controller_ns_ = 0;
  std::uint64_t controller_ticket_ = 0;

  std::atomic<std::uint64_t> answered_{0};
  std::unique_ptr<TripleBuffer<hal::Prediction>> answers_;

  std::mutex tools_;  // one of them asks
  std::mutex mutex_;
  std::condition_variable news_;
  Question* question_ = nullptr;
  std::atomic<bool> closing_{false};
  std::thread thread_;
};

}  // namespace tandem::internal_model
