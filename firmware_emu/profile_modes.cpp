// Set-points by handshake, ramps, and the motions of homing.
#include "firmware_emu/profile_modes.hpp"

#include <algorithm>
#include <cmath>

#include "base/archive.hpp"
#include "canopen/bytes.hpp"

namespace tandem::firmware {
namespace {

using namespace canopen;
namespace co = canopen::object;

constexpr std::uint16_t kBit4 = 1U << 4;          // new set-point, homing start, ip enabled
constexpr std::uint16_t kChangeAtOnce = 1U << 5;  // profile position
constexpr std::uint16_t kRelative = 1U << 6;      // profile position
constexpr double kUnlimited = 4294967295.0;

std::int32_t plus(std::int32_t a, std::int32_t b) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + static_cast<std::uint32_t>(b));
}

/// From `a` to `b` as counters wrap around.
std::int32_t way(std::int32_t a, std::int32_t b) noexcept {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(b) - static_cast<std::uint32_t>(a));
}

double approach(double value, double wanted, double step) noexcept {
  return value + std::clamp(wanted - value, -step, step);
}

}  // namespace

bool Trapezoid::run(double wanted, double acceleration, double deceleration,
                    double dt_s) noexcept TANDEM_RT {
  const bool slows = velocity * wanted < 0.0 || std::abs(wanted) < std::abs(velocity);
  velocity = approach(velocity, wanted, (slows ? deceleration : acceleration) * dt_s);
  position += velocity * dt_s;
  return velocity == wanted;
}

bool Trapezoid::move(double target, double speed, double acceleration, double deceleration,
                     double dt_s) noexcept TANDEM_RT {
  const double distance = target - position;
  // The largest speed from which the next periods can still stop at the target.
  const double step = 0.5 * deceleration * dt_s;
  const double stops = std::sqrt(step * step + 2.0 * deceleration * std::abs(distance)) - step;
  const double wanted = std::copysign(std::min(speed, stops), distance);
  const bool slows = velocity * wanted < 0.0 || std::abs(wanted) < std::abs(velocity);
  velocity = approach(velocity, wanted, (slows ? deceleration : acceleration) * dt_s);
  const bool reaches = std::abs(distance) <= std::abs(velocity) * dt_s + 0.5 &&
                       std::abs(velocity) <= deceleration * dt_s + 0.5 / dt_s;
  if (!reaches) {
    position += velocity * dt_s;
    return false;
  }
  position = target;
  velocity = 0.0;
  return true;
}

bool ProfileModes::has(Mode mode) noexcept TANDEM_RT { return cyclic(mode) != mode; }

Mode ProfileModes::cyclic(Mode mode) noexcept TANDEM_RT {
  switch (mode) {
    case Mode::kPp:
    case Mode::kHm:
    case Mode::kIp: return Mode::kCsp;
    case Mode::kPv: return Mode::kCsv;
    case Mode::kTq: return Mode::kCst;
    default: return mode;
  }
}

bool ProfileModes::add_to(ObjectDictionary& od, int axis, std::uint32_t modes) {
  const auto at = [axis](std::uint16_t index) { return of_axis(index, axis); };
  const std::uint32_t profiles = mode_bit(Mode::kPp) | mode_bit(Mode::kPv) | mode_bit(Mode::kTq);
  const bool profile = (modes & profiles) == 0 ||
                       (od.rebind(at(co::kTorqueSlope), 0, torque_slope_) &&
                        od.add(at(co::kProfileVelocity), 0, speed_, kWriteRpdo) &&
                        od.add(at(co::kProfileAcceleration), 0, acceleration_, kWriteRpdo) &&
                        od.add(at(co::kProfileDeceleration), 0, deceleration_, kWriteRpdo));
  return profile && od.add(at(co::kHomeOffset), 0, home_offset_, kReadWrite) &&
         od.add(at(co::kHomingMethod), 0, homing_method_, kReadWrite) &&
         od.add_value<std::uint8_t>(at(co::kHomingSpeeds), 0, 2) &&
         od.add(at(co::kHomingSpeeds), 1, homing_speeds_[0], kReadWrite) &&
         od.add(at(co::kHomingSpeeds), 2, homing_speeds_[1], kReadWrite) &&
         od.add(at(co::kHomingAcceleration), 0, homing_acceleration_, kReadWrite);
}

// From rest where the axis is, whenever a mode begins and whenever the drive takes up following.
void ProfileModes::restart(const ProfileInputs& in) noexcept {
  const bool halted = mode_ == in.mode && mode_ == Mode::kPp && out_.position != in.position;
  motion_ = {};
  start_ = in.position;
  if (!halted) target_ = in.position;
  if (mode_ != in.mode || homing_ == Homing::kSeeks) homing_ = Homing::kIdle;
  waiting_ = false;
  torque_ = in.torque;
  mode_ = in.mode;
  bit_4_ = in.mode == Mode::kHm && (in.controlword & kBit4) != 0 && homing_ != Homing::kIdle;
  out_ = {.position = in.position};
}

ProfileOutputs ProfileModes::step(const ProfileInputs& in, double dt_s) noexcept TANDEM_RT {
  const bool begins = in.mode != mode_ || (in.follows && !followed_);
  followed_ = in.follows;
  if (begins) restart(in);
  out_.homed = false;
  if (!in.follows) {
    out_.target_reached = false;
    bit_4_ = (in.controlword & kBit4) != 0;
    return out_;
  }
  switch (in.mode) {
    case Mode::kPp: position_mode(in, dt_s); break;
    case Mode::kPv: velocity_mode(in, dt_s); break;
    case Mode::kTq: torque_mode(in, dt_s); break;
    case Mode::kIp: interpolated(in); break;
    case Mode::kHm: homing_mode(in, dt_s); break;
    default: break;
  }
  bit_4_ = (in.controlword & kBit4) != 0;
  return out_;
}

