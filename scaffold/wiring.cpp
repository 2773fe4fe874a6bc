// One bus per limb and two joints per board; a limb whose bus would be overloaded at 1 kHz is
// split.
#include "scaffold/steps.hpp"

#include <algorithm>

#include "hal/ethercat-can/bus_load.hpp"

namespace tandem::scaffold {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr int kSlowEvery = 4;
constexpr std::size_t kAxes = 2;  // of a board

/// a, b, …, z, aa, ab, …
std::string letters(std::size_t number) {
  std::string text;
  for (std::size_t left = number + 1; left > 0; left = (left - 1) / 26)
    text.insert(text.begin(), static_cast<char>('a' + (left - 1) % 26));
  return text;
}

class Wirer {
 public:
  Wirer(NewRobot& robot, std::size_t most_joints) : robot_(robot), most_(most_joints) {}

  void run() {
    hal::RobotConfig& config = robot_.config;
    config.buses.clear();
    config.boards.clear();
    config.sensors.clear();
    bus_of_body_.assign(robot_.tree.bodies.size(), 0);
    std::size_t joint = 0;  // in the configuration, whose order is that of the limbs
    for (const Limb& limb : robot_.limbs) {
      const std::size_t parts = (limb.joints.size() + most_ - 1) / most_;
      const std::size_t each = (limb.joints.size() + parts - 1) / parts;
      for (std::size_t part = 0, at = 0; part < parts; ++part) {
        const std::size_t count = std::min(each, limb.joints.size() - at);
        add_bus(limb.name + (parts == 1 ? "" : "_" + letters(part)), joint, count);
        for (std::size_t i = 0; i < count; ++i) {
          bus_of_body_[limb.joints[at + i] + 1] = config.buses.size() - 1;
        }
        at += count;
        joint += count;
      }
    }
    for (std::size_t j = 0; j < robot_.tree.joints.size(); ++j) {
      const model::Joint& follower = robot_.tree.joints[j];
      if (follower.follows()) bus_of_body_[j + 1] = bus_of_body_[follower.leader + 1];
    }
    add_sensors();
  }

 private:
  void add_bus(const std::string& name, std::size_t first, std::size_t count) {
    hal::RobotConfig& config = robot_.config;
    hal::BusConfig bus;
    bus.name = name;
    bus.interface = "can" + std::to_string(config.buses.size());
    config.buses.push_back(bus);
    for (std::size_t i = 0; i < count; ++i) {
      if (i % kAxes == 0) {
        hal::BoardConfig board;
        board.node_id = static_cast<int>(i / kAxes) + 1;
        board.name = name + "_" + std::to_string(board.node_id);
        board.bus = name;
        board.slow_pdo_every = kSlowEvery;
        config.boards.push_back(board);
      }
      config.joints[first + i].board = config.boards.back().name;
      config.joints[first + i].axis = static_cast<int>(i % kAxes);
    }
  }

  void add_sensors() {
    std::vector<int> nodes;  // the next one that is free, by bus
    for (const hal::BusConfig& bus : robot_.config.buses) {
      nodes.push_back(1 + static_cast<int>(std::ranges::count(robot_.config.boards, bus.name,
                                                              &hal::BoardConfig::bus)));
    }
    for (const FoundSensor& found : robot_.sensors) {
      hal::SensorConfig sensor = found.config;
      const std::size_t bus = bus_of_body_[found.body];
      sensor.bus = robot_.config.buses[bus].name;
      sensor.node_id = nodes[bus]++;
      robot_.config.sensors.push_back(std::move(sensor));
    }
  }

  NewRobot& robot_;
  std::size_t most_;
  std::vector<std::size_t> bus_of_body_;
};

}  // namespace

Status wire(NewRobot& robot) {
  std::string remedy;
  for (std::size_t most = 16; most >= 2; most -= 2) {
    Wirer(robot, most).run();
    const auto loads = hal::can::bus_loads(robot.config, kPeriod_ns);
    if (!loads) return std::unexpected(loads.error());
    const auto full = std::ranges::find_if(*loads, [](const auto& load) { return !load.fits(); });
    if (full == loads->end()) return {};
    remedy = full->remedy;
  }
  return fail("not even one board of two joints fits on a CAN FD bus beside its sensors", remedy);
}

}  // namespace tandem::scaffold
