#include "model/shape_mass.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <sstream>

#include "base/counted.hpp"
#include "base/open_file.hpp"
#include "base/xml_scan.hpp"
#include "model/stl_mesh.hpp"
#include "model/urdf_inertia.hpp"
#include "model/urdf_shapes.hpp"

namespace tandem::model {
namespace {

using Eigen::Vector3d;
using tinyxml2::XMLElement;
namespace fs = std::filesystem;

constexpr double kPi = std::numbers::pi;
constexpr double kLargest_m = 10.0;  // of a link
constexpr int kLevels = 8;           // of folders above the description, in which a package may be

Inertia solid(double mass_kg, const Vector3d& moments) {
  return {mass_kg, Vector3d::Zero(), moments.asDiagonal()};
}

Inertia box(const Vector3d& edges, double density) {
  const double m = density * edges.prod();
  const Vector3d squares = edges.cwiseProduct(edges);
  return solid(m, m / 12.0 * (Vector3d::Constant(squares.sum()) - squares));
}

Inertia cylinder(double r, double l, double density) {
  const double m = density * kPi * r * r * l;
  const double across = m * (r * r / 4.0 + l * l / 12.0);
  return solid(m, {across, across, 0.5 * m * r * r});
}

/// A cylinder, and half a ball at either end.
Inertia capsule(double r, double l, double density) {
  const Inertia middle = cylinder(r, l, density);
  const double m = density * 4.0 / 3.0 * kPi * r * r * r;
  const double along = 0.4 * m * r * r;
  const double across = along + m * (0.25 * l * l + 0.375 * l * r);
  return solid(middle.mass_kg + m,
               middle.about_com_kg_m2.diagonal() + Vector3d(across, across, along));
}

/// The inertia of a shape that is no mesh, in its own frame.
Inertia solid_of(const Shape& shape, double density) {
  const Vector3d& s = shape.size_m;
  switch (shape.kind) {
    case Shape::Kind::kBox: return box(s, density);
    case Shape::Kind::kSphere: return capsule(s.x(), 0.0, density);
    case Shape::Kind::kCylinder: return cylinder(s.x(), s.z(), density);
    case Shape::Kind::kCapsule: return capsule(s.x(), s.z(), density);
    case Shape::Kind::kMesh: break;
  }
  return {};
}

/// The file of <mesh filename="…">; empty where none is found.
std::string find_mesh(const std::string& name, const std::string& description) {
  std::error_code ignored;
  std::string path = name;
  std::string package;
  for (const std::string_view scheme : {"package://", "model://"}) {
    if (!name.starts_with(scheme)) continue;
    path = name.substr(scheme.size());
    package = path.substr(0, path.find('/'));
  }
  if (name.starts_with("file://")) path = name.substr(7);
  fs::path folder = fs::absolute(description, ignored).parent_path();
  for (int level = 0; level < kLevels; ++level) {
    std::vector<fs::path> places{folder / path};
    if (!package.empty() && folder.filename() == package)
      places.push_back(folder.parent_path() / path);
    for (const fs::path& one : places)
      if (fs::is_regular_file(one, ignored)) return one.string();
    if (package.empty() || folder == folder.parent_path()) break;
    folder = folder.parent_path();
  }
  return {};
}

Vector3d scale_of(const XMLElement& mesh) {
  const char* const text = mesh.Attribute("scale");
  std::istringstream words(text == nullptr ? "1 1 1" : text);
  Vector3d scale = Vector3d::Ones();
  words >> scale.x() >> scale.y() >> scale.z();
  return words && scale.allFinite() ? scale : Vector3d::Ones().eval();
}

/// A shape's inertia in its own frame, and its longest side.
struct Solid {
  Inertia inertia;
  double longest_m = 0.0;
};

Solid box_around(const std::vector<Triangle>& surface, double density) {
  Vector3d least = surface[0][0], most = surface[0][0];
  for (const Triangle& one : surface) {
    for (const Vector3d& corner : one) {
      least = least.cwiseMin(corner);
      most = most.cwiseMax(corner);
    }
  }
  Solid found{box(most - least, density), (most - least).maxCoeff()};
  found.inertia.com_m = 0.5 * (least + most);
  return found;
}

double longest_m(const Shape& shape) {
  const Vector3d& s = shape.size_m;
  switch (shape.kind) {
    case Shape::Kind::kBox: return s.maxCoeff();
    case Shape::Kind::kSphere: return 2.0 * s.x();
    case Shape::Kind::kCylinder: return std::max(2.0 * s.x(), s.z());
    case Shape::Kind::kCapsule: return 2.0 * s.x() + s.z();
    case Shape::Kind::kMesh: break;
  }
  return 0.0;
}

Result<Solid> solid_of(const XMLElement& mesh, const std::string& description, double density) {
  const char* const text = mesh.Attribute("filename");
  const std::string name = text == nullptr ? "" : text;
  const std::string path = find_mesh(name, description);
  if (path.empty()) return fail("its mesh " + name + " is not found");
  const auto bytes = read_file(path, {}, kMostOtherBytes);
  if (!bytes) return fail("its mesh " + name + " cannot be read");
  auto surface = parse_stl(*bytes);
  if (!surface) return fail("its mesh " + name + ": " + surface.error().message);
  const Vector3d scale = scale_of(mesh);
  for (Triangle& one : *surface)
    for (Vector3d& corner : one) corner = corner.cwiseProduct(scale);
  Solid solid = box_around(*surface, density);
  const Inertia found = solid_within(*surface, density);
  const double box_kg = solid.inertia.mass_kg;
  const bool fits = found.mass_kg > 0.01 * box_kg && found.mass_kg <= box_kg;
  if (fits && inertia_problem(found).empty()) solid.inertia = found;
  return solid;
}

class Masses {
 public:
  Masses(const std::string& file, double density) : file_(file), density_(density) {}

