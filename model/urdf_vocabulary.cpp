#include "model/urdf_vocabulary.hpp"

#include <algorithm>
#include <cmath>
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

/// Words of an element that is read; null: nobody reads what is in it.
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
      {"mimic", {{}, {"joint", "multiplier", "offset"}}},
      {"safety_controller",
       {{}, {"soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"}}}};
  const auto found = kWords.find(element);
  return found == kWords.end() ? nullptr : &found->second;
}

bool has(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// Elements that may be left out of a link or joint without another motion.
bool is_idle(std::string_view element) {
  for (const char* one : {"visual", "collision", "dynamics", "calibration", "safety_controller"})
    if (element == one) return true;
  return false;
}

/// How much longer or shorter than the word a slip of the finger may be.
constexpr std::size_t kSlip = 2;

/// The word that was meant, or empty: collision_checking is an extension, not a misspelt
/// collision. What is not written nearly alike was meant only where the word itself is missing.
/// Any word, when so much is wrong that no more is listed.
template <class IsThere>
std::string meant_by(const std::string& name, const std::vector<std::string>& words,
                     const Diagnostics& errors, const IsThere& is_there) {
  if (errors.size() > bounds::kErrors.most) return name;
  std::string word = nearest(name, words);
  const std::size_t longer =
      std::max(name.size(), word.size()) - std::min(name.size(), word.size());
  if (longer > kSlip && (is_idle(word) || is_there(word))) return {};
  return word;
}

bool in_namespace(std::string_view name) { return name.find(':') != std::string_view::npos; }

/// xmlns="…" and xmlns:drake="…" only say what a namespace is.
bool declares_namespace(std::string_view name) {
  return name == "xmlns" || name.starts_with("xmlns:");
}

/// The entry that an entry below the diagonal of a full inertia matrix repeats.
const char* mirrored(std::string_view name) {
  return name == "iyx" ? "ixy" : name == "izx" ? "ixz" : name == "izy" ? "iyz" : nullptr;
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
    if (in_namespace(name)) {
      count(foreign_, "<" + name + "> in <" + e.Name() + ">", child->GetLineNum());
      continue;
    }
    const auto is_there = [&e](const std::string& word) {
      return e.FirstChildElement(word.c_str()) != nullptr;
    };
    if (const std::string meant = meant_by(name, words->elements, errors, is_there);
        !meant.empty()) {
      add_error(errors, {"unknown element <" + name + "> in <" + e.Name() + ">",
                         "did you mean <" + meant + ">?", file_, child->GetLineNum(), key});
      continue;
    }
    count(unused_, "the element <" + name + "> in <" + e.Name() + ">", child->GetLineNum());
  }
}

bool Vocabulary::takes_foreign(const XMLElement& e) {
  if (!in_namespace(e.Name())) return false;
  count(foreign_, std::string("<") + e.Name() + ">", e.GetLineNum());
  return true;
}

void Vocabulary::pass_over(const XMLElement& e) {
  count(unused_, std::string("the element <") + e.Name() + ">", e.GetLineNum());
}

void Vocabulary::count(std::map<std::string, Place>& places, const std::string& what, int line) {
  Place& place = places[what];
  if (place.count++ == 0) place.line = line;
}

void Vocabulary::look_at_attributes(const XMLElement& e, const std::string& key,
                                    Diagnostics& errors) {
  const std::vector<std::string>& known = known_in(e.Name())->attributes;
  const bool origin = std::string_view(e.Name()) == "origin";
  const bool inertia = std::string_view(e.Name()) == "inertia";
  if (inertia) look_at_mirrored(e, key, errors);
  for (const XMLAttribute* one = e.FirstAttribute(); one != nullptr; one = one->Next()) {
    const std::string name = one->Name();
    if (has(known, name) || declares_namespace(name)) continue;
    if (in_namespace(name)) {
      count(foreign_, name + " of <" + e.Name() + ">", e.GetLineNum());
      continue;
    }
    if (inertia && mirrored(name) != nullptr) continue;
    std::string hint;
    const auto is_there = [&e](const std::string& word) {
      return e.Attribute(word.c_str()) != nullptr;
    };
    if (const std::string meant = meant_by(name, known, errors, is_there); !meant.empty())
      hint = "did you mean '" + meant + "'?";
    if (origin && hint.empty())
      hint = "a place is given by 'xyz' and 'rpy' (roll, pitch, yaw in rad)";
    if (!hint.empty()) {
      add_error(errors, {"unknown attribute '" + name + "' of <" + e.Name() + ">", hint, file_,
                         e.GetLineNum(), key});
      continue;
    }
    count(unused_, "the attribute '" + name + "' of <" + e.Name() + ">", e.GetLineNum());
  }
}

/// An inertia is symmetric: iyx may be there where it repeats ixy.
void Vocabulary::look_at_mirrored(const XMLElement& inertia, const std::string& key,
                                  Diagnostics& errors) {
  constexpr double kRounding = 1e-6;  // of the largest entry: the digits of the file
  double largest = 0.0;
  for (const XMLAttribute* one = inertia.FirstAttribute(); one != nullptr; one = one->Next())
    largest = std::max(largest, std::abs(one->DoubleValue()));
  for (const XMLAttribute* one = inertia.FirstAttribute(); one != nullptr; one = one->Next()) {
    const std::string name = one->Name();
    const char* const other = mirrored(name);
    if (other == nullptr) continue;
    double below = 0.0, above = 0.0;
    if (inertia.Attribute(other) == nullptr) {
      add_error(errors,
                {"unknown attribute '" + name + "' of <inertia>",
                 std::string("did you mean '") + other + "'?", file_, inertia.GetLineNum(), key});
    } else if (one->QueryDoubleValue(&below) != tinyxml2::XML_SUCCESS ||
               inertia.QueryDoubleAttribute(other, &above) != tinyxml2::XML_SUCCESS ||
               !(std::abs(below - above) <= kRounding * largest)) {
      add_error(errors, {"'" + name + "' of <inertia> is \"" + one->Value() + "\", but '" + other +
                             "' is \"" + inertia.Attribute(other) + "\"",
                         "an inertia is symmetric: correct one of them, or remove '" + name + "'",
                         file_, inertia.GetLineNum(), key});
    }
  }
}

void Vocabulary::warn_of_foreign(Diagnostics& warnings) const {
  constexpr std::size_t kNamed = 6;
  if (foreign_.empty()) return;
  std::string names;
  std::size_t places = 0, named = 0;
  int line = foreign_.begin()->second.line;
  for (const auto& [what, place] : foreign_) {
    places += place.count;
    line = std::min(line, place.line);
    if (++named <= kNamed) names += (names.empty() ? "" : ", ") + what;
  }
  if (named > kNamed) names += ", and " + std::to_string(named - kNamed) + " more";
  add_error(warnings, {"what is in other XML namespaces is not used (" + counted(places, "place") +
                           "): " + names,
                       {},
                       file_,
                       line,
                       {}});
}

void Vocabulary::warn(Diagnostics& warnings) const {
  warn_of_foreign(warnings);
  for (const auto& [what, place] : unused_) {
    const std::string more =
        place.count == 1 ? "" : ", nor in " + counted(place.count - 1, "more place");
    add_error(warnings, {what + " is not used" + more, {}, file_, place.line, {}});
  }
}

}  // namespace tandem::model
