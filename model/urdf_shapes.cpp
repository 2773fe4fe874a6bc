// Boxes, spheres, cylinders and capsules by link; a shape without usable dimensions counts as a
// mesh.
#include "model/urdf_shapes.hpp"

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <sstream>

#include "base/xml_scan.hpp"

namespace tandem::model {
namespace {

using Eigen::Vector3d;
using tinyxml2::XMLElement;

Vector3d vector(const XMLElement* e, const char* name) {
  const char* text = e == nullptr ? nullptr : e->Attribute(name);
  Vector3d v = Vector3d::Zero();
  std::istringstream words(text == nullptr ? "" : text);
  words >> v.x() >> v.y() >> v.z();
  return words && v.allFinite() ? v : Vector3d::Zero().eval();
}

Placement origin(const XMLElement& e) {
  const XMLElement* at = e.FirstChildElement("origin");
  const Vector3d rpy = vector(at, "rpy");
  return {(Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
           Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
           Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
              .toRotationMatrix(),
          vector(at, "xyz")};
}

}  // namespace

Shape shape_of(const XMLElement& collision) {
  Shape shape;
  shape.in_link = origin(collision);
  const XMLElement* geometry = collision.FirstChildElement("geometry");
  const XMLElement* form = geometry == nullptr ? nullptr : geometry->FirstChildElement();
  if (form == nullptr) return shape;
  const std::string_view name = form->Name();
  if (name == "box") {
    shape.kind = Shape::Kind::kBox;
    shape.size_m = vector(form, "size");
  } else if (name == "sphere") {
    shape.kind = Shape::Kind::kSphere;
    shape.size_m.x() = form->DoubleAttribute("radius");
  } else if (name == "cylinder" || name == "capsule") {
    shape.kind = name == "capsule" ? Shape::Kind::kCapsule : Shape::Kind::kCylinder;
    shape.size_m = {form->DoubleAttribute("radius"), 0.0, form->DoubleAttribute("length")};
  }
  if (!(shape.size_m.x() > 0.0)) shape.kind = Shape::Kind::kMesh;  // no usable figures
  return shape;
}

std::map<std::string, std::vector<Shape>> collision_shapes(std::string_view text) {
  std::map<std::string, std::vector<Shape>> shapes;
  tinyxml2::XMLDocument document;
  const std::string plain = without_instructions(text);
  const XMLElement* robot = document.Parse(plain.data(), plain.size()) == tinyxml2::XML_SUCCESS
                                ? document.FirstChildElement("robot")
                                : nullptr;
  if (robot == nullptr) return shapes;
  for (const XMLElement* link = robot->FirstChildElement("link"); link != nullptr;
       link = link->NextSiblingElement("link")) {
    const char* name = link->Attribute("name");
    for (const XMLElement* c = link->FirstChildElement("collision");
         c != nullptr && name != nullptr; c = c->NextSiblingElement("collision")) {
      shapes[name].push_back(shape_of(*c));
    }
  }
  return shapes;
}

}  // namespace tandem::model
