#include "log/controller_messages.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

#include "base/quoting.hpp"
#include "log/cdr_writer.hpp"
#include "log/robot_view.hpp"

namespace tandem::log {
namespace {

using hal::MarkInfo;
using hal::MarkShape;
using State = hal::MarkBlock::State;

/// visualization_msgs/Marker's constants.
std::uint32_t type_of(MarkShape shape) {
  switch (shape) {
    case MarkShape::kPoints: return 7;  // SPHERE_LIST
    case MarkShape::kArrow: return 0;
    case MarkShape::kLine:
    case MarkShape::kPolygon: return 4;  // LINE_STRIP
    case MarkShape::kText: return 9;     // TEXT_VIEW_FACING
  }
  return 7;
}

/// Not yet whole, or with a place that is no number: a viewer has no use for it.
bool is_shown(const MarkInfo& mark, const State& state, std::uint32_t points) {
  const std::size_t least = mark.shape == MarkShape::kArrow ? 2 : 1;
  const auto places = std::span(state.place_m).subspan(mark.first, points);
  return points >= least && std::ranges::all_of(places, [](const auto& place) {
           return std::ranges::all_of(place, [](double value) { return std::isfinite(value); });
         });
}

void write_time(CdrWriter& out, std::int64_t time_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  out.number(static_cast<std::uint32_t>(time_ns / kSecond_ns));
  out.number(static_cast<std::uint32_t>(time_ns % kSecond_ns));
}

void write_place(CdrWriter& out, const std::array<double, 3>& place_m) {
  for (const double value : place_m) out.number(value);
}

void write_points(CdrWriter& out, const MarkInfo& mark, const State& state, std::uint32_t points) {
  if (points == 0 || mark.shape == MarkShape::kText) return out.number(std::uint32_t{0});
  const bool closes = mark.shape == MarkShape::kPolygon && points > 1;
  out.number(points + (closes ? 1U : 0U));
  for (std::size_t i = 0; i < points; ++i) write_place(out, state.place_m[mark.first + i]);
  if (closes) write_place(out, state.place_m[mark.first]);
}

void write_marker(CdrWriter& out, const std::string& space, std::uint32_t id, const MarkInfo& mark,
                  std::int64_t stamp_ns, const State& state) {
  const State::One& now = state.marks[id];
  const auto most = static_cast<std::uint32_t>(mark.points);
  std::uint32_t points = std::min(now.points, most);
  if (!is_shown(mark, state, points)) points = 0;
  constexpr std::uint32_t kAdd = 0, kDelete = 2;
  write_time(out, stamp_ns);
  out.text(mark.frame);
  out.text(space + "/" + mark.name);
  out.number(id);
  out.number(type_of(mark.shape));
  out.number(points == 0 ? kDelete : kAdd);
  const bool is_text = mark.shape == MarkShape::kText;
  write_place(out, is_text && points > 0 ? state.place_m[mark.first] : std::array<double, 3>{});
  for (const double quaternion : {0.0, 0.0, 0.0, 1.0}) out.number(quaternion);
  const double head = mark.shape == MarkShape::kArrow ? 2.0 * mark.size_m : mark.size_m;
  write_place(out, {mark.size_m, head, mark.shape == MarkShape::kArrow ? 0.0 : mark.size_m});
  for (const float part : mark.rgba) out.number(std::bit_cast<std::uint32_t>(part));
  write_time(out, 0);           // lifetime: for ever
  out.number(std::uint8_t{1});  // frame_locked
  write_points(out, mark, state, points);
  out.number(std::uint32_t{0});  // colors
  out.text("");                  // texture_resource
  write_time(out, 0);            // texture: header,
  out.text("");
  out.text("");                  // format,
  out.number(std::uint32_t{0});  // data
  out.number(std::uint32_t{0});  // uv_coordinates
  const std::string_view said(now.text.data(), now.text.size());
  out.text(is_text ? shown(said.substr(0, said.find('\0'))) : std::string());
  out.text("");                  // mesh_resource
  out.text("");                  // mesh_file: filename,
  out.number(std::uint32_t{0});  // data
  out.number(std::uint8_t{0});   // mesh_use_embedded_materials
}

}  // namespace

std::string rosout_definition() { return std::string(view_definition(kRosoutType)); }

void encode_rosout(const hal::TextEvent& event, std::int64_t stamp_ns, Bytes& out) {
  CdrWriter cdr(out);
  write_time(cdr, stamp_ns);
  cdr.number(static_cast<std::uint8_t>(event.level));
  cdr.text(event.controller());
  cdr.text(event.words());
  cdr.text("");
  cdr.text("cycle " + std::to_string(event.cycle));
  cdr.number(std::uint32_t{0});
}

std::string marks_definition() { return std::string(view_definition(kMarksType)); }

void encode_marks(const std::string& controller, const std::vector<hal::MarkInfo>& marks,
                  std::int64_t stamp_ns, std::span<const std::byte> bytes, Bytes& out) {
  State state;
  std::memcpy(&state, bytes.data(), std::min(bytes.size(), sizeof state));
  CdrWriter cdr(out);
  cdr.number(static_cast<std::uint32_t>(marks.size()));
  for (std::size_t i = 0; i < marks.size(); ++i) {
    write_marker(cdr, controller, static_cast<std::uint32_t>(i), marks[i], stamp_ns, state);
  }
}

}  // namespace tandem::log