  ShapeMasses run(const XMLElement& robot) {
    for (const XMLElement* link = robot.FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      const char* const name = link->Attribute("name");
      if (name != nullptr && !has_mass(*link)) read(*link, name);
    }
    return std::move(out_);
  }

 private:
  static bool has_mass(const XMLElement& link) {
    const XMLElement* const inertial = link.FirstChildElement("inertial");
    const XMLElement* const mass =
        inertial == nullptr ? nullptr : inertial->FirstChildElement("mass");
    return mass != nullptr && mass->DoubleAttribute("value") != 0.0;
  }

  void read(const XMLElement& link, const std::string& name) {
    const bool collides = link.FirstChildElement("collision") != nullptr;
    const char* const role = collides ? "collision" : "visual";
    Inertia whole;
    std::size_t shapes = 0, meshes = 0;
    for (const XMLElement* one = link.FirstChildElement(role); one != nullptr;
         one = one->NextSiblingElement(role)) {
      const Shape shape = shape_of(*one);
      const XMLElement* const geometry = one->FirstChildElement("geometry");
      const XMLElement* const mesh =
          geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
      const auto found = mesh != nullptr
                             ? solid_of(*mesh, file_, density_)
                             : Result<Solid>({solid_of(shape, density_), longest_m(shape)});
      if (!found) {
        out_.without.emplace_back(name, found.error().message);
        continue;
      }
      if (found->longest_m > kLargest_m) report_size(*one, mesh, name, found->longest_m);
      if (!(found->inertia.mass_kg > 0.0)) continue;
      ++(mesh != nullptr ? meshes : shapes);
      whole = whole + shape.in_link * found->inertia;
    }
    if (link.FirstChildElement(role) == nullptr) out_.without.emplace_back(name, kNoShape);
    if (shapes + meshes == 0) return;
    std::string from = shapes == 0 ? "" : counted(shapes, "shape");
    if (meshes != 0) from += (from.empty() ? "" : ", ") + counted(meshes, "mesh", "meshes");
    out_.links.push_back({name, whole, from});
  }

  void report_size(const XMLElement& element, const XMLElement* mesh, const std::string& link,
                   double longest_m) {
    char size[32];
    std::snprintf(size, sizeof size, "%.3g m long", longest_m);
    if (mesh == nullptr) {
      out_.errors.push_back({std::string("its shape is ") + size + ", more than any robot's",
                             "lengths are in metres", file_, element.GetLineNum(), "link " + link});
      return;
    }
    const char* const name = mesh->Attribute("filename");
    out_.errors.push_back({std::string("its mesh ") + (name == nullptr ? "" : name) + " is " +
                               size + ", more than any robot's: it is in millimetres, most likely",
                           "give the <mesh> scale=\"0.001 0.001 0.001\"", file_, mesh->GetLineNum(),
                           "link " + link});
  }

  const std::string& file_;
  double density_;
  ShapeMasses out_;
};

}  // namespace

ShapeMasses masses_from_shapes(std::string_view text, const std::string& file,
                               double density_kg_m3) {
  tinyxml2::XMLDocument document;
  const std::string plain = without_instructions(text);
  if (!check_xml_bounds(text, file)) return {};
  const XMLElement* const robot =
      document.Parse(plain.data(), plain.size()) == tinyxml2::XML_SUCCESS
          ? document.FirstChildElement("robot")
          : nullptr;
  return robot == nullptr ? ShapeMasses{} : Masses(file, density_kg_m3).run(*robot);
}

}  // namespace tandem::model
