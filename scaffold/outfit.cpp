// <sensor> elements, which urdfdom does not read, straight from the XML.
#include "scaffold/outfit.hpp"

#include <tinyxml2.h>

namespace tandem::scaffold {
namespace {

using tinyxml2::XMLElement;

std::string text_of(const XMLElement& e, const char* attribute) {
  const char* text = e.Attribute(attribute);
  return text == nullptr ? "" : text;
}

}  // namespace

Outfit read_outfit(std::string_view text) {
  Outfit outfit;
  tinyxml2::XMLDocument document;
  const XMLElement* robot = document.Parse(text.data(), text.size()) == tinyxml2::XML_SUCCESS
                                ? document.FirstChildElement("robot")
                                : nullptr;
  if (robot == nullptr) return outfit;
  for (const XMLElement* e = robot->FirstChildElement("sensor"); e != nullptr;
       e = e->NextSiblingElement("sensor")) {
    const XMLElement* parent = e->FirstChildElement("parent");
    if (parent == nullptr) continue;
    const std::string joint = text_of(*parent, "joint");
    outfit.sensors.push_back({text_of(*e, "name"), text_of(*e, "type"),
                              joint.empty() ? text_of(*parent, "link") : joint});
  }
  return outfit;
}

}  // namespace tandem::scaffold
