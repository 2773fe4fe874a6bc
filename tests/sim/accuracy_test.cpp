// How exact a run is that asks for nothing: the default integrator and sub-step against
// Runge-Kutta's.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "hal/sim/plant.hpp"
#include "model/interpreted_kernels.hpp"
#include "model/urdf.hpp"

namespace tandem::sim {
namespace {

/// Three point masses of 1 kg, 1 m apart, each below the other at 0; nothing brakes them.
class TriplePendulum : public testing::Test {
 protected:
  TriplePendulum() {
    std::string urdf = R"(<robot name="triple"><link name="base"/>)";
    for (const char link : {'1', '2', '3'}) {
      const std::string parent = link == '1' ? "base" : std::string("rod") + char(link - 1);
      urdf +=
          std::string(R"(<link name="rod)") + link +
          R"("><inertial><origin xyz="0 0 -1"/><mass value="1"/>)"
          R"(<inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial></link>)"
          R"(<joint name="joint)" +
          link + R"(" type="continuous"><parent link=")" + parent + R"("/><child link="rod)" +
          link + R"("/><origin xyz="0 0 )" + (link == '1' ? "0" : "-1") +
          R"("/><axis xyz="0 1 0"/></joint>)";
    }
    auto read = model::parse_urdf(urdf + "</robot>", "triple.urdf", {.floating_base = false});
    EXPECT_TRUE(read) << read.error().front().to_string();
    kernels.emplace(*model::make_mechanism(read->tree, {}));
  }
  /// Where it is after ten seconds.
  [[nodiscard]] std::array<double, 3> after_10_s(std::array<double, 3> start,
                                                 const PlantConfig& with) const {
    PlantConfig config = with;
    config.kernels = kernels->get();
    for (std::size_t j = 0; j < 3; ++j)
      config.passive.push_back({.name = kernels->get()->joint_names[j]});
    Result<Plant> plant = Plant::create(config);
    EXPECT_TRUE(plant);
    plant->set_state(start, std::array{0.0, 0.0, 0.0});
    EXPECT_EQ(plant->advance(10'000'000'000), Code::kOk);
    return {plant->q()[0], plant->q()[1], plant->q()[2]};
  }
  std::optional<model::InterpretedKernels> kernels;
};

TEST_F(TriplePendulum, IsWhereItBelongsAfterTenSeconds) {
  for (const std::array start :
       {std::array{0.5, -0.3, 0.4}, std::array{1.0, 0.2, -0.5}, std::array{1.0, -0.5, 0.5}}) {
    PlantConfig yardstick;
    yardstick.integrator = Integrator::kRungeKutta4;
    const auto exact = after_10_s(start, yardstick);
    const auto by_default = after_10_s(start, {});
    for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(by_default[j], exact[j], 1e-4) << j;
  }
}

}  // namespace
}  // namespace tandem::sim
