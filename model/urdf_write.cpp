// Edits the text itself, between the bytes where elements begin and end, so that what is not
// replaced keeps its layout.
#include "model/urdf_write.hpp"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <set>

#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "base/xml_scan.hpp"
#include "model/placements.hpp"

namespace tandem::model {
namespace {

/// The shortest decimal number that is read back as the same double.
std::string shortest_text(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value + 0.0).ptr;  // no -0
  return {text, end};
}

std::string shortest_texts(const Eigen::Vector3d& v) {
  return shortest_text(v.x()) + " " + shortest_text(v.y()) + " " + shortest_text(v.z());
}

/// An element's bytes: [begin, end) with its tags, [inside, inside_end) between them. One that
/// closes itself (<a/>) has inside = inside_end = end.
struct Element {
  std::string name;
  std::size_t begin = 0, inside = 0, inside_end = 0, end = 0;
  std::size_t depth = 0;  // of the root: 0
};

/// Every element, in the order in which they begin. @pre `text` is well-formed
std::vector<Element> elements_of(std::string_view text) {
  std::vector<Element> all;
  std::vector<std::size_t> open;  // of all
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
    if (const auto behind = behind_no_tag(text, at)) {
      at = *behind;
      continue;
    }
    const std::size_t end = behind_tag(text, at);
    if (text.substr(at).starts_with("</")) {
      if (open.empty()) break;
      all[open.back()].inside_end = at;
      all[open.back()].end = end;
      open.pop_back();
    } else {
      const std::size_t name_end = text.find_first_of(" \t\r\n/>", at);
      all.push_back(
          {std::string(text.substr(at + 1, name_end - at - 1)), at, end, end, end, open.size()});
      if (text[end - 2] != '/') open.push_back(all.size() - 1);
    }
    at = end;
  }
  return all;
}

/// The elements of this name directly within `parent`.
std::vector<Element> children(const std::vector<Element>& all, const Element& parent,
                              std::string_view name) {
  std::vector<Element> found;
  std::ranges::copy_if(all, std::back_inserter(found), [&](const Element& e) {
    return e.depth == parent.depth + 1 && e.begin >= parent.inside && e.end <= parent.inside_end &&
           e.name == name;
  });
  return found;
}

/// The value of the tag's attribute `name`, its entities resolved.
std::string name_attribute(std::string_view text, const Element& element) {
  std::string tag(text.substr(element.begin, element.inside - element.begin));
  if (!tag.ends_with("/>")) tag.insert(tag.size() - 1, "/");
  tinyxml2::XMLDocument alone;
  if (alone.Parse(tag.c_str()) != tinyxml2::XML_SUCCESS) return {};
  const char* value = alone.RootElement()->Attribute("name");
  return value == nullptr ? "" : value;
}

/// The blanks before an element that has its line for itself.
std::string indentation(std::string_view text, std::size_t begin) {
  std::size_t line = begin;
  while (line > 0 && (text[line - 1] == ' ' || text[line - 1] == '\t')) --line;
  return line == 0 || text[line - 1] == '\n' ? std::string(text.substr(line, begin - line)) : "";
}

struct Edit {
  std::size_t begin, end;
  std::string text;
};

using Part = std::pair<std::string, std::string>;  // an inertial's: name, whole element

std::vector<Part> parts_of(const Inertia& inertia) {
  const Eigen::Vector3d& c = inertia.com_m;
  const Eigen::Matrix3d& I = inertia.about_com_kg_m2;
  std::string moments = "<inertia";
  const std::pair<const char*, double> entries[] = {{"ixx", I(0, 0)}, {"ixy", I(0, 1)},
                                                    {"ixz", I(0, 2)}, {"iyy", I(1, 1)},
                                                    {"iyz", I(1, 2)}, {"izz", I(2, 2)}};
  for (const auto& [name, value] : entries)
    moments += std::string(" ") + name + "=\"" + shortest_text(value) + "\"";
  return {{"origin", "<origin xyz=\"" + shortest_texts(c) + "\" rpy=\"0 0 0\"/>"},
          {"mass", "<mass value=\"" + shortest_text(inertia.mass_kg) + "\"/>"},
          {"inertia", moments + "/>"}};
}

