// Outline, topology, urdfdom, tree: each stage only when the one before found no error.
#include "model/urdf.hpp"

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <span>

#include "base/bounds.hpp"
#include "base/nearest.hpp"
#include "base/open_file.hpp"
#include "model/right_angles.hpp"
#include "model/urdf_inertia.hpp"
#include "model/urdf_mimic.hpp"
#include "model/urdf_outline.hpp"
#include "model/urdf_override.hpp"
#include "model/urdf_repair.hpp"
#include "model/urdf_shapes.hpp"

namespace tandem::model {
namespace {

constexpr double kFarthest_m = 100.0;  // of one joint from the one before

/// Collects what urdfdom would print. The hook is global, hence the mutex.
class ConsoleCapture : public console_bridge::OutputHandler {
 public:
  ConsoleCapture() : lock_(mutex()) { console_bridge::useOutputHandler(this); }
  ~ConsoleCapture() override { console_bridge::restorePreviousOutputHandler(); }
  ConsoleCapture(const ConsoleCapture&) = delete;
  ConsoleCapture& operator=(const ConsoleCapture&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    text_ += (text_.empty() ? "" : "; ") + text;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  static std::mutex& mutex() {
    static std::mutex one;
    return one;
  }
  std::lock_guard<std::mutex> lock_;
  std::string text_;
};

Result<urdf::ModelInterfaceSharedPtr> parse_with_urdfdom(const std::string& text) {
  ConsoleCapture console;
  try {
    if (auto model = urdf::parseURDF(text)) return model;
  } catch (const std::exception& e) {
    return fail(std::string("the URDF library refuses the description: ") + e.what());
  }
  return fail("the URDF library refuses the description: " + console.text());
}

/// Sets what is within rounding of 0 or +-1 to it, so that right angles stay exact.
double exact(double x) {
  if (std::abs(x) < kExactRightAngle) return 0.0;
  return std::abs(std::abs(x) - 1.0) < kExactRightAngle ? std::copysign(1.0, x) : x;
}

Eigen::Matrix3d rotation(const urdf::Rotation& r) {
  double x = 0.0, y = 0.0, z = 0.0, w = 1.0;
  r.getQuaternion(x, y, z, w);
  return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix().unaryExpr(&exact);
}

Eigen::Vector3d vector(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }
Placement placement(const urdf::Pose& pose) {
  return {rotation(pose.rotation), vector(pose.position)};
}

Inertia inertia_of(const urdf::Link& link) {
  if (link.inertial == nullptr) return {};
  const urdf::Inertial& i = *link.inertial;
  Eigen::Matrix3d about_com;
  about_com << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
  return placement(i.origin) * Inertia{i.mass, Eigen::Vector3d::Zero(), about_com};
}

bool moves(const urdf::Joint& joint) { return joint.type != urdf::Joint::FIXED; }

Eigen::Vector3d axis_of(const urdf::Joint& joint) {
  return vector(joint.axis).stableNormalized().unaryExpr(&exact);
}

/// Where the child of a locked joint stands in the joint's frame.
Placement displacement(const urdf::Joint& joint, double position) {
  const Eigen::Vector3d axis = axis_of(joint);
  if (joint.type == urdf::Joint::PRISMATIC) {
    return {Eigen::Matrix3d::Identity(), axis * position};
  }
  return {Eigen::AngleAxisd(position, axis).toRotationMatrix().unaryExpr(&exact),
          Eigen::Vector3d::Zero()};
}

/// Turns urdfdom's model into a Tree, depth first.
class Builder {
 public:
  Builder(const Outline& outline, const UrdfOptions& options, const std::string& file)
      : outline_(outline), options_(options) {
    out_.tree.name = outline.robot;
    out_.tree.file = file;
    out_.tree.floating_base = options.floating_base;
    out_.warnings = outline.warnings;
    out_.right_angles = outline.right_angles;
  }

  std::expected<UrdfModel, Diagnostics> run(const urdf::ModelInterface& model) {
    const auto root = model.getRoot();
    const bool floats = !outline_.floating_joint.empty();
    if (floats) check_floating(*root->child_joints.front());
    check_locks(model);
    mimics_ = resolve_mimics(outline_, options_, out_.tree.file, errors_);
    check_still(std::span(mimics_.still).subspan(options_.lock.size()));
    check_overrides(options_, outline_, errors_);
    add_all(floats ? *root->child_links.front() : *root);
    apply_mimics(mimics_, out_.tree, out_.warnings);
    check_inertias(out_.tree, outline_, options_, errors_, out_.warnings);
    if (!errors_.empty()) return std::unexpected(errors_);
    return std::move(out_);
  }

 private:
  void error(int line, std::string key, std::string message, std::string hint) {
    errors_.push_back({std::move(message), std::move(hint), out_.tree.file, line, std::move(key)});
  }

  const OutlineJoint& outlined(const std::string& joint) const {
    return *std::ranges::find(outline_.joints, joint, &OutlineJoint::name);
  }

  const double* lock_of(const std::string& joint) const {
    const auto found =
        std::ranges::find(mimics_.still, joint, &std::pair<std::string, double>::first);
    return found == mimics_.still.end() ? nullptr : &found->second;
  }