// The rising edge of bit 4 offers a set-point; the drive holds bit 12 until it has taken it and
// the master has withdrawn bit 4.
void ProfileModes::take_set_point(const ProfileInputs& in) noexcept {
  const bool offered = (in.controlword & kBit4) != 0;
  if (offered && !bit_4_ && !waiting_) {
    const std::int32_t base = (in.controlword & kRelative) != 0 ? target_ : 0;
    next_target_ = plus(base, in.target_position);
    waiting_ = true;
    out_.bit_12 = true;
  }
  const bool free = out_.target_reached || (in.controlword & kChangeAtOnce) != 0 ||
                    (target_ == out_.position && motion_.velocity == 0.0);
  if (waiting_ && free) {
    target_ = next_target_;
    waiting_ = false;
  }
  if (!offered && !waiting_) out_.bit_12 = false;
}

void ProfileModes::position_mode(const ProfileInputs& in, double dt_s) noexcept {
  take_set_point(in);
  const double unit = 1.0 / in.acceleration_units;
  out_.target_reached =
      motion_.move(motion_.position + way(out_.position, target_), speed_ / in.velocity_units,
                   speeding() * unit, slowing() * unit, dt_s) &&
      !waiting_;
  out_.position = plus(start_, clamp_round<std::int32_t>(motion_.position));
  out_.velocity = clamp_round<std::int32_t>(motion_.velocity);
}

void ProfileModes::velocity_mode(const ProfileInputs& in, double dt_s) noexcept {
  const double unit = 1.0 / in.acceleration_units;
  out_.target_reached = motion_.run(in.target_velocity / in.velocity_units, speeding() * unit,
                                    slowing() * unit, dt_s);
  out_.velocity = clamp_round<std::int32_t>(motion_.velocity);
  out_.position = in.position;
  out_.bit_12 = out_.velocity == 0;
}

void ProfileModes::torque_mode(const ProfileInputs& in, double dt_s) noexcept {
  const double slope = torque_slope_ == 0 ? kUnlimited : torque_slope_;
  torque_ = approach(torque_, in.target_torque, slope * dt_s);
  out_.torque = clamp_round<std::int16_t>(torque_);
  out_.position = in.position;
  out_.target_reached = torque_ == in.target_torque;
}

// Every set-point is followed as it comes; without bit 4 the axis stays at the last one.
void ProfileModes::interpolated(const ProfileInputs& in) noexcept {
  out_.bit_12 = (in.controlword & kBit4) != 0;
  if (out_.bit_12) out_.position = in.target_position;
  out_.target_reached = false;
}

void ProfileModes::end_homing(Homing how) noexcept {
  homing_ = how;
  motion_.velocity = 0.0;
  out_.velocity = 0;
  out_.target_reached = true;
  out_.bit_12 = how == Homing::kDone;
  out_.bit_13 = how == Homing::kFailed;
  out_.homed = how == Homing::kDone;
  if (!out_.homed) return;
  start_ = home_offset_;  // the axis stays; its counts are others from now on
  motion_.position = 0.0;
  out_.position = home_offset_;
}

void ProfileModes::homing_mode(const ProfileInputs& in, double dt_s) noexcept {
  const bool starts = (in.controlword & kBit4) != 0;
  if (starts && !bit_4_) {
    out_.bit_12 = out_.bit_13 = out_.target_reached = false;
    const int method = homing_method_;
    const bool has = HomingSearch::has(method) && (homing_methods_ >> method & 1U) != 0;
    if (!has) return end_homing(Homing::kFailed);
    homing_ = Homing::kSeeks;
    search_.begin(method);
  }
  if (homing_ != Homing::kSeeks) return;
  if (!starts) {  // interrupted: it stays here
    homing_ = Homing::kIdle;
    motion_.velocity = 0.0;
    out_.velocity = 0;
    return;
  }
  HomingSenses seen = in.senses;
  seen.position = in.position;
  switch (search_.step(seen)) {
    case HomingSearch::Result::kFound:
      out_.position = in.position;
      return end_homing(Homing::kDone);
    case HomingSearch::Result::kFailed: return end_homing(Homing::kFailed);
    case HomingSearch::Result::kMoves: break;
  }
  if (search_.turned()) motion_.velocity = 0.0;
  const std::uint32_t speed = homing_speeds_[search_.slow() && homing_speeds_[1] != 0 ? 1 : 0];
  const double acceleration = homing_acceleration_ / in.acceleration_units;
  motion_.run(search_.direction() * (speed / in.velocity_units), acceleration, acceleration, dt_s);
  out_.position = plus(start_, clamp_round<std::int32_t>(motion_.position));
  out_.velocity = clamp_round<std::int32_t>(motion_.velocity);
}

void ProfileModes::power_on() noexcept TANDEM_RT {
  const std::uint64_t methods = homing_methods_;
  *this = ProfileModes{};
  homing_methods_ = methods;
}

void ProfileModes::archive(Archive& ar) {
  ar(speed_, acceleration_, deceleration_, torque_slope_, homing_speeds_, homing_acceleration_,
     home_offset_, homing_method_, mode_, motion_.position, motion_.velocity, start_, target_,
     next_target_, torque_, followed_, bit_4_, waiting_, homing_, search_, out_.position,
     out_.velocity, out_.torque, out_.target_reached, out_.bit_12, out_.bit_13, out_.homed);
}

}  // namespace tandem::firmware
