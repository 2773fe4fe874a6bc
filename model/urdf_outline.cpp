// One walk over the XML: elements, attributes, finite numbers. Errors that urdfdom would not
// report, or without a line, are found here.
#include "model/urdf_outline.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>

#include "base/bounds.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "base/utf8.hpp"
#include "base/xml_scan.hpp"
#include "model/urdf_limits.hpp"
#include "model/urdf_numbers.hpp"
#include "model/urdf_text.hpp"
#include "model/urdf_vocabulary.hpp"

namespace tandem::model {
namespace {

using tinyxml2::XMLElement;

constexpr double kMostTurn_rad = 6.5;  // of an rpy: more is degrees, most likely

/// The attributes of `e` and what is in it, whose values are numbers, with one blank between them.
void tidy_numbers(tinyxml2::XMLElement& e) {
  for (const tinyxml2::XMLAttribute* one = e.FirstAttribute(); one != nullptr; one = one->Next()) {
    std::string text;
    for (const std::string& word : words_of(one->Value())) text += (text.empty() ? "" : " ") + word;
    e.SetAttribute(one->Name(), text.c_str());
  }
  for (tinyxml2::XMLElement* child = e.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement())
    tidy_numbers(*child);
}

enum class Needed : bool { kNo, kYes };

/// Walks the XML once, collects what matters and reports what is wrong with it.
class Reader {
 public:
  Reader(const std::string& file, const UrdfOptions& options)
      : file_(file), options_(options), vocabulary_(file), limits_(file, out_.errors) {}

  Outline run(std::string_view text) {
    if (const XMLElement* robot = parse(text)) {
      read_robot(*robot);
    } else {
      out_.incomplete = true;
    }
    return std::move(out_);
  }

 private:
  /// The root element, or null with an error.
  const XMLElement* parse(std::string_view text) {
    if (const std::string encoding = wide_encoding(text); !encoding.empty()) {
      error(0, "", "the file is " + encoding + ", and a URDF must be UTF-8",
            conversion(encoding, file_));
      return nullptr;
    }
    encoding_ = declared_encoding(text);
    if (text.find('\0') != std::string_view::npos) {
      error(0, "", "the file holds a zero byte, so it is no XML", "name a URDF text file");
      return nullptr;
    }
    const std::size_t first = text.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
    if (first != std::string_view::npos && text[first] != '<') {
      error(1, "", "this is no XML, so no URDF", "name a .urdf file");
      return nullptr;
    }
    if (Status within = check_xml_bounds(text, file_); !within) {
      out_.errors.push_back(within.error());
      return nullptr;
    }
    const std::string plain = without_instructions(text);
    if (document_.Parse(plain.data(), plain.size()) != tinyxml2::XML_SUCCESS) {
      report_xml_error();
      return nullptr;
    }
    if (auto wrong = find_wrong_reference(plain, file_)) {
      add_error(out_.errors, std::move(*wrong));
      return nullptr;
    }
    const XMLElement* robot = document_.RootElement();
    if (robot == nullptr || std::string_view(robot->Name()) != "robot") {
      const std::string found = robot == nullptr ? "" : robot->Name();
      error(robot == nullptr ? 0 : robot->GetLineNum(), found, "the root element is not <robot>",
            "name a URDF; expand xacro and convert SDF first");
      return nullptr;
    }
    if (const XMLElement* second = robot->NextSiblingElement()) {
      error(second->GetLineNum(), second->Name(), "there is a second root element",
            "a file holds one robot: remove the other");
      return nullptr;
    }
    if (auto left = find_xacro(*robot, file_)) {
      out_.errors.push_back(std::move(*left));
      return nullptr;
    }
    return robot;
  }

  void error(int line, std::string key, std::string message, std::string hint = {}) {
    add_error(out_.errors, {std::move(message), std::move(hint), file_, line, std::move(key)});
  }

