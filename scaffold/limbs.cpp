// Cuts the tree at the root and where heavy branches part; names by feet, sides and words such as
// head.
#include "scaffold/limbs.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

#include "scaffold/words.hpp"

namespace tandem::scaffold {
namespace {

using Eigen::Vector3d;
using model::Tree;

constexpr double kHeavyShare = 0.02;  // of the robot's mass: a branch that is a limb, no finger
constexpr std::size_t kLongBranch = 3;
constexpr double kAside = 0.03;  // of the robot's size: a limb is left or right beyond it

class Splitter {
 public:
  Splitter(const Tree& tree, const Posed& neutral) : tree_(tree), neutral_(neutral) {}

  std::vector<Limb> run() {
    Limb few;  // single joints at the root: wheels, fingers
    for (const int joint : starting_at(0)) {
      Limb limb;
      grow(joint, limb);
      if (limb.joints.size() > 1) {
        limbs_.push_back(limb);
      } else {
        few.joints.push_back(joint);
      }
    }
    if (!few.joints.empty()) limbs_.push_back(few);
    return std::move(limbs_);
  }

 private:
  [[nodiscard]] std::vector<int> starting_at(int body) const {
    std::vector<int> joints;
    for (std::size_t j = 0; j < tree_.joints.size(); ++j) {
      if (tree_.joints[j].parent == body) joints.push_back(static_cast<int>(j));
    }
    return joints;
  }
  [[nodiscard]] std::size_t count(int joint) const {
    std::size_t joints = 1;
    for (const int next : starting_at(joint + 1)) joints += count(next);
    return joints;
  }
  [[nodiscard]] bool is_limb(int joint) const {
    double total = 0.0;
    for (const model::Body& body : tree_.bodies) total += body.inertia.mass_kg;
    return count(joint) >= kLongBranch && neutral_.beyond(joint).mass_kg > kHeavyShare * total;
  }
  void grow(int joint, Limb& limb) {
    limb.joints.push_back(joint);
    const std::vector<int> next = starting_at(joint + 1);
    const bool trunk = std::ranges::count_if(next, [&](int j) { return is_limb(j); }) > 1;
    for (const int j : next) {
      if (!trunk) {
        grow(j, limb);
        continue;
      }
      Limb branch;
      grow(j, branch);
      limbs_.push_back(branch);
    }
  }

  const Tree& tree_;
  const Posed& neutral_;
  std::vector<Limb> limbs_;
};

bool is_below(const Tree& tree, int joint, int above) {
  for (int body = joint + 1; body > 0; body = tree.joints[body - 1].parent) {
    if (body == above + 1) return true;
  }
  return false;
}

class Namer {
 public:
  Namer(const Tree& tree, const Posed& neutral, const Vector3d& ahead,
        const std::vector<Limb>& limbs)
      : tree_(tree), neutral_(neutral), ahead_(ahead), limbs_(limbs) {
    for (std::size_t b = 0; b < tree.bodies.size(); ++b) {
      size_ = std::max(size_, neutral.body(static_cast<int>(b)).p.norm());
    }
    for (const Limb& limb : limbs) legs_ += limb.foot >= 0 ? 1 : 0;
    for (const Limb& limb : limbs)
      if (limb.foot >= 0) middle_ += tip_of(limb) / static_cast<double>(legs_);
  }

  [[nodiscard]] std::string name(const Limb& limb) const {
    std::string kind = kind_of(limb);
    if (kind == "torso" || kind == "head" || limbs_.size() == 1) return kind;
    const Vector3d left = Vector3d::UnitZ().cross(ahead_);
    double aside = tip_of(limb).dot(left);
    if (kind == "leg") aside -= middle_.dot(left);
    std::string side;
    if (aside > kAside * size_) side = "left_";
    if (aside < -kAside * size_) side = "right_";
    if (kind == "leg" && side.empty()) side = told_side(limb);
    if (kind == "leg" && legs_ > 2) {
      const double x = (neutral_.origin(limb.joints.front()) - neutral_.whole().com_m).dot(ahead_);
      side += x >= 0.0 ? "front_" : "hind_";
    }
    return side + kind;
  }

 private:
  [[nodiscard]] Vector3d tip_of(const Limb& limb) const {
    return neutral_.beyond(limb.joints.back()).com_m;
  }
  /// The side in the names of its links, where legs stand one behind the other.
  [[nodiscard]] std::string told_side(const Limb& limb) const {
    for (const int j : limb.joints) {
      const std::string& name = tree_.bodies[j + 1].name;
      if (has_word(name, "left") || has_word(name, "l")) return "left_";
      if (has_word(name, "right") || has_word(name, "r")) return "right_";
    }
    return {};
  }
  [[nodiscard]] std::string kind_of(const Limb& limb) const {
    if (limb.foot >= 0) return "leg";
    for (const Limb& other : limbs_) {
      if (&other != &limb && is_below(tree_, other.joints[0], limb.joints[0])) return "torso";
    }
    for (const int j : limb.joints) {
      for (const std::string& name : {tree_.joints[j].name, tree_.bodies[j + 1].name}) {
        if (mentions(name, "head") || mentions(name, "neck")) return "head";
      }
    }
    return "arm";
  }

  const Tree& tree_;
  const Posed& neutral_;
  const Vector3d& ahead_;
  const std::vector<Limb>& limbs_;
  double size_ = 0.0;
  int legs_ = 0;
  Vector3d middle_ = Vector3d::Zero();  ///< of the legs' tips
};

std::string foot_name(const std::string& limb, bool flat, std::size_t feet) {
  if (flat && feet == 2 && limb == "left_leg") return "l_sole";  // what controllers look for
  if (flat && feet == 2 && limb == "right_leg") return "r_sole";
  const std::string kind = flat ? "sole" : "foot";
  std::string name = limb;
  if (const std::size_t at = name.find("leg"); at != std::string::npos)
    return name.replace(at, 3, kind);
  return name + kind;
}

}  // namespace

std::vector<Limb> split_limbs(const Tree& tree, std::vector<FoundFoot>& feet, const Posed& neutral,
                              const Vector3d& ahead) {
  std::vector<Limb> limbs = Splitter(tree, neutral).run();
  for (std::size_t f = 0; f < feet.size(); ++f) {
    for (Limb& limb : limbs) {
      if (std::ranges::find(limb.joints, feet[f].body - 1) != limb.joints.end()) {
        limb.foot = static_cast<int>(f);
      }
    }
  }
  // Legs first, then the torso, as people list them; the tree's order among equals.
  std::ranges::stable_sort(limbs, std::greater{}, [](const Limb& l) { return l.foot >= 0; });
  const Namer namer(tree, neutral, ahead, limbs);
  std::vector<std::string> names;
  std::map<std::string, int> used;
  for (const Limb& limb : limbs) {
    const std::string name = namer.name(limb);
    const int count = ++used[name];
    names.push_back(count == 1 ? name : name + "_" + std::to_string(count));
  }
  for (std::size_t i = 0; i < limbs.size(); ++i) {
    limbs[i].name = names[i];
    std::erase_if(limbs[i].joints, [&](int j) { return tree.joints[j].follows(); });
    if (limbs[i].foot < 0) continue;
    FoundFoot& foot = feet[static_cast<std::size_t>(limbs[i].foot)];
    foot.name = foot_name(names[i], foot.flat(), feet.size());
  }
  std::erase_if(limbs, [](const Limb& limb) { return limb.joints.empty(); });
  return limbs;
}

}  // namespace tandem::scaffold
