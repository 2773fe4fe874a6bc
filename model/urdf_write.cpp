#include "model/urdf_write.hpp"

#include <tinyxml2.h>

#include <charconv>

namespace tandem::model {
namespace {

using tinyxml2::XMLElement;

/// The shortest decimal number that is read back as the same double.
std::string shortest_text(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value).ptr;
  return {text, end};
}

XMLElement* fresh(XMLElement* parent, const char* name) {
  if (XMLElement* old = parent->FirstChildElement(name)) parent->DeleteChild(old);
  return parent->InsertNewChildElement(name);
}

void write_inertial(XMLElement* link, const Inertia& inertia) {
  XMLElement* inertial = link->FirstChildElement("inertial");
  if (inertial == nullptr) inertial = link->InsertNewChildElement("inertial");
  const Eigen::Vector3d& c = inertia.com_m;
  XMLElement* origin = fresh(inertial, "origin");
  origin->SetAttribute(
      "xyz",
      (shortest_text(c.x()) + " " + shortest_text(c.y()) + " " + shortest_text(c.z())).c_str());
  origin->SetAttribute("rpy", "0 0 0");
  fresh(inertial, "mass")->SetAttribute("value", shortest_text(inertia.mass_kg).c_str());
  XMLElement* moments = fresh(inertial, "inertia");
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  const std::pair<const char*, double> entries[] = {{"ixx", I(0, 0)}, {"ixy", I(0, 1)},
                                                    {"ixz", I(0, 2)}, {"iyy", I(1, 1)},
                                                    {"iyz", I(1, 2)}, {"izz", I(2, 2)}};
  for (const auto& [name, value] : entries)
    moments->SetAttribute(name, shortest_text(value).c_str());
}

}  // namespace

Result<std::string> with_inertias(std::string_view text,
                                  const std::vector<std::pair<std::string, Inertia>>& inertias) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return fail("the description is no XML", "name a URDF");
  }
  for (const auto& [name, inertia] : inertias) {
    XMLElement* link = document.RootElement()->FirstChildElement("link");
    while (link != nullptr &&
           (link->Attribute("name") == nullptr || link->Attribute("name") != name))
      link = link->NextSiblingElement("link");
    if (link == nullptr) return fail("the description has no link '" + name + "'");
    write_inertial(link, inertia);
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return std::string(printer.CStr());
}

}  // namespace tandem::model
