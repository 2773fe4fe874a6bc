#include "log/controller_messages.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "hal/marker.hpp"
#include "log/cdr_writer.hpp"
#include "log/robot_view.hpp"

namespace tandem::log {
namespace {

void write_time(CdrWriter& out, std::int64_t time_ns) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  out.number(static_cast<std::uint32_t>(time_ns / kSecond_ns));
  out.number(static_cast<std::uint32_t>(time_ns % kSecond_ns));
}

void write_place(CdrWriter& out, const std::array<double, 3>& place_m) {
  for (const double value : place_m) out.number(value);
}

void write_marker(CdrWriter& out, const std::string& space, std::uint32_t id,
                  const hal::MarkInfo& mark, const hal::Marker& marker, std::int64_t stamp_ns) {
  write_time(out, stamp_ns);
  out.text(mark.link);
  out.text(space + "/" + mark.name);
  out.number(id);
  out.number(static_cast<std::uint32_t>(marker.type));
  out.number(static_cast<std::uint32_t>(marker.action));
  write_place(out, marker.position_m);
  for (const double value : marker.quaternion) out.number(value);
  write_place(out, marker.scale_m);
  for (const float part : mark.rgba) out.number(std::bit_cast<std::uint32_t>(part));
  write_time(out, 0);           // lifetime: for ever
  out.number(std::uint8_t{1});  // frame_locked
  out.number(static_cast<std::uint32_t>(marker.points_m.size()));
  for (const auto& place_m : marker.points_m) write_place(out, place_m);
  out.number(std::uint32_t{0});  // colors
  out.text("");                  // texture_resource
  write_time(out, 0);            // texture: header,
  out.text("");
  out.text("");                  // format,
  out.number(std::uint32_t{0});  // data
  out.number(std::uint32_t{0});  // uv_coordinates
  out.text(marker.text);
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
  hal::MarkBlock::State state;
  std::memcpy(&state, bytes.data(), std::min(bytes.size(), sizeof state));
  CdrWriter cdr(out);
  cdr.number(static_cast<std::uint32_t>(marks.size()));
  for (std::size_t i = 0; i < marks.size(); ++i) {
    write_marker(cdr, controller, static_cast<std::uint32_t>(i), marks[i],
                 hal::marker_of(marks[i], state, i), stamp_ns);
  }
}

}  // namespace tandem::log
