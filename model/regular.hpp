// Whether the dynamics of a robot can be solved: its mass matrix must not be singular.
// Layer: model.  Thread: non-RT.
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "model/model_spec.hpp"
#include "model/tree.hpp"

namespace tandem::model {

/// A state to look at, beside those that check_regular() chooses itself.
struct NamedPosition {
  std::string name;              ///< "in posture home"
  std::vector<double> position;  ///< by joint of the tree [rad or m]
};

/// Evaluates the mass matrix, rotors included, with every joint at 0 or the limit next to it, in
/// `positions` and in four states drawn within the joints' limits, always the same ones.
///
/// Errors: the tree has no moving joint; make_mechanism()'s; a mass matrix that, scaled to ones on
/// its diagonal, has an eigenvalue below 1e-10: it names the joints that share a mass or move
/// none, with the line of the first.
[[nodiscard]] Status check_regular(const Tree& tree, const ModelSpec& spec,
                                   const std::vector<NamedPosition>& positions);

}  // namespace tandem::model
