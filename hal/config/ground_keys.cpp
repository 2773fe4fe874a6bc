#include "hal/config/ground_keys.hpp"

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <optional>
#include <utility>

namespace tandem::hal {
namespace {

constexpr double kLongestShake_s = 1e6;
constexpr double kRadPerDegree = std::numbers::pi / 180.0;

enum class Axis : std::uint8_t { kX, kY, kZ };

// A key a line.
// clang-format off
/// A patch whose frictions may be the ground's.
struct PatchKeys {
  std::string name;
  std::array<double, 2> x_m{}, y_m{};
  std::optional<double> sliding, still;
  double stiffness_share = 1.0;
};
constexpr Key<PatchKeys> kPatch[] = {
  required(key<&PatchKeys::name>("name", "for messages").within("unique")),
  required(key<&PatchKeys::x_m>("x_m", {-1e4, 1e4}, "from and to, in the world").within("2 numbers of ±10000")),
  required(key<&PatchKeys::y_m>("y_m", {-1e4, 1e4}, "the same").within("2 numbers of ±10000")),
  key<&PatchKeys::sliding>("sliding_friction", kNotNegative, "Coulomb coefficient").by_default("the ground's"),
  key<&PatchKeys::still>("static_friction", kNotNegative, "the same of a point that is stuck").by_default("`sliding_friction`, or the ground's"),
  key<&PatchKeys::stiffness_share>("stiffness_share", {1e-3, 1.0}, "of the ground's stiffnesses: below 1 it is softer"),
};
/// A shape whose rectangle may be everywhere.
struct GroundKeys {
  std::string name;
  GroundShapeKind shape = GroundShapeKind::kSlope;
  std::optional<std::array<double, 2>> x_m, y_m;
  std::optional<double> height_m, slope_deg;
  double towards_deg = 0.0;
  double edge_m = GroundShape{}.edge_m;
};
constexpr Key<GroundKeys> kGround[] = {
  required(key<&GroundKeys::name>("name", "for messages").within("unique")),
  required(choice<&GroundKeys::shape>("shape", kGroundShapes, "an inclined plane; a plateau; a hill, highest in its middle")),
  key<&GroundKeys::x_m>("x_m", {-1e4, 1e4}, "from and to, in the world; required of a step or bump").within("2 numbers of ±10000").by_default("everywhere"),
  key<&GroundKeys::y_m>("y_m", {-1e4, 1e4}, "the same; both or none").within("2 numbers of ±10000").by_default("everywhere"),
  key<&GroundKeys::height_m>("height_m", {-100.0, 100.0}, "of a step or bump, over what is there without it; negative: a hole").by_default("required of those"),
  key<&GroundKeys::slope_deg>("slope_deg", {-60.0, 60.0}, "of a slope; it begins at the low end of its rectangle, else at the world's origin").by_default("required of a slope"),
  key<&GroundKeys::towards_deg>("towards_deg", {-360.0, 360.0}, "of a slope: where it rises to, from the world's x axis (0) to its y axis (90)"),
  key<&GroundKeys::edge_m>("edge_m", {1e-3, 10.0}, "of a step or slope: outside the rectangle, how far it is down to the level; the ground has no wall"),
};
/// A motion whose end may be the run's.
struct ShakeKeys {
  std::string name;
  Axis along = Axis::kX;
  double amplitude_m = 0.0, frequency_Hz = 0.0, from_s = 0.0;
  std::optional<double> for_s;
};
constexpr Key<ShakeKeys> kShake[] = {
  required(key<&ShakeKeys::name>("name", "for messages").within("unique")),
  required(choice<&ShakeKeys::along>("along", "x|y|z", "axis of the world")),
  required(key<&ShakeKeys::amplitude_m>("amplitude_m", {0.0, 10.0, true}, "of the sine")),
  required(key<&ShakeKeys::frequency_Hz>("frequency_Hz", {0.0, 100.0, true}, "of the sine; it fades in and out within a period")),
  key<&ShakeKeys::from_s>("from_s", {0.0, kLongestShake_s}, "begins so long after the first SYNC"),
  key<&ShakeKeys::for_s>("for_s", {0.0, kLongestShake_s, true}, "ends so long after that; two periods or more").by_default("to the end"),
};
// clang-format on

/// What is added to, and what is said of it.
struct Ground {
  ContactConfig& contact;
  GroundWords& words;
};

/// From where to where, where it says so.
template <class Keys>
void check_range(TomlTable& table, const Keys& keys) {
  for (const auto& [key, range] : {std::pair{"x_m", keys.x_m}, std::pair{"y_m", keys.y_m}}) {
    const std::optional<std::array<double, 2>> given = range;
    if (given && !((*given)[1] > (*given)[0]) && !table.has_errors())
      table.error(key, "it ends where it begins, or before", "write [from, to]");
  }
}

template <class Rows>
void check_name(TomlTable& table, const std::string& name, const Rows& rows, const char* what) {
  for (const auto& row : rows) {
    if (row.name != name) continue;
    table.error("name", std::string("two ") + what + " are called '" + name + "'",
                "rename one of them");
    return;
  }
}

/// For people, and for the log.
void note(const std::string& list, const std::string& name, const TomlTable& table,
          GroundWords& words) {
  words.differences.push_back(list + " " + name + ": " + values_text(table, ", "));
  words.toml += "[[" + list + "]]\n" + values_text(table, "\n") + "\n";
}

void add_ground(TomlTable& table, Ground& ground) {
  GroundKeys keys;
  read_keys(table, kGround, keys);
  table.finish();
  const bool slope = keys.shape == GroundShapeKind::kSlope;
  const char* const size = slope ? "slope_deg" : "height_m";
  for (const char* const other : {slope ? "height_m" : "slope_deg", slope ? "" : "towards_deg",
                                  keys.shape == GroundShapeKind::kBump ? "edge_m" : ""}) {
    if (*other != 0 && table.has(other))
      table.error(other, "is of another shape", std::string("give ") + size + ", or change shape");
  }
  const double by = slope ? keys.slope_deg.value_or(0.0) : keys.height_m.value_or(0.0);
  if (!table.has_errors() && by == 0.0)
    table.error(size, "changes nothing", std::string("give a ") + size + " that is not 0");
  if (keys.x_m.has_value() != keys.y_m.has_value() || (!slope && !keys.x_m))
    table.error("", "it has no rectangle", "give x_m and y_m, both");
  check_range(table, keys);
  Terrain& terrain = ground.contact.terrain;
  check_name(table, keys.name, terrain.shapes(), "parts of the ground");
  if (table.has_errors()) return;
  GroundShape shape{.name = keys.name,
                    .kind = keys.shape,
                    .height_m = keys.height_m.value_or(0.0),
                    .slope_rad = keys.slope_deg.value_or(0.0) * kRadPerDegree,
                    .towards_rad = keys.towards_deg * kRadPerDegree,
                    .edge_m = keys.edge_m};
  if (keys.x_m) shape.x_m = *keys.x_m;
  if (keys.y_m) shape.y_m = *keys.y_m;
  terrain.add(shape);
  note("ground", keys.name, table, ground.words);
}

void add_shake(TomlTable& table, Ground& ground) {
  ShakeKeys keys;
  read_keys(table, kShake, keys);
  table.finish();
  Terrain& terrain = ground.contact.terrain;
  check_name(table, keys.name, terrain.shakes(), "motions of the ground");
  if (keys.for_s && *keys.for_s * keys.frequency_Hz < 2.0 && !table.has_errors())
    table.error("for_s",
                "is shorter than two periods of " + std::to_string(keys.frequency_Hz) +
                    " Hz: it would end while it begins",
                "give 2 / frequency_Hz or more");
  if (table.has_errors()) return;
  GroundShake shake{.name = keys.name,
                    .amplitude_m = keys.amplitude_m,
                    .frequency_Hz = keys.frequency_Hz,
                    .from_s = keys.from_s};
  shake.along[static_cast<std::size_t>(keys.along)] = 1.0;
  if (keys.for_s) shake.for_s = *keys.for_s;
  terrain.add(shake);
  note("shake", keys.name, table, ground.words);
}

/// The first of those that overlap counts.
void add_patch(TomlTable& table, Ground& to) {
  ContactConfig& ground = to.contact;
  PatchKeys keys;
  read_keys(table, kPatch, keys);
  table.finish();
  const double sliding = keys.sliding.value_or(ground.sliding_friction);
  const double still = keys.still.value_or(keys.sliding ? sliding : ground.static_friction);
  if (!(still >= sliding))
    table.error(keys.still ? "static_friction" : "sliding_friction",
                "static friction is below sliding friction", "give both, static the larger");
  check_range(table, keys);
  check_name(table, keys.name, ground.patches, "patches");
  if (!keys.sliding && !keys.still && !table.has("stiffness_share") && !table.has_errors())
    table.error("", "changes nothing", "give sliding_friction, static_friction or stiffness_share");
  ground.patches.push_back({.name = keys.name,
                            .x_m = keys.x_m,
                            .y_m = keys.y_m,
                            .static_friction = still,
                            .sliding_friction = sliding,
                            .stiffness_share = keys.stiffness_share});
  note("patch", keys.name, table, to.words);
}

}  // namespace

void read_ground(TomlTable& sim, ContactConfig& ground, GroundWords& words) {
  Ground to{ground, words};
  for (TomlTable& table : sim.tables("patch")) add_patch(table, to);
  for (TomlTable& table : sim.tables("ground")) add_ground(table, to);
  for (TomlTable& table : sim.tables("shake")) add_shake(table, to);
}

Status read_ground(const std::string& toml, const std::string& file, ContactConfig& ground) {
  const Result<TomlDocument> document = TomlDocument::parse(toml, file);
  if (!document) return std::unexpected(document.error());
  ContactConfig read = ground;
  GroundWords words;
  TomlTable root = document->root();
  read_ground(root, read, words);
  root.finish();
  if (const Diagnostics& errors = document->diagnostics(); !errors.empty())
    return std::unexpected(errors.front());
  ground = std::move(read);
  return {};
}

std::string values_text(const TomlTable& table, std::string_view between) {
  std::string text;
  for (const auto& [key, value] : table.values()) {
    if (!text.empty()) text += between;
    text += key + " = " + value;
  }
  return text;
}

void describe_ground(KeyPage& page) {
  page.add("[[sim.patch]]", kPatch);
  page.add("[[sim.ground]]", kGround);
  page.add("[[sim.shake]]", kShake);
}

}  // namespace tandem::hal
