// Channels sampled at each SYNC, with seeded noise and bias.
#include "firmware_emu/sensor_board.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "firmware_emu/wire.hpp"

namespace tandem::firmware {

namespace {

using namespace canopen;

constexpr std::string_view kSensorSoftware = "tandem sensor firmware 1.0";
constexpr std::size_t kSensorEntries = 2;

Status bad_sensor(std::string key, std::string message) {
  return fail_at(std::move(key), std::move(message), "correct the sensor's setup");
}

std::vector<NoisySensor> make_sensors(const SensorSetup& setup) {
  std::vector<NoisySensor> sensors;
  for (std::size_t i = 0; i < setup.channels; ++i) {
    const double noise = setup.noise.empty() ? 0.0 : setup.noise[i];
    const double bias = setup.bias.empty() ? 0.0 : setup.bias[i];
    sensors.emplace_back(NoisySensor::Config{.noise = noise, .bias = bias},
                         NoiseGenerator::stream(setup.seed, i));
  }
  return sensors;
}

/// Adds the channels before the node resolves anything.
std::vector<NoisySensor> make_board(const SensorSetup& setup, ObjectDictionary& od,
                                    std::vector<float>& values) {
  od.add_string(canopen::object::kSoftwareVersion, 0, kSensorSoftware);
  od.add_value(canopen::object::kSensorChannels, 0, static_cast<std::uint8_t>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    od.add(canopen::object::kSensorChannels, static_cast<std::uint8_t>(i + 1), values[i],
           kReadTpdo);
  }
  return make_sensors(setup);
}

bool disturbs_quaternion(const SensorSetup& setup) {
  const auto any = [](const std::vector<double>& values) {
    return !values.empty() &&
           std::ranges::any_of(std::span(values).first<4>(), [](double x) { return x != 0.0; });
  };
  return setup.orients && (any(setup.noise) || any(setup.bias));
}

/// As an IMU shows it: noise turns a quaternion, and does not stretch it.
void normalise(std::span<float, 4> quaternion) noexcept {
  double square = 0.0;
  for (const float x : quaternion) square += static_cast<double>(x) * x;
  if (!(square > 0.0)) return;
  const double length = std::sqrt(square);
  for (float& x : quaternion) x = static_cast<float>(x / length);
}

}  // namespace

Status check(const SensorSetup& setup) {
  if (setup.node_id < 1 || setup.node_id > kMaxNodeId)
    return bad_sensor("node_id", "is not 1 to 127");
  if (setup.channels < 1 || setup.channels > kMaxChannels) {
    return bad_sensor("channels",
                      "a sensor has 1 to " + std::to_string(kMaxChannels) + " channels");
  }
  if (setup.orients && setup.channels < 4) {
    return bad_sensor("orients", "a quaternion has four channels");
  }
  for (const auto& [key, values] : {std::pair{"noise", &setup.noise}, {"bias", &setup.bias}}) {
    if (!values->empty() && values->size() != setup.channels) {
      return bad_sensor(key, "needs one number per channel, or none");
    }
    for (const double value : *values) {
      if (!std::isfinite(value)) return bad_sensor(key, "is not finite");
    }
  }
  for (const double value : setup.noise) {
    if (value < 0.0) return bad_sensor("noise", "is negative");
  }
  return {};
}

SensorBoard::SensorBoard(const SensorSetup& setup)
    : setup_(setup),
      od_(kNodeObjects + kSensorEntries + setup.channels),
      values_(setup.channels),
      disturbed_quaternion_(disturbs_quaternion(setup)),
      sensors_(make_board(setup_, od_, values_)),
      node_({.id = setup_.node_id,
             .device_type = kSensorDeviceType,
             .product = kSensorProduct,
             .serial = setup_.serial,
             .name = setup_.name,
             .max_pdo_bytes = setup_.max_pdo_bytes},
            od_),
      outbox_storage_(kSensorOutboxFrames),
      outbox_(outbox_storage_) {}

void SensorBoard::hear(const Frame& frame) noexcept TANDEM_RT {
  if (is_remote_request(frame)) (void)node_.answer_remote(frame.id, outbox_);
  if (!is_data_frame(frame)) return;
  if ((node_.receive(frame, outbox_) & kEventSync) != 0) sync_pending_ = true;
}

void SensorBoard::step(std::int64_t dt_ns, std::span<const double> truth) noexcept TANDEM_RT {
  node_.process(dt_ns, outbox_);
  if (!sync_pending_) return;
  sync_pending_ = false;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const auto value = static_cast<float>(sensors_[i].sample(truth[i]));
    if (std::isfinite(value)) values_[i] = value;
  }
  if (disturbed_quaternion_) normalise(std::span(values_).first<4>());
  node_.transmit_synchronous(outbox_);
}

void SensorBoard::archive(Archive& ar) {
  ar(od_, values_, sensors_, node_, sync_pending_);
  archive_outbox(ar, outbox_, kSensorOutboxFrames);
}

}  // namespace tandem::firmware
