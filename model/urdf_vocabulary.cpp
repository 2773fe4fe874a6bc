#include "model/urdf_vocabulary.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/bounds.hpp"
#include "base/counted.hpp"
#include "base/nearest.hpp"

namespace tandem::model {
namespace {

using tinyxml2::XMLAttribute;
using tinyxml2::XMLElement;

struct Words {
  std::vector<std::string> elements, attributes;
};

/// Of the elements that are read; null: nobody reads what is in it.
const Words* known_in(std::string_view element) {
  static const std::map<std::string, Words, std::less<>> kWords{
      {"link", {{"inertial", "visual", "collision"}, {"name", "type"}}},
      {"joint",
       {{"parent", "child", "origin", "axis", "limit", "dynamics", "mimic", "calibration",
         "safety_controller"},
        {"name", "type"}}},
      {"inertial", {{"origin", "mass", "inertia"}, {}}},
      {"origin", {{}, {"xyz", "rpy"}}},
      {"mass", {{}, {"value"}}},
      {"inertia", {{}, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}}},
      {"parent", {{}, {"link"}}},
      {"child", {{}, {"link"}}},
      {"axis", {{}, {"xyz"}}},
      {"limit",
       {{}, {"lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk"}}},
      {"mimic", {{}, {"joint", "multiplier", "offset"}}}};
  const auto found = kWords.find(element);
  return found == kWords.end() ? nullptr : &found->second;
}

bool has(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// The nearest word; any, when so much is wrong that no more is listed.
std::string meant_by(const std::string& name, const std::vector<std::string>& words,
                     const Diagnostics& errors) {
  return errors.size() > bounds::kErrors.most ? name : nearest(name, words);
}

}  // namespace

void Vocabulary::look_at(const XMLElement& e, const std::string& key, Diagnostics& errors) {
  const Words* words = known_in(e.Name());
  if (words == nullptr) return;
  look_at_attributes(e, key, errors);
  for (const XMLElement* child = e.FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    const std::string name = child->Name();
    if (has(words->elements, name)) {
      look_at(*child, key, errors);
      continue;
    }
    if (const std::string meant = meant_by(name, words->elements, errors); !meant.empty()) {
      add_error(errors, {"unknown element <" + name + "> in <" + e.Name() + ">",
                         "did you mean <" + meant + ">?", file_, child->GetLineNum(), key});
      continue;
    }
    Place& place = unused_["the element <" + name + "> in <" + e.Name() + ">"];
    if (place.count++ == 0) place.line = child->GetLineNum();
  }
}

void Vocabulary::look_at_attributes(const XMLElement& e, const std::string& key,
                                    Diagnostics& errors) {
  const std::vector<std::string>& known = known_in(e.Name())->attributes;
  const bool origin = std::string_view(e.Name()) == "origin";
  for (const XMLAttribute* one = e.FirstAttribute(); one != nullptr; one = one->Next()) {
    const std::string name = one->Name();
    if (has(known, name)) continue;
    std::string hint;
    if (const std::string meant = meant_by(name, known, errors); !meant.empty())
      hint = "did you mean '" + meant + "'?";
    if (origin && hint.empty())
      hint = "a place is given by 'xyz' and 'rpy' (roll, pitch, yaw in rad)";
    if (!hint.empty()) {
      add_error(errors, {"unknown attribute '" + name + "' of <" + e.Name() + ">", hint, file_,
                         e.GetLineNum(), key});
      continue;
    }
    Place& place = unused_["the attribute '" + name + "' of <" + e.Name() + ">"];
    if (place.count++ == 0) place.line = e.GetLineNum();
  }
}

void Vocabulary::warn(Diagnostics& warnings) const {
  for (const auto& [what, place] : unused_) {
    const std::string more =
        place.count == 1 ? "" : ", nor in " + counted(place.count - 1, "more place");
    add_error(warnings, {what + " is not used" + more, {}, file_, place.line, {}});
  }
}

}  // namespace tandem::model