  /// An error after which names, or what hangs on what, are not known.
  void lost(int line, std::string key, std::string message, std::string hint = {}) {
    out_.incomplete = true;
    error(line, std::move(key), std::move(message), std::move(hint));
  }

  void warning(int line, std::string key, std::string message, std::string hint) {
    add_error(out_.warnings, {std::move(message), std::move(hint), file_, line, std::move(key)});
  }

  void report_xml_error() {
    switch (document_.ErrorID()) {
      case tinyxml2::XML_ERROR_EMPTY_DOCUMENT:
        return error(0, "", "the file is empty", "restore it from its source");
      case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
        return error(document_.ErrorLineNum(), "", "elements are nested too deep");
      default:
        error(document_.ErrorLineNum(), "",
              "not well-formed XML: an element is not closed or "
              "is misspelt",
              "correct it at or after this line; the file may have been cut off");
    }
  }

  void read_robot(const XMLElement& robot) {
    out_.robot = name_of(robot, "name", "robot");
    tinyxml2::XMLElement* reduced = reduced_.NewElement("robot");
    reduced->SetAttribute("name", "robot");
    reduced_.InsertEndChild(reduced);
    for (const XMLElement* e = robot.FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      if (name == "link") {
        read_link(*e, *reduced);
      } else if (name == "joint") {
        read_joint(*e, *reduced);
      } else {
        check_unknown(*e);
      }
    }
    if (out_.links.empty()) lost(robot.GetLineNum(), "", "the robot has no link");
    check_count();
    limits_.warn(out_.warnings);
    vocabulary_.warn(out_.warnings);
    tinyxml2::XMLPrinter printer(nullptr, true);
    reduced_.Print(&printer);
    out_.text = printer.CStr();
  }

  /// What follows costs more than in proportion to links and joints.
  void check_count() {
    const std::size_t before = out_.errors.size();
    if (out_.links.size() > bounds::kUrdfLinks.most)
      add_error(out_.errors,
                beyond(bounds::kUrdfLinks, file_, out_.links[bounds::kUrdfLinks.most].line));
    std::size_t moving = 0;
    for (const OutlineJoint& joint : out_.joints) {
      if (joint.type == "fixed" || ++moving != bounds::kMovingJoints.most + 1) continue;
      add_error(out_.errors,
                beyond(bounds::kMovingJoints, file_, joint.line, "joint " + joint.name));
    }
    out_.incomplete |= out_.errors.size() > before || before > bounds::kErrors.most;
  }

  /// Elements that others use are passed over; a misspelt <link> or <joint> is an error.
  void check_unknown(const XMLElement& e) {
    static const std::vector<std::string> kOthers{"material", "transmission", "gazebo", "sensor",
                                                  "mujoco",   "camera",       "plugin"};
    const std::string name = e.Name();
    if (std::ranges::find(kOthers, name) != kOthers.end() || vocabulary_.takes_foreign(e)) return;
    const std::vector<std::string> ours{"link", "joint"};
    if (const std::string meant = nearest(name, ours); !meant.empty() && name.size() <= 6) {
      return lost(e.GetLineNum(), name, "unknown element <" + name + ">",
                  "did you mean <" + meant + ">?");
    }
    vocabulary_.pass_over(e);
  }

  std::string attribute(const XMLElement& e, const char* name, const std::string& key,
                        Needed needed) {
    const char* value = e.Attribute(name);
    if (value != nullptr && *value != '\0') return value;
    if (needed == Needed::kYes) {
      error(e.GetLineNum(), key, std::string("<") + e.Name() + "> has no attribute '" + name + "'",
            "add it");
    }
    return {};
  }

