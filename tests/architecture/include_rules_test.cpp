// The include rules of the folders: the tables of docs/architecture.md are what is tested. A folder
// may include those that are named in its row, and nothing else of ours.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// A room, and what it may include besides itself: a room, or one header of a room.
using Rules = std::map<std::string, std::vector<std::string>>;

/// The first and the third cell of each row of docs/architecture.md that is about a folder.
const Rules& rules() {
  static const Rules table = [] {
    const std::regex row(R"(^\| `([a-z_/-]+)/` \|[^|]*\| ([^|]*) \|$)");
    const std::regex name(R"([a-z_][a-z_/.-]*)");
    Rules read;
    std::ifstream page(fs::path(TANDEM_SOURCE_DIR) / "docs/architecture.md");
    for (std::string line; std::getline(page, line);) {
      std::smatch cell;
      if (!std::regex_match(line, cell, row)) continue;
      const std::string allowed = cell[2];
      read.try_emplace(cell[1], std::sregex_token_iterator(allowed.begin(), allowed.end(), name),
                       std::sregex_token_iterator());
    }
    return read;
  }();
  return table;
}

/// The innermost room that holds `path` (relative to the root); empty when none does.
std::string room_of(const std::string& path) {
  std::string best;
  for (const auto& [room, allowed] : rules()) {
    if (path.starts_with(room + "/") && room.size() > best.size()) best = room;
  }
  return best;
}

bool may_include(const std::string& room, const std::string& included) {
  const std::string target = room_of(included);
  if (target.empty()) return true;  // a system or library header in quotes
  if (target == room) return true;
  const std::vector<std::string>& allowed = rules().at(room);
  return std::ranges::find(allowed, target) != allowed.end() ||
         std::ranges::find(allowed, included) != allowed.end();
}

struct Include {
  std::string file;  ///< relative to the root
  int line;
  std::string included;
};