  /// The joint that makes the base a free one agrees with robot.toml.
  void check_floating(const urdf::Joint& joint) {
    const std::string key = "joint " + joint.name;
    if (!options_.floating_base) {
      error(outline_.floating_line, key,
            "the joint of type 'floating' lets the base move, but robot.toml says base = \"fixed\"",
            "set base = \"floating\" in [model], or make the joint fixed");
    }
    const Placement origin = placement(joint.parent_to_joint_origin_transform);
    if (origin.R.isIdentity(0.0) && origin.p.isZero(0.0)) return;
    out_.warnings.push_back({"the <origin> of the floating joint is not used",
                             "a posture says where the base starts", out_.tree.file,
                             outline_.floating_line, key});
  }

  /// An error of [model.lock], at its place in robot.toml.
  void lock_error(const std::string& joint, std::string message, std::string hint) {
    const auto line = options_.lock_lines.find(joint);
    errors_.push_back({std::move(message), std::move(hint), options_.overrides_file,
                       line == options_.lock_lines.end() ? 0 : line->second,
                       "model.lock." + joint});
  }

  void check_locks(const urdf::ModelInterface& model) {
    for (const auto& [name, position] : options_.lock) {
      const auto joint = model.getJoint(name);
      if (joint == nullptr || !outline_.joint_lines.contains(name)) {
        std::vector<std::string> known;
        for (const auto& [one, line] : outline_.joint_lines) known.push_back(one);
        lock_error(name, "the description has no joint '" + name + "' to lock",
                   suggest(name, known));
        continue;
      }
      if (!moves(*joint)) {
        if (outlined(name).locked) continue;
        lock_error(name, "the joint '" + name + "' is fixed in the description",
                   "remove it from [model.lock]");
      } else if (!std::isfinite(position)) {
        lock_error(name, "is locked at a position that is not finite", "give a finite one");
      } else if (const OutlineJoint& limits = outlined(name);
                 position < limits.lower || position > limits.upper) {
        lock_error(name, "locks the joint at " + beyond(limits, position),
                   "lock it within them: " + place(limits.line));
      }
    }
  }

  /// Followers of joints that stand still.
  void check_still(std::span<const std::pair<std::string, double>> still) {
    for (const auto& [name, position] : still) {
      const OutlineJoint& limits = outlined(name);
      if (!(position < limits.lower) && !(position > limits.upper)) continue;
      error(limits.line, "joint " + name,
            "follows a joint that stands still, and so stands at " + beyond(limits, position),
            "lock it within them");
    }
  }

  static std::string beyond(const OutlineJoint& limits, double position) {
    return std::to_string(position) + ", beyond its limits " + std::to_string(limits.lower) +
           " to " + std::to_string(limits.upper);
  }

  [[nodiscard]] std::string place(int line) const {
    return out_.tree.file + ":" + std::to_string(line);
  }

  /// Depth first with a stack of our own: the deepest chain is the file's choice.
  void add_all(const urdf::Link& root) {
    struct Pending {
      const urdf::Link* link;
      int parent;
    };
    std::vector<Pending> stack{{&root, -1}};
    while (!stack.empty()) {
      const Pending next = stack.back();
      stack.pop_back();
      const int index = static_cast<int>(out_.tree.links.size());
      add(*next.link, next.parent);
      auto joints = next.link->child_joints;
      std::ranges::sort(joints, std::greater{}, [](const auto& joint) { return joint->name; });
      for (const auto& joint : joints) {
        const auto child = std::ranges::find(next.link->child_links, joint->child_link_name,
                                             [](const auto& link) { return link->name; });
        stack.push_back({child->get(), index});
      }
    }
  }

  void add(const urdf::Link& source, int parent) {
    Tree& tree = out_.tree;
    Link link;
    link.name = source.name;
    link.inertia = inertia_of(source);
    if (const LinkOverride* given = find_override(options_, source.name)) {
      link.inertia = overridden(link.inertia, *given);
    }
    link.parent = parent;
    if (parent < 0) {
      tree.bodies.push_back({source.name, {}});
    } else {
      const urdf::Joint& joint = *source.parent_joint;
      const Link& above = tree.links[static_cast<std::size_t>(parent)];
      link.joint = joint.name;
      const Placement origin = placement(joint.parent_to_joint_origin_transform);
      if (origin.p.norm() > kFarthest_m) {
        char distance[32];
        std::snprintf(distance, sizeof distance, "%.4g", origin.p.norm());
        errors_.push_back({std::string("its origin is ") + distance +
                               " m from its parent's frame, farther than any robot reaches",
                           "lengths are in metres", tree.file, outline_.joint_lines.at(joint.name),
                           "joint " + joint.name});
      }
      const Placement in_body = above.in_body * origin;
      if (const double* position = lock_of(joint.name); position != nullptr && moves(joint)) {
        link.body = above.body;
        link.in_body = in_body * displacement(joint, std::isfinite(*position) ? *position : 0.0);
      } else if (!moves(joint)) {
        link.body = above.body;
        link.in_body = in_body;
      } else {
        link.moving = static_cast<int>(tree.joints.size());
        link.body = link.moving + 1;
        tree.joints.push_back(moving_joint(joint, above.body, in_body));
        tree.bodies.push_back({source.name, {}});
      }
    }
    const bool fixed_to_world = link.body == 0 && !tree.floating_base;
    if (options_.repair_inertia && !fixed_to_world) repair(link);
    Body& body = tree.bodies[static_cast<std::size_t>(link.body)];
    body.inertia = body.inertia + link.in_body * link.inertia;
    tree.links.push_back(link);
  }

