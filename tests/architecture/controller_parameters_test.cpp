// The numbers of the bundled controllers are parameters, and each has its row in the docs.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace tandem {
namespace {

namespace fs = std::filesystem;

std::string content(const fs::path& path) {
  std::stringstream out;
  out << std::ifstream(path).rdbuf();
  return out.str();
}

/// The sources of controllers/, by name.
std::vector<std::pair<std::string, std::string>> sources() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const auto& entry : fs::directory_iterator(TANDEM_SOURCE_DIR "/controllers")) {
    if (entry.path().extension() == ".cpp")
      all.emplace_back(entry.path().filename().string(), content(entry.path()));
  }
  return all;
}

TEST(ControllerParameters, AreDeclaredWhereverABundledControllerReadsANumber) {
  // Keys of [controller.parameters] itself: way-points and harmonics are data, in tables.
  const std::regex read(R"(parameters\.(number|numbers|integer|boolean|rows)(_or)?\()");
  ASSERT_GT(sources().size(), 10U);
  for (const auto& [name, text] : sources()) EXPECT_FALSE(std::regex_search(text, read)) << name;
  EXPECT_TRUE(std::regex_search(std::string("setup.parameters.number_or(\"x\", 1)"), read));
}

TEST(ControllerParameters, EachHaveARowInTheDocs) {
  const std::regex declared(
      R"re(setup\s*\.(?:parameter|joint_parameters|list_parameters)\(\s*"(\w+)")re");
  const std::string page = content(TANDEM_SOURCE_DIR "/docs/controllers.md");
  std::set<std::string> names;
  for (const auto& [name, text] : sources()) {
    for (std::sregex_iterator one(text.begin(), text.end(), declared), end; one != end; ++one) {
      names.insert((*one)[1]);
      const std::regex row("\n\\|[^|\n]*`" + (*one)[1].str() + "`[^|\n]*\\|");
      EXPECT_TRUE(std::regex_search(page, row)) << name << ": " << (*one)[1];
    }
  }
  for (const char* one : {"bandwidth_rad_s", "stiffness_Nm_rad", "link_damping_Nms_rad", "from_s"})
    EXPECT_TRUE(names.contains(one)) << one;
}

}  // namespace
}  // namespace tandem
