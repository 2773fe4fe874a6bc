// Chains and hands of the tree's limbs, and links that are neighbours.
#include <algorithm>
#include <set>

#include "scaffold/feet.hpp"
#include "scaffold/limbs.hpp"
#include "scaffold/moveit.hpp"
#include "scaffold/posture.hpp"

namespace tandem::scaffold {
namespace {

using model::Link;
using model::Tree;

std::vector<int> joints_at(const Tree& tree, int body) {
  std::vector<int> joints;
  for (std::size_t j = 0; j < tree.joints.size(); ++j)
    if (tree.joints[j].parent == body) joints.push_back(static_cast<int>(j));
  return joints;
}

/// The link that moving joint `joint` leads to.
const Link& child_of(const Tree& tree, int joint) {
  return *std::ranges::find(tree.links, joint, &Link::moving);
}

const std::string& parent_of(const Tree& tree, int joint) {
  return tree.links[static_cast<std::size_t>(child_of(tree, joint).parent)].name;
}

/// Whether `link` is `above`, or hangs on it.
bool hangs_on(const Tree& tree, int link, int above) {
  while (link >= 0 && link != above) link = tree.links[static_cast<std::size_t>(link)].parent;
  return link == above;
}

/// Down from the link to which the last joint leads, along fixed links, to where they branch.
int end_of_fixed_links(const Tree& tree, int link) {
  for (;;) {
    int next = -1, count = 0;
    for (std::size_t l = 0; l < tree.links.size(); ++l) {
      if (tree.links[l].parent != link) continue;
      ++count;
      if (tree.links[l].moving < 0) next = static_cast<int>(l);
    }
    if (count != 1 || next < 0) return link;
    link = next;
  }
}

/// @param on  a link that the chain has to pass; -1: none
std::string tip_of(const Tree& tree, const std::vector<hal::SiteConfig>& sites, int last, int on) {
  const int first = tree.child_link_index(tree.joints[static_cast<std::size_t>(last)].name);
  for (const hal::SiteConfig& site : sites) {
    const int link = tree.link_index(site.link);
    if (link < 0 || tree.links[static_cast<std::size_t>(link)].body != last + 1) continue;
    if (on < 0 || hangs_on(tree, link, on)) return site.link;
  }
  const int tip = on >= 0 ? on : end_of_fixed_links(tree, first);
  return tree.links[static_cast<std::size_t>(tip)].name;
}

/// The limb's joints that follow each other from its first one on, without a branch.
std::vector<int> chain_of(const Tree& tree, const std::set<int>& limb, int first) {
  std::vector<int> chain{first};
  for (;;) {
    const std::vector<int> next = joints_at(tree, chain.back() + 1);
    if (next.size() != 1 || !limb.contains(next[0])) return chain;
    chain.push_back(next[0]);
  }
}

}  // namespace

std::vector<MoveItGroup> moveit_groups(const Tree& tree,
                                       const std::vector<hal::SiteConfig>& sites) {
  const Posed neutral(tree, neutral_posture(tree));
  std::vector<FoundFoot> feet = find_feet(tree, neutral, FeetBy::kName);
  const Eigen::Vector3d ahead =
      feet.empty() ? Eigen::Vector3d::UnitX() : direction_ahead(feet, neutral);
  std::vector<MoveItGroup> groups;
  for (const Limb& limb : split_limbs(tree, feet, neutral, ahead)) {
    std::set<int> joints(limb.joints.begin(), limb.joints.end());
    for (std::size_t j = 0; j < tree.joints.size(); ++j)
      if (joints.contains(tree.joints[j].leader)) joints.insert(static_cast<int>(j));
    const int start = *joints.begin();  // the tree's order has the root's side first
    const bool alone = std::ranges::count_if(joints, [&](int j) {
                         return tree.joints[static_cast<std::size_t>(j)].parent ==
                                tree.joints[static_cast<std::size_t>(start)].parent;
                       }) == 1;
    MoveItGroup group, end;
    group.name = limb.name;
    group.joints.assign(joints.begin(), joints.end());
    end.name = limb.name + "_end";
    if (alone) {
      group.joints = chain_of(tree, joints, start);
      for (const int j : joints)
        if (std::ranges::find(group.joints, j) == group.joints.end()) end.joints.push_back(j);
      if (!end.joints.empty()) end.on = parent_of(tree, end.joints.front());
      group.base_link = parent_of(tree, start);
      group.tip_link =
          tip_of(tree, sites, group.joints.back(), end.on.empty() ? -1 : tree.link_index(end.on));
    }
    end.carrier = static_cast<int>(groups.size());
    groups.push_back(std::move(group));
    if (!end.joints.empty()) groups.push_back(std::move(end));
  }
  return groups;
}

std::vector<std::pair<std::string, std::string>> neighbours(const Tree& tree) {
  std::vector<std::pair<std::string, std::string>> pairs;
  for (std::size_t b = 0; b < tree.links.size(); ++b) {
    const Link& link = tree.links[b];
    if (link.shapes.empty()) continue;
    int beside = link.parent;  // the next one towards the root that has a shape
    while (beside >= 0 && tree.links[static_cast<std::size_t>(beside)].shapes.empty())
      beside = tree.links[static_cast<std::size_t>(beside)].parent;
    for (std::size_t a = 0; a < b; ++a) {
      const Link& other = tree.links[a];
      if (other.shapes.empty()) continue;
      if (static_cast<int>(a) == beside || other.body == link.body)
        pairs.emplace_back(other.name, link.name);
    }
  }
  return pairs;
}

std::string moveit_controller(const std::vector<MoveItGroup>& groups, std::size_t group,
                              const std::string& action) {
  return groups.size() == 1 ? action : groups[group].name + "_" + action;
}

}  // namespace tandem::scaffold
