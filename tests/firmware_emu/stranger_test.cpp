// The board at a CANopen master that is not ours: npm canopen, in a process of its own.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "canopen/eds.hpp"
#include "rig.hpp"
#include "tests/support/node.hpp"
#include "tests/support/scratch_folder.hpp"
#include "tests/support/script.hpp"

namespace tandem::firmware::testing {
namespace {

using tandem::test::kNode;

const std::string kFolder = TANDEM_SOURCE_DIR "/tests/firmware_emu";

/// Carries frames between script and board until the script says what it found.
nlohmann::json carry(test::Script& script, Rig& rig) {
  std::size_t told = rig.seen.size();
  for (std::string line = script.line(); !line.empty(); line = script.line()) {
    if (line.starts_with('=')) return nlohmann::json::parse(line.substr(1));
    const canopen::Frame frame = test::frame_of(line);
    rig.send(frame.id, {frame.payload().begin(), frame.payload().end()});
    rig.step();
    for (; told < rig.seen.size(); ++told) script.tell(rig.seen[told]);
  }
  return {};
}

TEST(Stranger, ReadsTheBoardByItsSheetAndExchangesAPdo) {
  if (kNode == nullptr) GTEST_SKIP() << "node is not installed";
  if (!std::filesystem::exists(kFolder + "/node_modules/canopen")) {
    GTEST_SKIP() << "canopen is not installed (run `npm ci` in tests/firmware_emu)";
  }
  BoardSetup setup = board_setup();
  setup.name = "left leg of the robot";
  Rig rig(setup);
  rig.joints[0].q = rig.joints[0].th = 0.5;
  const test::ScratchFolder folder;
  const std::string sheet = folder / "board.eds";
  canopen::EdsDevice device;
  device.file_name = "board.eds";
  std::ofstream(sheet) << canopen::make_eds(rig.board.dictionary(), device, {});
  rig.step();
  rig.seen.clear();
  test::Script script({kNode, kFolder + "/read_board.mjs", sheet, "5"});
  const nlohmann::json found = carry(script, rig);
  ASSERT_TRUE(found.is_object()) << "it has failed: see above";
  EXPECT_EQ(found["name"], "left leg of the robot") << "segmented";
  nlohmann::json wrong = nlohmann::json::array();
  for (int i = 1; i <= 8; ++i) {
    wrong.push_back("1003:" + std::to_string(i) + ": abort 8000024");  // no error yet
  }
  EXPECT_EQ(found["wrong"], wrong);
  EXPECT_EQ(found["read"], rig.board.dictionary().entries().size() - wrong.size());
  const std::vector<std::uint32_t> codes{0x06020000,   // no object
                                         0x06090011,   // no sub-index
                                         0x08000024,   // an empty history
                                         0x06010002,   // read only
                                         0x06070012,   // four bytes for two
                                         0x06070013,   // two for four
                                         0x06090030,   // a PDO with NMT's identifier
                                         0x06090031,   // beyond its range
                                         0x06040041};  // a demand into a TPDO
  EXPECT_EQ(found["refused"], nlohmann::json(codes));
  EXPECT_EQ(found["heartbeat"], 5);
  EXPECT_EQ(found["limit"], 123456);
  EXPECT_EQ(found["statusword"], 0x0250);
  EXPECT_EQ(found["position"], 41722);
  EXPECT_EQ(found["states"], nlohmann::json({0x7F, 0x05}));
  EXPECT_EQ(found["emergencies"], nlohmann::json::array());
}

}  // namespace
}  // namespace tandem::firmware::testing