  /// An attribute that names something: no blanks around it, no control characters in it.
  std::string name_of(const XMLElement& e, const char* attribute_name, const std::string& key) {
    std::string name = attribute(e, attribute_name, key, Needed::kYes);
    const bool odd = std::ranges::any_of(name, [](unsigned char c) { return c < 32 || c == 127; });
    const std::string what = std::string("'") + attribute_name + "' of <" + e.Name() + ">";
    if (!is_utf8(name)) {
      lost(e.GetLineNum(), key, what + " is not UTF-8",
           encoding_.empty()
               ? "save the file in UTF-8, or name it in plain letters"
               : "the file says that it is " + encoding_ + ": " + conversion(encoding_, file_));
      return {};
    }
    if (name.size() > bounds::kXmlName.most) {
      out_.incomplete = true;
      add_error(out_.errors, beyond(bounds::kXmlName, file_, e.GetLineNum(), e.Name()));
      return {};
    }
    out_.incomplete |= name.empty();
    if (name.empty() || (!odd && name.front() != ' ' && name.back() != ' ')) return name;
    lost(e.GetLineNum(), key, what + " has blanks around it or control characters in it",
         "remove them");
    return {};
  }

  /// The only child so named, or null; two are an error, and none is when it is needed.
  const XMLElement* child(const XMLElement& e, const char* name, const std::string& key,
                          Needed needed) {
    const XMLElement* found = e.FirstChildElement(name);
    if (found == nullptr) {
      if (needed == Needed::kYes) {
        error(e.GetLineNum(), key, std::string("<") + e.Name() + "> has no <" + name + ">",
              "add it");
      }
      return nullptr;
    }
    if (const XMLElement* second = found->NextSiblingElement(name)) {
      error(second->GetLineNum(), key, std::string("<") + e.Name() + "> has two <" + name + ">",
            "remove one of them");
    }
    return found;
  }

  /// Reads `count` finite numbers of an attribute; empty when they are not there.
  std::vector<double> numbers(const XMLElement* e, const char* name, std::size_t count,
                              const std::string& key, Needed needed) {
    if (e == nullptr) return {};
    const char* text = e->Attribute(name);
    if (text == nullptr) return (void)attribute(*e, name, key, needed), std::vector<double>();
    std::vector<double> found;
    for (const std::string& word : words_of(text)) {
      if (!number(*e, name, word, key, found.emplace_back())) return {};
    }
    if (found.size() == count) return found;
    error(
        e->GetLineNum(), key,
        std::string("'") + name + "' of <" + e->Name() + "> has " + counted(found.size(), "number"),
        "give " + std::to_string(count));
    return {};
  }

  bool number(const XMLElement& e, const char* name, const std::string& word,
              const std::string& key, double& value) {
    const NumberText found = number_of(word);
    value = found.value;
    const std::string where = std::string("'") + name + "' of <" + e.Name() + ">";
    if (found.kind == NumberKind::kNoNumber) {
      error(e.GetLineNum(), key, where + " is no number: '" + word + "'", "write it as 1.5e-3");
    } else if (found.kind == NumberKind::kEndless) {
      error(e.GetLineNum(), key, where + " is not finite or far out of range: " + word,
            "give a finite number below 1e30");
    }
    return found.kind == NumberKind::kFinite;
  }

  void check_unique(std::map<std::string, int>& lines, const std::string& name, const XMLElement& e,
                    const std::string& key) {
    const auto [at, fresh] = lines.emplace(name, e.GetLineNum());
    if (fresh || name.empty()) return;
    lost(e.GetLineNum(), key,
         std::string("there is another ") + e.Name() + " of this name at line " +
             std::to_string(at->second),
         "rename or remove one of them");
  }

  void check_origin(const XMLElement& e, const std::string& key) {
    const XMLElement* origin = child(e, "origin", key, Needed::kNo);
    (void)numbers(origin, "xyz", 3, key, Needed::kNo);
    for (const double turn_rad : numbers(origin, "rpy", 3, key, Needed::kNo)) {
      if (std::abs(turn_rad) <= kMostTurn_rad) continue;
      return warning(origin->GetLineNum(), key,
                     std::string("'rpy' of <origin> is \"") + origin->Attribute("rpy") +
                         "\": more than a turn",
                     "angles are in radians");
    }
  }

