#include "model/urdf_shapes.hpp"

namespace tandem::model {
namespace {

TEST(UrdfShapes, AreReadWithTheirFigures) {
  const auto shapes = collision_shapes(R"(<robot name="r"><link name="a">
    <collision><geometry><box size="1 2 3"/></geometry></collision>
    <collision><origin xyz="4 5 6"/><geometry><sphere radius="0.5"/></geometry></collision>
    <collision><geometry><cylinder radius="0.2" length="0.7"/></geometry></collision>
    <collision><geometry><capsule radius="0.3" length="0.8"/></geometry></collision>
    <collision><geometry><mesh filename="a.stl"/></geometry></collision>
    <collision><geometry><sphere radius="-1"/></geometry></collision></link></robot>)");
  const std::vector<Shape>& all = shapes.at("a");
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[0].kind, Shape::Kind::kBox);
  EXPECT_EQ(all[0].size_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(all[1].kind, Shape::Kind::kSphere);
  EXPECT_EQ(all[1].size_m.x(), 0.5);
  EXPECT_EQ(all[1].in_link.p, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(all[2].kind, Shape::Kind::kCylinder);
  EXPECT_EQ(all[2].size_m, Eigen::Vector3d(0.2, 0, 0.7));
  EXPECT_EQ(all[3].kind, Shape::Kind::kCapsule);
  EXPECT_EQ(all[3].size_m, Eigen::Vector3d(0.3, 0, 0.8));
  EXPECT_EQ(all[4].kind, Shape::Kind::kMesh);
  EXPECT_EQ(all[5].kind, Shape::Kind::kMesh) << "its radius is none";
}

}  // namespace
}  // namespace tandem::model
