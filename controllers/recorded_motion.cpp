// recorded_motion: plays the joint references of a log, of a run or imported.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "controllers/controller.hpp"
#include "controllers/min_jerk.hpp"
#include "controllers/motion_plan.hpp"
#include "controllers/parameters.hpp"
#include "controllers/tracking.hpp"
#include "log/joint_motion.hpp"

namespace tandem {
namespace {

/// Parameters: log (relative to the experiment), data_sha256 (any), joints (all), source (the
/// commands where the log has them), from_s, to_s (while its controllers ran), speed (1), torque
/// (false), approach_s (3, and longer where the way is), stop_at_end (false),
/// link_damping_Nms_rad (0, by joint).
class RecordedMotion : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    TomlTable& parameters = setup.parameters;
    progress_ = setup.signal("progress", "", "share of the recording that is played");
    worst_error_ = setup.signal("worst_error", "rad", kWorstErrorDoc);
    const std::string path = parameters.text("log");
    const std::string sha256 = parameters.text_or("data_sha256", "");
    log::MotionRequest request;
    const std::string source = parameters.choice_or("source", "", {"command", "state"});
    if (source == "command") request.source = log::MotionSource::kCommand;
    if (source == "state") request.source = log::MotionSource::kState;
    const Parameter from_s = setup.parameter("from_s", {.unit = "s",
                                                        .otherwise = kNotGiven,
                                                        .doc = "of the log's time; else where its "
                                                               "controllers began"});
    const Parameter to_s = setup.parameter("to_s", {.unit = "s",
                                                    .otherwise = kNotGiven,
                                                    .doc = "of the log's time; else where they "
                                                           "ended"});
    if (from_s.given()) request.from_s = from_s;
    if (to_s.given()) request.to_s = to_s;
    request.torque = setup
                         .parameter("torque", {.otherwise = false,
                                               .doc = "the recorded torques as feed-forward"})
                         .on();
    speed_ = setup.parameter("speed", {.min = log::kReplaySlowest,
                                       .max = log::kReplayFastest,
                                       .otherwise = 1,
                                       .doc = "times as fast as recorded"});
    if (request.torque && speed_ > 1.0) {
      parameters.error("torque", "the recorded torques are those of a slower motion",
                       "play it without: torque = false; or not faster than recorded: speed = 1");
    }
    approach_s_ = setup.parameter("approach_s", {.unit = "s",
                                                 .min = 0,
                                                 .above_min = true,
                                                 .otherwise = log::kReplayApproach_s,
                                                 .doc = "to the first place, at least"});
    stop_at_end_ = stop_at_end_parameter(setup);
    joints_ = joints_parameter(setup);
    for (const std::size_t joint : joints_) {
      setup.claim(joint, hal::ControlMode::kPosition);
      request.joints.push_back(setup.robot.joints[joint].name);
      limits_.push_back(setup.robot.joints[joint]);
    }
    from_.assign(joints_.size(), {});
    link_damping_Nms_rad_ =
        setup.joint_parameters("link_damping_Nms_rad", joints_,
                               {{.unit = "Nms/rad",
                                 .min = 0,
                                 .otherwise = 0,
                                 .live = true,
                                 .doc = "damps the links' swing on their springs"}});
    if (parameters.has_errors() || joints_.empty()) return {};
    if (const Status read = read_log(setup, path, sha256, request); !read) {
      const Error& error = read.error();
      const std::string of = error.file.empty() ? path : error.file;
      parameters.error("log", of + ": " + error.message, error.hint);
      return {};
    }
    const double period_s = static_cast<double>(setup.period_ns) * 1e-9;
    setup.plan(parameters, "log", approach_s_ + static_cast<double>(plan_.cycles() - 1) * period_s);
    return {};
  }