/// Every quoted include of a room's own files.
std::vector<Include> includes_of(const std::string& room) {
  static const std::regex pattern(R"re(^\s*#\s*include\s+"([^"]+)")re");
  const fs::path root = TANDEM_SOURCE_DIR;
  std::vector<Include> found;
  for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
    const std::string kind = entry.path().extension().string();
    const std::string file = fs::relative(entry.path(), root).generic_string();
    if (kind != ".hpp" && kind != ".cpp" && kind != ".h") continue;
    if (room_of(file) != room) continue;
    std::ifstream in(entry.path());
    std::string text;
    for (int line = 1; std::getline(in, text); ++line) {
      std::smatch match;
      if (std::regex_search(text, match, pattern)) found.push_back({file, line, match[1]});
    }
  }
  return found;
}

TEST(Architecture, RoomsIncludeOnlyWhatTheirRowAllows) {
  int checked = 0;
  for (const auto& [room, allowed] : rules()) {
    for (const auto& [file, line, included] : includes_of(room)) {
      ++checked;
      EXPECT_TRUE(may_include(room, included)) << file << ":" << line << " includes \"" << included
                                               << "\", which " << room << "/ may not use";
    }
  }
  EXPECT_GT(rules().size(), 30U) << "the page's tables are not read";
  EXPECT_GT(checked, 20) << "no includes were found: is the source folder right?";
}

TEST(Architecture, NoArrowRunsBackUp) {
  Rules above = rules();  // those that are not below all others of what is left
  for (std::size_t before = 0; before != above.size();) {
    before = above.size();
    std::erase_if(above, [&above](const auto& row) {
      return std::ranges::none_of(
          row.second, [&](const std::string& used) { return above.contains(room_of(used + "/")); });
    });
  }
  for (const auto& [room, allowed] : above)
    ADD_FAILURE() << room << "/ may include what includes it";
}

TEST(Architecture, TheRobotsProgramReachesNoOfflineRoom) {
  std::set<std::string> reached;
  std::vector<std::string> next{"apps"};
  while (!next.empty()) {
    const std::string room = room_of(next.back() + "/");
    next.pop_back();
    if (!reached.insert(room).second || room.empty()) continue;
    next.insert(next.end(), rules().at(room).begin(), rules().at(room).end());
  }
  EXPECT_TRUE(reached.contains("apps/run"));
  for (const char* room : {"identification", "scaffold", "report", "log/import", "apps/tools",
                           "apps/machine", "apps/bench", "apps/offline"}) {
    EXPECT_TRUE(rules().contains(room)) << room;
    EXPECT_FALSE(reached.contains(room)) << "`tandem` may include " << room << "/";
  }
}

TEST(Architecture, IncludesAreWrittenFromTheRoot) {
  for (const auto& [room, allowed] : rules()) {
    for (const auto& [file, line, included] : includes_of(room)) {
      EXPECT_NE(included.find('/'), std::string::npos)
          << file << ":" << line << " includes \"" << included
          << "\": write its path from the repository's root";
    }
  }
}

bool begins_with_a_comment(const fs::path& file) {
  std::ifstream in(file);
  std::string line;
  return std::getline(in, line) && line.starts_with("// ");
}

TEST(Architecture, EverySourceOrItsHeaderBeginsWithItsPurpose) {
  const fs::path root = TANDEM_SOURCE_DIR;
  int checked = 0;
  for (const char* folder : {"apps", "base", "bench", "canopen", "controllers", "dds", "ethercat",
                             "examples", "firmware_emu", "hal", "log", "model", "python", "report",
                             "rt", "runtime", "scaffold", "studio"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const fs::path& file = entry.path();
      if (file.extension() != ".hpp" && file.extension() != ".cpp") continue;
      const fs::path header = fs::path(file).replace_extension(".hpp");
      EXPECT_TRUE(begins_with_a_comment(file) ||
                  (file.extension() == ".cpp" && begins_with_a_comment(header)))
          << fs::relative(file, root).generic_string() << " does not say what it is for";
      ++checked;
    }
  }
  EXPECT_GT(checked, 300);
}

// base/open_file.hpp and base/trusted_code.hpp open files once, and judge what they have opened.
TEST(Architecture, FilesAreOpenedByBaseAlone) {
  const std::set<std::string> kernels_own{
      // which no user names
      "apps/bench/engine_page.cpp", "apps/clients/control_search.cpp", "apps/machine/machine.cpp",
      "apps/offline/main.cpp"};
  // A search for the plain text first: the pattern takes a hundred times as long, on every line.
  const std::vector<std::string> texts{"fstream", "fopen(", "truncate(", "resize_file(", "dlopen("};
  const std::regex opens(R"(\bi?o?fstream\b|\bfopen\(|\btruncate\(|\bresize_file\(|\bdlopen\()");
  const auto opens_a_file = [&](const std::string& code) {
    return std::ranges::any_of(texts, [&](const auto& text) { return code.contains(text); }) &&
           std::regex_search(code, opens);
  };
  const fs::path root = TANDEM_SOURCE_DIR;
  std::set<std::string> found;
  for (const auto& [room, allowed] : rules()) {
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      const std::string file = fs::relative(entry.path(), root).generic_string();
      if (room == "base" || (!file.ends_with(".cpp") && !file.ends_with(".hpp"))) continue;
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        const std::string code = line.substr(0, line.find("//"));
        if (!code.starts_with("#include") && opens_a_file(code)) found.insert(file);
      }
    }
  }
  EXPECT_EQ(found, kernels_own);
}

TEST(Architecture, RuleRefusesARoomAboveAndAcceptsOneBelow) {
  EXPECT_TRUE(may_include("hal/sim", "firmware_emu/board.hpp"));
  EXPECT_TRUE(may_include("controllers", "model/kernels.h"));
  EXPECT_FALSE(may_include("controllers", "model/tree.hpp"));
  EXPECT_FALSE(may_include("hal", "hal/sim/plant.hpp"));
  EXPECT_FALSE(may_include("hal", "hal/config/robot_config.hpp"));
  EXPECT_FALSE(may_include("controllers", "hal/config/robot_config.hpp"));
  EXPECT_FALSE(may_include("base", "rt/loop.hpp"));
  EXPECT_TRUE(may_include("apps/offline", "apps/tools/commands.hpp"));
  EXPECT_FALSE(may_include("apps/run", "apps/tools/commands.hpp"));
  EXPECT_FALSE(may_include("apps/control", "apps/clients/control_client.hpp"));
  EXPECT_FALSE(may_include("apps/text", "apps/main.hpp"));
}

}  // namespace
