// Reads the model, sites, sensors, contact, postures and safety of robot.toml, and calls the
// readers of the other tables in the order in which tables refer to each other.
#include "hal/config/robot_config.hpp"

#include <cmath>
#include <filesystem>
#include <limits>

#include "hal/config/robot_config_read.hpp"

namespace tandem::hal {
namespace {

void read_site(TomlTable table, ModelConfig& model) {
  SiteConfig site;
  site.line = table.line();
  read_whole(table, keys::kSite, site);
  check_own_name(table, site.name);
  check_unique(table, model.sites, site.name, "site");
  for (const SiteConfig& other : model.sites) {
    if (other.name == site.name || topic_token(other.name) != topic_token(site.name)) continue;
    table.error("name", "'" + site.name + "' and the site '" + other.name + "' are one topic",
                "rename one: only letters, digits and _ make a difference there");
  }
  model.sites.push_back(site);
}

LinkConfig read_link(TomlTable table, const std::string& name) {
  LinkConfig link;
  link.name = name;
  link.line = table.line();
  const LinkConfig unchanged = link;
  read_keys(table, keys::kLink, link);
  if (table.keys().empty()) {
    table.error("", "gives nothing", "give mass_kg, com_m or inertia_kg_m2, or remove it");
  }
  table.finish();
  return table.has_errors() ? unchanged : link;  // what the link then is follows from them
}

ModelConfig read_model(TomlTable& root, const std::string& folder) {
  ModelConfig model;
  TomlTable table = root.table("model");
  read_keys(table, keys::kModel, model);
  const std::filesystem::path urdf = model.urdf;
  if (!urdf.empty())
    model.urdf = (std::filesystem::path(folder) / urdf).lexically_normal().string();
  model.gravity_line = table.line("gravity_m_s2");
  TomlTable lock = table.table_or_empty("lock");
  for (const std::string& joint : lock.keys()) {
    model.lock.emplace_back(joint, lock.number(joint));
    model.lock_lines.emplace(joint, lock.line(joint));
  }
  lock.finish();
  model.links = read_links(table.table_or_empty("link"));
  table.finish();
  for (TomlTable& site : root.tables("site")) read_site(site, model);
  return model;
}

void check_channels(TomlTable& table, const char* key, const std::vector<double>& values,
                    std::size_t channels) {
  if (values.empty() || values.size() == channels) return;
  table.error(key, "has " + std::to_string(values.size()) + " numbers",
              "give one for each of the " + std::to_string(channels) + " channels");
}

/// @param bus  whose table holds this one; empty for a [[sensor]]
void read_sensor(TomlTable table, const std::string& bus, NodeIds& ids, RobotConfig& robot) {
  SensorConfig sensor;
  sensor.line = table.line();
  read_keys(table, keys::kSensor, sensor);
  if (const std::string problem = topic_name_problem(sensor.name);
      !problem.empty() && !sensor.name.empty()) {
    table.error("name", "'" + sensor.name + "' " + problem + ", but it becomes part of a topic",
                "use letters, digits and _");
  }
  check_unique(table, robot.sensors, sensor.name, "sensor");
  sensor.bus = read_bus_name(table, bus);
  check_reference(table, "bus", sensor.bus, robot.buses, "bus");
  sensor.node_id = ids.read(table, sensor.bus);
  if (sensor.type == SensorType::kForceTorque) {
    sensor.joint = table.text("joint");
  } else if (table.has("joint")) {
    table.error("joint", "an imu measures at a link, not through a joint", "remove this key");
  }
  check_channels(table, "noise", sensor.noise, sensor.channels());
  check_channels(table, "bias", sensor.bias, sensor.channels());
  table.finish();
  robot.sensors.push_back(sensor);
}

Foot read_foot(TomlTable table, const RobotConfig& robot) {
  Foot foot;
  foot.site = table.text("site");
  check_reference(table, "site", foot.site, robot.model.sites, "site");
  for (const SiteConfig& site : robot.model.sites) {
    if (site.name != foot.site || site.wrench) continue;
    table.error("site", "the site '" + site.name + "' takes no wrench",
                "set wrench = true in its [[site]]");
  }
  for (const Foot& other : robot.contact.feet) {
    if (other.site == foot.site) table.error("site", "two feet have this site", "merge them");
  }
  for (const auto& row : table.rows("points_m", 3)) {
    foot.points_m.push_back({row[0], row[1], row[2]});
  }
  if (table.has("points_m") && foot.points_m.empty() && !table.has_errors("points_m")) {
    table.error("points_m", "the sole has no point", "give at least one [x, y, z]");
  }
  table.finish();
  return foot;
}

void read_contact(TomlTable& root, RobotConfig& robot) {
  if (!root.has("contact")) return;
  ContactConfig& c = robot.contact;
  TomlTable table = root.table("contact");
  for (const std::string& key : table.keys()) c.lines.emplace(key, table.line(key));
  c.static_friction = kUnset;
  read_keys(table, keys::kContact, c);
  if (std::isnan(c.static_friction)) c.static_friction = c.sliding_friction;
  if (c.static_friction < c.sliding_friction) {
    table.error("static_friction", "is less than sliding_friction", "raise it or lower the other");
  }
  for (TomlTable& foot : table.tables("foot")) c.feet.push_back(read_foot(foot, robot));
  if (c.feet.empty() && robot.model.floating_base) {
    table.error("", "has no foot", "add [[contact.foot]] or remove [contact]");
  }
  table.finish();
}

double read_base_height(TomlTable& table, const RobotConfig& robot) {
  if (!table.is_text("base_height_m")) return table.number_or("base_height_m", 0.0);
  (void)table.choice("base_height_m", {"auto"});
  if (robot.contact.feet.empty()) {
    table.error("base_height_m", "there is no [contact] with a foot to stand on",
                "add one, or give a number");
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// What is wrong with a joint of a posture, as far as robot.toml alone says so.
JointReference not_driven(TomlTable& table, const std::string& key, const RobotConfig& robot) {
  if (robot.is_passive(key)) {
    return {{},
            table.error_at(key,
                           "the joint '" + key + "' is passive: " +
                               (robot.loops.empty() ? "no motor holds it"
                                                    : "where it stands follows from the "
                                                      "closed loops"),
                           "remove it here; position_rad of its [[passive]] says where it "
                           "starts from")};
  }
  if (robot.model.lock_lines.contains(key)) {
    return {{},
            table.error_at(key, "the joint '" + key + "' is locked in [model.lock]",
                           "remove it here, or the lock")};
  }
  return {key, table.error_at(key, "there is no [[joint]] '" + key + "'")};
}

void read_posture(TomlTable table, const std::string& name, bool fixed_base, RobotConfig& robot,
                  std::vector<JointReference>& loose) {
  PostureConfig posture;
  posture.name = name;
  posture.line = table.line();
  posture.position_rad.assign(robot.joints.size(), 0.0);
  if (robot.model.floating_base) {
    posture.base_height_m = read_base_height(table, robot);
  } else if (fixed_base && table.has("base_height_m")) {
    table.error("base_height_m", "a fixed base has no height",
                "remove this key, or set base = \"floating\" in [model]");
  }
  for (const std::string& key : table.keys()) {
    if (key == "base_height_m") continue;
    const int index = robot.joint_index(key);
    const double position = table.number_or(key, 0.0);
    if (index < 0) {
      loose.push_back(not_driven(table, key, robot));
    } else {
      posture.position_rad[static_cast<std::size_t>(index)] = position;
    }
  }
  robot.postures.push_back(posture);
}

const std::vector<std::string> kSections{
    "name",         "model",          "site",    "actuator",       "actuator_defaults",
    "gains",        "gains_defaults", "bus",     "board",          "sensor",
    "bus_defaults", "board_defaults", "joint",   "joint_defaults", "loop",
    "passive",      "contact",        "posture", "safety"};

/// Whether every section is where what names its content looks for it; else that is reported.
bool sections_are_right(TomlTable& root) {
  bool right = root.holds_only(kSections);
  for (const char* key : {"actuator", "gains", "posture"}) {
    right = root.table_or_empty(key).holds_tables() && right;
  }
  return right;
}

/// Reads in the order of the references: what is named before what names it.
RobotConfig read(const TomlDocument& document, std::vector<JointReference>& loose) {
  RobotConfig robot;
  robot.file = document.file();
  TomlTable root = document.root();
  read_keys(root, keys::kRoot, robot);
  check_own_name(root, robot.name);
  const bool right = sections_are_right(root);
  robot.model = read_model(root, document.folder());
  if (!right) return robot;
  read_drive_tables(root, robot);
  NodeIds ids;
  std::vector<SensorTable> sensors;
  std::vector<BoardTable> boards = read_buses(root, ids, robot, sensors);
  const auto of_lists = [](const Error& error) {
    return error.key == "bus" || error.key == "board" || error.key == "site";
  };
  if (std::ranges::any_of(document.diagnostics(), of_lists))
    return robot;  // what follows names them
  read_joints(root, axes_listed_by(boards), robot, loose);
  const auto wrong = [](const BoardTable& board) { return board.table.has_errors(); };
  if (std::ranges::any_of(boards, wrong)) loose.clear();  // a list that could not be read
  for (const SensorTable& sensor : sensors) read_sensor(sensor.table, sensor.bus, ids, robot);
  for (TomlTable& sensor : root.tables("sensor")) read_sensor(sensor, {}, ids, robot);
  read_contact(root, robot);
  read_loops(root, robot);
  TomlTable postures = root.table_or_empty("posture");
  // Neither floating nor fixed is an error that has been reported.
  const bool fixed_base = root.table_or_empty("model").text_or("base", {}) == "fixed";
  for (const std::string& name : postures.keys()) {
    read_posture(postures.table(name), name, fixed_base, robot, loose);
  }
  postures.finish();
  check_boards(boards, robot, loose);
  const auto of_list = [](const Error& error) { return error.key.ends_with(".names"); };
  if (std::ranges::any_of(document.diagnostics(), of_list) ||
      (robot.joints.empty() && !document.diagnostics().empty())) {
    loose.clear();  // which joints there are is not known
  }
  read_whole(root.table_or_empty("safety"), keys::kSafety, robot);
  return robot;
}

/// An experiment names a robot, a robot has a [model].
Result<TomlDocument> robot_alone(Result<TomlDocument> document) {
  if (!document || document->root().has("model") || !document->root().has("robot")) return document;
  return std::unexpected(Error{"this is an experiment, and a robot is needed",
                               "name the robot.toml that it names", document->file(),
                               document->root().line("robot"), "robot"});
}

std::expected<RobotConfig, Diagnostics> finish(Result<TomlDocument> document) {
  document = robot_alone(std::move(document));
  if (!document) return std::unexpected(Diagnostics{document.error()});
  std::vector<JointReference> loose;
  RobotConfig robot = read(*document, loose);
  Diagnostics errors = check_names(robot, loose);
  errors.insert(errors.begin(), document->diagnostics().begin(), document->diagnostics().end());
  if (errors.empty()) return robot;
  sort_by_line(errors);
  return std::unexpected(errors);
}

}  // namespace

std::vector<LinkConfig> read_links(TomlTable links) {
  std::vector<LinkConfig> all;
  if (!links.holds_tables()) return all;
  for (const std::string& name : links.keys()) {
    all.push_back(read_link(links.table(name), name));
  }
  return all;
}

std::expected<RobotConfig, Diagnostics> read_robot_config(const std::string& file) {
  return finish(TomlDocument::load(file, kRobotOfXml));
}

RobotConfig read_robot_config(const Result<TomlDocument>& loaded, Diagnostics& errors,
                              std::vector<JointReference>& loose) {
  const Result<TomlDocument> document = robot_alone(loaded);
  if (!document) {
    errors.push_back(document.error());
    return {};
  }
  RobotConfig robot = read(*document, loose);
  errors.insert(errors.end(), document->diagnostics().begin(), document->diagnostics().end());
  return robot;
}

std::expected<RobotConfig, Diagnostics> parse_robot_config(std::string_view text,
                                                           const std::string& file) {
  return finish(TomlDocument::parse(text, file));
}

}  // namespace tandem::hal
