// The peer of tests/dds/fastdds_peer, in this test program's domain.
// Layer: tests.  Thread: main.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/dds/peer_process.hpp"
#include "tests/support/dds_domain.hpp"

namespace tandem::dds::test {

constexpr const char* kFastDdsPeer = TANDEM_BINARY_DIR "/bin/fastdds_peer";
/// It is built where Fast DDS and its generator are installed.
inline bool have_fastdds() { return std::filesystem::exists(kFastDdsPeer); }
constexpr const char* kNoFastDds =
    "Fast DDS is not installed (libfastrtps-dev, libfastcdr-dev, fastddsgen)";

class FastDdsPeer : public PeerProcess {
 public:
  /// @param parts  "hear", "reliable", "std_msgs/msg/String", "rt/chatter", …
  explicit FastDdsPeer(const std::vector<std::string>& parts) : PeerProcess(command(parts)) {}

 private:
  static std::vector<std::string> command(const std::vector<std::string>& parts) {
    ::setenv("FASTRTPS_DEFAULT_PROFILES_FILE",
             TANDEM_SOURCE_DIR "/examples/ros2/fastdds_loopback.xml", 1);
    std::vector<std::string> all{kFastDdsPeer, std::to_string(own_domain())};
    all.insert(all.end(), parts.begin(), parts.end());
    return all;
  }
};

}  // namespace tandem::dds::test
