// Which files of a description the studio shows: none but those that it names, in its package.
#include "studio/mesh_files.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "studio/http_rules.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::studio {
namespace {

namespace fs = std::filesystem;

/// A package with a description, and what lies beside it.
struct MeshPackage {
  MeshPackage() {
    for (const char* file : {"arm/package.xml", "arm/urdf/arm.urdf", "arm/meshes/a.STL",
                             "arm/meshes/b.dae", "secret.stl", "arm_2/c.obj"}) {
      fs::create_directories((at(file)).parent_path());
      std::ofstream(at(file)) << "solid";
    }
    fs::create_symlink(at("secret.stl"), at("arm/meshes/link.stl"));
    fs::create_directory(at("arm/meshes/folder.stl"));
  }
  [[nodiscard]] fs::path at(const std::string& file) const {
    return fs::path(scratch.path()) / file;
  }
  [[nodiscard]] MeshFiles with(const std::string& name) const {
    return {"<robot><link><visual><geometry><mesh filename=\"" + name +
                "\"/></geometry></visual></link></robot>",
            at("arm/urdf/arm.urdf").string()};
  }
  [[nodiscard]] std::string why(const std::string& name) const {
    const MeshFiles files = with(name);
    EXPECT_EQ(files.names().size(), 1U) << name;
    const std::string words = files.why_not(0);
    EXPECT_EQ(files.read(0).has_value(), words.empty()) << name;
    return words;
  }
  tandem::test::ScratchFolder scratch;
};

TEST(StudioMeshes, OfTheDescriptionsPackageAreShown) {
  const MeshPackage package;
  EXPECT_EQ(package.why("../meshes/a.STL"), "");
  EXPECT_EQ(package.why("package://arm/meshes/a.STL"), "");
  EXPECT_EQ(package.why("../meshes/b.dae"), "");
  EXPECT_EQ(package.why("package://arm_2/c.obj"), "") << "a package beside it";
  EXPECT_EQ(package.why("file://" + package.at("arm/meshes/a.STL").string()), "");
  EXPECT_EQ(*package.with("../meshes/a.STL").read(0), "solid");
}

TEST(StudioMeshes, ElsewhereAreRefused) {
  const MeshPackage package;
  const std::string outside = "it lies outside the description's package";
  const std::string secret = package.at("secret.stl").string();
  for (const std::string& name :
       std::vector<std::string>{"../../secret.stl", "package://arm/../secret.stl",
                                "package://arm/meshes/../../secret.stl", secret, "file://" + secret,
                                "../meshes/link.stl"}) {
    EXPECT_EQ(package.why(name), outside) << name;
  }
  for (const char* name : {"package://../secret.stl", "package://./secret.stl", "package:///a.stl",
                           "package://nowhere/a.stl", "package://arm"}) {
    EXPECT_EQ(package.why(name), "its package is not beside or above the description") << name;
  }
  EXPECT_EQ(package.why("http://elsewhere/a.stl"), "it is no file of this machine");
  EXPECT_EQ(package.why("../meshes/b.ply"), "it is neither STL, OBJ nor COLLADA");
  EXPECT_EQ(package.why("/etc/passwd"), "it is neither STL, OBJ nor COLLADA");
  EXPECT_EQ(package.why("../meshes/none.stl"), "it is not there");
  EXPECT_EQ(package.why("../meshes/folder.stl"), "it is not there");
  EXPECT_EQ(package.why(std::string(2000, 'a') + ".stl"), "its name is too long");
  fs::resize_file(package.at("arm/meshes/a.STL"), kMostMeshBytes + 1);
  EXPECT_EQ(package.why("../meshes/a.STL"), "it has more than 32 MB");
  EXPECT_TRUE(MeshFiles("<robot><mesh", "").names().empty());
}

TEST(StudioMeshes, AreAskedForByNumber) {
  const MeshPackage package;
  const HttpRules here({"127.0.0.1", 8642, true}, "<robot/>", "token", "", {},
                       package.with("../meshes/a.STL"));
  const HttpRules open({"0.0.0.0", 8642, false}, "<robot/>", "token", "", {},
                       package.with("../meshes/a.STL"));
  const auto status = [](const HttpRules& rules, std::string_view target, const char* key = "") {
    RequestHead head{.method = "GET", .target = target};
    head.hosts = {"127.0.0.1:8642"};
    if (*key != '\0') head.authorizations = {key};
    return rules.answer(head)->status;
  };
  EXPECT_EQ(status(here, "/mesh/0"), 200U);
  for (const char* target : {"/mesh/1", "/mesh/", "/mesh/00x", "/mesh/-1", "/mesh/99999999999",
                             "/mesh/../robot.urdf", "/mesh/0/../../secret.stl", "/mesh/%2e%2e/a"}) {
    EXPECT_EQ(status(here, target), 404U) << target;
  }
  EXPECT_EQ(status(open, "/mesh/0"), 401U);
  EXPECT_EQ(status(open, "/mesh/0", "Bearer token"), 200U);
}

}  // namespace
}  // namespace tandem::studio
