// The sources of a robot's kernel library.
// Layer: model.  Thread: non-RT.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/dynamics.hpp"
#include "model/expression.hpp"

namespace tandem::model {

/// SHA-256, in hex, of everything that the kernels of this robot are made from: the tree, the
/// specification and the generator's version. Layout and comments of the files do not count.
[[nodiscard]] std::string description_hash(const Tree& tree, const ModelSpec& spec);

/// One file of the library's sources.
struct SourceFile {
  std::string name;
  std::string text;
  bool per_variant = false;  ///< compiled once for each variant, with TANDEM_VARIANT defined
  bool light = false;        ///< straight-line code, for which few optimisations are enough
};

/// Operations of one kernel.
struct KernelCount {
  std::string kernel;
  OperationCount count;
};

/// What the library is made of. The same input gives the same text.
struct GeneratedKernels {
  std::string robot;
  std::string hash;                 ///< description_hash()
  std::vector<SourceFile> headers;  ///< included, not compiled
  std::vector<SourceFile> sources;
  std::vector<KernelCount> counts;  ///< in the order of model/kernels.h
};

/// Errors: those of make_mechanism().
[[nodiscard]] Result<GeneratedKernels> generate_kernels(const Tree& tree, const ModelSpec& spec);

/// Operations of one kernel, without writing it. Errors: those of make_mechanism().
[[nodiscard]] Result<OperationCount> count_kernel(Kernel kernel, const Tree& tree,
                                                  const ModelSpec& spec);

}  // namespace tandem::model
