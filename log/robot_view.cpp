// Encodes JointState, TFMessage and String as CDR by hand, from the images, every 20 ms.
#include "log/robot_view.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <utility>

#include "log/cdr_writer.hpp"
#include "log/schema.hpp"

namespace tandem::log {
namespace {

struct Definition {
  std::string_view name;
  std::string_view text;
};

// Each with the texts of all messages in it; log/CMakeLists.txt says which.
constexpr Definition kDefinitions[] = {
#include <view_definitions.inc>
};

constexpr char kWorld[] = "odom";  // as over DDS

std::uint16_t add(McapWriter& writer, const char* topic, std::string_view type) {
  return writer.add_channel(writer.add_schema(type, "ros2msg", view_definition(type)), topic,
                            "cdr");
}

/// std_msgs/Header
void write_header(CdrWriter& out, std::int64_t time_ns, std::string_view frame) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  out.number(static_cast<std::uint32_t>(time_ns / kSecond_ns));
  out.number(static_cast<std::uint32_t>(time_ns % kSecond_ns));
  out.text(frame);
}

struct Place {
  std::array<double, 3> xyz_m;
  std::array<double, 4> quaternion;
};

/// geometry_msgs/TransformStamped
void write_transform(CdrWriter& out, std::int64_t time_ns, std::string_view parent,
                     std::string_view link, const Place& place) {
  write_header(out, time_ns, parent);
  out.text(link);
  for (const double value : place.xyz_m) out.number(value);
  for (const double value : place.quaternion) out.number(value);
}

/// @param position  of the link's own joint
Place place_of(const ViewedLink& link, double position) {
  const auto& [x, y, z, w] = link.quaternion;
  const auto& [ax, ay, az] = link.axis;
  if (link.slides) {
    // The axis in the parent's frame: a + 2 v x (v x a + w a), v the quaternion's vector.
    const double cx = y * az - z * ay + w * ax, cy = z * ax - x * az + w * ay,
                 cz = x * ay - y * ax + w * az;
    const std::array along{ax + 2.0 * (y * cz - z * cy), ay + 2.0 * (z * cx - x * cz),
                           az + 2.0 * (x * cy - y * cx)};
    Place place{link.xyz_m, link.quaternion};
    for (std::size_t i = 0; i < 3; ++i) place.xyz_m[i] += position * along[i];
    return place;
  }
  const double s = std::sin(0.5 * position), c = std::cos(0.5 * position);
  const double bx = s * ax, by = s * ay, bz = s * az;
  return {link.xyz_m,
          {w * bx + x * c + y * bz - z * by, w * by + y * c + z * bx - x * bz,
           w * bz + z * c + x * by - y * bx, w * c - x * bx - y * by - z * bz}};
}

void read_field(const hal::Layout& layout, std::string_view name, std::span<const std::byte> body,
                std::vector<double>& out) {
  const hal::Field& field = *layout.find(name);
  out.clear();
  for (std::size_t i = 0; i < field.count; ++i) out.push_back(element(field, body, i));
}

}  // namespace

std::string_view view_definition(std::string_view type) {
  return std::ranges::find(kDefinitions, type, &Definition::name)->text;
}

RobotView::RobotView(ViewedRobot robot, std::vector<std::string> joints)
    : robot_(std::move(robot)), joints_(std::move(joints)) {
  moves_ = std::ranges::any_of(robot_.links, [](const ViewedLink& one) { return one.joint >= 0; });
  stands_ =
      !robot_.fixed_root.empty() || std::ranges::count(robot_.links, -1, &ViewedLink::joint) > 0;
}

void RobotView::take_channel(std::uint16_t channel, std::string_view topic,
                             const hal::Layout& layout) {
  if (robot_.urdf.empty()) return;
  if (topic == "/tandem/state") {
    state_.channel = channel;
    state_layout_ = layout;
  } else if (topic == "/tandem/truth" && !robot_.base_link.empty()) {
    truth_.channel = channel;
    truth_layout_ = layout;
  } else if (topic == "/tandem/estimate" && !robot_.base_link.empty() && truth_.channel < 0) {
    const hal::Field* base = layout.find("base_position_m");
    if (base == nullptr || base->count != 3) return;  // of an observer alone
    truth_.channel = channel;
    truth_layout_ = layout;
  }
}

void RobotView::add_channels(McapWriter& writer) {
  described_ = false;
  if (state_.channel >= 0) {
    joint_states_ = add(writer, "/joint_states", "sensor_msgs/msg/JointState");
    description_ = add(writer, "/robot_description", "std_msgs/msg/String");
  }
  const bool links = state_.channel >= 0;
  if (truth_.channel >= 0 || (links && moves_)) {
    tf_ = add(writer, "/tf", "tf2_msgs/msg/TFMessage");
  }
  if (links && stands_) tf_static_ = add(writer, "/tf_static", "tf2_msgs/msg/TFMessage");
}