/// Parts that are there are replaced where they stand; others come first.
void edit_inertial(std::string_view text, const std::vector<Element>& all, const Element& inertial,
                   const Inertia& inertia, std::vector<Edit>& edits) {
  const std::string outer = indentation(text, inertial.begin);
  std::string more;
  for (const auto& [name, element] : parts_of(inertia)) {
    const std::vector<Element> found = children(all, inertial, name);
    if (!found.empty()) {
      edits.push_back({found[0].begin, found[0].end, element});
    } else {
      more += "\n" + outer + "  " + element;
    }
  }
  if (inertial.inside == inertial.end) {  // <inertial/>
    edits.push_back(
        {inertial.begin, inertial.end, "<inertial>" + more + "\n" + outer + "</inertial>"});
  } else if (!more.empty()) {
    edits.push_back({inertial.inside, inertial.inside, more});
  }
}

/// A link without an inertial gets one, as the first thing in it.
void add_inertial(std::string_view text, const Element& link, const Inertia& inertia,
                  std::vector<Edit>& edits) {
  const std::string outer = indentation(text, link.begin);
  std::string inertial = "\n" + outer + "  <inertial>";
  for (const auto& [name, element] : parts_of(inertia)) inertial += "\n" + outer + "    " + element;
  inertial += "\n" + outer + "  </inertial>";
  if (link.inside != link.end) {
    edits.push_back({link.inside, link.inside, inertial});
    return;
  }
  std::string tag(text.substr(link.begin, link.end - link.begin));
  tag.erase(tag.rfind('/'), 1);
  edits.push_back({link.begin, link.end, tag + inertial + "\n" + outer + "</link>"});
}

}  // namespace

namespace {

/// `text` with the edits, which do not overlap.
std::string edited(std::string_view text, std::vector<Edit> edits) {
  std::ranges::stable_sort(edits, {}, &Edit::begin);
  std::string result;
  std::size_t at = 0;
  for (const Edit& edit : edits) {
    result += text.substr(at, edit.begin - at);
    result += edit.text;
    at = edit.end;
  }
  return result.append(text.substr(at));
}

/// A joint's ends.
struct Edge {
  std::string joint, parent, child, leader;  // whom it mimics, or empty
};

std::vector<Edge> edges_of(const tinyxml2::XMLElement& robot) {
  const auto value = [](const tinyxml2::XMLElement* e, const char* name) {
    const char* const text = e == nullptr ? nullptr : e->Attribute(name);
    return std::string(text == nullptr ? "" : text);
  };
  std::vector<Edge> edges;
  for (const auto* e = robot.FirstChildElement("joint"); e != nullptr;
       e = e->NextSiblingElement("joint")) {
    edges.push_back({value(e, "name"), value(e->FirstChildElement("parent"), "link"),
                     value(e->FirstChildElement("child"), "link"),
                     value(e->FirstChildElement("mimic"), "joint")});
  }
  return edges;
}

/// The link that a name leaves out: it, or the child of the joint so named.
Result<std::string> first_dropped(const std::string& name, const std::vector<Edge>& edges) {
  std::vector<std::string> known;
  for (const Edge& edge : edges) {
    if (edge.child == name || edge.joint == name) return edge.child;
    known.push_back(edge.joint);
    known.push_back(edge.child);
  }
  const bool root = std::ranges::find(edges, name, &Edge::parent) != edges.end();
  if (root) return fail("'" + name + "' is the root: nothing would be left", "name another link");
  return fail("the description has no link and no joint '" + name + "'", suggest(name, known));
}

std::unexpected<Error> orphaned(const Edge& edge) {
  return fail(
      "joint '" + edge.joint + "' mimics joint '" + edge.leader + "', which goes away",
      "leave it out, too: --drop " + edge.joint + "; or let it stand still: --lock " + edge.joint);
}

/// The element with its line, where that has nothing else.
Edit removed(std::string_view text, const Element& element) {
  Edit edit{element.begin, element.end, {}};
  while (edit.begin > 0 && (text[edit.begin - 1] == ' ' || text[edit.begin - 1] == '\t'))
    --edit.begin;
  const bool alone = edit.begin == 0 || text[edit.begin - 1] == '\n';
  if (!alone) edit.begin = element.begin;
  if (alone && edit.end < text.size() && text[edit.end] == '\n') ++edit.end;
  return edit;
}

}  // namespace

