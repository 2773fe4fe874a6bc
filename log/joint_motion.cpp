#include "log/joint_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "log/run_window.hpp"

namespace tandem::log {
namespace {

constexpr std::int64_t kLongestHole_ns = 20'000'000;
constexpr std::int64_t kLongestHole_cycles = 3;
constexpr const char* kCommand = "/tandem/command";
constexpr const char* kState = "/tandem/state";
constexpr const char* kOtherStretch = "play another stretch: from_s and to_s";
constexpr const char* kMeasured = "play what was measured: source = \"state\"";

std::int64_t ns_of(double time_s) { return std::llround(time_s * 1e9); }

std::string seconds(std::int64_t time_ns) {
  char text[48];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(time_ns) * 1e-9);
  return text;
}

std::unexpected<Error> refuse(const LogFile& file, std::string message, std::string hint) {
  return std::unexpected(Error{std::move(message), std::move(hint), file.path(), 0, {}});
}

/// Where the wanted joints stand in the log.
Result<std::vector<std::size_t>> order_of(const LogFile& file,
                                          const std::vector<std::string>& joints) {
  const std::vector<std::string>& logged = file.info().joints;
  std::vector<std::size_t> order;
  for (const std::string& joint : joints) {
    const auto found = std::ranges::find(logged, joint);
    if (found == logged.end()) {
      return refuse(file, "the recording has no joint '" + joint + "'",
                    "is it of another robot? Else name those that it has in `joints`; " +
                        suggest(joint, logged));
    }
    order.push_back(static_cast<std::size_t>(found - logged.begin()));
  }
  return order;
}

/// Which part of the log is played.
struct Stretch {
  std::int64_t begin_ns, end_ns;
};

Result<Stretch> stretch_of(const LogFile& file, const LoggedTopic& topic,
                           const MotionRequest& request) {
  if (topic.messages < 2) {
    return refuse(file,
                  "has " + counted(topic.messages, "message") + " of " + topic.name + ": " +
                      "there is no motion to play",
                  "give the log of a longer run");
  }
  const RunInfo& info = file.info();
  RunWindow window;
  if (file.find("/tandem/event") != nullptr) {
    const auto events = file.events();
    if (!events) return std::unexpected(events.error());
    window = run_window(*events, settle_time_s(info.configuration));
  }
  const double first_s = static_cast<double>(topic.first_ns) * 1e-9;
  const double last_s = static_cast<double>(topic.last_ns) * 1e-9;
  const double faultless_s = std::min(window.stop_s, last_s);
  const double from_s = request.from_s.value_or(std::max(window.begin_s, first_s));
  const double to_s = request.to_s.value_or(std::min(window.end_s, last_s));
  const bool ran = info.hal == "import" || window.begin_s > -1e299;
  if (!request.from_s && (!ran || from_s > last_s)) {
    return refuse(file, "its controllers never ran", "give the log of a run that began");
  }
  if (from_s < first_s - kHalfNanosecond || to_s > last_s + kHalfNanosecond || !(from_s < to_s)) {
    return refuse(file,
                  "there is nothing from " + seconds(ns_of(from_s)) + " to " + seconds(ns_of(to_s)),
                  "the log goes from " + seconds(topic.first_ns) + " to " + seconds(topic.last_ns) +
                      ": correct from_s and to_s");
  }
  if (file.truncated() && !request.to_s) {
    return refuse(file,
                  "the log is cut: " + file.cut_reason() + "; what can be read ends at " +
                      seconds(topic.last_ns),
                  "copy it again; or play what there is: to_s");
  }
  if (file.damage_loses_messages() && !request.to_s) {
    return refuse(file, "the log is damaged: " + file.damage().front(),
                  "copy it again; or play what is whole: from_s and to_s");
  }
  if (faultless_s < to_s) {
    return refuse(file, "its run met a fault at " + seconds(ns_of(faultless_s)),
                  "play what was before: to_s");
  }
  return Stretch{ns_of(from_s - kHalfNanosecond), ns_of(to_s + kHalfNanosecond)};
}

/// The topic's columns, joint by joint.
class Rows {
 public:
  static Result<Rows> read(const LogFile& file, const std::string& topic,
                           const std::vector<std::string>& fields,
                           const std::vector<std::size_t>& joints) {
    Rows rows;
    rows.fields_ = fields.size();
    std::vector<Column> columns;
    for (const std::size_t joint : joints) {
      for (const std::string& field : fields) columns.push_back({field, joint});
    }
    auto table = file.read(topic, columns);
    if (!table) return std::unexpected(table.error());
    rows.table_ = std::move(*table);
    for (std::size_t i = 0; i < rows.table_.time_s.size(); ++i) {
      rows.time_ns_.push_back(ns_of(rows.table_.time_s[i]));
      if (i == 0 || rows.time_ns_[i] > rows.time_ns_[i - 1]) continue;
      const bool back = rows.time_ns_[i] < rows.time_ns_[i - 1];
      return refuse(file,
                    std::string("time ") + (back ? "goes backwards" : "stands still") + ": " +
                        seconds(rows.time_ns_[i]) + " after " + seconds(rows.time_ns_[i - 1]),
                    "the log is damaged, or two were joined: record it again");
    }
    return rows;
  }
  [[nodiscard]] const std::vector<std::int64_t>& time_ns() const { return time_ns_; }
  [[nodiscard]] double at(std::size_t joint, std::size_t field, std::size_t row) const {
    return table_.columns[joint * fields_ + field][row];
  }

