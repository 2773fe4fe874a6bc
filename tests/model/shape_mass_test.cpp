// Masses from shapes, against closed forms and slices; meshes against boxes.
#include "model/shape_mass.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <numbers>

#include "model/stl_mesh.hpp"
#include "tests/model/urdf_fixture.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::model {
namespace {

constexpr double kPi = std::numbers::pi;

/// The 12 triangles of a box with a corner at (1, 2, 3).
std::vector<Triangle> box_of(const Eigen::Vector3d& edges) {
  const auto corner = [&edges](int i) {
    return Eigen::Vector3d(1.0 + (i & 1) * edges.x(), 2.0 + (i >> 1 & 1) * edges.y(),
                           3.0 + (i >> 2 & 1) * edges.z());
  };
  std::vector<Triangle> all;
  for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1},
                                   {4, 5, 7, 6},
                                   {0, 1, 5, 4},
                                   {2, 6, 7, 3},
                                   {0, 4, 6, 2},
                                   {1, 3, 7, 5}}) {
    all.push_back({corner(a), corner(b), corner(c)});
    all.push_back({corner(a), corner(c), corner(d)});
  }
  return all;
}

std::string binary_stl(const std::vector<Triangle>& all) {
  std::string bytes(80, ' ');
  std::memcpy(bytes.data(), "solid", 5);  // as some exporters begin binary files
  const auto count = static_cast<std::uint32_t>(all.size());
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  for (const Triangle& one : all) {
    float numbers[12] = {};
    for (std::size_t corner = 0; corner < 3; ++corner)
      for (Eigen::Index i = 0; i < 3; ++i)
        numbers[3 + 3 * corner + static_cast<std::size_t>(i)] = static_cast<float>(one[corner][i]);
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string link(const std::string& geometry, const std::string& origin = {}) {
  return "<robot name='r'><link name='a'><collision>" + origin + "<geometry>" + geometry +
         "</geometry></collision></link></robot>";
}

TEST(ShapeMass, OfSolidsIsWhatTheirFormulasSay) {
  const auto found = [](const std::string& geometry) {
    const ShapeMasses masses = masses_from_shapes(link(geometry), "r.urdf", 1000.0);
    EXPECT_EQ(masses.links.size(), 1u);
    return masses.links.at(0).inertia;
  };
  const Inertia box = found("<box size='0.1 0.2 0.3'/>");
  EXPECT_NEAR(box.mass_kg, 6.0, 1e-12);
  EXPECT_NEAR(box.about_com_kg_m2(0, 0), 6.0 / 12.0 * (0.04 + 0.09), 1e-12);
  const Inertia ball = found("<sphere radius='0.1'/>");
  EXPECT_NEAR(ball.mass_kg, 4.0 / 3.0 * kPi, 1e-12);
  EXPECT_NEAR(ball.about_com_kg_m2(2, 2), 0.4 * ball.mass_kg * 0.01, 1e-12);
  const Inertia rod = found("<cylinder radius='0.1' length='0.5'/>");
  EXPECT_NEAR(rod.mass_kg, kPi * 5.0, 1e-12);
  EXPECT_NEAR(rod.about_com_kg_m2(2, 2), 0.5 * rod.mass_kg * 0.01, 1e-12);
}

TEST(ShapeMass, OfACapsuleIsTheSumOfItsSlices) {
  const double r = 0.1, l = 0.5;
  const Inertia found =
      masses_from_shapes(link("<capsule radius='0.1' length='0.5'/>"), "r.urdf", 1000.0)
          .links.at(0)
          .inertia;
  double mass = 0.0, across = 0.0;
  const int slices = 200000;
  const double step = (l + 2.0 * r) / slices;
  for (int i = 0; i < slices; ++i) {
    const double z = -0.5 * l - r + (i + 0.5) * step;
    const double over = std::max(0.0, std::abs(z) - 0.5 * l);
    const double square = r * r - over * over;
    const double kg = 1000.0 * kPi * square * step;
    mass += kg;
    across += kg * (0.25 * square + z * z);
  }
  EXPECT_NEAR(found.mass_kg, mass, 1e-7);
  EXPECT_NEAR(found.about_com_kg_m2(0, 0), across, 1e-7);
}

TEST(ShapeMass, OfAMeshIsThatOfWhatItEncloses) {
  const test::ScratchFolder folder;
  std::filesystem::create_directories(folder / "arm_description/meshes");
  std::filesystem::create_directories(folder / "arm_description/urdf");
  std::ofstream(folder / "arm_description/meshes/box.stl", std::ios::binary)
      << binary_stl(box_of({100.0, 200.0, 300.0}));
  const std::string file = folder / "arm_description/urdf/arm.urdf";
  for (const char* name : {"package://arm_description/meshes/box.stl", "../meshes/box.stl"}) {
    const ShapeMasses masses = masses_from_shapes(
        link(std::string("<mesh filename='") + name + "' scale='0.001 0.001 0.001'/>",
             "<origin xyz='0.5 0 0' rpy='0 0 1.5707963267948966'/>"),
        file, 1000.0);
    ASSERT_EQ(masses.links.size(), 1u) << name;
    const Inertia& found = masses.links[0].inertia;
    EXPECT_NEAR(found.mass_kg, 6.0, 1e-5);
    // (0.051, 0.102, 0.153) in the mesh, turned by 90 degrees about z and moved.
    EXPECT_LT((found.com_m - Eigen::Vector3d(0.5 - 0.102, 0.051, 0.153)).norm(), 1e-6);
    EXPECT_NEAR(found.about_com_kg_m2(1, 1), 6.0 / 12.0 * (0.04 + 0.09), 1e-6);
  }
}

TEST(ShapeMass, OfAnOpenMeshIsThatOfTheBoxAroundIt) {
  const test::ScratchFolder folder;
  std::vector<Triangle> open = box_of({1.0, 2.0, 3.0});
  open.resize(2);  // the floor alone encloses nothing
  open.push_back({Eigen::Vector3d(1, 2, 6), {2, 2, 6}, {1, 4, 6}});
  std::ofstream(folder / "open.stl", std::ios::binary) << binary_stl(open);
  const ShapeMasses masses =
      masses_from_shapes(link("<mesh filename='open.stl'/>"), folder / "r.urdf", 1.0);
  ASSERT_EQ(masses.links.size(), 1u);
  EXPECT_GT(masses.links[0].inertia.mass_kg, 0.01);
  EXPECT_LE(masses.links[0].inertia.mass_kg, 6.0 + 1e-9);
}

TEST(ShapeMass, SaysWhichMeshItCannotRead) {
  const test::ScratchFolder folder;
  std::ofstream(folder / "a.dae") << "<COLLADA>" << std::string(200, ' ') << "</COLLADA>";
  std::ofstream(folder / "cut.stl", std::ios::binary)
      << binary_stl(box_of({1.0, 1.0, 1.0})).substr(0, 300);
  for (const auto& [name, why] : {std::pair{"a.dae", "its mesh a.dae: this is no STL"},
                                  {"cut.stl", "its mesh cut.stl: the STL is cut off"},
                                  {"none.stl", "its mesh none.stl is not found"}}) {
    const ShapeMasses masses = masses_from_shapes(
        link(std::string("<mesh filename='") + name + "'/>"), folder / "r.urdf", 1.0);
    EXPECT_TRUE(masses.links.empty());
    ASSERT_EQ(masses.without.size(), 1u) << name;
    EXPECT_EQ(masses.without[0].second, why);
  }
}

TEST(ShapeMass, TakesNoneFromWhatIsInMillimetres) {
  const test::ScratchFolder folder;
  std::ofstream(folder / "arm.stl", std::ios::binary) << binary_stl(box_of({50.0, 50.0, 300.0}));
  const auto errors = [&folder](const std::string& shape) {
    return masses_from_shapes(link(shape), folder / "r.urdf", 1000.0).errors;
  };
  const Diagnostics mesh = errors("<mesh filename='arm.stl'/>");
  ASSERT_EQ(mesh.size(), 1u);
  EXPECT_NE(mesh[0].message.find("its mesh arm.stl is 300 m long"), std::string::npos)
      << mesh[0].message;
  EXPECT_NE(mesh[0].hint.find("scale=\"0.001 0.001 0.001\""), std::string::npos);
  EXPECT_TRUE(errors("<mesh filename='arm.stl' scale='0.001 0.001 0.001'/>").empty());
  for (const char* shape : {"<box size='50 50 300'/>", "<sphere radius='50'/>",
                            "<cylinder radius='5' length='300'/>"}) {
    ASSERT_EQ(errors(shape).size(), 1u) << shape;
    EXPECT_EQ(errors(shape)[0].hint, "lengths are in metres");
  }
  EXPECT_TRUE(errors("<box size='1 1 9'/>").empty());
}

TEST(ShapeMass, LeavesLinksThatHaveMassAndTakesVisualsWhereNothingCollides) {
  const ShapeMasses masses = masses_from_shapes(
      "<robot name='r'><link name='heavy'><inertial><mass value='1'/></inertial><collision>"
      "<geometry><sphere radius='1'/></geometry></collision></link><link name='seen'><visual>"
      "<geometry><sphere radius='1'/></geometry></visual></link><link name='frame'/></robot>",
      "r.urdf", 1.0);
  ASSERT_EQ(masses.links.size(), 1u);
  EXPECT_EQ(masses.links[0].link, "seen");
  EXPECT_EQ(masses.links[0].from, "1 shape");
  ASSERT_EQ(masses.without.size(), 1u);
  EXPECT_EQ(masses.without[0].first, "frame");
}

TEST(Stl, IsReadAsText) {
  const auto found = parse_stl(
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex +1e0 0 0\nvertex 0 1.5 0\n"
      "endloop\nendfacet\nendsolid a\n");
  ASSERT_TRUE(found) << found.error().message;
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ((*found)[0][2], Eigen::Vector3d(0, 1.5, 0));
  EXPECT_FALSE(parse_stl("solid a\nvertex 0 0 x"));
  EXPECT_FALSE(parse_stl(""));
}

// --- encodings ---

/// Every letter in two bytes; `text` is ASCII.
std::string wide(const std::string& text, bool little) {
  std::string bytes;
  for (const char c : text) bytes += little ? std::string{c, '\0'} : std::string{'\0', c};
  return bytes;
}

// source: siemens/ros-sharp #434
TEST(UrdfEncoding, IsNamedWithTheConversion) {
  const std::string robot = kRobot;
  for (const auto& [text, encoding] :
       {std::pair{"\xFF\xFE" + wide(robot, true), "UTF-16"},
        {"\xFE\xFF" + wide(robot, false), "UTF-16"},
        {wide("<?xml version='1.0' encoding='UTF-16'?>" + robot, true), "UTF-16LE"},
        {wide(robot, false), "UTF-16BE"}}) {
    expect_error(text, std::string("arm.urdf: the file is ") + encoding +
                           ", and a URDF must be UTF-8 (convert it: iconv -f " + encoding +
                           " -t UTF-8 arm.urdf > arm-utf8.urdf)");
  }
  EXPECT_EQ(errors_of("<?xml version='1.0' encoding='UTF-16'?>\n" + robot), "")
      << "what iconv leaves still declares the old encoding";
  EXPECT_NE(errors_of("<?xml version='1.0' encoding='ISO-8859-1'?>\n" +
                      replaced(robot, "<link name=\"tip\"/>", "<link name=\"gr\xFC n\"/>"))
                .find("the file says that it is ISO-8859-1: convert it: iconv -f ISO-8859-1"),
            std::string::npos);
}

}  // namespace
}  // namespace tandem::model