  void read_link(const XMLElement& e, XMLElement& reduced) {
    const std::size_t before = out_.errors.size();
    const std::string name = name_of(e, "name", "link");
    const std::string key = "link " + name;
    check_unique(out_.link_lines, name, e, key);
    out_.links.push_back({name, e.GetLineNum()});
    XMLElement* copy = reduced_.NewElement("link");
    copy->SetAttribute("name", name.c_str());
    reduced.InsertEndChild(copy);
    vocabulary_.look_at(e, key, out_.errors);
    const XMLElement* inertial = child(e, "inertial", key, Needed::kNo);
    if (inertial != nullptr) read_inertial(*inertial, key);
    if (out_.errors.size() > before) return stand_in(*copy);
    if (inertial == nullptr) return;
    tinyxml2::XMLElement* cloned =
        copy->InsertEndChild(inertial->DeepClone(&reduced_))->ToElement();
    tidy_numbers(*cloned);
    look_at_rpy(cloned->FirstChildElement("origin"), options_.exact_right_angles,
                out_.right_angles);
  }

  void read_inertial(const XMLElement& inertial, const std::string& key) {
    check_origin(inertial, key);
    const XMLElement* mass = child(inertial, "mass", key, Needed::kYes);
    const std::vector<double> kg = numbers(mass, "value", 1, key, Needed::kYes);
    if (!kg.empty()) out_.links.back().mass_kg = kg[0];
    const XMLElement* inertia = child(inertial, "inertia", key, Needed::kYes);
    double* entry = out_.links.back().moments_kg_m2.data();
    for (const char* moment : {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}) {
      const std::vector<double> found = numbers(inertia, moment, 1, key, Needed::kYes);
      *entry++ = found.empty() ? 0.0 : found[0];
    }
  }

  /// A possible inertial for a link that has an error, so that the rest can be read.
  void stand_in(XMLElement& link) {
    out_.links.back().mass_kg = 1.0;
    out_.links.back().moments_kg_m2 = {0.01, 0.0, 0.0, 0.01, 0.0, 0.01};
    XMLElement* inertial = link.InsertNewChildElement("inertial");
    inertial->InsertNewChildElement("mass")->SetAttribute("value", "1");
    XMLElement* inertia = inertial->InsertNewChildElement("inertia");
    for (const char* moment : {"ixx", "iyy", "izz"}) inertia->SetAttribute(moment, "0.01");
    for (const char* moment : {"ixy", "ixz", "iyz"}) inertia->SetAttribute(moment, "0");
  }

  void read_joint(const XMLElement& e, XMLElement& reduced) {
    const std::size_t before = out_.errors.size();
    OutlineJoint joint;
    joint.line = e.GetLineNum();
    joint.name = name_of(e, "name", "joint");
    const std::string key = "joint " + joint.name;
    vocabulary_.look_at(e, key, out_.errors);
    check_unique(out_.joint_lines, joint.name, e, key);
    joint.type = attribute(e, "type", key, Needed::kYes);
    check_type(joint, key);
    const XMLElement* parent = child(e, "parent", key, Needed::kYes);
    if (parent != nullptr) joint.parent = name_of(*parent, "link", key);
    const XMLElement* child_link = child(e, "child", key, Needed::kYes);
    if (child_link != nullptr) joint.child = name_of(*child_link, "link", key);
    out_.incomplete |= parent == nullptr || child_link == nullptr;
    check_origin(e, key);
    if (joint.type != "fixed" && joint.type != "floating") read_motion(e, joint, key);
    if (const XMLElement* mimic = child(e, "mimic", key, Needed::kNo)) {
      joint.mimic = name_of(*mimic, "joint", key);
      const auto read = [&](const char* name, double& value) {
        const std::vector<double> given = numbers(mimic, name, 1, key, Needed::kNo);
        if (!given.empty()) value = given[0];
      };
      read("multiplier", joint.mimic_multiplier);
      read("offset", joint.mimic_offset);
    }
    out_.joints.push_back(joint);
    copy_joint(e, joint, out_.errors.size() == before, reduced);
  }

