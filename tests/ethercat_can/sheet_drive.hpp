// A CiA 402 drive that does what its sheet says and nothing else: written apart from the project's
// own node and firmware, so that the master meets a stranger.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "canopen/bytes.hpp"
#include "canopen/data_sheet.hpp"
#include "canopen/frame.hpp"
#include "canopen/object_dictionary.hpp"

namespace tandem::hal::can::test {

using canopen::DataSheet;
using canopen::Frame;
using canopen::SheetEntry;

/// Numbers in, frames out. Its motor is where it is told to be.
class SheetDrive {
 public:
  SheetDrive(DataSheet sheet, int node) : sheet_(std::move(sheet)), node_(node) { power_on(); }

  int boot_ms = 2;    ///< from a reset to the boot-up message
  bool deaf = false;  ///< no RPDO reaches it
  bool answers_guarding = true;
  bool answers_late = false;  ///< every SDO answer comes a second time, later
  bool emergency_at_boot = false;
  int homing_ms = 50;                    ///< from bit 4 until it is there; never in a negative time
  bool homing_fails = false;             ///< then it says so by bit 13
  bool knows_homing = true;              ///< it goes into mode 6
  bool tells_states = false;             ///< its heartbeat comes at each change of state, too
  int first_syncs_unanswered = 0;        ///< after each start
  bool ignores_quick_stop = false;       ///< while it is enabled
  bool stays_in_quick_stop = false;      ///< as 605A = 5 to 8 have it
  bool refuses_operation = false;        ///< it stays pre-operational
  int error = 0x8611;                    ///< 603F in a fault
  int set_point_ms = 0;                  ///< mode 1: from bit 4 until it takes one
  bool takes_set_points = true;          ///< mode 1
  std::vector<std::int64_t> set_points;  ///< that it took
  double fastest = 0.0;                  ///< modes 1 and 3 [counts/s]
  bool stores = true;                    ///< 1010:1 keeps what was written over a reset
  int writes = 0;                        ///< SDO downloads that it took
  std::vector<std::uint32_t> aborts;     ///< that it answered

  [[nodiscard]] std::int64_t& value(int index, int sub = 0) {
    return values_[{static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub)}];
  }
  [[nodiscard]] bool operational() const { return nmt_ == 5; }
  [[nodiscard]] bool enabled(int axis = 0) const { return state_[axis] == 4; }
  [[nodiscard]] int guarded() const { return guarded_; }
  void fault() { state_[0] = 5; }
  /// It boots once more, after boot_ms.
  void lose_power() { power_on(); }

  void receive(const Frame& frame) {
    const auto id = static_cast<int>(frame.id);
    if (id == 0 && (frame.data[1] == 0 || frame.data[1] == node_)) return on_nmt(frame.data[0]);
    if (boot_in_ms_ > 0) return;
    if (id == 0x600 + node_) return on_sdo(frame);
    if (id == 0x700 + node_ && (frame.flags & canopen::kFlagRtr) != 0) {
      if (!answers_guarding) return;
      ++guarded_;
      toggle_ ^= 0x80;
      return send(0x700 + node_, {static_cast<std::uint8_t>(toggle_ | nmt_)});
    }
    if (nmt_ != 5) return;
    if (id == 0x80) return on_sync();
    if (deaf) return;
    for (int n = 0; n < 4; ++n) {
      const auto cob = value(0x1400 + n, 1);
      if ((cob & 0x80000000) == 0 && (cob & 0x7FF) == id) take_rpdo(n, frame);
    }
  }
  /// A millisecond passes.
  void tick() {
    if (boot_in_ms_ > 0 && --boot_in_ms_ == 0) {
      send(0x700 + node_, {0});
      nmt_ = 127;
      if (emergency_at_boot) send(0x80 + node_, {0x10, 0x81, 0x11, 0, 0, 0, 0, 0});
    }
    if (answers_late && !late_.empty()) {
      out.push_back(late_.front());
      late_.erase(late_.begin());
    }
    const std::int64_t every_ms = has(0x1017) ? value(0x1017) : 0;
    if (every_ms != 0 && nmt_ != 0 && ++since_heartbeat_ms_ >= every_ms) {
      since_heartbeat_ms_ = 0;
      send(0x700 + node_, {static_cast<std::uint8_t>(nmt_)});
    }
  }

  void store_now() { (void)store(0x65766173); }

  std::vector<Frame> out;