 private:
  TimeSeries table_;
  std::vector<std::int64_t> time_ns_;
  std::size_t fields_ = 0;
};

enum Field : std::size_t { kPosition, kVelocity, kTorque, kMode, kAge = kMode, kInteraction };

/// "" or why a command is no reference of stiff position control.
std::string not_led(const Rows& rows, std::size_t joint, std::size_t row) {
  const auto mode = static_cast<hal::ControlMode>(rows.at(joint, kMode, row));
  if (mode != hal::ControlMode::kPosition) {
    return std::string("was not led by position, but in mode ") + hal::to_string(mode);
  }
  const bool stiff =
      rows.at(joint, kInteraction, row) == static_cast<double>(hal::InteractionMode::kStiff);
  return stiff ? "" : "was compliant: its reference is not where it went";
}

/// The longest time that may lie between two samples.
std::int64_t longest_hole_ns(const JointMotion& motion) {
  return std::max(kLongestHole_ns, kLongestHole_cycles * motion.period_ns);
}

std::unexpected<Error> refuse_joint(const LogFile& file, const std::string& joint,
                                    const std::string& what, std::int64_t time_ns,
                                    std::string hint) {
  return refuse(file, "joint '" + joint + "' " + what + " at " + seconds(time_ns), std::move(hint));
}

/// Whether a track goes on to the motion's end. `last_ns`: its last sample's time, or its begin.
Status check_end(const LogFile& file, const JointTrack& track, const JointMotion& motion,
                 std::int64_t last_ns) {
  const std::int64_t longest_ns = longest_hole_ns(motion);
  const bool few = track.time_ns.size() < 2;
  if (few && motion.end_ns - motion.begin_ns <= longest_ns) {
    return refuse(file,
                  "joint '" + track.joint + "' has fewer than two samples from " +
                      seconds(motion.begin_ns) + " to " + seconds(motion.end_ns),
                  "play a longer stretch: from_s and to_s");
  }
  if (few || motion.end_ns - last_ns > longest_ns) {
    return refuse_joint(file, track.joint, "has a gap: nothing of it was recorded after this time",
                        last_ns, kOtherStretch);
  }
  return {};
}

/// The samples of one joint that are fresh.
Result<JointTrack> track_of(const LogFile& file, const Rows& rows, std::size_t joint,
                            const JointMotion& motion, const MotionRequest& request) {
  JointTrack track;
  track.joint = request.joints[joint];
  const auto wrong = [&](const std::string& what, std::int64_t time_ns, std::string hint) {
    return refuse_joint(file, track.joint, what, time_ns, std::move(hint));
  };
  const bool commanded = motion.source == MotionSource::kCommand;
  bool fast = true;
  std::int64_t before_ns = motion.begin_ns;
  const std::vector<std::int64_t>& time_ns = rows.time_ns();
  const auto first = std::ranges::lower_bound(time_ns, motion.begin_ns) - time_ns.begin();
  for (auto row = static_cast<std::size_t>(first); row < time_ns.size(); ++row) {
    if (time_ns[row] > motion.end_ns) break;
    if (!commanded && rows.at(joint, kAge, row) > 0.0) continue;    // said again
    if (time_ns[row] - before_ns > longest_hole_ns(motion)) break;  // is reported below
    before_ns = time_ns[row];
    if (commanded) {
      const std::string why = not_led(rows, joint, row);
      if (!why.empty()) return wrong(why, before_ns, kMeasured);
    }
    const double position = rows.at(joint, kPosition, row);
    const double velocity = rows.at(joint, kVelocity, row);
    const double torque = rows.at(joint, kTorque, row);
    if (!std::isfinite(position)) {
      return wrong("has no position", before_ns,
                   commanded ? kMeasured
                             : "leave it out of `joints`, or play another stretch: "
                               "from_s and to_s");
    }
    if (request.torque && !std::isfinite(torque)) {
      return wrong("has no torque", before_ns, "play it without: torque = false");
    }
    track.time_ns.push_back(before_ns);
    track.position_rad.push_back(position);
    track.velocity_rad_s.push_back(velocity);
    if (request.torque) track.torque_Nm.push_back(torque);
    fast = fast && std::isfinite(velocity);
  }
  if (const Status s = check_end(file, track, motion, before_ns); !s)
    return std::unexpected(s.error());
  if (!fast) track.velocity_rad_s.clear();
  return track;
}

}  // namespace

