#include "studio/twin_source.hpp"

#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

namespace tandem::studio {

using hal::FieldType;

TwinSource::TwinSource(const hal::ParallelView& view) {
  const std::size_t joints = view.position_rad.size();
  layout_.add("position_rad", FieldType::kF64, joints,
              "[rad or m] by joint: of the parallel robot, its newest at each tick");
  layout_.add("difference_rad", FieldType::kF64, joints,
              "[rad or m] by joint: the robot's position less the parallel one's, in one cycle");
  if (view.truth) {
    if (view.truth->passive() > 0) {
      layout_.add("passive_position_rad", FieldType::kF64, view.truth->passive(),
                  "[rad or m] of the parallel robot's passive joints");
    }
    layout_.add("base_position_m", FieldType::kF64, 3, "[m] of the parallel robot's base in W");
    layout_.add("base_quaternion", FieldType::kF64, 4, "x y z w of the parallel robot's base in W");
  }
  layout_.add("behind_cycles", FieldType::kU64, 1, "cycles that the parallel robot is late");
  image_.resize(layout_.bytes());
}

void TwinSource::look(const hal::ParallelView& view) {
  const auto put = [this](const char* name, std::span<const double> numbers) {
    if (const hal::Field* field = layout_.find(name))
      std::memcpy(image_.data() + field->offset, numbers.data(), numbers.size_bytes());
  };
  put("position_rad", view.state.position_rad());
  put("difference_rad", view.position_rad);
  // By the rule of log/unmeasured.hpp: a sample that is older than the run is none.
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t joint = 0; joint < view.state.joints(); ++joint) {
    if (view.state.age_cycles()[joint] <= view.state.cycle()[0]) continue;
    for (const char* name : {"position_rad", "difference_rad"}) {
      std::memcpy(image_.data() + layout_.find(name)->offset + joint * sizeof kNone, &kNone,
                  sizeof kNone);
    }
  }
  if (view.truth) {
    put("passive_position_rad", view.truth->passive_position_rad());
    put("base_position_m", view.truth->base_position_m());
    put("base_quaternion", view.truth->base_quaternion());
  }
  const std::uint64_t behind = view.behind_cycles;
  std::memcpy(image_.data() + layout_.find("behind_cycles")->offset, &behind, sizeof behind);
}

}  // namespace tandem::studio
