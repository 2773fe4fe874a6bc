// The documentation against the sources: every TOML key is documented, every link leads somewhere.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = TANDEM_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The first group of every match.
std::set<std::string> matches(const std::string& text, const char* pattern) {
  const std::regex expression(pattern);
  std::set<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), expression), end; it != end; ++it) {
    found.insert((*it)[1]);
  }
  return found;
}

/// Keys that the readers of robots and experiments ask for, by rows or by hand.
std::set<std::string> keys_read() {
  std::vector<fs::path> files{kRoot / "hal/sim/payload.cpp", kRoot / "hal/sim/scenario.cpp",
                              kRoot / "dds/config.cpp"};
  for (const char* folder : {"hal/config", "runtime"}) {
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) {
      if (entry.path().extension() != ".txt" && entry.is_regular_file()) files.push_back(entry);
    }
  }
  std::set<std::string> keys;
  for (const fs::path& file : files) {
    const std::string source = text_of(file);
    if (source.find("TomlTable") == std::string::npos && source.find("Key<") == std::string::npos)
      continue;
    keys.merge(matches(source,
                       "(?:number|integer|text|choice|boolean|numbers|texts|rows|table|tables)"
                       "(?:_or|_or_empty)?\\(\\s*\"(\\w+)\""));
    keys.merge(matches(source, "(?:key|choice|by_hand)<[^>]*>\\(\"(\\w+)\""));
  }
  EXPECT_GT(keys.size(), 250U) << "is the pattern right?";
  return keys;
}

TEST(Documentation, OfTheConfigurationHasEveryKey) {
  const auto words = matches(text_of(kRoot / "docs/configuration.md"), "(\\w+)");
  for (const std::string& key : keys_read()) {
    EXPECT_TRUE(words.contains(key)) << "docs/configuration.md does not know the key " << key;
  }
}

TEST(Documentation, OfImportsHasEveryKeyOfAMap) {
  const auto words = matches(text_of(kRoot / "docs/import.md"), "(\\w+)");
  const auto keys = matches(text_of(kRoot / "log/import/import_map.cpp"),
                            "\\w\\.(?:number|integer|text|choice|boolean|numbers|texts|table|"
                            "tables)(?:_or|_or_empty)?\\(\"(\\w+)\"");
  EXPECT_GT(keys.size(), 20U);
  for (const std::string& key : keys) {
    EXPECT_TRUE(words.contains(key)) << "docs/import.md does not know the key " << key;
  }
}

TEST(Documentation, OfTheJsonHasEveryKeyThatIsWritten) {
  const std::string page = text_of(kRoot / "docs/json.md");
  for (const char* file :
       {"apps/run/check_command.cpp", "apps/tools/model_command.cpp", "apps/tools/new_command.cpp",
        "apps/tools/log_command.cpp", "apps/tools/log_import.cpp", "apps/tools/log_replay.cpp",
        "apps/tools/log_thresholds.cpp", "apps/tools/eds_command.cpp", "apps/tools/eds_show.cpp",
        "apps/control/controller_control.cpp", "apps/control/joint_control.cpp",
        "apps/control/sensor_control.cpp", "apps/clients/topic_command.cpp",
        "apps/clients/topic_rate.cpp"}) {
    const std::string source = text_of(kRoot / file);
    for (const char* pattern : {"json\\[\"(\\w+)\"\\]", "\\{\"(\\w+)\", [^}\"]"}) {
      for (const std::string& key : matches(source, pattern)) {
        EXPECT_NE(page.find(key), std::string::npos)
            << "docs/json.md lacks " << key << " of " << file;
      }
    }
  }
}

TEST(Documentation, OfTheFaultsNamesTheTestsThatThereAre) {
  const auto named = matches(text_of(kRoot / "docs/faults.md"), "`FaultRow\\.(\\w+)`");
  const auto tests = matches(text_of(kRoot / "tests/runtime/fault_rows_test.cpp") +
                                 text_of(kRoot / "tests/runtime/fault_rows_collision_test.cpp") +
                                 text_of(kRoot / "tests/runtime/fault_rows_coman_test.cpp") +
                                 text_of(kRoot / "tests/runtime/fault_rows_wire_test.cpp"),
                             "TEST(?:_P)?\\(FaultRow, (\\w+)\\)");
  EXPECT_GT(tests.size(), 20U);
  EXPECT_EQ(named, tests);
  EXPECT_EQ(
      matches(text_of(kRoot / "docs/faults.md"), "`LineRow\\.(\\w+)`"),
      matches(text_of(kRoot / "tests/runtime/line_rows_test.cpp"), "TEST_F\\(LineRow, (\\w+)\\)"));
}

/// A page without its listings.
std::string prose_of(const fs::path& page) {
  return std::regex_replace(text_of(page), std::regex("```[^`]*```"), "");
}

/// The names by which a page's headings are linked to.
std::set<std::string> anchors_of(const fs::path& page) {
  std::set<std::string> anchors;
  for (const std::string& heading : matches("\n" + prose_of(page), "\n#+ +([^\n]*)")) {
    std::string anchor;
    for (const char c : std::regex_replace(heading, std::regex("\\]\\([^)]*\\)"), "")) {
      if (c == ' ') anchor += '-';
      if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_')
        anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    anchors.insert(anchor);
  }
  return anchors;
}

/// The folder of the sources' pages, or of an installation's ($TANDEM_PAGES).
fs::path pages_folder() {
  const char* installed = std::getenv("TANDEM_PAGES");
  return installed == nullptr ? kRoot : fs::path(installed);
}

std::vector<fs::path> all_pages(const fs::path& root) {
  std::vector<fs::path> pages;
  for (fs::recursive_directory_iterator entry(root), end; entry != end; ++entry) {
    const std::string name = entry->path().filename().string();
    if (name == "node_modules" || name == "build" || name == "runs" || name.starts_with(".")) {
      entry.disable_recursion_pending();
    } else if (name.ends_with(".md")) {
      pages.push_back(entry->path());
    }
  }
  return pages;
}

TEST(Documentation, LinksLeadSomewhere) {
  int links = 0;
  for (const fs::path& page : all_pages(pages_folder())) {
    for (const std::string& link : matches(prose_of(page), "\\]\\(([^):\\s]+)\\)")) {
      ++links;
      const std::size_t mark = link.find('#');
      const std::string file = link.substr(0, mark);
      const fs::path target = file.empty() ? page : page.parent_path() / file;
      EXPECT_TRUE(fs::exists(target)) << page.string() << " links to " << link;
      if (mark == std::string::npos || target.extension() != ".md") continue;
      EXPECT_TRUE(anchors_of(target).contains(link.substr(mark + 1)))
          << page.string() << " links to " << link;
    }
  }
  EXPECT_GT(links, 200);
}

// What pages ask a reader to look at, to copy or to start, without a link.
TEST(Documentation, LinksToExamplesAndMessagesAreOfFilesThatAreThere) {
  const fs::path root = pages_folder();
  std::set<std::string> named;
  for (const fs::path& page : all_pages(root)) {
    named.merge(matches(text_of(page),
                        "(?:\\$TANDEM/|`)((?:examples|dds/(?:ros2|idl|tandem_msgs))[\\w./-]*)"));
  }
  EXPECT_GT(named.size(), 10U);
  for (const std::string& file : named) EXPECT_TRUE(fs::exists(root / file)) << file;
}

}  // namespace
