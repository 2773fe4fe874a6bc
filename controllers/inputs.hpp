// What a controller wants to be told while it runs: declared in configure() by
// ControllerSetup::input(), read in start() and update() by the handle that it returns.
// Layer: controllers.  Thread: declared non-RT; read in the controller's calls. Plain data: no
// lock.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"

namespace tandem {

enum class InputKind : std::uint8_t { kTwist, kWrench, kPose, kNumbers, kButtons, kTrajectory };

/// A kind of input: what it is called, and what a sample of it is made of.
struct InputKindRow {
  std::string_view name;
  std::string_view components;  ///< divided by blanks; empty: the controller names them
  std::string_view units;       ///< of each; "-": none
};
/// Every kind, in InputKind's order. Positions, velocities, forces along x, y, z, then about them.
inline constexpr InputKindRow kInputKinds[] = {
    {"twist", "x y z roll pitch yaw", "m/s m/s m/s rad/s rad/s rad/s"},
    {"wrench", "fx fy fz tx ty tz", "N N N Nm Nm Nm"},
    {"pose", "x y z qx qy qz qw", "m m m - - - -"},
    {"numbers", "", ""},
    {"buttons", "", ""},
    {"trajectory", "", ""},
};
[[nodiscard]] constexpr const InputKindRow& row_of(InputKind kind) noexcept {
  return kInputKinds[static_cast<std::size_t>(kind)];
}

/// What an input holds before its first sample, and once its time-out is over.
enum class AfterTimeout : std::uint8_t {
  kDefault,  ///< InputOptions::otherwise
  kZero,     ///< of a pose: no rotation; of a trajectory: no points
  kLast,     ///< the last sample
};

struct InputOptions {
  std::string doc = {};                 ///< one line: whose, in which frame
  std::vector<std::string> names = {};  ///< of numbers and buttons; of a trajectory: its joints
  std::string unit = {};                ///< of numbers
  /// Bounds of each component, or one of all of them. `max` empty: any finite number, of buttons 1,
  /// of a trajectory the joints' limits. `min` empty: -max, of buttons 0. A sample beyond them is
  /// refused as a whole.
  std::vector<double> min = {}, max = {};
  double timeout_s = 0.5;  ///< that a sample is fresh; 0: until the next
  AfterTimeout after = AfterTimeout::kDefault;
  std::vector<double> otherwise = {};  ///< a number per component; empty: as kZero
  std::size_t most_points = 16;        ///< of a trajectory
  bool terms = false;                  ///< of a trajectory: its samples have TrajectoryTerms
};

/// What a trajectory asks of a joint, in the order of the sample's numbers. A tolerance is what
/// the measured value may differ by from the reference; 0: the controller's own, below 0: anything.
struct JointTerms {
  double stays = 0.0;                       ///< 1: its positions are none, and it stays where it is
  double path_rad = 0.0, path_rad_s = 0.0;  ///< tolerances on the way
  double goal_rad = 0.0, goal_rad_s = 0.0;  ///< tolerances at the end
};

/// And of all of them.
struct TrajectoryTerms {
  double start_s = 0.0;      ///< its beginning after the sample's arrival; below 0: it is past
  double goal_time_s = 0.0;  ///< that joints have after its end; 0, below 0: as a tolerance
};

/// An input: what was declared, and what the loop puts into it between two cycles.
struct InputBlock {
  static constexpr std::size_t kMost = 16;          ///< of one controller
  static constexpr std::size_t kMostValues = 4096;  ///< of one input

  InputBlock(std::string its_name, InputKind its_kind, InputOptions its)
      : name(std::move(its_name)), kind(its_kind), options(std::move(its)) {
    const InputKindRow& row = row_of(kind);
    components = row.components.empty() ? options.names : words(row.components);
    units = row.components.empty() ? std::vector<std::string>(components.size(), options.unit)
                                   : words(row.units);
    value.assign(values(), 0.0);
  }
  /// Numbers of a sample: of a trajectory its points, whether they have velocities, then of each
  /// point its time, the joints' positions and the joints' velocities; with terms, those of all
  /// joints and then of each.
  [[nodiscard]] std::size_t values() const noexcept {
    if (kind != InputKind::kTrajectory) return components.size();
    return terms_at() + (options.terms ? kTerms + kTermsOfJoint * components.size() : 0);
  }
  /// Where the terms of a trajectory stand in its sample.
  [[nodiscard]] std::size_t terms_at() const noexcept TANDEM_RT {
    return 2 + options.most_points * (1 + 2 * components.size());
  }
  static constexpr std::size_t kTerms = sizeof(TrajectoryTerms) / sizeof(double);
  static constexpr std::size_t kTermsOfJoint = sizeof(JointTerms) / sizeof(double);
  void archive(Archive& ar) { ar(value, sequence, cycle, fresh, arrived); }