const char* to_string(MotionSource source) noexcept {
  return source == MotionSource::kCommand ? "command" : "state";
}

Result<JointMotion> read_joint_motion(const LogFile& file, const MotionRequest& request) {
  if (const Status whole = file.require_samples(); !whole) return std::unexpected(whole.error());
  const auto order = order_of(file, request.joints);
  if (!order) return std::unexpected(order.error());
  JointMotion motion;
  motion.source = request.source.value_or(file.find(kCommand) != nullptr ? MotionSource::kCommand
                                                                         : MotionSource::kState);
  const bool commanded = motion.source == MotionSource::kCommand;
  if (commanded && file.find(kCommand) == nullptr) {
    return refuse(file, "the recording has no commands", kMeasured);
  }
  const auto topic = file.require(commanded ? kCommand : kState);
  if (!topic) return std::unexpected(topic.error());
  const auto stretch = stretch_of(file, **topic, request);
  if (!stretch) return std::unexpected(stretch.error());
  std::vector<std::string> fields{"position_rad", "velocity_rad_s", "torque_nm"};
  if (commanded) fields.insert(fields.end(), {"mode", "interaction"});
  if (!commanded) fields.emplace_back("age_cycles");
  const auto rows = Rows::read(file, (*topic)->name, fields, *order);
  if (!rows) return std::unexpected(rows.error());
  motion.begin_ns = stretch->begin_ns;
  motion.end_ns = stretch->end_ns;
  motion.period_ns = file.info().period_ns;
  for (std::size_t joint = 0; joint < request.joints.size(); ++joint) {
    auto track = track_of(file, *rows, joint, motion, request);
    if (!track) return std::unexpected(track.error());
    motion.tracks.push_back(std::move(*track));
  }
  // From sample to sample: only then are the cycles of a replay those of the recording.
  motion.begin_ns = motion.tracks.front().time_ns.front();
  motion.end_ns = motion.tracks.front().time_ns.back();
  for (const JointTrack& track : motion.tracks) {
    motion.begin_ns = std::min(motion.begin_ns, track.time_ns.front());
    motion.end_ns = std::max(motion.end_ns, track.time_ns.back());
  }
  return motion;
}

}  // namespace tandem::log
