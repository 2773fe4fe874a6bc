#include "hal/truth.hpp"

#include <memory>

namespace tandem::hal {
namespace {

std::shared_ptr<const Layout> truth_layout(std::size_t joints, std::size_t feet, std::size_t loops,
                                           std::size_t passive) {
  auto layout = std::make_shared<Layout>();
  layout->add("cycle", FieldType::kU64, 1, "number of the loop's cycle");
  layout->add("time_ns", FieldType::kI64, 1, "nominal time of the cycle since the start");
  layout->add("base_position_m", FieldType::kF64, 3, "base origin in W");
  layout->add("base_quaternion", FieldType::kF64, 4, "x y z w, base to W");
  layout->add("base_velocity", FieldType::kF64, 6, "in the base's frame: linear, angular");
  layout->add("center_of_mass_m", FieldType::kF64, 3, "in W");
  layout->add("position_rad", FieldType::kF64, joints, "link side");
  layout->add("velocity_rad_s", FieldType::kF64, joints, "link side");
  layout->add("torque_Nm", FieldType::kF64, joints, "on the link, from the spring");
  layout->add("foot_position_m", FieldType::kF64, 3 * feet, "origin of each foot's site in W");
  layout->add("foot_force_N", FieldType::kF64, 3 * feet, "of the ground on each foot, W axes");
  layout->add("foot_moment_Nm", FieldType::kF64, 3 * feet, "about the site's origin, W axes");
  layout->add("hoist_share", FieldType::kF64, 1, "1: the base is held, 0: it is free");
  if (loops > 0) {
    layout->add("loop_position_error_m", FieldType::kF64, loops, "how far each loop is open");
    layout->add("loop_velocity_error_m_s", FieldType::kF64, loops, "how fast each loop opens");
  }
  if (passive > 0) {
    layout->add("passive_position_rad", FieldType::kF64, passive, "of joints without a motor");
  }
  return layout;
}

}  // namespace

#define TANDEM_BIND(name)                             \
  {                                                   \
    const Field* found = layout().find(#name);        \
    name##_ = {found->offset, found->count};          \
  }

TruthImage::TruthImage(std::size_t joints, std::size_t feet, std::size_t loops, std::size_t passive)
    : Image(truth_layout(joints, feet, loops, passive)) {
  TANDEM_BIND(cycle)
  TANDEM_BIND(time_ns)
  TANDEM_BIND(base_position_m)
  TANDEM_BIND(base_quaternion)
  TANDEM_BIND(base_velocity)
  TANDEM_BIND(center_of_mass_m)
  TANDEM_BIND(position_rad)
  TANDEM_BIND(velocity_rad_s)
  TANDEM_BIND(torque_Nm)
  TANDEM_BIND(foot_position_m)
  TANDEM_BIND(foot_force_N)
  TANDEM_BIND(foot_moment_Nm)
  TANDEM_BIND(hoist_share)
  if (loops > 0) {
    TANDEM_BIND(loop_position_error_m)
    TANDEM_BIND(loop_velocity_error_m_s)
  }
  if (passive > 0) TANDEM_BIND(passive_position_rad)
}

#undef TANDEM_BIND

}  // namespace tandem::hal
