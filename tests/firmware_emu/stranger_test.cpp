// The board at a CANopen master that is not ours: npm canopen, in a process of its own.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "canopen/eds.hpp"
#include "rig.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::firmware::testing {
namespace {

#ifdef TANDEM_NODE
constexpr const char* kNode = TANDEM_NODE;
#else
constexpr const char* kNode = nullptr;
#endif

const std::string kFolder = TANDEM_SOURCE_DIR "/tests/firmware_emu";

/// node with a script; its lines are frames for the board, the board's frames lines for it.
class Script {
 public:
  explicit Script(std::vector<std::string> arguments) {
    std::array<int, 2> in{}, out{};
    if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    std::vector<char*> words;
    for (std::string& one : arguments) words.push_back(one.data());
    words.push_back(nullptr);
    ::posix_spawn(&pid_, words[0], &actions, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(in[0]);
    ::close(out[1]);
    to_ = ::fdopen(in[1], "w");
    from_ = ::fdopen(out[0], "r");
  }
  ~Script() {
    std::fclose(to_);
    std::fclose(from_);
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
  }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;

  /// The next line; empty at its end.
  std::string line() {
    std::array<char, 65536> text;
    if (std::fgets(text.data(), text.size(), from_) == nullptr) return {};
    return text.data();
  }
  void tell(const canopen::Frame& frame) {
    std::fprintf(to_, "%x ", static_cast<unsigned>(frame.id));
    for (const std::uint8_t byte : frame.payload()) std::fprintf(to_, "%02x", byte);
    std::fputc('\n', to_);
    std::fflush(to_);
  }

 private:
  pid_t pid_ = -1;
  std::FILE* to_ = nullptr;
  std::FILE* from_ = nullptr;
};

/// Carries frames between script and board until the script says what it found.
nlohmann::json carry(Script& script, Rig& rig) {
  std::size_t told = rig.seen.size();
  for (std::string line = script.line(); !line.empty(); line = script.line()) {
    if (line.starts_with('=')) return nlohmann::json::parse(line.substr(1));
    std::istringstream words(line);
    std::string data;
    unsigned id = 0;
    words >> std::hex >> id >> data;
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i + 1 < data.size(); i += 2) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoi(data.substr(i, 2), nullptr, 16)));
    }
    rig.send(id, bytes);
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
  Script script({kNode, kFolder + "/read_board.mjs", sheet, "5"});
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
