#include "report/replay.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "base/toml_reader.hpp"
#include "log/joint_motion.hpp"
#include "report/figure.hpp"

namespace tandem::report {
namespace {

constexpr std::size_t kProbes = 40;
constexpr double kSame_rad = 1e-4;   // between two cycles of the run there is a line, not its cubic
constexpr double kAlike_rad = 1e-2;  // what a declared limit of acceleration may take away
constexpr double kNever = std::numeric_limits<double>::infinity();

/// What the run's experiment plays of this recording.
struct Played {
  log::MotionRequest request;
  double approach_s = 0.0, speed = 1.0;
};

std::optional<Played> played(const RunData& run, const RunData& recording) {
  for (const auto& [file, text] : run.info.configuration) {
    const auto document = TomlDocument::parse(text, file);
    if (!file.ends_with(".toml") || !document || !document->root().has("robot")) continue;
    TomlTable root = document->root();
    for (TomlTable& controller : root.tables("controller")) {
      const std::string plugin = controller.text_or("plugin", "");
      TomlTable parameters = controller.table_or_empty("parameters");
      if (std::filesystem::path(plugin).stem() != "recorded_motion" ||
          parameters.text_or("data_sha256", "") != recording.data_sha256) {
        continue;
      }
      Played found;
      found.speed = parameters.number_or("speed", 1.0, {log::kReplaySlowest, log::kReplayFastest});
      const std::string source = parameters.text_or("source", "");
      if (source == "command") found.request.source = log::MotionSource::kCommand;
      if (source == "state") found.request.source = log::MotionSource::kState;
      if (parameters.has("from_s")) found.request.from_s = parameters.number_or("from_s", 0.0);
      if (parameters.has("to_s")) found.request.to_s = parameters.number_or("to_s", 0.0);
      found.request.joints = parameters.texts_or("joints", run.info.joints);
      found.approach_s = parameters.number_or("approach_s", log::kReplayApproach_s);
      return found;
    }
  }
  return std::nullopt;
}

/// Whether the run's samples around a time are missing.
bool in_gap(const RunData& run, double time_s) {
  const auto after = std::ranges::upper_bound(run.time_s, time_s + 1e-9);
  if (after == run.time_s.begin() || after == run.time_s.end()) return false;
  return *after - *(after - 1) > kGapSteps * run.step_s && time_s - *(after - 1) > 1e-9;
}

/// A signal of a run at a time; NaN outside and in its gaps.
double value_at(const RunData& run, const std::vector<double>& values, double time_s) {
  const auto after = std::ranges::upper_bound(run.time_s, time_s + 1e-9);
  if (after == run.time_s.begin()) return std::numeric_limits<double>::quiet_NaN();
  const auto row = static_cast<std::size_t>(after - run.time_s.begin()) - 1;
  const double since = time_s - run.time_s[row];
  if (std::abs(since) < 1e-9) return values[row];
  if (row + 1 == run.rows() || in_gap(run, time_s)) return std::numeric_limits<double>::quiet_NaN();
  const double step = run.time_s[row + 1] - run.time_s[row];
  return values[row] + (values[row + 1] - values[row]) * since / step;
}

/// How far the run's references are from the motion at most; kNever where that is `least` or more,
/// or where the run ends before half of it.
double probe_distance(const RunData& run, const log::JointMotion& motion, const Replay& replay,
                      double least) {
  double most = 0.0;
  for (std::size_t k = 0; k < replay.joints.size(); ++k) {
    const log::JointTrack& track = motion.tracks[k];
    const std::size_t samples = track.time_ns.size();
    std::size_t compared = 0;
    for (std::size_t probe = 0; probe < kProbes; ++probe) {
      const std::size_t i = probe * (samples - 1) / (kProbes - 1);
      const double time_s = replay.run_time_s(static_cast<double>(track.time_ns[i]) * 1e-9);
      if (time_s > run.time_s.back()) break;  // it was ended before
      if (in_gap(run, time_s)) continue;
      const double off =
          value_at(run, run.reference_rad[replay.joints[k]], time_s) - track.position_rad[i];
      if (!(std::abs(off) < least)) return kNever;
      most = std::max(most, std::abs(off));
      ++compared;
    }
    if (compared < kProbes / 2) return kNever;
  }
  return most;
}

struct Distance {
  double rms = 0.0, max = 0.0;
  std::size_t samples = 0;
};

Distance distance_of(const RunData& run, const std::vector<double>& mine, const RunData& recording,
                     const std::vector<double>& theirs, const Replay& replay) {
  Distance found;
  for (std::size_t row = 0; row < recording.rows(); ++row) {
    const double time_s = recording.time_s[row];
    if (time_s < replay.from_s - 1e-9 || time_s > replay.to_s + 1e-9) continue;
    const double off = value_at(run, mine, replay.run_time_s(time_s)) - theirs[row];
    if (!std::isfinite(off)) continue;
    found.rms += off * off;
    found.max = std::max(found.max, std::abs(off));
    ++found.samples;
  }
  if (found.samples > 0) found.rms = std::sqrt(found.rms / static_cast<double>(found.samples));
  return found;
}

}  // namespace

Result<std::optional<Replay>> find_replay(const RunData& run, const RunData& recording) {
  const std::optional<Played> what = played(run, recording);
  if (!what) return std::nullopt;
  const auto file = log::LogFile::open(recording.path);
  if (!file) return std::unexpected(file.error());
  const auto motion = log::read_joint_motion(*file, what->request);
  if (!motion) return std::unexpected(motion.error());
  Replay replay;
  for (const std::string& joint : what->request.joints) {
    const auto at = std::ranges::find(run.info.joints, joint);
    if (at == run.info.joints.end()) return std::nullopt;
    replay.joints.push_back(static_cast<std::size_t>(at - run.info.joints.begin()));
  }
  replay.from_s = static_cast<double>(motion->begin_ns) * 1e-9;
  replay.to_s = static_cast<double>(motion->end_ns) * 1e-9;
  replay.speed = what->speed;
  const double period_s = static_cast<double>(run.info.period_ns) * 1e-9;
  const auto whole = [period_s](double time_s) { return std::ceil(time_s / period_s - 1e-6); };
  const double lead_s =
      (whole(what->approach_s) + std::round(log::kReplayRunUp_s / period_s)) * period_s;
  const auto begin_s = [&](std::int64_t cycle) {
    return run.time_s.front() + lead_s + static_cast<double>(cycle) * period_s;
  };
  double best = kAlike_rad;
  std::optional<Replay> found;
  for (std::int64_t cycle = 0; begin_s(cycle) < run.time_s.back(); ++cycle) {
    replay.begin_s = begin_s(cycle);
    const double off = probe_distance(run, *motion, replay, best);
    if (off < best) {
      best = off;
      found = replay;
    } else if (best < kSame_rad) {
      break;
    }
  }
  return found;
}

PageTable replay_table(const RunData& run, const RunData& recording, const Replay& replay) {
  PageTable table{"Replay",
                  "Replay minus recording at the same place of the motion: measured position, and "
                  "reference. The largest first.",
                  {"joint", "rms", "max", "max of the reference"},
                  {}};
  struct Line {
    std::size_t joint;
    Distance measured, reference;
  };
  std::vector<Line> lines;
  for (const std::size_t joint : replay.joints) {
    lines.push_back({joint,
                     distance_of(run, run.position_rad[joint], recording,
                                 recording.position_rad[joint], replay),
                     distance_of(run, run.reference_rad[joint], recording,
                                 recording.reference_rad[joint], replay)});
  }
  std::ranges::stable_sort(lines, std::ranges::greater{},
                           [](const Line& line) { return line.measured.rms; });
  for (const Line& line : lines) {
    const bool slides = run.slides(line.joint);
    const double factor = slides ? 1e3 : kDegrees;
    const char* const unit = slides ? "mm" : "deg";
    const auto text = [&](const Distance& one, double value) {
      return one.samples == 0 ? std::string("unknown")
                              : fmt::format("{:.4f} {}", factor * value, unit);
    };
    table.rows.push_back({run.info.joints[line.joint], text(line.measured, line.measured.rms),
                          text(line.measured, line.measured.max),
                          text(line.reference, line.reference.max)});
  }
  return table;
}

}  // namespace tandem::report
