// docs/configuration.md against the rows of keys: TANDEM_WRITE_PAGE=1 writes what they say into it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

#include "dds/config.hpp"
#include "hal/config/robot_config_read.hpp"
#include "runtime/estimation_options.hpp"
#include "runtime/experiment_tables.hpp"

namespace tandem {
namespace {

KeyPage every_key() {
  KeyPage page;
  hal::describe_drives(page);
  runtime::describe_experiment(page);
  runtime::describe_estimation(page);
  dds::describe_keys(page);
  return page;
}

/// The page's lines with the tables that the rows know in the place of those that are there: the
/// first after the line that begins with the title.
std::vector<std::string> written(const std::vector<std::string>& lines, const KeyPage& keys) {
  std::vector<std::string> out = lines;
  for (const KeyPage::Table& table : keys.tables) {
    auto at = std::ranges::find_if(out, [&](const std::string& line) {
      const std::size_t mark = line.find_first_not_of("# ");
      return mark != std::string::npos && line.substr(mark).starts_with(table.title) &&
             (line.front() == '#' || line.front() == '`');
    });
    at = std::find_if(at, out.end(), [](const auto& line) { return line.starts_with("|---"); });
    if (at == out.end()) {
      ADD_FAILURE() << "docs/configuration.md has no table " << table.title;
      continue;
    }
    const auto end = std::find_if(++at, out.end(), [](const auto& line) { return line.empty(); });
    at = out.erase(at, end);
    out.insert(at, table.rows.begin(), table.rows.end());
  }
  return out;
}

TEST(Documentation, OfTheConfigurationIsWhatTheRowsSay) {
  const std::string file = std::string(TANDEM_SOURCE_DIR) + "/docs/configuration.md";
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const KeyPage keys = every_key();
  EXPECT_GE(keys.tables.size(), 15U);
  const std::vector<std::string> right = written(lines, keys);
  if (std::getenv("TANDEM_WRITE_PAGE") != nullptr) {
    std::ofstream out(file);
    for (const std::string& line : right) out << line << "\n";
    return;
  }
  const auto [is, should] = std::ranges::mismatch(lines, right);
  EXPECT_EQ(lines, right) << "the first line that differs: "
                          << (should == right.end() ? "(none)" : *should)
                          << "\nTANDEM_WRITE_PAGE=1 with this test writes the page";
}

TEST(Documentation, EveryRowIsAKeyOfItsTableOnce) {
  for (const KeyPage::Table& table : every_key().tables) {
    std::set<std::string> rows;
    for (const std::string& row : table.rows) {
      EXPECT_TRUE(rows.insert(row.substr(0, row.find(" | "))).second) << table.title << row;
      EXPECT_FALSE(row.ends_with("|  |")) << table.title << " has no words of " << row;
    }
  }
}

}  // namespace
}  // namespace tandem
