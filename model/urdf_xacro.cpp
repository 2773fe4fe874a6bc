// Searches elements and attributes for <xacro:...>, ${...} and $(...), and reports the first with
// the number of the others.
#include "model/urdf_xacro.hpp"

#include <string_view>

namespace tandem::model {
namespace {

using tinyxml2::XMLElement;

/// What xacro left in an element's attributes, or empty.
std::string left_in(const XMLElement& e) {
  for (const auto* a = e.FirstAttribute(); a != nullptr; a = a->Next()) {
    const std::string_view value = a->Value();
    if (value.contains("${") || value.contains("$(")) return std::string(value);
  }
  return {};
}

class Search {
 public:
  explicit Search(const std::string& file) : file_(file) {}

  std::optional<Error> run(const XMLElement& robot) {
    for (const XMLElement* e = robot.FirstChildElement(); e; e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      const bool matters = name == "link" || name == "joint";
      if (name.starts_with("xacro:") || matters) {
        const char* own = matters ? e->Attribute("name") : nullptr;
        key_ = std::string(name) + (own == nullptr ? "" : " " + std::string(own));
        visit(*e, matters);
      }
    }
    if (first_ && places_ > 1) {
      first_->message += places_ == 2 ? ", as in one more place"
                                      : ", as in " + std::to_string(places_ - 1) + " more places";
    }
    return first_;
  }

 private:
  /// The depth is bounded: the parser refuses what is nested deeper.
  void visit(const XMLElement& e, bool attributes) {
    const std::string_view name = e.Name();
    if (name.starts_with("xacro:")) {
      return found(e, "<" + std::string(name) + "> is xacro, not URDF");
    }
    attributes = attributes && name != "visual" && name != "collision";
    if (attributes) {
      if (const std::string left = left_in(e); !left.empty()) {
        found(e, "'" + left + "' was left by xacro");
      }
    }
    for (const XMLElement* c = e.FirstChildElement(); c; c = c->NextSiblingElement()) {
      visit(*c, attributes);
    }
  }

  void found(const XMLElement& e, std::string message) {
    if (++places_ > 1) return;
    first_ = Error{.message = std::move(message),
                   .hint = "expand the xacro first: xacro FILE > robot.urdf",
                   .file = file_,
                   .line = e.GetLineNum(),
                   .key = key_};
  }

  const std::string& file_;
  std::string key_;
  std::optional<Error> first_;
  int places_ = 0;
};

}  // namespace

std::optional<Error> find_xacro(const XMLElement& robot, const std::string& file) {
  return Search(file).run(robot);
}

}  // namespace tandem::model