 private:
  [[nodiscard]] bool has(int index, int sub = 0) const {
    return sheet_.find(static_cast<std::uint16_t>(index), static_cast<std::uint8_t>(sub)) !=
           nullptr;
  }
  void power_on() {
    values_.clear();
    for (const SheetEntry& entry : sheet_.entries) {
      value(entry.index, entry.sub) = entry.value ? entry.value->of(node_) : 0;
    }
    for (const auto& [key, number] : stored_) values_[key] = number;
    state_.fill(1);
    nmt_ = 0;
    boot_in_ms_ = boot_ms;
  }
  void send(int id, std::initializer_list<std::uint8_t> bytes) {
    Frame frame;
    frame.id = static_cast<std::uint32_t>(id);
    frame.length = static_cast<std::uint8_t>(bytes.size());
    std::copy(bytes.begin(), bytes.end(), frame.data.begin());
    out.push_back(frame);
  }
  void on_nmt(int command) {
    if (command == 0x81 || command == 0x82) power_on();
    if (command == 1 && !refuses_operation) nmt_ = 5;
    if (command == 2) nmt_ = 4;
    if (command == 0x80) nmt_ = 127;
    if (command == 1) unanswered_ = first_syncs_unanswered;
    if (tells_states && nmt_ != 0) send(0x700 + node_, {static_cast<std::uint8_t>(nmt_)});
  }
  void on_sdo(const Frame& request) {
    const auto index = canopen::get<std::uint16_t>(&request.data[1]);
    const std::uint8_t sub = request.data[3];
    Frame answer;
    answer.id = static_cast<std::uint32_t>(0x580 + node_);
    answer.length = 8;
    answer.data[1] = request.data[1];
    answer.data[2] = request.data[2];
    answer.data[3] = sub;
    const SheetEntry* entry = sheet_.find(index, sub);
    std::uint32_t abort = 0;
    if (entry == nullptr) abort = sheet_.has(index) ? 0x06090011 : 0x06020000;
    const bool reads = request.data[0] == 0x40;
    if (abort == 0 && reads && (entry->access & canopen::kRead) == 0) abort = 0x06010001;
    if (abort == 0 && request.data[0] == 0x40) {
      answer.data[0] = static_cast<std::uint8_t>(0x43 | (4 - size_of(*entry)) << 2);
      canopen::put(&answer.data[4], static_cast<std::uint32_t>(value(index, sub)));
      for (int i = size_of(*entry); i < 4; ++i) answer.data[4u + i] = 0xA5;  // rubbish, as seen
    } else if (abort == 0) {
      abort = write(*entry, request);
      answer.data[0] = 0x60;
    }
    if (abort != 0) {
      answer.data[0] = 0x80;
      canopen::put(&answer.data[4], abort);
      aborts.push_back(abort);
    }
    out.push_back(answer);
    if (answers_late) late_.push_back(answer);
  }
  [[nodiscard]] static int size_of(const SheetEntry& entry) {
    return entry.type == 2 || entry.type == 5 ? 1 : entry.type == 3 || entry.type == 6 ? 2 : 4;
  }
  std::uint32_t write(const SheetEntry& entry, const Frame& request) {
    const int size = 4 - (request.data[0] >> 2 & 3);
    if ((entry.access & canopen::kWrite) == 0) return 0x06010002;
    if (size != size_of(entry)) return 0x06070010;
    const bool mapping = (entry.index & 0xF800) == 0x1000 && (entry.index & 0x0600) == 0x0600;
    const bool maps = mapping || (entry.index >= 0x1A00 && entry.index < 0x1A04);
    if (maps) {
      const int parameter = entry.index - 0x200;
      if (has(parameter, 1) && (value(parameter, 1) & 0x80000000) == 0) return 0x06010000;
      if (entry.sub != 0 && value(entry.index) != 0) return 0x06010000;
    }
    const auto raw = canopen::get<std::uint32_t>(&request.data[4]);
    if (maps && entry.sub == 0 && entry.high && (raw & 0xFF) > *entry.high) return 0x06090031;
    ++writes;
    if (entry.index == 0x1010) return store(raw);
    const std::uint32_t mask = size == 4 ? 0xFFFFFFFF : (1u << 8 * size) - 1;
    value(entry.index, entry.sub) = raw & mask;
    return 0;
  }
  std::uint32_t store(std::uint32_t signature) {
    if (signature != 0x65766173 || !stores) return 0x08000020;
    for (const SheetEntry& entry : sheet_.entries) {
      const bool demand = (entry.access & canopen::kMapRpdo) != 0;
      if ((entry.access & canopen::kWrite) == 0 || demand) continue;
      stored_[{entry.index, entry.sub}] = value(entry.index, entry.sub);
    }
    return 0;
  }
  void take_rpdo(int n, const Frame& frame) {
    std::size_t offset = 0;
    const bool at_once = value(0x1400 + n, 2) > 240;
    for (int sub = 1; sub <= value(0x1600 + n); ++sub) {
      const auto mapped = static_cast<std::uint32_t>(value(0x1600 + n, sub));
      const std::size_t size = (mapped & 0xFF) / 8;
      std::int64_t number = 0;
      for (std::size_t i = 0; i < size; ++i) {
        number |= std::int64_t{frame.data[offset + i]} << 8 * i;
      }
      offset += size;
      auto& to = at_once ? values_ : pending_;
      to[{static_cast<std::uint16_t>(mapped >> 16), static_cast<std::uint8_t>(mapped >> 8)}] =
          number;
    }
  }
  void on_sync() {
    for (const auto& [key, number] : pending_) values_[key] = number;
    pending_.clear();
    for (int axis = 0; axis < 2; ++axis) {
      if (!has(0x6040 + 0x800 * axis)) continue;
      machine(axis);
      move(axis);
    }
    if (unanswered_ > 0 && unanswered_-- > 0) return;
    for (int n = 0; n < 4; ++n) {
      const auto cob = value(0x1800 + n, 1);
      const auto type = value(0x1800 + n, 2);
      if (!has(0x1800 + n, 1) || (cob & 0x80000000) != 0 || type == 0 || type > 240) continue;
      if (++syncs_[n] % type != 0) continue;
      Frame frame;
      frame.id = static_cast<std::uint32_t>(cob & 0x7FF);
      for (int sub = 1; sub <= value(0x1A00 + n); ++sub) {
        const auto mapped = static_cast<std::uint32_t>(value(0x1A00 + n, sub));
        const auto number = value(static_cast<int>(mapped >> 16), mapped >> 8 & 0xFF);
        for (std::size_t i = 0; i < (mapped & 0xFF) / 8; ++i) {
          frame.data[frame.length++] = static_cast<std::uint8_t>(number >> 8 * i);
        }
      }
      out.push_back(frame);
    }
  }
  /// CiA 402's states: 1 switch-on disabled, 2 ready, 3 switched on, 4 enabled, 5 fault, 6 quick
  /// stop.
  void machine(int axis) {
    const int at = 0x800 * axis;
    int& state = state_[axis];
    const auto cw = static_cast<unsigned>(value(0x6040 + at));
    if (state == 5) {
      if ((cw & 0x80) != 0 && (last_controlword_[axis] & 0x80) == 0) state = 1;
    } else if ((cw & 0x06) == 0x02 && stays_in_quick_stop && (state == 4 || state == 6)) {
      state = 6;
    } else if ((cw & 0x02) == 0 || ((cw & 0x04) == 0 && !(ignores_quick_stop && state == 4))) {
      state = 1;
    } else if ((cw & 0x0F) == 0x06 && state <= 3) {
      state = 2;
    } else if ((cw & 0x0F) == 0x07 && state >= 2 && state <= 4) {
      state = 3;
    } else if ((cw & 0x0F) == 0x0F && state >= 3 && state <= 4) {
      state = 4;
    }
    last_controlword_[axis] = cw;
    constexpr std::array<int, 7> kStatusword{0, 0x0250, 0x0231, 0x0233, 0x0237, 0x0218, 0x0217};
    value(0x6041 + at) = kStatusword[static_cast<std::size_t>(state)];
    if (axis == 0 && state == 4 && value(0x6061) == 6) value(0x6041) |= home(cw);
    if (axis == 0 && value(0x6061) == 1) value(0x6041) |= take_set_point(cw);
    value(0x603F + at) = state == 5 ? error : 0;
  }
  /// Profile position's handshake. @return bit 12 of the statusword
  unsigned take_set_point(unsigned cw) {
    const bool offered = state_[0] == 4 && (cw & 0x10) != 0;
    if (state_[0] != 4) {
      way_to_ = value(0x6064);
      speed_ = 0.0;
      acknowledges_ = false;
    }
    if (offered && (last_offer_ & 0x10) == 0) looks_in_ms_ = set_point_ms;
    if (offered && looks_in_ms_ >= 0 && --looks_in_ms_ < 0 && takes_set_points) {
      way_to_ = static_cast<std::int32_t>(value(0x607A));
      set_points.push_back(way_to_);
      acknowledges_ = true;
    }
    if (!offered) acknowledges_ = false;
    last_offer_ = cw;
    return acknowledges_ ? 0x1000u : 0u;
  }
  /// A millisecond of a way by 6081, 6083 and 6084, which ends at rest. Units are counts.
  void go_on_way() {
    const double left = static_cast<double>(way_to_) - static_cast<double>(value(0x6064)) - part_;
    const auto down = static_cast<double>(value(0x6084));
    const double most =
        std::min(static_cast<double>(value(0x6081)), std::sqrt(2 * down * std::abs(left)));
    approach(std::copysign(most, left), std::abs(left));
  }
  /// @param left  counts that it may still go
  void approach(double wanted, double left) {
    const bool slower = std::abs(wanted) < std::abs(speed_) || wanted * speed_ < 0.0;
    const double step = static_cast<double>(value(slower ? 0x6084 : 0x6083)) * 1e-3;
    speed_ += std::clamp(wanted - speed_, -step, step);
    part_ += std::clamp(speed_ * 1e-3, -left, left);
    const double whole = std::round(part_);
    value(0x6064) += static_cast<std::int64_t>(whole);
    part_ -= whole;
    if (has(0x606C)) value(0x606C) = static_cast<std::int64_t>(speed_);
    fastest = std::max(fastest, std::abs(speed_));
  }
  /// @return bits 10, 12 and 13 of the statusword. They stay until bit 4 rises again.
  unsigned home(unsigned cw) {
    if ((cw & 0x10) == 0) {
      if (homing_ > 0) homing_ = 0;
    } else if ((last_homing_ & 0x10) == 0) {
      homed_bits_ = 0;
      homing_ = homing_ms;
    } else if (homing_ > 0 && (cw & 0x100) == 0 && --homing_ == 0) {
      homed_bits_ = homing_fails ? 0x2000 : 0x1400;
      if (!homing_fails) value(0x6064) = has(0x607C) ? value(0x607C) : 0;
    }
    last_homing_ = cw;
    const bool rests = homing_ == 0 || (cw & 0x100) != 0;
    return homed_bits_ | (rests && homed_bits_ == 0 ? 0x400u : 0u);
  }
  void move(int axis) {
    const int at = 0x800 * axis;
    auto mode = static_cast<std::int8_t>(value(0x6060 + at));
    if (mode == 6 && !knows_homing) mode = static_cast<std::int8_t>(value(0x6061));
    if (mode == 1 && value(0x6061 + at) != 1) way_to_ = value(0x6064);
    value(0x6061 + at) = mode;
    const auto i32 = [&](int index, int sub = 0) {
      return has(index + at, sub) ? static_cast<std::int32_t>(value(index + at, sub)) : 0;
    };
    if (state_[axis] != 4) return;
    if (mode == 1) go_on_way();
    if (mode == 3) approach(i32(0x60FF), 1e9);
    if (mode == 8) value(0x6064 + at) = i32(0x607A);
    if (mode == 7 && (last_controlword_[axis] & 0x10) != 0) value(0x6064 + at) = i32(0x60C1, 1);
    if (mode == 9) value(0x6064 + at) += (i32(0x60FF) + i32(0x60B1)) / 1000;
    if (mode == 10) value(0x6077 + at) = i32(0x6071) + i32(0x60B2);
  }

  DataSheet sheet_;
  int node_;
  int nmt_ = 0;
  std::array<int, 2> state_{1, 1};  ///< by axis
  int boot_in_ms_ = 0;
  int unanswered_ = 0;  ///< SYNCs
  int guarded_ = 0;
  int toggle_ = 0x80;
  std::int64_t since_heartbeat_ms_ = 0;
  std::array<unsigned, 2> last_controlword_{};
  unsigned last_homing_ = 0;
  unsigned homed_bits_ = 0;
  int homing_ = 0;  ///< [ms] that are left
  unsigned last_offer_ = 0;
  int looks_in_ms_ = -1;
  bool acknowledges_ = false;
  std::int64_t way_to_ = 0;
  double speed_ = 0.0;  ///< counts/s
  double part_ = 0.0;   ///< of a count
  std::array<int, 4> syncs_{};
  std::map<std::pair<std::uint16_t, std::uint8_t>, std::int64_t> values_, pending_, stored_;
  std::vector<Frame> late_;
};

}  // namespace tandem::hal::can::test
