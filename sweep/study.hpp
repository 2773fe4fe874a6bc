// A study: an experiment, which of its values vary, and how. Its points are independent runs.
// Layer: sweep.  Thread: any.
#pragma once

#include <cstdint>
#include <expected>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/toml_setting.hpp"
#include "sweep/sampling.hpp"

namespace tandem::sweep {

/// A [[vary]]: a key of the experiment, and what it is set to.
struct Vary {
  std::string key;                  ///< as of `--set`
  std::vector<std::string> values;  ///< in TOML; empty: it is distributed
  const Distribution* distribution = nullptr;
  double a = 0.0, b = 0.0;  ///< of the distribution

  /// The value at 0 < u < 1, in TOML. Numbers have nine digits: they can be typed.
  [[nodiscard]] std::string at(double u) const;
};

/// A [[variant]]: settings of one side of a comparison, such as a controller.
struct Variant {
  std::string name;
  std::vector<TomlSetting> settings;
};

/// [keep]: which logs stay.
struct Keep {
  double logs_MB = 0.0;      ///< budget; 0: no logs
  std::uint64_t sample = 0;  ///< that passed, in their order; the others are of failures
};

struct Study {
  std::string file, text;
  std::string experiment;                           ///< resolved against the study's folder
  std::vector<std::optional<std::uint64_t>> seeds;  ///< one of none: the experiment's own
  std::vector<TomlSetting> settings;                ///< of every point
  std::vector<Vary> vary;
  std::vector<Variant> variants;  ///< empty: nothing is compared
  const Method* method = nullptr;
  std::uint64_t points = 0;    ///< of the method; of a grid its combinations
  std::uint64_t seed = 1;      ///< of the method
  double time_limit_s = 60.0;  ///< of a point, on the wall clock
  Keep keep;

  /// All that its points are made of, but for the experiment: neither comments nor what is kept.
  [[nodiscard]] std::string meaning() const;
};

/// Points that a study has at most.
inline constexpr std::uint64_t kMostPoints = 10'000'000;

/// Reads a study.toml. Errors, all at once, with line and key: those of its keys; a distribution in
/// a grid; a place that varies and is set twice, by whatever keys; more than kMostPoints.
[[nodiscard]] std::expected<Study, Diagnostics> read_study(const std::string& file);

/// One run.
struct Point {
  std::uint64_t index = 0;   ///< in the order of the study
  std::uint64_t sample = 0;  ///< those of a sample differ in seed and variant alone
  std::size_t variant = 0;   ///< 0 without any
  std::optional<std::uint64_t> seed;
  std::vector<std::string> values;    ///< of the study's `vary`, in TOML
  std::vector<TomlSetting> settings;  ///< all of them
  /// By what it sets: 16 digits of the SHA-256 of its keys, values and seed.
  std::string name;

  /// `tandem run EXPERIMENT --set … --seed …`, for a shell.
  [[nodiscard]] std::string command(const std::string& experiment) const;
};

/// The points of a study, by their numbers: variants vary fastest, then seeds.
class Points {
 public:
  /// @param study  outlives it
  explicit Points(const Study& study);
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const Study& study() const { return study_; }
  /// @pre index < size()
  [[nodiscard]] Point at(std::uint64_t index) const;

 private:
  const Study& study_;
  std::uint64_t size_;
  std::vector<double> unit_;  // coordinates; empty of a grid
};

}  // namespace tandem::sweep
