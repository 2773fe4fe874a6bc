// Whatever bytes stand for a recording and its map: the import is an error with a message, or
// cycles. The input is the map, a zero, and the recording.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <string>

#include "log/import/import_log.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace tandem;
using fuzz::require;

std::string memory_file(const char* name, std::span<const std::uint8_t> bytes) {
  const int descriptor = ::memfd_create(name, 0);
  require(descriptor >= 0);
  require(::write(descriptor, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  return "/proc/self/fd/" + std::to_string(descriptor);
}

void forget(const std::string& path) {
  (void)::close(std::atoi(path.substr(path.rfind('/') + 1).c_str()));
}

const hal::RobotConfig& robot() {
  static const hal::RobotConfig one = [] {
    const std::string file = TANDEM_SOURCE_DIR "/config/double_pendulum/robot.toml";
    std::ifstream in(file);
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    text +=
        "[[sensor]]\nname=\"ft\"\ntype=\"force_torque\"\nbus=\"arm\"\nnode_id=20\n"
        "joint=\"joint2\"\nlink=\"link2\"\n[[sensor]]\nname=\"imu\"\ntype=\"imu\"\n"
        "bus=\"arm\"\nnode_id=21\nlink=\"link1\"\n";
    auto read = hal::parse_robot_config(text, file);
    require(read.has_value());
    return *read;
  }();
  return one;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> all(data, size);
  const auto zero = static_cast<std::size_t>(std::ranges::find(all, 0) - all.begin());
  const std::string map = memory_file("map", all.first(zero));
  const std::string file = memory_file("recording", all.subspan(std::min(zero + 1, size)));
  const auto imported = log::read_recording({{file}, map, ""}, robot());
  if (!imported) {
    require(!imported.error().empty());
    for (const Error& error : imported.error()) require(!error.message.empty());
  } else if (auto sampler = log::Sampler::create(imported->recording, imported->map, robot())) {
    hal::StateImage state(robot().shape());
    hal::CommandImage command(robot().shape());
    const std::uint64_t most = std::min<std::uint64_t>(sampler->cycles(), 1000);
    for (std::uint64_t cycle = 0; cycle < most; ++cycle) {
      if (sampler->fill(cycle, state, command)) require(state.cycle()[0] == cycle);
    }
  }
  forget(map);
  forget(file);
  return 0;
}
