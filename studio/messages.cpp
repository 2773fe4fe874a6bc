#include "studio/messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

#include "apps/text/console.hpp"
#include "hal/config/terrain_grid.hpp"
#include "studio/mark_source.hpp"
#include "studio/mesh_files.hpp"

namespace tandem::studio {
namespace {

using apps::Json;
using apps::json_text;

static_assert(std::endian::native == std::endian::little, "frames are little endian");

constexpr std::uint8_t kTickKind = 1, kWindowKind = 2;
constexpr std::uint8_t kStands = 1, kGap = 2;

template <class T>
void put(std::string& frame, T value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  frame.append(bytes, sizeof value);
}

void put(std::string& frame, std::span<const float> numbers) {
  const std::size_t at = frame.size();
  frame.resize(at + numbers.size_bytes());
  if (!numbers.empty()) std::memcpy(frame.data() + at, numbers.data(), numbers.size_bytes());
}

Json known(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json joint_json(const hal::JointConfig& joint) {
  return {{"name", joint.name},
          {"type", joint.slides ? "prismatic" : "revolute"},
          {"unit", joint.slides ? "m" : "rad"},
          {"lower", known(joint.min_position_rad)},
          {"upper", known(joint.max_position_rad)},
          {"velocity", known(joint.max_velocity_rad_s)},
          {"torque", known(joint.max_torque_Nm)},
          {"passive", false}};
}

Json feet_json(const hal::RobotConfig& robot) {
  Json feet = Json::array();
  const std::vector<hal::SiteConfig>& sites = robot.model.sites;
  for (const hal::Foot& foot : robot.contact.feet) {
    const auto site = std::ranges::find(sites, foot.site, &hal::SiteConfig::name);
    if (site == sites.end()) continue;
    feet.push_back(
        {{"name", foot.site}, {"link", site->link}, {"xyz", site->xyz_m}, {"rpy", site->rpy_rad}});
  }
  return feet;
}

Json patch_json(const hal::GroundPatch& patch) {
  return {{"name", patch.name},
          {"x_m", patch.x_m},
          {"y_m", patch.y_m},
          {"static_friction", patch.static_friction},
          {"sliding_friction", patch.sliding_friction},
          {"stiffness_share", patch.stiffness_share}};
}

/// The level plane, and what is added to it: as a grid of heights, so that only hal::Terrain
/// computes them.
Json ground_json(const hal::ContactConfig& ground) {
  if (!(ground.stiffness_N_m > 0.0)) return nullptr;
  Json json{{"height_m", ground.height_m}};
  if (!ground.terrain.level()) {
    constexpr double kPerMetre = 1e5;
    hal::TerrainGrid grid = hal::grid_of(ground.terrain);
    for (double& height : grid.height_m) height = std::round(kPerMetre * height) / kPerMetre;
    json["terrain"] = {{"x_m", std::move(grid.x_m)},
                       {"y_m", std::move(grid.y_m)},
                       {"height_m", std::move(grid.height_m)},
                       {"coarser", grid.coarser}};
  }
  for (const hal::GroundPatch& patch : ground.patches) json["patches"].push_back(patch_json(patch));
  return json;
}

const char* level_name(Event::Level level) {
  switch (level) {
    case Event::Level::kInfo: return "info";
    case Event::Level::kWarn: return "warn";
    case Event::Level::kError: return "error";
  }
  return "?";
}

Json field_json(const SourceField& field) {
  return {{"name", field.name},
          {"unit", field.unit},
          {"doc", field.doc},
          {"type", to_string(field.type)},
          {"elements", field.elements.empty() ? Json(nullptr) : Json(field.elements)},
          {"count", field.count}};
}

Json mark_json(const hal::MarkInfo& mark) {
  return {{"name", mark.name},   {"shape", to_string(mark.shape)},
          {"link", mark.link},   {"xyz", mark.xyz_m},
          {"rpy", mark.rpy_rad}, {"size_m", mark.size_m},
          {"rgba", mark.rgba}};
}

}  // namespace

std::string hello_text(const RunDescription& run, std::span<const std::uint64_t> reach) {
  const hal::RobotConfig& robot = run.robot;
  const double period_s = 1e-9 * static_cast<double>(run.period_ns);
  Json joints = Json::array(), postures = Json::array(), reaches = Json::array();
  Json sites = Json::array();
  for (const hal::JointConfig& joint : robot.joints) joints.push_back(joint_json(joint));
  for (const auto& posture : robot.postures) postures.push_back(posture.name);
  for (const hal::SiteConfig& site : robot.model.sites)
    sites.push_back({{"name", site.name}, {"link", site.link}});
  for (const std::uint64_t cycles : reach) {
    reaches.push_back(period_s * static_cast<double>(cycles));
  }
  const MeshFiles meshes(run.urdf, run.urdf_file);
  Json files = Json::array();
  for (std::size_t i = 0; i < meshes.names().size(); ++i) {
    const std::string why = meshes.why_not(i);
    files.push_back(
        {{"file", meshes.names()[i]},
         {"path", why.empty() ? Json(std::string(kMeshPath) + std::to_string(i)) : Json()},
         {"why", why}});
  }
  return json_text({{"op", "hello"},
                    {"protocol", kProtocol},
                    {"version", run.version},
                    {"robot", robot.name},
                    {"experiment", run.experiment},
                    {"title", robot.name + ": " + run.experiment},
                    {"simulated", run.simulated},
                    {"emulated", run.emulated.empty() ? Json() : Json(run.emulated)},
                    {"floating", robot.model.floating_base},
                    {"ground", ground_json(robot.contact)},
                    {"period_s", period_s},
                    {"run", run.run},
                    {"history_s", std::move(reaches)},
                    {"joints", std::move(joints)},
                    {"passive", robot.passive_names()},
                    {"feet", feet_json(robot)},
                    {"postures", std::move(postures)},
                    {"sites", std::move(sites)},
                    {"meshes", std::move(files)},
                    {"urdf", "/robot.urdf"}});
}

std::string signals_text(std::uint32_t revision, const SignalTable& table) {
  Json sources = Json::array();
  for (const Source& source : table.sources()) {
    if (!source.there) continue;
    Json fields = Json::array();
    for (const SourceField& field : source.fields) fields.push_back(field_json(field));
    Json one{{"name", source.name}, {"first", source.first}, {"fields", std::move(fields)}};
    for (const hal::MarkInfo& mark : source.marks) one["marks"].push_back(mark_json(mark));
    sources.push_back(std::move(one));
  }
  return json_text({{"op", "signals"}, {"revision", revision}, {"sources", std::move(sources)}});
}

std::string events_text(std::span<const Event> events) {
  Json list = Json::array();
  for (const Event& event : events) {
    list.push_back({{"time_s", event.time_s},
                    {"cycle", event.cycle},
                    {"level", level_name(event.level)},
                    {"who", event.who},
                    {"text", event.text}});
  }
  return json_text({{"op", "events"}, {"events", std::move(list)}});
}

std::string back_text(double time_s, std::uint64_t cycle, double from_s) {
  return json_text({{"op", "back"}, {"time_s", time_s}, {"cycle", cycle}, {"from_s", from_s}});
}

std::string error_text(std::string_view message, std::string_view hint) {
  return json_text({{"op", "error"}, {"message", message}, {"hint", hint}});
}

std::string answer_text(std::int64_t number, std::string_view json) {
  std::string text = R"({"op":"answer","id":)" + std::to_string(number) + R"(,"answer":)";
  return text.append(json) + "}";
}

std::string watched_text(std::string_view request, std::string_view json) {
  std::string text =
      R"({"op":"watched","request":)" + json_text(std::string(request)) + R"(,"answer":)";
  return text.append(json) + "}";
}

std::string control_text(bool taken, bool yours, std::string_view by, bool went_back) {
  return json_text({{"op", "control"},
                    {"taken", taken},
                    {"yours", yours},
                    {"by", by},
                    {"went_back", went_back}});
}

std::string entered_text(bool all) {
  return json_text({{"op", "entered"}, {"may", all ? "all" : "look"}});
}

std::string ended_text(std::string_view how, std::string_view log) {
  return json_text({{"op", "ended"}, {"how", how}, {"log", log}});
}

void Tick::merge_before(const Tick& earlier) {
  gap = gap || earlier.gap;
  if (earlier.revision != revision || earlier.numbers.size() != numbers.size()) return;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3) {
    numbers[i] = least(numbers[i], earlier.numbers[i]);
    numbers[i + 1] = largest(numbers[i + 1], earlier.numbers[i + 1]);
  }
}

std::string tick_frame(const Tick& tick, std::uint32_t lost) {
  std::string frame;
  frame.reserve(32 + tick.numbers.size() * sizeof(float));
  put(frame, kTickKind);
  put(frame, static_cast<std::uint8_t>((tick.stands ? kStands : 0) | (tick.gap ? kGap : 0)));
  put(frame, std::uint16_t{0});
  put(frame, tick.revision);
  put(frame, lost);
  put(frame, static_cast<std::uint32_t>(tick.numbers.size() / 3));
  put(frame, tick.cycle);
  put(frame, tick.time_s);
  put(frame, std::span<const float>(tick.numbers));
  return frame;
}

std::string window_frame(const FrameHead& head, std::span<const float> numbers) {
  std::string frame;
  frame.reserve(32 + numbers.size_bytes());
  put(frame, kWindowKind);
  put(frame, static_cast<std::uint8_t>(head.level));
  put(frame, static_cast<std::uint16_t>(head.signals));
  put(frame, head.id);
  put(frame, static_cast<std::uint32_t>(head.rows));
  put(frame, static_cast<std::uint32_t>(head.cycles));
  put(frame, head.start_s);
  put(frame, head.step_s);
  put(frame, numbers);
  return frame;
}

std::string window_frame(std::uint32_t id, const History& history, const Window& window,
                         std::span<const SignalId> signals, std::int64_t period_ns) {
  const double period_s = 1e-9 * static_cast<double>(period_ns);
  std::vector<float> numbers(signals.size() * window.numbers());
  std::span<float> rest(numbers);
  for (const SignalId signal : signals) {
    history.read(window, signal, rest.first(window.numbers()));
    rest = rest.subspan(window.numbers());
  }
  return window_frame({.id = id,
                       .level = window.level,
                       .signals = signals.size(),
                       .rows = window.rows,
                       .cycles = window.cycles,
                       .start_s = period_s * static_cast<double>(window.first_cycle),
                       .step_s = period_s * static_cast<double>(window.cycles)},
                      numbers);
}

}  // namespace tandem::studio