  const std::string name;
  const InputKind kind;
  InputOptions options;
  std::vector<std::string> components, units;

  // The loop's.
  std::vector<double> value;
  std::uint64_t sequence = 0;  ///< samples since the controller's start
  std::uint64_t cycle = 0;     ///< in which the last one arrived
  bool fresh = false;          ///< there is one, within its time-out
  bool arrived = false;        ///< in this cycle

 private:
  static std::vector<std::string> words(std::string_view text) {
    std::vector<std::string> all;
    while (!text.empty()) {
      const std::size_t end = text.find(' ');
      const std::string_view word = text.substr(0, end);
      all.emplace_back(word == "-" ? std::string_view() : word);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    return all;
  }
};

/// The handle of an input. A copy is as good. Valid as long as the controller.
class Input {
 public:
  Input() = default;  ///< of none: only to be assigned to
  explicit Input(const InputBlock& block) noexcept : block_(&block) {}

  /// What holds in this cycle, in the kind's order of components: the newest sample while it is
  /// fresh, else what InputOptions::after says.
  [[nodiscard]] std::span<const double> values() const noexcept TANDEM_RT { return block_->value; }
  [[nodiscard]] double operator[](std::size_t component) const noexcept TANDEM_RT {
    return block_->value[component];
  }
  /// Whether values() is a sample within its time-out.
  [[nodiscard]] bool fresh() const noexcept TANDEM_RT { return block_->fresh; }
  /// Whether one arrived in this cycle.
  [[nodiscard]] bool arrived() const noexcept TANDEM_RT { return block_->arrived; }
  /// Samples since the controller's start.
  [[nodiscard]] std::uint64_t sequence() const noexcept TANDEM_RT { return block_->sequence; }
  /// In which cycle of the run the last one arrived. @pre sequence() > 0
  [[nodiscard]] std::uint64_t cycle() const noexcept TANDEM_RT { return block_->cycle; }

  // A trajectory's.

  /// Way-points of it; 0: there is none, and the joints stay.
  [[nodiscard]] std::size_t points() const noexcept TANDEM_RT {
    return static_cast<std::size_t>(block_->value[0]);
  }
  [[nodiscard]] bool has_velocities() const noexcept TANDEM_RT { return block_->value[1] != 0.0; }
  /// After the sample's arrival. It grows from point to point.
  [[nodiscard]] double time_s(std::size_t point) const noexcept TANDEM_RT {
    return block_->value[at(point)];
  }
  /// A number per joint of InputOptions::names.
  [[nodiscard]] std::span<const double> position_rad(std::size_t point) const noexcept TANDEM_RT {
    return values().subspan(at(point) + 1, block_->components.size());
  }
  /// The same, 0 without velocities.
  [[nodiscard]] std::span<const double> velocity_rad_s(std::size_t point) const noexcept TANDEM_RT {
    return values().subspan(at(point) + 1 + block_->components.size(), block_->components.size());
  }
  /// @pre InputOptions::terms
  [[nodiscard]] TrajectoryTerms terms() const noexcept TANDEM_RT {
    const double* const its = block_->value.data() + block_->terms_at();
    return {its[0], its[1]};
  }
  /// @pre InputOptions::terms
  [[nodiscard]] JointTerms terms(std::size_t joint) const noexcept TANDEM_RT {
    const double* const its = block_->value.data() + block_->terms_at() + InputBlock::kTerms +
                              joint * InputBlock::kTermsOfJoint;
    return {its[0], its[1], its[2], its[3], its[4]};
  }

 private:
  [[nodiscard]] std::size_t at(std::size_t point) const noexcept TANDEM_RT {
    return 2 + point * (1 + 2 * block_->components.size());
  }
  const InputBlock* block_ = nullptr;
};

/// A controller's inputs, in the order of their declaration. Their places do not change.
struct ControllerInputs {
  std::deque<InputBlock> all;

  Input declare(std::string name, InputKind kind, InputOptions options) {
    return Input(all.emplace_back(std::move(name), kind, std::move(options)));
  }
  void archive(Archive& ar) {
    for (InputBlock& one : all) one.archive(ar);
  }
};

}  // namespace tandem
