// Force/torque sensors and IMUs by <sensor> type or name, one per wrench and one per body.
#include "scaffold/sensors.hpp"

#include <tinyxml2.h>

#include <algorithm>

#include "base/file_name.hpp"
#include "scaffold/words.hpp"

namespace tandem::scaffold {
namespace {

using model::Tree;

bool is_force_torque(const std::string& name) {
  if (mentions(name, "imu") || mentions(name, "gyro") || has_word(name, "acc")) return false;
  return has_word(name, "ft") || mentions(name, "force");
}

/// One <sensor>, as some simulators write it outside <gazebo>. urdfdom does not read it.
struct SensorElement {
  std::string name;
  std::string type;
  std::string parent;  // a joint or a link
};

std::string text_of(const tinyxml2::XMLElement& e, const char* attribute) {
  const char* text = e.Attribute(attribute);
  return text == nullptr ? "" : text;
}

/// What cannot be understood here is left out: it is only ever the ground of a guess.
std::vector<SensorElement> read_elements(std::string_view description) {
  std::vector<SensorElement> elements;
  tinyxml2::XMLDocument document;
  const bool parsed =
      document.Parse(description.data(), description.size()) == tinyxml2::XML_SUCCESS;
  const tinyxml2::XMLElement* robot = parsed ? document.FirstChildElement("robot") : nullptr;
  if (robot == nullptr) return elements;
  for (const auto* e = robot->FirstChildElement("sensor"); e != nullptr;
       e = e->NextSiblingElement("sensor")) {
    const tinyxml2::XMLElement* parent = e->FirstChildElement("parent");
    if (parent == nullptr) continue;
    const std::string joint = text_of(*parent, "joint");
    elements.push_back({text_of(*e, "name"), text_of(*e, "type"),
                        joint.empty() ? text_of(*parent, "link") : joint});
  }
  return elements;
}

class Finder {
 public:
  explicit Finder(const Tree& tree) : tree_(tree), mass_kg_(tree.links.size(), 0.0) {
    for (std::size_t i = tree.links.size(); i-- > 0;) {
      mass_kg_[i] += tree.links[i].inertia.mass_kg;
      if (tree.links[i].parent >= 0) mass_kg_[tree.links[i].parent] += mass_kg_[i];
    }
  }

  std::vector<FoundSensor> run(std::string_view description) {
    for (const SensorElement& element : read_elements(description)) {
      if (!mentions(element.type, "force")) continue;
      add_wrench(tree_.child_link_index(element.parent), element.name, {});
    }
    for (std::size_t i = 0; i < tree_.links.size(); ++i) {
      const model::Link& link = tree_.links[i];
      if (is_force_torque(link.name)) {
        add_wrench(static_cast<int>(i), link.name, by_name("link", link.name));
      }
    }
    for (std::size_t i = 0; i < tree_.links.size(); ++i) {
      const model::Link& link = tree_.links[i];
      if (mass_kg_[i] > 0.0 && is_force_torque(link.joint)) {
        add_wrench(static_cast<int>(i), link.joint, by_name("joint", link.joint));
      }
    }
    for (std::size_t i = 0; i < tree_.links.size(); ++i) {
      const std::string& name = tree_.links[i].name;
      if (mentions(name, "imu")) {
        add_imu(static_cast<int>(i), topic_token(name), by_name("link", name));
      }
    }
    const bool imu = std::ranges::any_of(
        found_, [](const FoundSensor& s) { return s.config.type == hal::SensorType::kImu; });
    if (tree_.floating_base && !imu) {
      add_imu(0, "base_imu", "the description names no IMU; say where it is, or remove it");
    }
    return std::move(found_);
  }

 private:
  /// The link beyond the joint that a sensor at `link` measures: a frame without mass measures
  /// for the link that it is fixed to, a chain of such frames is one sensor.
  [[nodiscard]] int measured(int link) const {
    while (link > 0 && !(mass_kg_[link] > 0.0)) link = tree_.links[link].parent;
    while (link > 0 && !(tree_.links[link].inertia.mass_kg > 0.0)) {
      int child = -1;
      for (std::size_t i = 0; i < tree_.links.size(); ++i) {
        if (tree_.links[i].parent != link) continue;
        if (child >= 0 || tree_.links[i].moving >= 0) return link;
        child = static_cast<int>(i);
      }
      link = child;
    }
    return link;
  }

  static std::string by_name(const std::string& what, const std::string& name) {
    return "by the name of the " + what + " " + name + "; remove it if your robot has none";
  }

  void add_wrench(int named, std::string name, const std::string& guess) {
    const int link = named < 0 ? -1 : measured(named);
    if (link <= 0 || (!tree_.floating_base && tree_.links[link].body == 0)) return;
    const std::string& joint = tree_.links[link].joint;
    int frame = link;  // the frame that the description made for it, when there is one
    for (std::size_t i = 0; i < tree_.links.size(); ++i) {
      const bool here = tree_.links[i].body == tree_.links[link].body;
      if (here && is_force_torque(tree_.links[i].name) && measured(static_cast<int>(i)) == link) {
        frame = static_cast<int>(i);
        name = tree_.links[i].name;
        break;
      }
    }
    name = topic_token(name);
    if (taken(joint, name)) return;
    FoundSensor sensor;
    sensor.config.name = name;
    sensor.config.type = hal::SensorType::kForceTorque;
    sensor.config.joint = joint;
    sensor.config.link = tree_.links[frame].name;
    sensor.body = tree_.links[link].body;
    sensor.guess = guess;
    found_.push_back(std::move(sensor));
  }

  void add_imu(int link, std::string name, const std::string& guess) {
    const int body = tree_.links[link].body;
    for (const FoundSensor& other : found_) {
      if (other.config.type == hal::SensorType::kImu && other.body == body) return;
    }
    FoundSensor sensor;
    sensor.config.name = std::move(name);
    while (taken({}, sensor.config.name)) sensor.config.name += "_2";
    sensor.config.type = hal::SensorType::kImu;
    sensor.config.link = tree_.links[link].name;
    sensor.body = body;
    sensor.guess = guess;
    found_.push_back(std::move(sensor));
  }

  [[nodiscard]] bool taken(const std::string& joint, const std::string& name) const {
    return std::ranges::any_of(found_, [&](const FoundSensor& s) {
      return (!joint.empty() && s.config.joint == joint) || s.config.name == name;
    });
  }

  const Tree& tree_;
  std::vector<double> mass_kg_;  ///< per link: of it and all beyond
  std::vector<FoundSensor> found_;
};

}  // namespace

std::vector<FoundSensor> find_sensors(const Tree& tree, std::string_view description) {
  return Finder(tree).run(description);
}

}  // namespace tandem::scaffold
