// Debian's packages against what else says the same: the list of packages, the version.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace {

const std::filesystem::path kSources = TANDEM_SOURCE_DIR;

std::string whole(const char* file) {
  std::ifstream in(kSources / file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(Packages, AreBuiltWithWhatTheListHas) {
  const std::string control = whole("debian/control");
  const std::string builds = control.substr(0, control.find("\nPackage:"));
  std::istringstream list(whole("scripts/packages.txt"));
  // What every Debian build has, and what is needed at run time alone.
  const std::set<std::string> others{"make", "g++", "gnuplot-nox"};
  int compared = 0;
  std::string section;
  for (std::string line; std::getline(list, line);) {
    if (line.starts_with('[')) section = line.substr(1, line.find_first_of(":]") - 1);
    const bool is_name = !line.empty() && line.front() != '#' && line.front() != '[';
    if (!is_name || (section != "demo" && section != "python") || others.contains(line)) continue;
    ++compared;
    EXPECT_NE((builds + ",").find(" " + line), std::string::npos)
        << "Build-Depends of debian/control lacks " << line;
  }
  EXPECT_GT(compared, 20);
}

TEST(Packages, HaveTheProgramsVersion) {
  std::smatch program, package;
  const std::string cmake = whole("CMakeLists.txt"), changes = whole("debian/changelog");
  ASSERT_TRUE(
      std::regex_search(cmake, program, std::regex(R"(project\(tandem VERSION ([0-9.]+))")));
  ASSERT_TRUE(std::regex_search(changes, package, std::regex(R"(^tandem \(([0-9.]+)\))")));
  EXPECT_EQ(program[1], package[1]);
}

}  // namespace
