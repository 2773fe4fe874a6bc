// docs/firmware.md's object table against the dictionary of a board.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "rig.hpp"

namespace tandem::firmware::testing {
namespace {

struct Object {
  std::set<std::string> types;
  std::set<char> access;  ///< as the page writes it: w, R, T
};
/// By index.
using Objects = std::map<unsigned, Object>;

std::string type_of(const canopen::ObjectEntry& entry) {
  using enum canopen::DataType;
  switch (entry.type) {
    case kReal32: return "f32";
    case kInteger8:
    case kInteger16:
    case kInteger32: return fmt::format("i{}", 8 * entry.size);
    default: return fmt::format("u{}", 8 * entry.size);
  }
}

std::set<char> access_of(const canopen::ObjectEntry& entry) {
  std::set<char> access;
  if ((entry.access & canopen::kWrite) != 0) access.insert('w');
  if ((entry.access & canopen::kMapRpdo) != 0) access.insert('R');
  if ((entry.access & canopen::kMapTpdo) != 0) access.insert('T');
  return access;
}

/// Those of the first axis, and of the board beside the communication profile's.
Objects objects_of(const canopen::ObjectDictionary& dictionary) {
  Objects objects;
  for (const canopen::ObjectEntry& entry : dictionary.entries()) {
    if (entry.index < 0x2000 || (entry.sub == 0 && dictionary.find(entry.index, 1) != nullptr))
      continue;
    objects[entry.index].types.insert(type_of(entry));
    objects[entry.index].access.merge(access_of(entry));
  }
  return objects;
}

/// What is between the separators, without blanks around it.
std::vector<std::string> split(const std::string& text, char by) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, by);) {
    part.erase(0, part.find_first_not_of(' '));
    part.erase(part.find_last_not_of(' ') + 1);
    parts.push_back(part);
  }
  return parts;
}

/// "6098, 6099:1,2, 609A" or "605A..605E": the indices of a row.
std::vector<unsigned> indices_of(const std::string& cell) {
  static const std::regex index("(\\.\\.)?([0-9A-F]{4})");
  std::vector<unsigned> indices;
  for (std::sregex_iterator at(cell.begin(), cell.end(), index), end; at != end; ++at) {
    const auto number = static_cast<unsigned>(std::stoul((*at)[2], nullptr, 16));
    const unsigned first = (*at)[1].matched ? indices.back() + 1 : number;
    for (unsigned i = first; i <= number; ++i) indices.push_back(i);
  }
  return indices;
}

TEST(ObjectPage, HasWhatTheBoardHas) {
  Rig rig(board_setup());
  const Objects has = objects_of(rig.board.dictionary());
  ASSERT_GT(has.size(), 60U);
  std::ifstream page(TANDEM_SOURCE_DIR "/docs/firmware.md");
  std::set<unsigned> told;
  bool table = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("| index | type |")) table = true;
    if (table && line.empty()) break;
    if (!table || (!line.starts_with("| 2") && !line.starts_with("| 6"))) continue;
    const auto cells = split(line.substr(1), '|');
    ASSERT_GE(cells.size(), 4U) << line;
    const auto types = split(cells[1], ',');
    Object objects;
    for (const unsigned index : indices_of(cells[0])) {
      EXPECT_TRUE(told.insert(index).second) << fmt::format("{:04X} twice: {}", index, line);
      ASSERT_TRUE(has.contains(index)) << fmt::format("no board has {:04X}: {}", index, line);
      objects.types.insert(has.at(index).types.begin(), has.at(index).types.end());
      EXPECT_EQ(has.at(index).access, std::set<char>(cells[2].begin(), cells[2].end()))
          << fmt::format("{:04X}: {}", index, line);
    }
    EXPECT_EQ(objects.types, std::set<std::string>(types.begin(), types.end())) << line;
  }
  for (const auto& [index, object] : has) {
    EXPECT_TRUE(told.contains(index)) << fmt::format("docs/firmware.md lacks {:04X}", index);
  }
}

}  // namespace
}  // namespace tandem::firmware::testing