  /// @param whole  it has no error; else its place and its axis are left out
  void copy_joint(const XMLElement& e, const OutlineJoint& joint, bool whole, XMLElement& reduced) {
    XMLElement* copy = reduced_.NewElement("joint");
    copy->SetAttribute("name", joint.name.c_str());
    copy->SetAttribute("type", joint.type.c_str());
    reduced.InsertEndChild(copy);
    for (const char* part : {"parent", "child", "origin", "axis"}) {
      const XMLElement* found = e.FirstChildElement(part);
      const bool names = found != nullptr && found->Attribute("link") != nullptr;
      if (found == nullptr || (!whole && !names)) continue;
      tinyxml2::XMLElement* cloned = copy->InsertEndChild(found->DeepClone(&reduced_))->ToElement();
      if (!names) tidy_numbers(*cloned);
    }
    look_at_rpy(copy->FirstChildElement("origin"), options_.exact_right_angles, out_.right_angles);
    if (joint.type != "fixed") {
      look_at_axis(copy->FirstChildElement("axis"), options_.exact_right_angles, out_.right_angles);
    }
    XMLElement* limit = reduced_.NewElement("limit");  // ours are in `joint`; urdfdom needs one
    for (const char* name : {"velocity", "effort"}) limit->SetAttribute(name, "0");
    copy->InsertEndChild(limit);
  }

  /// A type that is none becomes "fixed". So does a planar or floating joint that is locked.
  void check_type(OutlineJoint& joint, const std::string& key) {
    static const std::vector<std::string> kTypes{"revolute", "continuous", "prismatic", "fixed",
                                                 "floating"};
    const auto lock =
        std::ranges::find(options_.lock, joint.name, &std::pair<std::string, double>::first);
    const bool planar = joint.type == "planar";
    const bool floats = joint.type == "floating" && !options_.floating_base;
    if (lock != options_.lock.end() && (planar || floats)) {
      joint.type = "fixed";
      joint.locked = true;
      if (lock->second == 0.0) return;
      return error(joint.line, key, "a joint of several directions can be locked at 0 only",
                   "[model.lock] " + joint.name + " = 0");
    }
    if (!joint.type.empty() && std::ranges::find(kTypes, joint.type) != kTypes.end()) return;
    if (planar) {
      error(joint.line, key, "joints of type 'planar' are not supported",
            "build it of two prismatic and one revolute joint; or `tandem new --lock " +
                shell_word(joint.name) + "` makes it stand still");
    } else if (!joint.type.empty()) {
      error(joint.line, key, "unknown joint type '" + joint.type + "'",
            suggest(joint.type, kTypes));
    }
    joint.type = "fixed";
  }

  void read_motion(const XMLElement& e, OutlineJoint& joint, const std::string& key) {
    const std::vector<double> axis =
        numbers(child(e, "axis", key, Needed::kNo), "xyz", 3, key, Needed::kYes);
    if (!axis.empty() && std::hypot(axis[0], axis[1], axis[2]) < 1e-6) {
      error(joint.line, key, "the axis has no length", "give a direction, for example 0 0 1");
    }
    (void)child(e, "limit", key, Needed::kNo);
    limits_.read(e, joint, key, out_.warnings);
  }

  const std::string& file_;
  const UrdfOptions& options_;
  std::string encoding_;  // that the file declares, if it is not UTF-8
  tinyxml2::XMLDocument document_;
  tinyxml2::XMLDocument reduced_;
  Outline out_;
  Vocabulary vocabulary_;
  LimitsReader limits_;
};

}  // namespace

Outline outline_urdf(std::string_view text, const std::string& file, const UrdfOptions& options) {
  return Reader(file, options).run(text);
}

}  // namespace tandem::model
