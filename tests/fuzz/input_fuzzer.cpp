// Whatever stands for the samples of a controller's input: rows of a timeline, a file of them,
// samples of a peer. An error with words, or samples within the input's bounds, each in a cycle
// after the one before; and the loop takes no other number.
//
// The input: a byte for the input's kind and what follows (Kind), then a CSV file; or TOML of
// [controller.inputs]; or numbers of samples, eight bytes each.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/toml_reader.hpp"
#include "hal/config/capabilities.hpp"
#include "runtime/input_port.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/hal/fake_backend.hpp"

namespace {

using namespace tandem;
using fuzz::require;
using namespace tandem::runtime;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr std::uint64_t kCycles = 64;

const hal::Robot& robot() {
  static const hal::Robot kRobot = hal::robot_of(hal::test::fake_robot());
  return kRobot;
}

/// One of each kind, with bounds of its own.
InputBlock block_of(unsigned kind) {
  InputOptions options{.doc = "fuzz", .timeout_s = 0.005, .most_points = 3};
  options.after = static_cast<AfterTimeout>(kind / 6 % 3);
  switch (static_cast<InputKind>(kind % 6)) {
    case InputKind::kTwist:
    case InputKind::kWrench: options.max = {1.0}; break;
    case InputKind::kPose: break;
    case InputKind::kNumbers: options.names = {"a", "b"}, options.max = {1.0, 2.0}; break;
    case InputKind::kButtons: options.names = {"go", "stop"}; break;
    case InputKind::kTrajectory: options.names = {"elbow", "wrist"}; break;
  }
  return {"in", static_cast<InputKind>(kind % 6), std::move(options)};
}

/// A file with this text; the last one is gone.
const std::string& file_with(std::string_view text) {
  static struct File {
    File() { number = ::mkstemps(path.data(), 4); }
    ~File() { ::unlink(path.c_str()); }
    std::string path = std::filesystem::temp_directory_path() / "tandem_fuzz_XXXXXX.csv";
    int number = -1;
  } file;
  require(file.number >= 0 && ::ftruncate(file.number, 0) == 0);
  require(::pwrite(file.number, text.data(), text.size(), 0) == static_cast<ssize_t>(text.size()));
  return file.path;
}

/// What reaches the controller is what the input may hold.
void run(InputPort& port) {
  const auto may_hold = [&] {
    require(port.check(port.look().value).has_value());
    require(std::ranges::all_of(port.look().value, [](double one) { return std::isfinite(one); }));
  };
  const std::uint64_t begun = 7;
  const auto time = [](std::uint64_t cycle) {
    return hal::CycleTime{.cycle = cycle,
                          .time_ns = static_cast<std::int64_t>(cycle) * kPeriod_ns,
                          .period_ns = kPeriod_ns};
  };
  hal::Outside outside;
  port.begin(time(begun), true, outside);
  for (std::uint64_t cycle = begun; cycle < begun + kCycles; ++cycle) {
    (void)port.take(time(cycle), true, outside);
    may_hold();
  }
}

using Made = Result<std::shared_ptr<InputPort>>;

Made port_of(unsigned kind, const InputSource* source) {
  auto io = std::make_shared<ControllerIo>();
  InputBlock& block = io->inputs.all.emplace_back(block_of(kind));
  return InputPort::make(io, block, "fuzz", robot(), kPeriod_ns, source);
}

void read_or_refuse(unsigned kind, const InputSource& source) {
  const Made port = port_of(kind, &source);
  if (port) return run(**port);
  require(!port.error().to_string().empty());
}

/// [controller.inputs] of an experiment.
void read_table(unsigned kind, std::string_view text) {
  auto document = TomlDocument::parse(text, "fuzz/x.toml");
  if (!document) return;
  TomlTable root = document->root();
  for (InputSource source : read_input_sources(root)) {
    if (document->diagnostics().empty() && source.feeder == InputFeeder::kTimeline) {
      source.name = "in";
      read_or_refuse(kind, source);
    }
  }
}

/// Samples that somebody sends.
void offer(unsigned kind, std::string_view bytes) {
  const Made port = port_of(kind, nullptr);
  require(port.has_value());
  std::vector<double> sample((*port)->input().values());
  while (!bytes.empty()) {
    const std::string_view taken = bytes.substr(0, sample.size() * sizeof(double));
    bytes.remove_prefix(taken.size());
    std::memcpy(sample.data(), taken.data(), taken.size());
    const auto number = (*port)->offer(InputFeeder::kCommand, sample);
    if (!number) require(!number.error().to_string().empty());
    run(**port);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const unsigned kind = data[0] / 3;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      read_or_refuse(kind, {.name = "in", .feeder = InputFeeder::kFile, .file = file_with(rest)});
      break;
    case 1: read_table(kind, rest); break;
    default: offer(kind, rest); break;
  }
  return 0;
}
