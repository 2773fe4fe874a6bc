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

/// The key of a line of a table.
std::string key_of(const std::string& line) { return line.substr(3, line.find("` |") - 3); }

/// Whether a key has no row: ordinary code reads it, and its line of the page is by hand.
bool is_by_hand(const std::string& key) {
  static const std::string kKeys =
      "|lock.JOINT|position = { kp, ki, kd, output_limit }|velocity = { … }|torque = { … }|"
      "current = { … }|boards|sensors|bus|node_id|joints|boot_time_s|name` or `names|homing|brake|"
      "sites|axis|length_m|[[contact.foot]]|";
  return kKeys.find("|" + key + "|") != std::string::npos;
}

void add_robot(KeyPage& page) {
  using namespace hal::keys;
  page.add("robot.toml", kRoot);
  page.add("[model]", kModel);
  page.add("[model.link.NAME]", kLink);
  page.add("[[site]]", kSite);
  page.add("[actuator.NAME]", kActuator);
  page.add("[gains.NAME]", kGains);
  page.add("[[bus]]", kBus);
  page.add("[[board]]", kBoard);
  page.add("[[joint]]", kJoint);
  page.add("[[joint]]", kDrive);
  page.add("[[joint]]", kBrake, "brake.");
  page.add("[[joint]]", kStopOptions, "stop_options.");
  page.add("homing", kHoming);
  page.add("[[passive]]", kPassive);
  page.add("[[loop]]", kLoop);
  page.add("[[sensor]]", kSensor);
  page.add("[contact]", kContact);
  page.add("[safety]", kSafety);
}

KeyPage every_key() {
  KeyPage page;
  add_robot(page);
  runtime::describe_experiment(page);
  runtime::describe_estimation(page);
  dds::describe_keys(page);
  return page;
}

/// The page's lines with the rows in the place of those that are there: in the first table after
/// the line that begins with the title. Those by hand stay after the line that they are after.
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
    std::vector<std::string> rows = table.rows;
    std::string before;
    for (auto line = at; line != end; before = key_of(*line++)) {
      const bool row = std::ranges::find(table.rows, key_of(*line), key_of) != table.rows.end();
      if (row || !is_by_hand(key_of(*line))) continue;
      const auto place = std::ranges::find(rows, before, key_of);
      rows.insert(place == rows.end() ? rows.begin() : place + 1, *line);
    }
    at = out.erase(at, end);
    out.insert(at, rows.begin(), rows.end());
  }
  return out;
}

TEST(Documentation, OfTheConfigurationIsWhatTheRowsSay) {
  const std::string file = std::string(TANDEM_SOURCE_DIR) + "/docs/configuration.md";
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const KeyPage keys = every_key();
  EXPECT_GE(keys.tables.size(), 30U);
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