  void repair(Link& link) {
    auto found = repaired(link.inertia);
    if (!found) return;
    link.inertia = found->inertia;
    out_.warnings.push_back({found->text, kRepaired, out_.tree.file,
                             outline_.link_lines.at(link.name), "link " + link.name});
  }

  Joint moving_joint(const urdf::Joint& source, int parent, const Placement& in_body) {
    Joint joint;
    joint.name = source.name;
    joint.parent = parent;
    joint.axis = axis_of(source);
    joint.in_parent = in_body;
    joint.line = outline_.joint_lines.at(source.name);
    joint.type = source.type == urdf::Joint::PRISMATIC    ? JointType::kPrismatic
                 : source.type == urdf::Joint::CONTINUOUS ? JointType::kContinuous
                                                          : JointType::kRevolute;
    const OutlineJoint& limits = outlined(source.name);
    joint.lower = limits.lower;
    joint.upper = limits.upper;
    joint.velocity = limits.velocity;
    joint.effort = limits.effort;
    if (!limits.limits_note.empty()) out_.limits_notes[source.name] = limits.limits_note;
    return joint;
  }

  const Outline& outline_;
  const UrdfOptions& options_;
  UrdfModel out_;
  Mimics mimics_;
  Diagnostics errors_;
};

Diagnostics one_error(std::string message, std::string hint, const std::string& file) {
  return {Error{std::move(message), std::move(hint), file, 0, {}}};
}

/// urdfdom leaves an inertial out that it cannot read, and goes on: whatever the outline has read,
/// the model has to have.
Diagnostics lost_masses(const Outline& outline, const urdf::ModelInterface& model,
                        const std::string& file) {
  Diagnostics lost;
  for (const OutlineLink& one : outline.links) {
    const auto link = model.getLink(one.name);
    const double mass_kg =
        link == nullptr || link->inertial == nullptr ? 0.0 : link->inertial->mass;
    if (mass_kg == one.mass_kg) continue;
    lost.push_back({"the URDF library reads another mass than the file has",
                    "write its <inertial> in plain decimal numbers", file, one.line,
                    "link " + one.name});
  }
  return lost;
}

/// What the text says wrongly, and what else is wrong with the model: of a link or joint that has
/// been reported, the rest is made up.
Diagnostics together(Diagnostics errors, const Diagnostics& others) {
  const std::size_t of_text = errors.size();
  for (const Error& one : others) {
    const bool reported =
        std::any_of(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(of_text),
                    [&one](const Error& error) { return error.key == one.key; });
    if (!reported) add_error(errors, one);
  }
  return errors;
}

}  // namespace

std::expected<UrdfModel, Diagnostics> parse_urdf(std::string_view text, const std::string& file,
                                                 const UrdfOptions& options) {
  Outline outline = outline_urdf(text, file, options);
  const bool named = !outline.incomplete;
  if (named) check_topology(outline, file);
  sort_by_line(outline.errors);
  if (named && outline.incomplete) {
    const Diagnostics links = impossible_links(outline, file);
    return std::unexpected(together(std::move(outline.errors), links));
  }
  if (outline.incomplete) return std::unexpected(outline.errors);
  const auto model = parse_with_urdfdom(outline.text);
  if (!model) {
    if (!outline.errors.empty()) return std::unexpected(outline.errors);
    return std::unexpected(one_error(model.error().message, {}, file));
  }
  if (Diagnostics lost = lost_masses(outline, **model, file); !lost.empty())
    return std::unexpected(together(std::move(outline.errors), lost));
  auto read = Builder(outline, options, file).run(**model);
  if (!read) return std::unexpected(together(std::move(outline.errors), read.error()));
  if (!outline.errors.empty()) return std::unexpected(outline.errors);
  const auto shapes = collision_shapes(text);
  for (Link& link : read->tree.links) {
    if (const auto found = shapes.find(link.name); found != shapes.end()) {
      link.shapes = found->second;
    }
  }
  read->text = std::make_shared<const std::string>(text);
  warn_of_odd_masses(read->tree, outline, read->warnings);
  return read;
}

std::expected<UrdfModel, Diagnostics> read_urdf(const std::string& file,
                                                const UrdfOptions& options) {
  const std::string named = options.overrides_file.empty()
                                ? ""
                                : "; it is the urdf of [model] in " + options.overrides_file;
  const Result<std::string> text = read_file(file, "name a .urdf file", kMostUrdfBytes);
  if (text) return parse_urdf(*text, file, options);
  return std::unexpected(one_error(text.error().message, text.error().hint + named, file));
}

}  // namespace tandem::model