Result<std::string> without_limbs(std::string_view text, const std::vector<std::string>& names,
                                  const std::vector<std::string>& still) {
  tinyxml2::XMLDocument document;
  const std::string plain = without_instructions(text);
  if (document.Parse(plain.data(), plain.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return fail("the description is no XML", "name a URDF");
  }
  const std::vector<Edge> edges = edges_of(*document.RootElement());
  std::set<std::string> links;
  std::vector<std::string> open;
  for (const std::string& name : names) {
    const Result<std::string> first = first_dropped(name, edges);
    if (!first) return std::unexpected(first.error());
    open.push_back(*first);
  }
  while (!open.empty()) {
    const std::string link = open.back();
    open.pop_back();
    if (!links.insert(link).second) continue;
    for (const Edge& edge : edges)
      if (edge.parent == link) open.push_back(edge.child);
  }
  std::set<std::string> joints;
  for (const Edge& edge : edges)
    if (links.contains(edge.child)) joints.insert(edge.joint);
  std::set<std::string> freed;  // joints that are left, and whose leader is not
  for (const Edge& edge : edges) {
    if (joints.contains(edge.joint) || !joints.contains(edge.leader)) continue;
    if (std::ranges::find(still, edge.joint) == still.end()) return orphaned(edge);
    freed.insert(edge.joint);
  }
  const std::vector<Element> all = elements_of(text);
  std::vector<Edit> edits;
  for (const Element& element : children(all, all.front(), "joint")) {
    if (!freed.contains(name_attribute(text, element))) continue;
    for (const Element& mimic : children(all, element, "mimic"))
      edits.push_back(removed(text, mimic));
  }
  for (const auto& [kind, gone] : {std::pair{"link", &links}, {"joint", &joints}}) {
    for (const Element& element : children(all, all.front(), kind))
      if (gone->contains(name_attribute(text, element))) edits.push_back(removed(text, element));
  }
  return edited(text, std::move(edits));
}

Result<std::string> with_inertias(std::string_view text,
                                  const std::vector<std::pair<std::string, Inertia>>& inertias) {
  tinyxml2::XMLDocument document;
  const std::string plain = without_instructions(text);
  if (document.Parse(plain.data(), plain.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return fail("the description is no XML", "name a URDF");
  }
  const std::vector<Element> all = elements_of(text);
  const std::vector<Element> links = children(all, all.front(), "link");
  std::vector<Edit> edits;
  for (const auto& [name, inertia] : inertias) {
    const auto link = std::ranges::find_if(
        links, [&](const Element& e) { return name_attribute(text, e) == name; });
    if (link == links.end()) return fail("the description has no link '" + name + "'");
    const std::vector<Element> inertials = children(all, *link, "inertial");
    if (inertials.empty()) {
      add_inertial(text, *link, inertia, edits);
    } else {
      edit_inertial(text, all, inertials[0], inertia, edits);
    }
  }
  return edited(text, std::move(edits));
}

Result<std::string> with_fixed(std::string_view text,
                               const std::vector<std::pair<std::string, Placement>>& placements) {
  tinyxml2::XMLDocument document;
  const std::string plain = without_instructions(text);
  if (document.Parse(plain.data(), plain.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return fail("the description is no XML", "name a URDF");
  }
  const std::vector<Element> all = elements_of(text);
  const std::vector<Element> joints = children(all, all.front(), "joint");
  std::vector<Edit> edits;
  for (const auto& [name, placement] : placements) {
    const auto joint = std::ranges::find_if(
        joints, [&](const Element& e) { return name_attribute(text, e) == name; });
    if (joint == joints.end()) return fail("the description has no joint '" + name + "'");
    const std::string outer = indentation(text, joint->begin);
    const std::array<double, 3> rpy = rpy_of(placement.R);
    std::string fixed = "<joint name=\"" + xml_text(name) + "\" type=\"fixed\">\n" + outer +
                        "  <origin xyz=\"" + shortest_texts(placement.p) + "\" rpy=\"" +
                        shortest_texts(Eigen::Vector3d(rpy.data())) + "\"/>\n";
    for (const char* end : {"parent", "child"}) {
      const std::vector<Element> found = children(all, *joint, end);
      if (found.empty()) return fail("joint '" + name + "' has no <" + std::string(end) + ">");
      fixed += outer + "  ";
      fixed += text.substr(found[0].begin, found[0].end - found[0].begin);
      fixed += '\n';
    }
    edits.push_back({joint->begin, joint->end, fixed + outer + "</joint>"});
  }
  return edited(text, std::move(edits));
}

}  // namespace tandem::model
