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
          "one joint of the ring must not follow another");
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

/// Narrows one leader's range and speed to those of one follower. Limits of a follower that leave
/// the leader no way contradict the multiplier or the offset, a widespread error of grippers'
/// descriptions: they are not used.
class Narrowing {
 public:
  Narrowing(Joint& leader, Joint& follower, const std::string& file)
      : leader_(leader), follower_(follower), file_(file) {}

  void run(Diagnostics& warnings) {
    narrow_range(warnings);
    const double speed = follower_.velocity / std::abs(follower_.multiplier);
    if (!(speed < leader_.velocity)) return;  // or one of the two is not given
    leader_.velocity = speed;
    warnings.push_back(report("its speed is lowered to " + std::to_string(speed) +
                                  ", at which its follower '" + follower_.name + "' keeps its own",
                              {}));
  }

 private:
  void narrow_range(Diagnostics& warnings) {
    constexpr double kNoWay = 1e-3;  // of what the narrower of the two has by itself
    if (!follower_.has_limits()) return;
    const Travel range = follower_.leaders_range();
    // fmax() and fmin() take the follower's where the leader has none.
    const double lower = std::fmax(leader_.lower, range.lower);
    const double upper = std::fmin(leader_.upper, range.upper);
    const double whole = leader_.has_limits()
                             ? std::min(range.upper - range.lower, leader_.upper - leader_.lower)
                             : range.upper - range.lower;
    if (!(upper - lower > kNoWay * whole)) return drop_limits(warnings);
    const bool narrower = leader_.lower != lower || leader_.upper != upper;
    leader_.lower = lower;
    leader_.upper = upper;
    if (leader_.type == JointType::kContinuous) leader_.type = JointType::kRevolute;
    if (!narrower) return;
    warnings.push_back(report("its range is narrowed to " + range_text(lower, upper) +
                                  ", in which its follower '" + follower_.name + "' keeps its own",
                              {}));
  }

  void drop_limits(Diagnostics& warnings) {
    const double a = follower_.multiplier * leader_.lower + follower_.offset;
    const double b = follower_.multiplier * leader_.upper + follower_.offset;
    warnings.push_back({"its limits, " + range_text(follower_.lower, follower_.upper) +
                            ", contradict its <mimic>: joint '" + leader_.name + "' at " +
                            range_text(leader_.lower, leader_.upper) + " takes it to " +
                            range_text(std::min(a, b), std::max(a, b)) +
                            ", and so they are not used",
                        "correct the multiplier, the offset or the limits", file_, follower_.line,
                        "joint " + follower_.name});
    follower_.lower = follower_.upper = kNoLimit;
  }

  Error report(std::string message, std::string hint) const {
    return {std::move(message), std::move(hint), file_, leader_.line, "joint " + leader_.name};
  }

  Joint& leader_;
  Joint& follower_;
  const std::string& file_;
};

}  // namespace

Mimics resolve_mimics(const Outline& outline, const UrdfOptions& options, const std::string& file,
                      Diagnostics& errors) {
  if (options.mimic_independent) return {{}, options.lock};
  return Resolver(outline, options, file, errors).run(outline);
}

void apply_mimics(const Mimics& mimics, Tree& tree, Diagnostics& warnings) {
  for (Joint& joint : tree.joints) {
    const auto found = mimics.followers.find(joint.name);
    if (found == mimics.followers.end()) continue;
    joint.leader = tree.joint_index(found->second.leader);
    joint.multiplier = found->second.multiplier;
    joint.offset = found->second.offset;
    Joint& leader = tree.joints[static_cast<std::size_t>(joint.leader)];
    Narrowing(leader, joint, tree.file).run(warnings);
  }
}

}  // namespace tandem::model
