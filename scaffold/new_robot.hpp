// What a robot's folder is made of, from its description alone. docs/robots.md says by which
// rules; every guess is marked as one in the files.
// Layer: scaffold.  Thread: non-RT.
#pragma once

#include <expected>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "hal/config/robot_config.hpp"
#include "model/right_angles.hpp"
#include "model/urdf_extras.hpp"
#include "scaffold/drives.hpp"
#include "scaffold/limbs.hpp"
#include "scaffold/sensors.hpp"

namespace tandem::scaffold {

enum class Base : std::uint8_t {
  kAuto,  ///< floating when the root has mass and there are feet by name
  kFloating,
  kFixed,
};

/// A robot that others may take after.
struct Like {
  hal::RobotConfig config;
  model::Tree tree;
};

struct Request {
  std::string urdf;  ///< path of the description
  std::string name;  ///< of the robot; also its folder's
  Base base = Base::kAuto;
  const Like* like = nullptr;  ///< take springs and ground from it; null: rigid drives
  std::string text = {};       ///< of the description; empty: the file's
  std::vector<std::pair<std::string, double>> lock = {};  ///< joint -> where it stands [rad or m]
  std::string command = {};  ///< that makes this robot again, in the same folder; empty: unknown
  bool dynamics = false;     ///< rigid drives get the damping and friction of <dynamics>
};

/// A way-point of move.toml, in the order of [[joint]].
struct WayPoint {
  double time_s = 0.0;
  std::vector<double> position_rad;
};

/// What move.toml does.
struct Move {
  struct HeldBack {
    std::string joint;
    double swing = 0.0;  ///< what is left to either side [rad or m]
  };
  std::vector<WayPoint> points;
  std::vector<HeldBack> held_back;  ///< by weak drives, the floor, or what the legs can balance
  double squat_m = 0.0;             ///< the root goes down so far; 0: it stays
  bool swings = false;              ///< joints that are in no leg move
};

/// Everything that the files say, before it is text.
struct NewRobot {
  model::Tree tree;
  hal::RobotConfig config;
  std::vector<Limb> limbs;
  std::vector<FoundFoot> feet;
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitX();  ///< where it looks; one of the root's axes
  std::vector<FoundSensor> sensors;
  std::vector<JointLimits> limits;                   ///< by the tree's joints
  std::map<std::string, model::JointExtras> extras;  ///< by joint; the tree has the soft limits
  std::vector<DriveSize> drives;
  std::vector<GainSet> gains;
  std::vector<std::string> remarks;  ///< of the whole: what was decided, and why
  std::string command;               ///< of the request
  Move move;
  std::vector<std::string> report;  ///< one or two joints that are worth plots
  std::string like;                 ///< name of the robot that springs come from; may be empty
  double scale = 1.0;               ///< its springs' factor
  double mass_kg = 0.0;
  double stands_m = 0.0;            ///< height of the root; 0: the base is fixed
  double stands_share = 0.0;        ///< of the greatest height in which the feet reach the ground
  Diagnostics warnings;             ///< of the description's reader
  model::RightAngles right_angles;  ///< what the description has of few digits
  model::Displacement turned;       ///< what exact ones would move the most
};

/// Reads the description and decides everything else.
/// Errors: those of model::read_urdf(), with inertias repaired; no moving joint; no standing
/// posture; a bus that cannot carry its limb however it is cut.
[[nodiscard]] std::expected<NewRobot, Diagnostics> make_robot(const Request& request);

/// The files' contents. @pre `urdf_file` is the name beside them.
[[nodiscard]] std::string robot_text(const NewRobot& robot, const std::string& urdf_file,
                                     const std::string& source);
[[nodiscard]] std::string hold_text(const NewRobot& robot);
[[nodiscard]] std::string move_text(const NewRobot& robot);

}  // namespace tandem::scaffold
