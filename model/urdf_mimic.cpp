// Follows chains of <mimic> to their leader, composing multiplier and offset, and narrows the
// leader's limits to its followers'.
#include "model/urdf_mimic.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

namespace tandem::model {
namespace {

class Resolver {
 public:
  Resolver(const Outline& outline, const UrdfOptions& options, const std::string& file,
           Diagnostics& errors)
      : file_(file), errors_(errors) {
    mimics_.still = options.lock;
    for (const auto& [name, position] : options.lock) still_.emplace(name, position);
    for (const OutlineJoint& joint : outline.joints) {
      joints_.emplace(joint.name, &joint);
      if (joint.type == "fixed") still_.emplace(joint.name, 0.0);
    }
  }

  Mimics run(const Outline& outline) {
    for (const OutlineJoint& joint : outline.joints)
      if (!joint.mimic.empty() && !still_.contains(joint.name)) resolve(joint);
    return std::move(mimics_);
  }

 private:
  void error(const OutlineJoint& joint, std::string message, std::string hint) {
    errors_.push_back(
        {std::move(message), std::move(hint), file_, joint.line, "joint " + joint.name});
  }

  /// Walks the chain of mimics to the joint that follows nobody.
  void resolve(const OutlineJoint& first) {
    Following result{first.name, 1.0, 0.0};
    std::set<std::string> passed;
    for (const OutlineJoint* at = &first; !at->mimic.empty() && !stands(*at, first);) {
      if (!passed.insert(at->name).second) return report_ring(first, at->name);
      result.offset += result.multiplier * at->mimic_offset;
      result.multiplier *= at->mimic_multiplier;
      result.leader = at->mimic;
      at = joints_.at(at->mimic);
    }
    if (!std::isfinite(result.multiplier) || !std::isfinite(result.offset)) {
      return error(first, "the multipliers and offsets of what it mimics are too large together",
                   "correct them");
    }
    const auto still = still_.find(result.leader);
    if (still != still_.end() || result.multiplier == 0.0) {
      const double leader = still == still_.end() ? 0.0 : still->second;
      mimics_.still.emplace_back(first.name, result.multiplier * leader + result.offset);
    } else {
      mimics_.followers.emplace(first.name, std::move(result));
    }
  }

  bool stands(const OutlineJoint& joint, const OutlineJoint& first) const {
    return &joint != &first && still_.contains(joint.name);
  }

  void report_ring(const OutlineJoint& joint, const std::string& again) {
    if (again != joint.name) return;  // it leads into a ring: those that make it are reported
    if (joint.mimic == joint.name) return error(joint, "mimics itself", "name another joint");
    error(joint, "mimics joint '" + joint.mimic + "', and in the end itself",
          "one joint of the ring must follow nobody");
  }

  const std::string& file_;
  Diagnostics& errors_;
  Mimics mimics_;
  std::map<std::string, const OutlineJoint*> joints_;
  std::map<std::string, double> still_;  // fixed and locked joints: their position
};

std::string range_text(double lower, double upper) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6g to %.6g", lower, upper);
  return text;
}

/// Narrows one leader's range and speed to those of one follower.
class Narrowing {
 public:
  Narrowing(Joint& leader, const Joint& follower, const std::string& file)
      : leader_(leader), follower_(follower), file_(file) {}

  void run(Diagnostics& errors, Diagnostics& warnings) {
    const double lower = leader_.lower;
    const double upper = leader_.upper;
    narrow_range(follower_.leaders_range());
    if (leader_.lower > leader_.upper) {
      errors.push_back(report("no position of it keeps its follower '" + follower_.name +
                                  "' within " + range_text(follower_.lower, follower_.upper),
                              "correct the multiplier, the offset or the limits"));
    } else if (follower_.has_limits() && (leader_.lower != lower || leader_.upper != upper)) {
      warnings.push_back(
          report("its range is narrowed to " + range_text(leader_.lower, leader_.upper) +
                     ", in which its follower '" + follower_.name + "' keeps its own",
                 {}));
    }
    const double speed = follower_.velocity / std::abs(follower_.multiplier);
    if (!(speed < leader_.velocity)) return;  // or one of the two is not given
    leader_.velocity = speed;
    warnings.push_back(report("its speed is lowered to " + std::to_string(speed) +
                                  ", at which its follower '" + follower_.name + "' keeps its own",
                              {}));
  }

 private:
  void narrow_range(const Range& range) {
    if (!follower_.has_limits()) return;
    const bool open = !leader_.has_limits();
    leader_.lower = open ? range.lower : std::max(leader_.lower, range.lower);
    leader_.upper = open ? range.upper : std::min(leader_.upper, range.upper);
    if (leader_.type == JointType::kContinuous) leader_.type = JointType::kRevolute;
  }
  Error report(std::string message, std::string hint) const {
    return {std::move(message), std::move(hint), file_, leader_.line, "joint " + leader_.name};
  }

  Joint& leader_;
  const Joint& follower_;
  const std::string& file_;
};

}  // namespace

Mimics resolve_mimics(const Outline& outline, const UrdfOptions& options, const std::string& file,
                      Diagnostics& errors) {
  if (options.mimic_independent) return {{}, options.lock};
  return Resolver(outline, options, file, errors).run(outline);
}

void apply_mimics(const Mimics& mimics, Tree& tree, Diagnostics& errors, Diagnostics& warnings) {
  for (Joint& joint : tree.joints) {
    const auto found = mimics.followers.find(joint.name);
    if (found == mimics.followers.end()) continue;
    joint.leader = tree.joint_index(found->second.leader);
    joint.multiplier = found->second.multiplier;
    joint.offset = found->second.offset;
    Joint& leader = tree.joints[static_cast<std::size_t>(joint.leader)];
    Narrowing(leader, joint, tree.file).run(errors, warnings);
  }
}

}  // namespace tandem::model
