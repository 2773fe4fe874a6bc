// One joint on another maker's drive that loses its commands.
#pragma once

#include "tests/ethercat_can/sheet_rig.hpp"

namespace tandem::hal::can::test {

/// One that hears nothing more while its joint is asked to go elsewhere.
struct DeafRig : SheetRig {
  explicit DeafRig(Change change = nullptr, const Sheet& sheet = servo())
      : SheetRig(sheet, change) {}
  void go_deaf(double to_rad) {
    ASSERT_TRUE(bring_up());
    steps(5);
    drive.deaf = true;
    command.position_rad()[0] = to_rad;
  }
  /// Cycles until the joint is in fault, at most `most`.
  int until_fault(int most = 2000) {
    int taken = 0;
    while (taken < most && state.fault()[0] == 0) {
      step();
      ++taken;
    }
    return taken;
  }
  [[nodiscard]] std::string told() const { return master->status_text(); }
};

}  // namespace tandem::hal::can::test
