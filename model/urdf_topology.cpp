// Links and joints form one tree: one root, at most one parent per link, no ring.
#include <algorithm>
#include <map>

#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {
namespace {

class Topology {
 public:
  Topology(Outline& outline, const std::string& file) : outline_(outline), file_(file) {}

  void run() {
    for (const OutlineJoint& joint : outline_.joints) check_ends(joint);
    if (outline_.incomplete) return;  // what follows would only repeat it
    for (const OutlineJoint& joint : outline_.joints) add(joint);
    if (outline_.incomplete) return;
    check_roots();
    check_loops();
    if (outline_.incomplete) return;
    for (const OutlineJoint& joint : outline_.joints) {
      if (joint.type == "floating" && free_base(joint)) return take_out(joint);
    }
  }

 private:
  void error(int line, std::string key, std::string message, std::string hint) {
    outline_.incomplete = true;
    outline_.errors.push_back({std::move(message), std::move(hint), file_, line, std::move(key)});
  }

  void check_ends(const OutlineJoint& joint) {
    const std::string key = "joint " + joint.name;
    for (const auto& [role, link] :
         {std::pair("parent", joint.parent), std::pair("child", joint.child)}) {
      if (link.empty() || outline_.link_lines.contains(link)) continue;
      error(joint.line, key, std::string("there is no link '") + link + "', its " + role,
            suggest(link, names(outline_.link_lines)));
    }
    if (joint.mimic.empty() || outline_.joint_lines.contains(joint.mimic)) return;
    error(joint.line, key, "there is no joint '" + joint.mimic + "' to mimic",
          suggest(joint.mimic, names(outline_.joint_lines)));
  }

  static std::vector<std::string> names(const std::map<std::string, int>& lines) {
    std::vector<std::string> found;
    for (const auto& [name, line] : lines) found.push_back(name);
    return found;
  }

  void add(const OutlineJoint& joint) {
    const auto [at, fresh] = leads_to_.emplace(joint.child, &joint);
    if (fresh) return;
    error(joint.line, "link " + joint.child,
          "has two parents, by the joints '" + at->second->name + "' and '" + joint.name +
              "': the description has a loop",
          "remove one of the joints, and close the loop by a [[loop]] in robot.toml");
  }

  void check_roots() {
    const OutlineLink* root = nullptr;
    for (const OutlineLink& link : outline_.links) {
      if (leads_to_.contains(link.name)) continue;
      if (root != nullptr) {
        error(link.line, "link " + link.name,
              "no joint leads to it, nor to '" + root->name + "': the robot has two roots",
              "connect it by a joint or remove it");
      } else {
        root = &link;
      }
    }
  }

  /// Every link has at most one parent by now, so a link from which no root is reached hangs on
  /// a ring.
  void check_loops() {
    std::map<std::string, int> seen_by;  // link -> the walk (from 1) that first met it
    int walk = 0;
    for (const OutlineLink& link : outline_.links) {
      ++walk;
      std::string at = link.name;
      while (seen_by.emplace(at, walk).second && leads_to_.contains(at)) {
        at = leads_to_.at(at)->parent;
      }
      if (seen_by.at(at) != walk || !leads_to_.contains(at)) continue;
      report_loop(at);
    }
  }

  void report_loop(const std::string& start) {
    std::string ring = start;
    std::string at = start;
    int shown = 0;
    do {
      at = leads_to_.at(at)->parent;
      if (++shown <= 8) ring += " <- " + at;
    } while (at != start);
    const OutlineJoint& joint = *leads_to_.at(start);
    error(joint.line, "joint " + joint.name, "the links make a loop: " + ring,
          "every link must hang on one root");
  }

  /// Whether the joint leads from a root that is nothing else to the base; if not, an error.
  bool free_base(const OutlineJoint& joint) {
    const std::string key = "joint " + joint.name;
    const auto root = std::ranges::find(outline_.links, joint.parent, &OutlineLink::name);
    const std::string what =
        "a joint of type 'floating' is understood only from a root without "
        "mass to the robot's base, ";
    if (leads_to_.contains(joint.parent)) {
      error(
          joint.line, key, what + "and '" + joint.parent + "' is not the root",
          "make it fixed, or describe what it carries as a robot of its own; `tandem new --lock " +
              shell_word(joint.name) + "` does the one, `--drop` leaves out what it carries");
      return false;
    }
    if (std::ranges::count(outline_.joints, joint.parent, &OutlineJoint::parent) > 1) {
      error(joint.line, key, what + "and other joints leave '" + joint.parent + "', too",
            "let them start at '" + joint.child + "', or remove them");
      return false;
    }
    if (root->mass_kg != 0.0) {
      error(joint.line, key, what + "and '" + joint.parent + "' has mass",
            "remove its <inertial>, or remove the link and the joint");
      return false;
    }
    return true;
  }

  void take_out(const OutlineJoint& joint) {
    const std::string root = joint.parent;
    outline_.floating_joint = joint.name;
    outline_.floating_line = joint.line;
    outline_.link_lines.erase(root);
    outline_.joint_lines.erase(outline_.floating_joint);
    std::erase_if(outline_.links, [&](const OutlineLink& link) { return link.name == root; });
    std::erase_if(outline_.joints, [&](const OutlineJoint& one) { return one.parent == root; });
  }

  Outline& outline_;
  const std::string& file_;
  std::map<std::string, const OutlineJoint*> leads_to_;  // child link -> its joint
};

}  // namespace

void check_topology(Outline& outline, const std::string& file) { Topology(outline, file).run(); }

}  // namespace tandem::model
