// 05: listens to a robot's joint states over DDS, as any ROS 2 node could.
//   build/release/bin/tandem run config/double_pendulum/hold.toml --dds --realtime
//   build/release/bin/example_05_subscribe 10 [DOMAIN]
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "dds/endpoint.hpp"

/// The whole text as a number; anything else ends the program.
static unsigned number_from(std::string_view text) {
  unsigned number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && end == text.data() + text.size()) return number;
  std::fprintf(stderr, "'%s' is no number: give how many samples, and a domain\n", text.data());
  std::exit(2);
}

int main(int argc, char** argv) {
  using namespace tandem::dds;
  if (argc < 2) return 2;
  int left = static_cast<int>(number_from(argv[1]));
  Config config;  // on this machine alone; Config::interfaces has others
  if (argc > 2) config.domain = number_from(argv[2]);
  const auto domain = Domain::open(config);
  if (!domain) return std::puts(domain.error().to_string().c_str()), 1;
  const auto node = Participant::open(*domain, "listener");
  if (!node) return std::puts(node.error().to_string().c_str()), 1;
  auto reader = Reader<sensor_msgs::JointState>::create(**node, "rt/joint_states", Qos{});
  if (!reader) return std::puts(reader.error().to_string().c_str()), 1;

  while (left > 0) {
    reader->take([&](const sensor_msgs::JointState& sample, const auto&) {
      std::printf("%d.%09u", sample.header.stamp.sec, sample.header.stamp.nanosec);
      for (unsigned i = 0; i < sample.name._length; ++i) {
        std::printf("  %s %.4f rad", sample.name._buffer[i], sample.position._buffer[i]);
      }
      std::printf("\n");
      --left;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return 0;
}
