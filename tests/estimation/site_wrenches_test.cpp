// Wrenches at places, from J^T f computed by another way than the solution.
#include "estimation/site_wrenches.hpp"

#include <gtest/gtest.h>

#include "model/interpreted_kernels.hpp"
#include "model/urdf.hpp"

namespace tandem::estimation {
namespace {

using model::evaluate_kernel;
using model::Kernel;

struct Chain {
  Chain(const std::string& name, std::vector<double> posture, std::vector<model::SiteSpec> sites)
      : tree(
            model::read_urdf(TANDEM_SOURCE_DIR "/config/" + name + "/" + name + ".urdf", {})->tree),
        mechanism(*model::make_mechanism(tree, spec(name, std::move(sites)))),
        kernels(mechanism, name),
        q(std::move(posture)) {}
  static model::ModelSpec spec(const std::string& name, std::vector<model::SiteSpec> sites) {
    model::ModelSpec spec;
    spec.robot = name;
    spec.sites = std::move(sites);
    return spec;
  }
  /// Torques of a wrench at the site.
  void add(std::vector<double>& torques, std::size_t site, const std::vector<double>& f) const {
    const auto J = evaluate_kernel(Kernel::kSiteJacobians, mechanism, {q})[0];
    const std::size_t n = torques.size();
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t row = 0; row < 6; ++row)
        torques[i] += J[6 * n * site + row * n + i] * f[row];
  }

  model::Tree tree;
  model::Mechanism mechanism;
  model::InterpretedKernels kernels;
  std::vector<double> q;
};

const std::vector<double> kBent{0.3, -1.0, 1.2, -0.8, -1.3, 0.4};

TEST(SiteWrenches, AreTheOnesThatExplainTheTorques) {
  const Chain arm("ur5e", kBent, {{.name = "tool0", .link = "tool0"}});
  auto sites = SiteWrenches::make(*arm.kernels.get(), {"tool0"});
  ASSERT_TRUE(sites) << sites.error().to_string();
  const std::vector<double> wrench{20.0, -30.0, 10.0, 1.0, -2.0, 0.5};
  std::vector<double> residual(6, 0.0);
  arm.add(residual, 0, wrench);
  sites->solve(nullptr, arm.q.data(), residual);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(sites->wrench(0)[i], wrench[i], 0.05 * 30.0) << i;
  EXPECT_LT(sites->unexplained_Nm(), 0.1);
}

// A push on the upper arm is no wrench at a shoulder's flange: the elbow's torque is left over.
TEST(SiteWrenches, SayWhatTheyDoNotExplain) {
  const Chain arm("ur5e", kBent, {{.name = "upper", .link = "upper_arm_link"}});
  auto sites = SiteWrenches::make(*arm.kernels.get(), {"upper"});
  ASSERT_TRUE(sites) << sites.error().to_string();
  const std::vector<double> residual{5.0, -4.0, 3.0, 0.0, 0.0, 4.0};  // joints 3 and 6 lie beyond
  sites->solve(nullptr, arm.q.data(), residual);
  EXPECT_NEAR(sites->unexplained_Nm(), 5.0, 0.01);
}

// Two joints about parallel axes: a force in their plane. Along the axes nothing is seen.
TEST(SiteWrenches, OfAShortChainHaveZerosWhereItsJointsSeeNothing) {
  const Chain arm("double_pendulum", {0.4, 0.9},
                  {{.name = "tip", .link = "link2", .xyz_m = {0.0, 0.1, 0.4}}});
  auto sites = SiteWrenches::make(*arm.kernels.get(), {"tip"});
  ASSERT_TRUE(sites) << sites.error().to_string();
  std::vector<double> in_plane(2, 0.0), along(2, 0.0);
  arm.add(in_plane, 0, {0.0, 3.0, -2.0, 0.0, 0.0, 0.0});
  arm.add(along, 0, {7.0, 0.0, 0.0, 0.0, 1.0, 1.0});
  for (const double torque : along) EXPECT_NEAR(torque, 0.0, 1e-12);
  sites->solve(nullptr, arm.q.data(), in_plane);
  const auto f = sites->wrench(0);
  for (const std::size_t row : {0U, 4U, 5U}) EXPECT_NEAR(f[row], 0.0, 1e-12) << row;
  EXPECT_LT(sites->unexplained_Nm(), 0.01);
  std::vector<double> again(2, 0.0);
  arm.add(again, 0, {f[0], f[1], f[2], f[3], f[4], f[5]});
  for (std::size_t j = 0; j < 2; ++j) EXPECT_NEAR(again[j], in_plane[j], 0.01);
}

TEST(SiteWrenches, RefuseSitesThatAreNotThereOrTwice) {
  const Chain arm("ur5e", kBent, {{.name = "tool0", .link = "tool0"}});
  const auto refused = [&](const std::vector<std::string>& sites) {
    const auto made = SiteWrenches::make(*arm.kernels.get(), sites);
    return made ? std::string() : made.error().to_string();
  };
  EXPECT_NE(refused({"tool1"}).find("did you mean 'tool0'"), std::string::npos)
      << refused({"tool1"});
  EXPECT_NE(refused({"tool0", "tool0"}).find("twice"), std::string::npos);
  EXPECT_NE(refused(std::vector<std::string>(5, "tool0")).find("more than 4"), std::string::npos);
}

}  // namespace
}  // namespace tandem::estimation
