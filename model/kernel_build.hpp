// A robot's kernel library: generated, compiled and linked, as far as it is not up to date.
// Layer: model.  Thread: non-RT; starts compilers as child processes.
#pragma once

#include <functional>
#include <string>

#include "base/result.hpp"
#include "model/generate.hpp"

namespace tandem::model {

struct BuildOptions {
  std::string library;   ///< path of the shared library to make
  std::string compiler;  ///< empty: the one that built this program, else c++
  int jobs = 0;          ///< compilers at a time; 0: one per core
  bool force = false;    ///< compile every file again
  /// Called from the caller's thread as files are done: how many of how many, and which.
  std::function<void(int done, int total, const std::string& file)> progress;
  /// Called once when another process builds this library: its end is awaited.
  std::function<void()> waiting;
};

struct BuildReport {
  std::string library;
  std::string hash;             ///< description_hash()
  bool was_up_to_date = false;  ///< nothing was compiled
  int compiled = 0;             ///< files
  double seconds = 0.0;         ///< wall time of compiling and linking
  std::vector<KernelCount> counts;
};

/// Where a robot's library stands when nothing else is said: DIRECTORY/ROBOT_kernels.so.
[[nodiscard]] std::string library_path(const std::string& directory, const std::string& robot);

/// Makes the library. Sources and objects are kept in LIBRARY.build/; a file is compiled again
/// only if its text, the headers or the command changed. Of several processes that make one
/// library, one compiles and the others wait for it. Compiler flags do not depend on how
/// this program was built, so that a run's bits do not either.
///
/// What was linked is checked by check_kernels() before it takes its place.
///
/// Errors: those of generate_kernels(); no compiler; a file that does not compile (its log's
/// path and first lines); a kernel that does not compute what the description says; a folder that
/// cannot be written or locked.
[[nodiscard]] Result<BuildReport> build_kernels(const Tree& tree, const ModelSpec& spec,
                                                const BuildOptions& options);

}  // namespace tandem::model
