// Which elements and attributes a URDF's links and joints may have, and what is said of others.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <tinyxml2.h>

#include <map>
#include <string>

#include "base/result.hpp"

namespace tandem::model {

/// Looks at elements one after the other. What is misspelt, or would turn something, is an error;
/// whatever else nobody reads is named once for all places in which it is. What is in a namespace
/// of its own (drake:acceleration) cannot be misspelt: all of it is named in one warning.
class Vocabulary {
 public:
  explicit Vocabulary(const std::string& file) : file_(file) {}

  /// Checks `e` and what is in it.
  /// @param key  "link NAME" or "joint NAME"
  void look_at(const tinyxml2::XMLElement& e, const std::string& key, Diagnostics& errors);
  /// Whether the name of an element in <robot> is in a namespace; then it is counted here.
  bool takes_foreign(const tinyxml2::XMLElement& e);
  /// An element in <robot> that nobody reads.
  void pass_over(const tinyxml2::XMLElement& e);
  /// A warning for each name that is not used.
  void warn(Diagnostics& warnings) const;

 private:
  struct Place {
    int line = 0;
    std::size_t count = 0;
  };
  void look_at_attributes(const tinyxml2::XMLElement& e, const std::string& key,
                          Diagnostics& errors);
  void look_at_mirrored(const tinyxml2::XMLElement& inertia, const std::string& key,
                        Diagnostics& errors);
  static void count(std::map<std::string, Place>& places, const std::string& what, int line);
  void warn_of_foreign(Diagnostics& warnings) const;

  const std::string& file_;
  std::map<std::string, Place> unused_;   // "<contact> in <link>"
  std::map<std::string, Place> foreign_;  // "drake:acceleration of <limit>"
};

}  // namespace tandem::model
