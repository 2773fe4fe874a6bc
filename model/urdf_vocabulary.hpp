// Which elements and attributes a URDF's links and joints may have, and what is said of others.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <tinyxml2.h>

#include <map>
#include <string>

#include "base/result.hpp"

namespace tandem::model {

/// Looks at elements one after the other. What is misspelt, or would turn something, is an error;
/// whatever else nobody reads is named once for all places in which it is.
class Vocabulary {
 public:
  explicit Vocabulary(const std::string& file) : file_(file) {}

  /// Of `e` and what is in it.
  /// @param key  "link NAME" or "joint NAME"
  void look_at(const tinyxml2::XMLElement& e, const std::string& key, Diagnostics& errors);
  /// A warning for each name that is not used.
  void warn(Diagnostics& warnings) const;

 private:
  struct Place {
    int line = 0;
    std::size_t count = 0;
  };
  void look_at_attributes(const tinyxml2::XMLElement& e, const std::string& key,
                          Diagnostics& errors);

  const std::string& file_;
  std::map<std::string, Place> unused_;  // "<contact> in <link>"
};

}  // namespace tandem::model
