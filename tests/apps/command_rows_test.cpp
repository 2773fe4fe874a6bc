// The rows of the commands, and what docs/json.md says of them.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <set>
#include <string>

#include "apps/control/command_rows.hpp"

namespace tandem::apps {
namespace {

TEST(CommandRows, HaveNamesAndKeysThatAreUnlikeEachOther) {
  std::set<std::string> names;
  for (const CommandRow& row : command_rows()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_FALSE(row.doc.empty()) << row.name;
    std::set<std::string> keys, flags;
    for (const ControlKey& key : row.keys) {
      EXPECT_TRUE(keys.insert(key.name).second) << row.name << " " << key.name;
      EXPECT_TRUE(key.line.empty() || flags.insert(key.line).second) << row.name << " " << key.line;
      EXPECT_TRUE(key.sent || !key.line.empty()) << "nobody can give " << key.name;
      EXPECT_FALSE(key.doc.empty()) << row.name << " " << key.name;
    }
  }
}

/// `joint halt` had spoken of "joint.move", which nobody can type.
TEST(CommandRows, SpeakOfCommandsAsTheyAreTyped) {
  for (const CommandRow& row : command_rows()) {
    for (const CommandRow& other : command_rows()) {
      if (!other.name.contains('.')) continue;  // a word of English
      EXPECT_EQ(row.doc.find(other.name + " "), std::string::npos) << row.name << ": " << row.doc;
    }
  }
}

/// Words in backticks of the cells that show requests, in the section of what a process is asked.
std::set<std::string> documented() {
  std::ifstream file(TANDEM_SOURCE_DIR "/docs/json.md");
  const std::regex word("`([a-z][A-Za-z0-9_.-]*)`");
  std::set<std::string> words;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("## ")) inside = line.starts_with("## A running process");
    if (!inside || !line.starts_with("| `")) continue;
    const bool keys_apart = line.starts_with("| `inject`");
    std::size_t end = line.find(" | ");
    if (keys_apart) end = line.find(" | ", end + 3);
    const std::string cell = line.substr(0, end);
    for (std::sregex_iterator found(cell.begin(), cell.end(), word), last; found != last; ++found) {
      words.insert((*found)[1]);
    }
  }
  return words;
}

TEST(CommandRows, AreThoseOfTheDocumentation) {
  const std::set<std::string> page = documented();
  ASSERT_GT(page.size(), 40U);
  std::set<std::string> commands;
  for (const CommandRow& row : command_rows()) {
    if (!row.more.asks.empty()) continue;
    commands.insert(row.name);
    EXPECT_TRUE(page.contains(row.name)) << "docs/json.md lacks the command " << row.name;
    for (const ControlKey& key : row.keys) {
      if (!key.sent) continue;
      EXPECT_TRUE(page.contains(key.name))
          << "docs/json.md lacks " << key.name << " of " << row.name;
      for (const std::string& choice : key.choices) {
        EXPECT_TRUE(page.contains(choice))
            << "docs/json.md lacks '" << choice << "' of " << row.name;
      }
    }
  }
  for (const std::string& word : page) {
    if (word.find('.') == std::string::npos) continue;
    EXPECT_TRUE(commands.contains(word)) << "docs/json.md has " << word << ", which nobody answers";
  }
}

}  // namespace
}  // namespace tandem::apps
