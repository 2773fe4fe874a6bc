#include "apps/tools/log_thresholds.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "apps/text/console.hpp"
#include "apps/tools/carried_settings.hpp"
#include "apps/tools/log_alarms.hpp"
#include "apps/tools/log_torques.hpp"
#include "apps/tools/opened_log.hpp"
#include "base/counted.hpp"
#include "base/quoting.hpp"
#include "estimation/collision.hpp"
#include "estimation/config.hpp"

namespace tandem::apps {
namespace {

constexpr double kBlock_s = 0.5;
constexpr std::size_t kLeastBlocks = 16;
constexpr std::size_t kFewRuns = 3;  // of fewer the rate is a guess

/// The largest magnitudes of a joint's torque in free motion, block by block; the last part of a
/// block is left out.
std::vector<double> largest_of(const ExternalTorques& run, std::size_t joint) {
  std::vector<double> largest;
  if (run.time_s.empty()) return largest;
  double begin = run.time_s.front(), most = 0.0;
  for (std::size_t i = 0; i < run.free_rows(); ++i) {
    if (run.time_s[i] - begin >= kBlock_s) {
      largest.push_back(most);
      most = 0.0;
      begin = run.time_s[i];
    }
    most = std::max(most, std::abs(run.torque_Nm[joint][i]));
  }
  return largest;
}

/// What thresholds belong to: all logs have to have it in common.
struct Origin {
  std::string path;  ///< the first log's
  std::string robot;
  std::string description_hash;       ///< empty: not known
  std::vector<std::string> channels;  ///< felt_channels()
  std::optional<double> bandwidth_Hz;
};

Origin origin_of(const log::LogFile& file) {
  Origin origin{.path = file.path(),
                .robot = file.info().robot,
                .description_hash = file.info().description_hash,
                .channels = felt_channels(file),
                .bandwidth_Hz = {}};
  const std::optional<TomlDocument> experiment = experiment_of(file.info());
  if (!experiment) return origin;
  TomlTable estimation = experiment->root().table_or_empty("estimation");
  if (!estimation.has("observer")) return origin;
  origin.bandwidth_Hz = estimation.table_or_empty("observer")
                            .number_or("bandwidth_Hz", estimation::ObserverConfig().bandwidth_Hz);
  return origin;
}

/// An error when the logs' thresholds would be of different things.
Status check_same(const Origin& first, const Origin& other) {
  const auto refused = [&](const std::string& what, const std::string& value,
                           const std::string& than, const std::string& hint) -> Status {
    return std::unexpected(
        Error{fmt::format("{}: {} here, {} in {}", what, value, than, first.path),
              hint,
              other.path,
              0,
              {}});
  };
  if (first.channels != other.channels) {
    const auto text = [](const Origin& one) {
      return fmt::format("{} with {}", one.robot, counted(one.channels.size(), "torque"));
    };
    return refused("the logs are of different robots", text(other), text(first),
                   "thresholds are one robot's: give logs of one");
  }
  if (!first.description_hash.empty() && !other.description_hash.empty() &&
      first.description_hash != other.description_hash) {
    const auto text = [](const Origin& one) {
      return fmt::format("{} {:.16}…", one.robot, one.description_hash);
    };
    return refused("the logs are of different descriptions", text(other), text(first),
                   "external torques depend on the description: record all runs with one");
  }
  if (first.bandwidth_Hz && other.bandwidth_Hz && *first.bandwidth_Hz != *other.bandwidth_Hz) {
    const auto text = [](const Origin& one) { return fmt::format("{} Hz", *one.bandwidth_Hz); };
    return refused("[estimation.observer] bandwidth_Hz differs", text(other), text(first),
                   "thresholds belong to a bandwidth: record all runs with the one that the "
                   "thresholds are for");
  }
  return {};
}

/// All runs to learn from, or to try the thresholds on.
/// @param origin  the first log's, if it is not known yet
Result<std::vector<NamedTorques>> read_all(const std::vector<std::string>& paths, double from_s,
                                           std::optional<Origin>& origin) {
  std::vector<NamedTorques> all;
  std::map<std::string, std::string> seen;  // data's digest -> path
  for (const std::string& path : paths) {
    const Result<log::LogFile> file = opened_log(path);
    if (!file) return std::unexpected(file.error());
    const auto [twin, is_new] = seen.emplace(file->data_sha256(), path);
    if (!is_new) return std::unexpected(log::same_data(path, twin->second));
    if (!origin) origin = origin_of(*file);
    if (const Status same = check_same(*origin, origin_of(*file)); !same)
      return std::unexpected(same.error());
    Result<ExternalTorques> torques = read_external_torques(*file, from_s);
    if (!torques) return std::unexpected(torques.error());
    all.push_back({path, std::move(*torques)});
  }
  return all;
}

/// By joint, in the order of the logs. Rounded up: a threshold of 0, where nothing was ever felt,
/// would be one of noise.
Result<std::vector<double>> learn(const std::vector<NamedTorques>& runs, std::size_t joints,
                                  double alarms_per_hour) {
  std::vector<double> thresholds;
  const double share = alarms_per_hour / static_cast<double>(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    std::vector<std::vector<double>> largest;
    for (const NamedTorques& run : runs) {
      largest.push_back(largest_of(run.torques, j));
      if (largest.back().size() >= kLeastBlocks) continue;
      return std::unexpected(
          Error{"there are less than 8 s of external torques to learn from",
                "record a longer run without faults and pushes, or choose an earlier --from",
                run.path,
                0,
                {}});
    }
    const double learned = estimation::learn_threshold(largest, kBlock_s, share);
    thresholds.push_back(std::ceil(1e3 * std::max(1e-3, learned)) * 1e-3);
  }
  return thresholds;
}

void print_learned(const std::vector<NamedTorques>& runs, const std::vector<std::string>& joints,
                   const std::vector<double>& thresholds, const LogOptions& options) {
  std::FILE* out = human_output(options.json);
  for (const NamedTorques& run : runs) {
    const std::size_t rows = run.torques.free_rows();
    fmt::print(out, "# {} s of {}\n",
               std::round(run.torques.time_s[rows - 1] - run.torques.time_s.front()),
               shown(run.path, 4'096));
  }
  fmt::print(out, "# {} false alarms an hour at most\n", options.alarms_per_hour);
  if (runs.size() < kFewRuns) {
    fmt::print(out,
               "# Runs differ, as a joint sticks in one and slips in another: give {} or more.\n",
               kFewRuns);
  }
  fmt::print(out, "[estimation.collision.threshold_Nm]\n");
  for (std::size_t j = 0; j < joints.size(); ++j)
    fmt::print(out, "{} = {:.3f}\n", quoted_text(joints[j]), thresholds[j]);
}

}  // namespace

Status print_thresholds(const LogOptions& options) {
  std::optional<Origin> origin;
  const auto runs = read_all(options.files, options.from_s, origin);
  if (!runs) return std::unexpected(runs.error());
  const std::vector<std::string> joints = origin ? origin->channels : std::vector<std::string>();
  const auto thresholds = learn(*runs, joints.size(), options.alarms_per_hour);
  if (!thresholds) return std::unexpected(thresholds.error());
  const auto others = read_all(options.against, options.from_s, origin);
  if (!others) return std::unexpected(others.error());
  const AlarmTable table = alarm_table(*others, *thresholds);
  Result<std::string> page = std::string();
  if (!options.output.empty()) page = write_alarm_page(table, options.output);
  if (!page) return std::unexpected(page.error());
  print_learned(*runs, joints, *thresholds, options);
  Json json{{"alarms_per_hour", options.alarms_per_hour}, {"threshold_Nm", Json::object()}};
  for (std::size_t j = 0; j < joints.size(); ++j)
    json["threshold_Nm"][joints[j]] = (*thresholds)[j];
  if (!others->empty()) {
    print_alarms(table, human_output(options.json));
    json["against"] = alarms_json(table);
  }
  if (!page->empty()) fmt::print(human_output(options.json), "# {}\n", shown(*page, 4'096));
  return write_json(options.json, json);
}

}  // namespace tandem::apps
