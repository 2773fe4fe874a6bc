#include "apps/run/game_pad.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <sstream>
#include <utility>

#include "base/nearest.hpp"

namespace tandem::apps {
namespace {

constexpr std::chrono::milliseconds kAgain{100};    // between two samples of a pad at rest
constexpr std::chrono::milliseconds kPadLook{500};  // between two looks for one that is gone

struct PadCode {
  const char* name;
  std::uint16_t type, code;
};
/// linux/input-event-codes.h
constexpr PadCode kCodes[]{
    {"ABS_X", EV_ABS, ABS_X},
    {"ABS_Y", EV_ABS, ABS_Y},
    {"ABS_Z", EV_ABS, ABS_Z},
    {"ABS_RX", EV_ABS, ABS_RX},
    {"ABS_RY", EV_ABS, ABS_RY},
    {"ABS_RZ", EV_ABS, ABS_RZ},
    {"ABS_THROTTLE", EV_ABS, ABS_THROTTLE},
    {"ABS_RUDDER", EV_ABS, ABS_RUDDER},
    {"ABS_GAS", EV_ABS, ABS_GAS},
    {"ABS_BRAKE", EV_ABS, ABS_BRAKE},
    {"ABS_HAT0X", EV_ABS, ABS_HAT0X},
    {"ABS_HAT0Y", EV_ABS, ABS_HAT0Y},
    {"BTN_SOUTH", EV_KEY, BTN_SOUTH},
    {"BTN_EAST", EV_KEY, BTN_EAST},
    {"BTN_NORTH", EV_KEY, BTN_NORTH},
    {"BTN_WEST", EV_KEY, BTN_WEST},
    {"BTN_TL", EV_KEY, BTN_TL},
    {"BTN_TR", EV_KEY, BTN_TR},
    {"BTN_TL2", EV_KEY, BTN_TL2},
    {"BTN_TR2", EV_KEY, BTN_TR2},
    {"BTN_SELECT", EV_KEY, BTN_SELECT},
    {"BTN_START", EV_KEY, BTN_START},
    {"BTN_MODE", EV_KEY, BTN_MODE},
    {"BTN_THUMBL", EV_KEY, BTN_THUMBL},
    {"BTN_THUMBR", EV_KEY, BTN_THUMBR},
    {"BTN_TRIGGER", EV_KEY, BTN_TRIGGER},
    {"BTN_THUMB", EV_KEY, BTN_THUMB},
    {"BTN_TOP", EV_KEY, BTN_TOP},
};

using Bits = std::array<unsigned char, KEY_MAX / 8 + 1>;

bool has_bit(const Bits& bits, std::uint16_t code) {
  return (bits[code / 8] >> (code % 8) & 1) != 0;
}

std::unexpected<Error> wrong_at(const runtime::InputPort& port, std::string message,
                                std::string hint) {
  Error error = port.source().where;
  error.message = std::move(message);
  error.hint = std::move(hint);
  return std::unexpected(std::move(error));
}

/// What the device says of a part: whether it has it, its range, where it is.
Status measure(int device, PadPart& part, const std::string& text) {
  Bits bits{};
  if (::ioctl(device, EVIOCGBIT(part.type, bits.size()), bits.data()) < 0) {
    return fail("is no event device", "name one of /dev/input/by-id/*-event-joystick");
  }
  if (!has_bit(bits, part.code)) return fail("has no " + text, "`evtest` shows what it has");
  if (part.type == EV_KEY) return {};
  input_absinfo info{};
  if (::ioctl(device, EVIOCGABS(part.code), &info) < 0 || info.maximum <= info.minimum) {
    return fail("has no range of " + text, "choose another axis");
  }
  part.min = info.minimum;
  part.max = info.maximum;
  part.raw = info.value;
  return {};
}

}  // namespace

double PadPart::value(double deadband) const {
  if (type == EV_KEY) return raw != 0.0 ? gain : 0.0;
  const double middle = 2.0 * (raw - min) / (max - min) - 1.0;
  const double way = std::max(0.0, std::min(std::abs(middle), 1.0) - deadband) / (1.0 - deadband);
  return gain * std::copysign(way, middle);
}

Result<PadPart> parse_pad_part(const std::string& text) {
  std::istringstream in(text);
  std::string name, number, more;
  in >> name >> number >> more;
  PadPart part;
  if (name.starts_with('-')) {
    part.gain = -1.0;
    name.erase(0, 1);
  }
  std::vector<std::string> known;
  const auto* found = std::ranges::find(kCodes, name, &PadCode::name);
  for (const PadCode& code : kCodes) known.emplace_back(code.name);
  if (found == std::end(kCodes)) return fail("there is no '" + name + "'", suggest(name, known));
  part.type = found->type;
  part.code = found->code;
  if (number.empty()) return part;
  char* end = nullptr;
  const double gain = std::strtod(number.c_str(), &end);
  if (*end != '\0' || !std::isfinite(gain) || !more.empty()) {
    return fail("'" + text + "' is not an axis or button, and a number", "write \"-ABS_Y 0.5\"");
  }
  part.gain *= gain;
  return part;
}

Result<GamePad> GamePad::open(std::shared_ptr<runtime::InputPort> port) {
  const runtime::InputSource& source = port->source();
  if (port->input().kind == InputKind::kTrajectory) {
    return wrong_at(*port, "a game pad is no source of a trajectory", "choose another source");
  }
  std::vector<PadPart> parts;
  for (const auto& [component, text] : source.mapping) {
    const std::vector<std::string>& all = port->input().components;
    const auto place = std::ranges::find(all, component);
    if (place == all.end()) {
      return wrong_at(*port, "mapping: the input has no component '" + component + "'",
                      suggest(component, all));
    }
    auto part = parse_pad_part(text);
    if (!part) return wrong_at(*port, "mapping: " + part.error().message, part.error().hint);
    part->component = static_cast<std::size_t>(place - all.begin());
    std::vector<double> sample(port->without().begin(), port->without().end());
    for (const double end : {part->gain, part->type == EV_ABS ? -part->gain : 0.0}) {
      sample[part->component] = end;
      if (const Status fits = port->check(sample); !fits) {
        return wrong_at(*port, "mapping: " + component + " " + fits.error().message,
                        "give the value at its end: \"ABS_Y 0.5\"; " + fits.error().hint);
      }
    }
    parts.push_back(*part);
  }
  Descriptor device(::open(source.device.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  if (device.get() < 0) {
    return wrong_at(
        *port, "cannot open the game pad " + source.device + ": " + std::strerror(errno),
        "is it plugged in, and is this user in the group `input`? ls -l /dev/input/by-id");
  }
  auto part = parts.begin();
  for (const auto& [component, text] : source.mapping) {
    const Status measured = measure(device.get(), *part++, text);
    if (!measured) {
      return wrong_at(*port, source.device + " " + measured.error().message, measured.error().hint);
    }
  }
  GamePad pad(std::move(device), std::move(port), std::move(parts));
  if (!pad.look()) return wrong_at(*pad.port_, source.device + " does not say how it stands", {});
  return pad;
}

bool GamePad::read() {
  if (read_events()) return true;
  device_ = Descriptor();
  port_->refuse(
      fail_at(port_->source().device, "the game pad is gone", "plug it in again").error());
  return false;
}

bool GamePad::read_events() {
  std::array<input_event, 64> events{};
  for (;;) {
    const ssize_t bytes = ::read(device_.get(), events.data(), sizeof events);
    if (bytes < 0 && errno == EINTR) continue;
    if (bytes < 0) return errno == EAGAIN;
    if (bytes == 0) return false;
    const std::size_t count = static_cast<std::size_t>(bytes) / sizeof(input_event);
    for (const input_event& event : std::span(events).first(count)) {
      if (!take(event)) return false;
    }
  }
}

/// After SYN_DROPPED what follows until the next report's end is older than what the device says.
bool GamePad::take(const input_event& event) {
  if (event.type == EV_SYN) {
    if (event.code == SYN_DROPPED) dropped_ = true;
    if (event.code != SYN_REPORT) return true;
    if (std::exchange(dropped_, false) && !look()) return false;
    offer();
    return true;
  }
  for (PadPart& part : parts_) {
    if (!dropped_ && part.type == event.type && part.code == event.code) part.raw = event.value;
  }
  return true;
}

/// How each part stands. False: the device does not say.
bool GamePad::look() {
  Bits keys{};
  if (::ioctl(device_.get(), EVIOCGKEY(keys.size()), keys.data()) < 0) return false;
  for (PadPart& part : parts_) {
    input_absinfo info{};
    if (part.type == EV_ABS && ::ioctl(device_.get(), EVIOCGABS(part.code), &info) < 0) {
      return false;
    }
    part.raw = part.type == EV_ABS ? info.value : has_bit(keys, part.code) ? 1.0 : 0.0;
  }
  return true;
}

void GamePad::look_for() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_for_ < kPadLook) return;
  looked_for_ = now;
  auto again = open(port_);
  if (again) {
    *this = std::move(*again);
    return;
  }
  if (missed_ == again.error().message) return;  // once
  missed_ = again.error().message;
  port_->refuse(again.error());
}

void GamePad::offer_again() {
  if (std::chrono::steady_clock::now() - offered_ >= kAgain) offer();
}

void GamePad::offer() {
  if (auto heir = port_->heir()) port_ = std::move(heir);  // its controller was reloaded
  offered_ = std::chrono::steady_clock::now();
  const std::span<const double> without = port_->without();
  std::vector<double> sample(without.begin(), without.end());
  for (const PadPart& part : parts_) sample[part.component] = part.value(port_->source().deadband);
  (void)port_->offer(runtime::InputFeeder::kGamepad, sample);
}

Result<std::unique_ptr<GamePads>> GamePads::open(runtime::RunServices& services) {
  const auto ports = services.inputs_of(runtime::InputFeeder::kGamepad);
  if (ports.empty()) return nullptr;
  std::unique_ptr<GamePads> pads(new GamePads);
  for (const auto& port : ports) {
    auto pad = GamePad::open(port);
    if (!pad) return std::unexpected(pad.error());
    pads->pads_.push_back(std::move(*pad));
  }
  pads->thread_ = std::thread([&one = *pads] { one.run(); });
  return pads;
}

GamePads::~GamePads() {
  ending_ = true;
  if (thread_.joinable()) thread_.join();
}

void GamePads::run() {
  std::vector<pollfd> wait(pads_.size());
  while (!ending_) {
    for (std::size_t i = 0; i < pads_.size(); ++i) wait[i] = {pads_[i].descriptor(), POLLIN, 0};
    (void)::poll(wait.data(), wait.size(), static_cast<int>(kAgain.count()));
    for (std::size_t i = 0; i < pads_.size(); ++i) {
      GamePad& pad = pads_[i];
      if (pad.descriptor() < 0) {
        pad.look_for();
      } else if (wait[i].revents == 0 || pad.read()) {
        pad.offer_again();
      }
    }
  }
}

}  // namespace tandem::apps
