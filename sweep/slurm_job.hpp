// A sweep as arrays of jobs of Slurm: how its points are divided, the script, what was submitted.
// Layer: sweep.  Thread: any.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "sweep/results.hpp"

namespace tandem::sweep {

/// What was submitted of a sweep: `slurm.json` of its folder.
struct SlurmJob {
  std::string directory;           ///< in which the study was named
  std::string study;               ///< as it was named
  std::uint64_t chunk_points = 1;  ///< of each element of the arrays
  /// An array, whose element i computes chunk `offset` + i.
  struct Array {
    std::uint64_t id = 0, offset = 0;
  };
  std::vector<Array> arrays{};
};

/// None: nothing was submitted. Errors: the file cannot be read.
[[nodiscard]] Result<std::optional<SlurmJob>> slurm_job_in(const std::string& folder);
/// Errors: the file cannot be written.
[[nodiscard]] Status write_slurm_job(const std::string& folder, const SlurmJob& job);

/// How many chunks there are. @pre size > 0
[[nodiscard]] constexpr std::uint64_t chunks_of(std::uint64_t points, std::uint64_t size) {
  return (points + size - 1) / size;
}
/// @pre number < chunks_of(points, size)
[[nodiscard]] constexpr Chunk chunk_of(std::uint64_t number, std::uint64_t size,
                                       std::uint64_t points) {
  const std::uint64_t first = number * size;
  return {.number = number, .first = first, .end = size < points - first ? first + size : points};
}
/// Points of a chunk where nobody says how many: about a hundred chunks, of a thousand at most.
[[nodiscard]] std::uint64_t usual_chunk_points(std::uint64_t points);

/// Elements of one submission.
struct ArrayOfChunks {
  std::uint64_t offset = 0;
  std::vector<std::uint64_t> indices;  ///< rising
  /// "0-17,20", for --array.
  [[nodiscard]] std::string list() const;
};
/// MaxArraySize limits the index, not the count of elements, so that each array begins at 0.
/// @param chunks  rising  @pre max_array_size > 0
[[nodiscard]] std::vector<ArrayOfChunks> arrays_of(const std::vector<std::uint64_t>& chunks,
                                                   std::uint64_t max_array_size);

/// What the script of a job is made of.
struct SlurmScript {
  SlurmJob job;
  std::string program;  ///< of tandem
  std::string folder;   ///< of the sweep; absolute, as `program`
  std::size_t cpus = 1;
  double time_limit_s = 60.0;        ///< of a point
  std::vector<std::string> options;  ///< of sbatch, without dashes: "partition=long"
  double most_minutes =
      std::numeric_limits<double>::infinity();  ///< that the partition gives a job

  /// What a chunk takes at most, if each of its points takes as long as it may.
  [[nodiscard]] double needed_minutes() const;

  /// For bash, to be submitted with an array's offset as its argument.
  [[nodiscard]] std::string text() const;
};

}  // namespace tandem::sweep