  void start(const hal::CycleTime& time, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    start_ns_ = time.time_ns;
    double longest_s = approach_s_;
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const double here = state.position_rad()[joints_[k]];
      const double torque = state.torque_Nm()[joints_[k]];
      from_[k] = {here, std::isfinite(torque) ? torque : 0.0};
      longest_s = std::max(longest_s, approach_time_s(plan_.position(k, 0) - here, limits_[k]));
    }
    approach_cycles_ =
        static_cast<std::int64_t>(std::ceil(longest_s * 1e9 / static_cast<double>(time.period_ns)));
  }

  Code update(const hal::CycleTime& time, const hal::StateImage& state,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    const std::int64_t since = (time.time_ns - start_ns_) / time.period_ns;
    const Code code = play(since, time, state, command);
    worst_error_ = worst_error(joints_, state, command);
    return code;
  }

  void archive(Archive& ar) override { ar(start_ns_, approach_cycles_, from_); }

 private:
  struct From {
    double position_rad = 0.0, torque_Nm = 0.0;
  };

  Code play(std::int64_t since, const hal::CycleTime& time, const hal::StateImage& state,
            hal::CommandImage& command) noexcept TANDEM_RT {
    progress_ = 0.0;
    if (since < approach_cycles_) {
      approach(static_cast<double>(since) / static_cast<double>(approach_cycles_), time, command);
      damp_links(state, command);
      return Code::kOk;
    }
    const std::size_t last = plan_.cycles() - 1;
    const std::size_t cycle = std::min(static_cast<std::size_t>(since - approach_cycles_), last);
    progress_ = static_cast<double>(cycle + 1) / static_cast<double>(last + 1);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      command.position_rad()[joints_[k]] = plan_.position(k, cycle);
      command.velocity_rad_s()[joints_[k]] = plan_.velocity(k, cycle);
      command.torque_Nm()[joints_[k]] = plan_.has_torque() ? plan_.torque(k, cycle) : 0.0;
    }
    damp_links(state, command);
    return cycle == last && stop_at_end_.on() ? Code::kStopped : Code::kOk;
  }

  /// On a spring the link may swing, which the motor's own loop hardly damps.
  void damp_links(const hal::StateImage& state,
                  hal::CommandImage& command) const noexcept TANDEM_RT {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const double damping = link_damping_Nms_rad_[k];
      if (damping == 0.0) continue;
      const std::size_t joint = joints_[k];
      const double swing = state.velocity_rad_s()[joint] - command.velocity_rad_s()[joint];
      command.torque_Nm()[joint] -= damping * swing;
    }
  }

  /// From where the joints stood to where the plan begins, torques alike.
  void approach(double share, const hal::CycleTime& time,
                hal::CommandImage& command) const noexcept TANDEM_RT {
    const double approach_s =
        static_cast<double>(approach_cycles_) * static_cast<double>(time.period_ns) * 1e-9;
    const MinJerk profile = min_jerk(share);
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const double way = plan_.position(k, 0) - from_[k].position_rad;
      command.position_rad()[joints_[k]] = from_[k].position_rad + way * profile.s;
      command.velocity_rad_s()[joints_[k]] = way * profile.ds / approach_s;
      const double to_Nm = plan_.has_torque() ? plan_.torque(k, 0) : 0.0;
      const double from_Nm = plan_.has_torque() ? from_[k].torque_Nm : 0.0;
      command.torque_Nm()[joints_[k]] = from_Nm + (to_Nm - from_Nm) * profile.s;
    }
  }

  /// Errors: of the log; joints that it has and the robot lacks; those of the plan.
  Status read_log(const ControllerSetup& setup, const std::string& path, const std::string& sha256,
                  const log::MotionRequest& request) {
    const auto file =
        log::LogFile::open((std::filesystem::path(setup.parameters.folder()) / path).string());
    if (!file) return std::unexpected(file.error());
    if (!sha256.empty() && sha256 != file->data_sha256()) {
      return fail("is another recording than the one that data_sha256 names",
                  "write the experiment again with `tandem log replay`, or remove data_sha256");
    }
    if (!setup.parameters.has("joints")) {
      for (const std::string& joint : file->info().joints) {
        if (setup.robot.joint_index(joint) >= 0) continue;
        return fail("is a recording of another robot: this one has no joint '" + joint + "'",
                    "name those that both have in `joints`");
      }
    }
    const auto motion = log::read_joint_motion(*file, request);
    if (!motion) return std::unexpected(motion.error());
    auto plan = MotionPlan::make(*motion, setup.robot, joints_, setup.period_ns, speed_);
    if (!plan) return std::unexpected(plan.error());
    plan_ = std::move(*plan);
    return {};
  }

  std::vector<std::size_t> joints_;
  std::vector<hal::DrivenJoint> limits_;
  std::vector<Parameter> link_damping_Nms_rad_;  // as `joints_`
  Signal progress_, worst_error_;
  MotionPlan plan_;
  double approach_s_ = 0.0, speed_ = 1.0;
  Parameter stop_at_end_;
  std::int64_t start_ns_ = 0, approach_cycles_ = 0;
  std::vector<From> from_;
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::RecordedMotion, "recorded_motion", "Plays the motion of a log.")
