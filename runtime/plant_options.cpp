#include "runtime/plant_options.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/nearest.hpp"
#include "hal/config/ground_keys.hpp"
#include "hal/sim/payload.hpp"

namespace tandem::runtime {
namespace {

using hal::ActuatorConfig;
using hal::PassiveConfig;

constexpr const char* kTheActuators = "the actuator's";
constexpr double kLongest_s = 1e6;

struct EncoderChange {
  double zero_error_rad = 0.0;
};
struct PayloadTimes {
  std::string name;
  double from_s = 0.0;
  std::optional<double> until_s;
};

// A key a line.
// clang-format off
constexpr Key<ActuatorConfig> kActuator[] = {
  key<&ActuatorConfig::friction_Nm>("friction_Nm", kNotNegative, "dry friction").by_default(kTheActuators),
  key<&ActuatorConfig::damping_Nms_rad>("damping_Nms_rad", kNotNegative, "D, the back-EMF's share included").by_default(kTheActuators),
  key<&ActuatorConfig::inertia_kg_m2>("inertia_kg_m2", kPositive, "J, reflected: of a rigid actuator the joint's armature").by_default(kTheActuators),
  key<&ActuatorConfig::spring_Nm_rad>("spring_Nm_rad", kNotNegative, "Ks").by_default(kTheActuators),
  key<&ActuatorConfig::spring_damping_Nms_rad>("spring_damping_Nms_rad", kNotNegative, "Ds").by_default(kTheActuators),
  key<&ActuatorConfig::torque_constant_Nm_A>("torque_constant_Nm_A", kPositive, "K: the drive takes its current for another torque").by_default(kTheActuators),
  key<&ActuatorConfig::resistance_ohm>("resistance_ohm", kPositive, "R").by_default(kTheActuators),
};
constexpr Key<EncoderChange> kEncoder[] = {
  key<&EncoderChange::zero_error_rad>("zero_error_rad", {-10.0, 10.0}, "what both encoders read too much"),
};
constexpr Key<PassiveConfig> kPassive[] = {
  key<&PassiveConfig::friction_Nm>("friction_Nm", {0.0, 1e6}, {}),
  key<&PassiveConfig::damping_Nms_rad>("damping_Nms_rad", {0.0, 1e6}, {}),
};
constexpr Key<PayloadTimes> kPayload[] = {
  required(key<&PayloadTimes::name>("name", "for messages").within("unique")),
  by_hand<PayloadTimes>("link", "–", "a link of the URDF", "that carries it: one of `link` and `site`"),
  by_hand<PayloadTimes>("site", "–", "a `[[site]]`", "at which it is carried"),
  by_hand<PayloadTimes>("mass_kg", "required", "> 0 to 100000", "of the payload"),
  by_hand<PayloadTimes>("com_m", "`[0, 0, 0]`", "3 numbers of ±100", "center of mass, in the frame of the link or site"),
  by_hand<PayloadTimes>("inertia_kg_m2", "a point's", "6 numbers", "`[ixx, ixy, ixz, iyy, iyz, izz]` about the center of mass, along the axes of that frame"),
  key<&PayloadTimes::from_s>("from_s", {0.0, kLongest_s}, "picked up so long after the first SYNC").by_default("from the start"),
  key<&PayloadTimes::until_s>("until_s", {0.0, kLongest_s, true}, "dropped; later than `from_s`").by_default("never"),
};
// clang-format on

std::int64_t whole_ns(double seconds) { return std::llround(seconds * 1e9); }

void nothing_given(TomlTable& table) {
  if (table.keys().empty()) table.error("", "changes nothing", "give a key, or remove it");
}

/// An error of the changed description, at the link's table or key that says so.
void place(const Error& error, TomlTable& links) {
  constexpr std::string_view kOwn = "sim.link.", kLink = "link ";
  const bool own = error.key.starts_with(kOwn);
  const std::string name = own                            ? error.key.substr(kOwn.size())
                           : error.key.starts_with(kLink) ? error.key.substr(kLink.size())
                                                          : "";
  // A robot.toml's inertias can be repaired. These are what somebody has just written.
  const std::string hint = error.hint.substr(0, error.hint.find("; inertia = \"repair\""));
  if (name.empty() || !links.has(name))
    return links.error("", error.key + ": " + error.message, hint);
  TomlTable at = links.table(name);
  const auto about = [&](std::string_view key, std::string_view word) {
    return at.has(key) && error.message.find(word) != std::string::npos;
  };
  const char* const key = about("inertia_kg_m2", "inertia")  ? "inertia_kg_m2"
                          : about("com_m", "centre of mass") ? "com_m"
                          : about("mass_kg", "mass")         ? "mass_kg"
                                                             : "";
  at.error(key, error.message, hint);
}

/// The description once more, with the links' masses in place of its own.
void change_links(TomlTable links, const robot::FileTexts& files, sim::PlantChanges& plant) {
  std::vector<hal::LinkConfig>& all = plant.robot.model.links;
  for (hal::LinkConfig& link : hal::read_links(links)) {
    std::erase_if(all, [&](const hal::LinkConfig& one) { return one.name == link.name; });
    link.key = "sim.link." + link.name;
    all.push_back(std::move(link));
  }
  if (links.has_errors()) return;
  hal::RobotConfig robot = plant.robot;
  const auto model = robot::complete_robot(robot, files);
  if (model) {
    plant.tree = model->tree;
    return;
  }
  for (const Error& error : model.error()) place(error, links);
}

void change_joint(TomlTable table, const std::string& name, sim::PlantChanges& plant) {
  hal::RobotConfig& robot = plant.robot;
  nothing_given(table);
  const auto passive = std::ranges::find(robot.passive, name, &PassiveConfig::name);
  if (passive != robot.passive.end()) {
    read_keys(table, kPassive, *passive);
    return table.finish();
  }
  const auto joint = std::ranges::find(robot.joints, name, &hal::JointConfig::name);
  if (joint == robot.joints.end()) {
    std::vector<std::string> known = robot.passive_names();
    for (const hal::JointConfig& one : robot.joints) known.push_back(one.name);
    return table.error("", "the robot has no joint '" + name + "'", suggest(name, known));
  }
  ActuatorConfig own = robot.actuator_of(*joint);
  EncoderChange encoder;
  read_keys(table, kActuator, own);
  for (const char* const key : {"spring_Nm_rad", "spring_damping_Nms_rad"}) {
    if (own.order >= 2 || !table.has(key)) continue;
    table.error(key,
                "changes nothing: " + joint->actuator + " of " + robot.file + " is rigid (order " +
                    std::to_string(own.order) + ")",
                "leave it out; actuators of order 2 and 3 have a spring");
  }
  read_keys(table, kEncoder, encoder);
  table.finish();
  own.name = table.path();  // no other actuator's
  if (const std::string problem = hal::actuator_problem(own); !problem.empty())
    table.error("", problem,
                "its actuator in " + robot.file + " is of order " + std::to_string(own.order));
  plant.zero_error_rad[static_cast<std::size_t>(joint - robot.joints.begin())] =
      encoder.zero_error_rad;
  joint->actuator = own.name;
  robot.actuators.push_back(std::move(own));
}

void change_joints(TomlTable joints, sim::PlantChanges& plant) {
  if (!joints.holds_tables()) return;
  plant.zero_error_rad.assign(plant.robot.joints.size(), 0.0);
  for (const std::string& name : joints.keys()) change_joint(joints.table(name), name, plant);
  const bool none = std::ranges::all_of(plant.zero_error_rad, [](double e) { return e == 0.0; });
  if (none) plant.zero_error_rad.clear();
}

/// ", from 5 s to 9 s"; nothing of what is there for good.
std::string times_text(const PayloadTimes& times) {
  const auto seconds = [](const char* before, double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%s%.6g s", before, value);
    return std::string(text);
  };
  return ", " + (times.from_s > 0.0 ? seconds("from ", times.from_s) : "from the start") +
         (times.until_s ? seconds(" to ", *times.until_s) : "");
}

/// What is there for good is a part of the tree.
void add_payload(TomlTable& table, const model::Tree& described, std::vector<std::string>& names,
                 sim::PlantChanges& plant) {
  PayloadTimes times;
  sim::ScenarioFault payload;
  read_keys(table, kPayload, times);
  sim::read_payload(table, plant.robot, &described, payload);
  table.finish();
  if (!times.name.empty() && std::ranges::count(names, times.name) != 0)
    table.error("name", "two payloads are called '" + times.name + "'", "rename one of them");
  names.push_back(times.name);
  if (times.until_s && !(*times.until_s > times.from_s))
    table.error("until_s", "it is dropped before it is picked up", "give more than from_s");
  if (payload.link < 0 || table.has_errors()) return;
  if (const std::string heavy = sim::too_heavy(payload, described); !heavy.empty()) {
    plant.warnings.push_back(table.error_at("mass_kg", heavy));
    plant.warnings.back().hint = "give its mass in kg";
  }
  payload.number = static_cast<std::uint32_t>(names.size());
  plant.payloads.resize(names.size());
  plant.payloads.back() = times.name + ", " + sim::words_of(payload, described);
  plant.differences.push_back("payload " + plant.payloads.back() + times_text(times));
  if (times.from_s > 0.0 || times.until_s) {
    payload.start_ns = whole_ns(times.from_s);
    if (times.until_s) payload.duration_ns = whole_ns(*times.until_s - times.from_s);
    plant.carried.push_back(payload);
    return;
  }
  plant.kept.push_back(payload);
  model::Link& link = plant.tree.links[static_cast<std::size_t>(payload.link)];
  model::Body& body = plant.tree.bodies[static_cast<std::size_t>(link.body)];
  const model::Inertia more = sim::load_of(payload).in_link;
  link.inertia = link.inertia + more;
  body.inertia = body.inertia + link.in_body * more;
}

}  // namespace

void leave_plant_changes(TomlTable& sim) {
  (void)sim.table_or_empty("link");
  (void)sim.table_or_empty("joint");
  (void)sim.tables("payload");
  for (const char* const what : hal::kGroundTables) (void)sim.tables(what);
}

std::shared_ptr<const sim::PlantChanges> read_plant_changes(TomlTable sim,
                                                            const hal::RobotConfig& robot,
                                                            const model::UrdfModel* description,
                                                            const robot::FileTexts& files) {
  const auto given = [&](const char* what) { return sim.has(what); };
  if (std::ranges::none_of(std::array{"link", "joint", "payload"}, given) &&
      std::ranges::none_of(hal::kGroundTables, given))
    return nullptr;
  if (description == nullptr) {
    sim.error("", "the plant cannot be changed without the robot's description");
    return nullptr;
  }
  auto plant = std::make_shared<sim::PlantChanges>();
  plant->robot = robot;
  plant->tree = description->tree;
  if (sim.has("link")) change_links(sim.table("link"), files, *plant);
  if (sim.has("joint")) change_joints(sim.table("joint"), *plant);
  for (const char* const what : {"link", "joint"}) {
    TomlTable all = sim.table_or_empty(what);
    for (const std::string& name : all.keys())
      plant->differences.push_back(what + (" " + name + ": ") +
                                   hal::values_text(all.table(name), ", "));
  }
  std::vector<std::string> names;
  for (TomlTable& table : sim.tables("payload"))
    add_payload(table, description->tree, names, *plant);
  hal::GroundWords words;
  hal::read_ground(sim, plant->robot.contact, words);
  std::ranges::move(words.differences, std::back_inserter(plant->differences));
  plant->ground = std::move(words.toml);
  return plant;
}

void describe_plant_changes(KeyPage& page) {
  page.add("[sim.joint.NAME]", kActuator);
  page.add("[sim.joint.NAME]", kEncoder);
  page.add("[[sim.payload]]", kPayload);
  hal::describe_ground(page);
}

}  // namespace tandem::runtime
