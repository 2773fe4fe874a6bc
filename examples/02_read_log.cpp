// 02: reads a run's log and prints how well each joint followed its reference.
//   build/release/bin/example_02_read_log runs/…/log.mcap
#include <cmath>
#include <cstdio>

#include "log/log_file.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto log = tandem::log::LogFile::open(argv[1]);
  if (!log) {
    std::puts(log.error().to_string().c_str());
    return 2;
  }
  std::printf("%s, %llu messages\n", log->info().robot.c_str(),
              static_cast<unsigned long long>(log->messages()));
  for (std::size_t j = 0; j < log->info().joints.size(); ++j) {
    const auto state = log->read("/tandem/state", {{"position_rad", j}, {"drive_state", j}});
    const auto command = log->read("/tandem/command", {{"position_rad", j}});
    if (!state || !command) return 1;
    // A command is answered in the next cycle's state, when the drive is in operation.
    const std::size_t cycles = std::min(state->time_s.size(), command->time_s.size());
    double most = 0.0;
    for (std::size_t k = 0; k + 1 < cycles; ++k) {
      if (state->columns[1][k + 1] != 5.0) continue;  // hal::DriveState::kOperationEnabled
      most = std::max(most, std::abs(command->columns[0][k] - state->columns[0][k + 1]));
    }
    std::printf("%-24s at most %.4f rad off\n", log->info().joints[j].c_str(), most);
  }
  return 0;
}
