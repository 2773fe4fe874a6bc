// Steps of make_robot() that have a source of their own, under whose name they stand here.
// Layer: scaffold.  Thread: any, non-RT.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "scaffold/loads.hpp"
#include "scaffold/new_robot.hpp"
#include "scaffold/standing.hpp"

namespace tandem::scaffold {

// like.cpp: springs and gains taken from a robot that has them.

/// Gives each joint the drive of the joint of `like` that it resembles most (kind of limb,
/// direction of its axis, place in the limb), scaled by mass times reach: a motor of so many
/// windings side by side, springs and gains of so many times the stiffness. A joint that would
/// sag by more than a degree under gravity, or whose motor would get too hot of it, has a firmer
/// drive of `like`, and where none is enough that drive once more so many times as large; the
/// remarks say which. A joint of a leg may sag: it is loaded slowly. Slides have rigid drives.
/// @param torques  (joints) of torques_at(), in the first posture
void take_drives(const Like& like, const std::vector<JointLoad>& loads,
                 const std::vector<double>& torques, double period_s, NewRobot& robot);

/// mass times reach of one robot over that of the other.
[[nodiscard]] double scale_of(const model::Tree& robot, const model::Tree& like);

// described_dynamics.cpp: damping and friction of the description's joints (<dynamics>), put into
// the drives.

/// Adds to each rigid drive the damping and the dry friction of its joints. A drive whose joints
/// differ in them is split; what would take more than half of a joint's effort (damping at its
/// speed) is left out, with a warning. The reader's warning that nothing is used goes.
/// @pre  `robot` has its tree, limits and drives, and no gains yet
void add_described_dynamics(NewRobot& robot);

// wiring.cpp: buses, boards and nodes of a new robot.

/// A bus for each limb, two joints a board, sensors on the bus of their limb; a limb that is too
/// much for one bus is cut into as few as can carry it at 1 kHz. Fills `config`'s buses, boards
/// and sensors, and each joint's board and axis.
/// Errors: not even two boards fit on a bus.
[[nodiscard]] Status wire(NewRobot& robot);

// lying.cpp: a robot whose legs do not lie along -z of its root.

/// It would be laid on its side. The hint has the link and the joint that put it upright.
/// @param down, ahead  axes of the root `root`: along its legs, and where it looks
[[nodiscard]] Error lies(const std::string& root, const Eigen::Vector3d& down,
                         const Eigen::Vector3d& ahead);

// ground.cpp: the ground under a new robot's feet.

/// Fills the sites of the feet and [contact]: stiffness and damping per point in proportion to
/// the weight on it, so that every robot sinks in as `like` does (null: as COMAN does).
void fill_ground(const hal::RobotConfig* like, NewRobot& robot);

// firmness.cpp: whether a robot on its feet is held firmly enough not to fall over.

/// The stiffness [Nm/rad or N/m] that a drive's position loop gives its joint before its integral
/// has begun: kp, in series with the spring where the loop is closed on the motor.
[[nodiscard]] double held_stiffness(const hal::ActuatorConfig& drive,
                                    const hal::GainsConfig& gains);

/// How many times as stiff all joints together would have to be for the robot to stand still: below
/// 1 it does. Gravity bends joints and ground until they carry it, to first order: the inverted
/// pendulum over ankles, knees, hips and trunk in series, sagittal and lateral, on soles that press
/// into the ground. There the energy must have a minimum in the base's six directions and in every
/// joint, and the ground must press on every contact point: where it does not, the weight has left
/// the soles and the robot tips. At first every point carries the same share; none slips.
///
/// It says nothing of motion: a robot that stands by this may still be thrown over when it is let
/// down, or sway for long. No torque limit, and no integral, which is slow.
/// @param q  (joints) the posture, in the tree's order
/// @return 0.01 to 100; empty: not even the stiffest stand, so it is not for the drives to say
/// @pre the ground is filled
[[nodiscard]] std::optional<double> needed_firmness(const NewRobot& robot,
                                                    const Eigen::VectorXd& q);

/// A warning, with what the softest leg joint has and would need and what to do, when the robot
/// would fall over.
[[nodiscard]] std::optional<Error> falls_over(const NewRobot& robot, const Eigen::VectorXd& q);

// burden.cpp: whether a robot's drives can carry it, wherever its joints are.

struct Burden {
  Error told;          ///< a warning: the worst joint, and what to do
  bool grams = false;  ///< a thousandth of the masses would be right: nothing else is worth saying
};

/// None when each drive can hold what gravity asks for: of a leg's joint in the standing posture,
/// of every other one at its worst.
/// @param loads  of loads_of(), with what legs bear
[[nodiscard]] std::optional<Burden> overburdened(const NewRobot& robot,
                                                 const std::vector<JointLoad>& loads);

// moves.cpp: move.toml: a motion of every joint that is safe to begin with.

/// Every joint to one side of its posture, to the other and back, as far as drives of `robot` can
/// carry and accelerate what hangs on them.
/// @pre  `robot` has its joints and drives
[[nodiscard]] Move swing(const NewRobot& robot, const Eigen::VectorXd& posture);

/// The same for what is no leg, while the legs lower the robot twice and keep its centre of mass
/// over the feet.
[[nodiscard]] Move squat_and_swing(const NewRobot& robot, const StandingPosture& standing);

}  // namespace tandem::scaffold
