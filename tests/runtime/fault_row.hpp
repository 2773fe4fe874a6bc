// A row of docs/faults.md, the robots that its test runs on, and what the rows have in common.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/runtime/fault_robot.hpp"
#include "tests/sim/swing_robot.hpp"
#include "tests/support/test_robot.hpp"

namespace tandem::runtime::test {

using canopen::DriveMotion;
using hal::FaultKind;
using sim::ScenarioFault;

/// The page's line of the running test, cell by cell: fault | detected by | reaction | detected |
/// safe | test.
inline std::vector<std::string> row_of_this_test() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  const std::string test = info->name();
  const bool on_line = std::string(info->test_suite_name()) == "LineRow";
  const std::string name =
      std::string(on_line ? "`LineRow." : "`FaultRow.") + test.substr(0, test.find('/')) + "`";
  std::ifstream page(std::filesystem::path(TANDEM_SOURCE_DIR) / "docs/faults.md");
  for (std::string line; std::getline(page, line);) {
    if (line.find(name) == std::string::npos) continue;
    std::vector<std::string> cells;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, '|');) cells.push_back(cell);
    return cells;
  }
  ADD_FAILURE() << "docs/faults.md has no row with the test " << name;
  return {};
}

/// Object 2036, 1 s, and a cycle for the master's reaction.
inline constexpr int kLongestStop = 1002;

inline int number_in(const std::string& cell) {
  const std::size_t digit = cell.find_first_of("0123456789");
  return digit == std::string::npos ? -1 : std::stoi(cell.substr(digit));
}

/// "12": exactly; "≤ 150": as the phase of a heartbeat (50 cycles) wants it; "27 (COMAN 134)": the
/// second where the test runs on COMAN.
inline void expect_cycles(int measured, const std::string& cell, const char* what) {
  const std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
  const std::size_t own = test.ends_with("/coman") ? cell.find("COMAN") : std::string::npos;
  const int declared = number_in(cell.substr(own == std::string::npos ? 0 : own));
  if (cell.find("≤") == std::string::npos) {
    EXPECT_EQ(measured, declared) << what;
    return;
  }
  EXPECT_LE(measured, declared) << what;
  EXPECT_GT(measured, declared - 50) << what;
}

/// The outcome is the one that the page declares.
inline void expect_row(const Outcome& outcome) {
  const std::vector<std::string> row = row_of_this_test();
  ASSERT_EQ(row.size(), 7U);
  expect_cycles(outcome.noticed, row[4], "noticed after so many cycles");
  expect_cycles(outcome.safe, row[5], "safe after so many cycles");
  if (outcome.safe < 0) return;
  EXPECT_GE(outcome.open, outcome.safe) << "every bridge opens in the end";
  EXPECT_LE(outcome.open, outcome.safe + kLongestStop);
}

/// A row on each of two robots. UR5e: six stiff joints on three boards, one bus. COMAN on its
/// hoist: 29 joints, most with springs, on 16 boards and five buses. Joint 0, on board 0, moves.
class FaultRow : public testing::TestWithParam<const char*> {};

/// A robot of config/ that outlives the rig that is made of it.
struct LoadedRobot {
  explicit LoadedRobot(const std::string& name) : loaded(tandem::test::load_test_robot(name)) {}
  tandem::test::TestRobot loaded;
};
struct RowRig : private LoadedRobot, FaultRig {
  explicit RowRig(const std::string& name, std::vector<ScenarioFault> scenario = {},
                  hal::StopCategory on_fault = hal::StopCategory::kCategory1)
      : LoadedRobot(name),
        FaultRig(with(loaded.robot, on_fault), loaded.kernels.get(),
                 name == "coman" ? "stand" : "ready", std::move(scenario), kHanging_ns) {}
  static constexpr std::int64_t kHanging_ns = 1'000'000'000'000;
  static hal::RobotConfig with(hal::RobotConfig config, hal::StopCategory on_fault) {
    for (hal::JointConfig& joint : config.joints) joint.on_fault = on_fault;
    return config;
  }
};