bool RobotView::Source::due(std::uint16_t of, std::int64_t time_ns) {
  if (of != channel) return false;
  const std::int64_t period = time_ns / kPeriod_ns;
  return std::exchange(last_period, period) != period;
}

void RobotView::follow(std::uint16_t channel, std::int64_t time_ns,
                       std::span<const std::byte> image,
                       const std::function<void(std::uint16_t, std::span<const std::byte>)>& emit) {
  if (state_.due(channel, time_ns)) {
    if (!std::exchange(described_, true)) {
      CdrWriter(body_).text(robot_.urdf);
      emit(description_, body_);
      write_fixed_links(time_ns);
      if (stands_) emit(tf_static_, body_);
    }
    if (write_joint_states(time_ns, image)) {
      emit(joint_states_, body_);
      write_links(time_ns, image);
      if (moves_) emit(tf_, body_);
    }
  }
  if (truth_.due(channel, time_ns) && write_base(time_ns, image)) emit(tf_, body_);
}

bool RobotView::write_joint_states(std::int64_t time_ns, std::span<const std::byte> state) {
  // Older than the run: a joint of which nothing has been measured yet.
  read_field(state_layout_, "cycle", state, values_);
  const double cycle = values_.front();
  read_field(state_layout_, "age_cycles", state, values_);
  if (std::ranges::any_of(values_, [cycle](double age) { return age > cycle; })) return false;
  CdrWriter out(body_);
  write_header(out, time_ns, "");
  out.number(static_cast<std::uint32_t>(joints_.size() + robot_.followers.size()));
  for (const std::string& joint : joints_) out.text(joint);
  for (const hal::Follower& one : robot_.followers) out.text(one.name);
  // A follower has no torque that anybody measures.
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  struct Part {
    const char* field;
    double share, offset_share;  // of a follower: times its multiplier, its offset
  };
  for (const auto& [field, share, offset] :
       {Part{"position_rad", 1.0, 1.0}, {"velocity_rad_s", 1.0, 0.0}, {"torque_nm", kNone, 0.0}}) {
    read_field(state_layout_, field, state, values_);
    for (const hal::Follower& one : robot_.followers) {
      values_.push_back(share * one.multiplier * values_.at(one.leader) + offset * one.offset);
    }
    out.list(values_);
  }
  return true;
}

/// Where a viewer of ROS expects what robot_state_publisher says.
void RobotView::write_links(std::int64_t time_ns, std::span<const std::byte> state) {
  read_field(state_layout_, "position_rad", state, values_);
  const auto position = [this](const ViewedLink& link) {
    return link.multiplier * values_.at(static_cast<std::size_t>(link.joint)) + link.offset;
  };
  const auto known = [&](const ViewedLink& link) {
    return link.joint >= 0 && std::isfinite(position(link));
  };
  CdrWriter out(body_);
  out.number(static_cast<std::uint32_t>(std::ranges::count_if(robot_.links, known)));
  for (const ViewedLink& link : robot_.links | std::views::filter(known)) {
    write_transform(out, time_ns, link.parent, link.name, place_of(link, position(link)));
  }
}

void RobotView::write_fixed_links(std::int64_t time_ns) {
  const bool rooted = !robot_.fixed_root.empty();
  const auto fixed = std::ranges::count(robot_.links, -1, &ViewedLink::joint);
  CdrWriter out(body_);
  out.number(static_cast<std::uint32_t>(fixed + (rooted ? 1 : 0)));
  if (rooted) write_transform(out, time_ns, kWorld, robot_.fixed_root, {{}, {0.0, 0.0, 0.0, 1.0}});
  for (const ViewedLink& link : robot_.links) {
    if (link.joint >= 0) continue;
    write_transform(out, time_ns, link.parent, link.name, {link.xyz_m, link.quaternion});
  }
}

bool RobotView::write_base(std::int64_t time_ns, std::span<const std::byte> truth) {
  if (truth_layout_.find("base_valid") != nullptr) {  // an estimate that has not started
    read_field(truth_layout_, "base_valid", truth, values_);
    if (values_.front() == 0.0) return false;
  }
  CdrWriter out(body_);
  out.number(std::uint32_t{1});  // of the list of transforms
  write_header(out, time_ns, kWorld);
  out.text(robot_.base_link);
  for (const char* field : {"base_position_m", "base_quaternion"}) {
    read_field(truth_layout_, field, truth, values_);
    if (!std::ranges::all_of(values_, [](double value) { return std::isfinite(value); })) {
      return false;
    }
    for (const double value : values_) out.number(value);
  }
  return true;
}

}  // namespace tandem::log
