// What <limit>, <safety_controller> and <dynamics> of a URDF's joints say.
// Layer: model, private to urdf*.cpp.  Thread: non-RT only.
#pragma once

#include <tinyxml2.h>

#include <string>
#include <string_view>
#include <vector>

#include "base/result.hpp"
#include "model/urdf_outline.hpp"

namespace tandem::model {

/// Reads the limits of one joint after the other. Limits that make no sense are left to
/// robot.toml, with a note. Exporters write "no limit" as infinity, NaN, 1e16 or 999999: what is
/// beyond 1000 turns, 1000 m, or 1e15 of another unit is none, and that is said once.
class LimitsReader {
 public:
  /// @param file  both outlive this
  LimitsReader(const std::string& file, Diagnostics& errors) : file_(file), errors_(errors) {}

  /// @param joint  its type is known already
  void read(const tinyxml2::XMLElement& element, OutlineJoint& joint, const std::string& key,
            Diagnostics& warnings);
  /// Warnings that stand once for all joints.
  void warn(Diagnostics& warnings) const;

 private:
  struct Said {
    std::vector<std::string> joints;
    std::string example;
    int line = 0;
    void add(const std::string& joint, int at, std::string_view what);
  };

  [[nodiscard]] double number(const tinyxml2::XMLElement& e, const char* name, double none,
                              const std::string& key);
  [[nodiscard]] double most(const tinyxml2::XMLElement& e, const char* name, OutlineJoint& joint,
                            const std::string& key);
  void note(OutlineJoint& joint, int line, const std::string& what) const;
  void read_limit(const tinyxml2::XMLElement& limit, OutlineJoint& joint, const std::string& key,
                  Diagnostics& warnings);
  void read_range(const tinyxml2::XMLElement& limit, OutlineJoint& joint, const std::string& key,
                  Diagnostics& warnings);
  void read_endless(const tinyxml2::XMLElement& limit, OutlineJoint& joint);
  void read_safety(const tinyxml2::XMLElement& safety, OutlineJoint& joint, const std::string& key,
                   Diagnostics& warnings);
  void read_dynamics(const tinyxml2::XMLElement& dynamics, OutlineJoint& joint);

  const std::string& file_;
  Diagnostics& errors_;
  Said turning_;  // revolute joints without limits
  Said damped_;
};

}  // namespace tandem::model