inline ScenarioFault of(FaultKind kind) {
  ScenarioFault fault;
  fault.kind = kind;
  const bool joint = kind >= FaultKind::kEncoderFreeze && kind <= FaultKind::kSpringBreak;
  const bool board = kind >= FaultKind::kBoardKill && kind <= FaultKind::kSupplySag;
  if (joint) fault.joint = 0;
  if (board) fault.board = 0;
  if (kind == FaultKind::kBusDown || sim::is_frame_fault(kind)) fault.bus = 0;
  return fault;
}

/// `count` frames of one identifier are lost; 0: all from now on.
inline ScenarioFault lose(std::uint32_t cob_id, std::uint32_t count) {
  ScenarioFault fault = of(FaultKind::kFrameDrop);
  fault.cob_id = cob_id;
  fault.cob_mask = 0x7FF;
  fault.count = count;
  return fault;
}

inline constexpr std::uint32_t kFeedbackOfBoard0 = 0x181, kCommandOfBoard0 = 0x201;
inline constexpr std::uint32_t kSync = 0x080, kHeartbeat = 0x700;

/// The joints of the other boards stop by the declared category, and all of it stays latched with
/// cause and time.
inline void expect_stopped(FaultRig& rig, const std::string& cause) {
  for (std::size_t b = 1; b < rig.robot.boards.size(); ++b) {
    for (std::size_t a = 0; a < rig.board(b).axes(); ++a) {
      EXPECT_EQ(rig.axis(b, a).machine().motion(), DriveMotion::kNone) << b << "." << a;
      EXPECT_EQ(rig.axis(b, a).objects().error_code, 0) << "it stopped in order";
    }
  }
  EXPECT_EQ(rig.backend->phase(), hal::Phase::kFault) << "latched";
  EXPECT_NE(rig.causes().find(cause), std::string::npos) << rig.causes();
  EXPECT_NE(rig.backend->status_text().find(" s"), std::string::npos) << "with its time";
}

/// The newest injected fault has struck so many frames: without it the row would say nothing.
inline void expect_struck(const FaultRig& rig, std::uint32_t frames) {
  ASSERT_FALSE(rig.backend->emulated->faults().empty());
  EXPECT_EQ(rig.backend->emulated->faults().back().struck, frames);
}

inline void expect_running(FaultRig& rig) {
  EXPECT_FALSE(rig.noticed()) << rig.causes();
  EXPECT_EQ(rig.cycle->phase(), RunPhase::kRunning);
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
    EXPECT_EQ(rig.axis(b).machine().motion(), DriveMotion::kFollow);
  }
}

inline bool is_on_bus0(const FaultRig& rig, const std::string& board) {
  const auto found = std::ranges::find(rig.robot.boards, board, &hal::BoardConfig::name);
  return found != rig.robot.boards.end() && found->bus == rig.robot.buses[0].name;
}

/// Each board of bus 0 stopped by itself, for this reason.
inline void expect_error_on_bus0(const FaultRig& rig, std::uint16_t error_code) {
  for (std::size_t b = 0; b < rig.robot.boards.size(); ++b) {
    const std::string& name = rig.robot.boards[b].name;
    if (!is_on_bus0(rig, name)) continue;
    EXPECT_EQ(rig.axis(b).objects().error_code, error_code) << name;
  }
}

/// The samples of every joint on bus 0 have this age.
inline void expect_age_on_bus0(const FaultRig& rig, std::uint32_t age_cycles) {
  for (std::size_t j = 0; j < rig.robot.joints.size(); ++j) {
    const hal::JointConfig& joint = rig.robot.joints[j];
    if (!is_on_bus0(rig, joint.board)) continue;
    EXPECT_EQ(rig.cycle->state().age_cycles()[j], age_cycles) << joint.name;
  }
}

}  // namespace tandem::runtime::test
