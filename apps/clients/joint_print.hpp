// What `tandem joint` prints of joints: tables, one joint with its drive, values with their units.
// Layer: apps/clients.  Thread: main.
#pragma once

#include <string>

#include "apps/text/console.hpp"

namespace tandem::apps {

// A joint is one of those of `joint.list`: docs/json.md.

[[nodiscard]] bool slides(const Json& joint);
[[nodiscard]] std::string unit_of(const Json& joint);         ///< "rad", "m"
[[nodiscard]] std::string torque_unit_of(const Json& joint);  ///< "Nm", "N"
/// Four digits; "-" for null.
[[nodiscard]] std::string number_of(const Json& joint, const char* key);
/// "position", or "position (idle)" while the drive is not there yet.
[[nodiscard]] std::string mode_of(const Json& joint);
/// "-0.5 rad"; with `degrees` "-0.5 rad (-28.65 deg)"; "-" without a value.
[[nodiscard]] std::string place_of(const Json& joint, const Json& value, bool degrees);

// Tables of a list of joints, and the facts of one, on standard output.

void print_joints(const Json& joints);
void print_drives(const Json& joints);
void print_gains(const Json& joints);
void print_joint(const Json& joint);

}  // namespace tandem::apps
