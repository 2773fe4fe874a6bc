// The error codes of CiA 301 and CiA 402 (603F, EMCY), as other makers' drives report them.
#include <algorithm>
#include <array>
#include <utility>

#include "canopen/objects.hpp"

namespace tandem::canopen {

namespace {

using Words = std::pair<std::uint16_t, std::string_view>;

/// Sorted. A code that is not here is told by the one above it: 0x2213 by 0x2210, 0x2200, 0x2000.
constexpr std::array kWords{
    Words{0x1000, "generic error"},
    Words{0x2000, "current"},
    Words{0x2100, "current at the input of the device"},
    Words{0x2130, "short circuit at the input of the device"},
    Words{0x2200, "current inside the device"},
    Words{0x2220, "continuous over-current inside the device"},
    Words{0x2230, "short circuit or earth leakage inside the device"},
    Words{0x2300, "current at the output of the device"},
    Words{0x2310, "continuous over-current"},
    Words{0x2320, "short circuit or earth leakage of the motor"},
    Words{0x2330, "earth leakage of the motor"},
    Words{0x2340, "short circuit of the motor"},
    Words{0x2350, "overload (I2t)"},
    Words{0x2351, "overload (I2t), a warning"},
    Words{0x3000, "voltage"},
    Words{0x3100, "mains voltage"},
    Words{0x3110, "mains over-voltage"},
    Words{0x3120, "mains under-voltage"},
    Words{0x3130, "a mains phase is missing"},
    Words{0x3200, "DC link voltage"},
    Words{0x3210, "DC link over-voltage"},
    Words{0x3220, "DC link under-voltage"},
    Words{0x3300, "output voltage"},
    Words{0x4000, "temperature"},
    Words{0x4100, "ambient temperature"},
    Words{0x4200, "device temperature"},
    Words{0x4210, "the device is too hot"},
    Words{0x4220, "the device is too cold"},
    Words{0x4300, "drive temperature"},
    Words{0x4310, "the drive is too hot"},
    Words{0x4320, "the drive is too cold"},
    Words{0x4400, "supply temperature"},
    Words{0x5000, "device hardware"},
    Words{0x5100, "supply of the device"},
    Words{0x5110, "low-voltage supply of the device"},
    Words{0x5200, "control hardware"},
    Words{0x5210, "measurement circuit"},
    Words{0x5400, "power section"},
    Words{0x5410, "output stages"},
    Words{0x5420, "brake chopper"},
    Words{0x5440, "contactors"},
    Words{0x5450, "fuses"},
    Words{0x5500, "data storage"},
    Words{0x5530, "non-volatile memory"},
    Words{0x6000, "device software"},
    Words{0x6010, "software reset by the watchdog"},
    Words{0x6200, "user software"},
    Words{0x6300, "data record"},
    Words{0x6310, "parameters are lost"},
    Words{0x6320, "parameter error"},
    Words{0x7000, "additional modules"},
    Words{0x7110, "brake chopper"},
    Words{0x7120, "motor"},
    Words{0x7121, "the motor is blocked"},
    Words{0x7122, "motor error or wrong commutation"},
    Words{0x7200, "measurement circuit"},
    Words{0x7300, "sensor"},
    Words{0x7303, "resolver"},
    Words{0x7305, "incremental encoder"},
    Words{0x7310, "speed sensor"},
    Words{0x7320, "position sensor"},
    Words{0x7400, "computation circuit"},
    Words{0x7500, "communication module"},
    Words{0x8000, "monitoring"},
    Words{0x8100, "communication"},
    Words{0x8110, "CAN frames were lost"},
    Words{0x8120, "CAN is error passive"},
    Words{0x8130, "heartbeat or guarding lost"},
    Words{0x8140, "recovered from bus-off"},
    Words{0x8150, "two nodes send the same CAN identifier"},
    Words{0x8200, "protocol"},
    Words{0x8210, "PDO too short"},
    Words{0x8220, "PDO too long"},
    Words{0x8250, "RPDO time-out"},
    Words{0x8300, "torque control"},
    Words{0x8311, "excess torque"},
    Words{0x8331, "torque fault"},
    Words{0x8400, "velocity control"},
    Words{0x8500, "position control"},
    Words{0x8600, "positioning"},
    Words{0x8611, "following error"},
    Words{0x8612, "reference limit"},
    Words{0x8700, "synchronisation"},
    Words{0x8800, "winding control"},
    Words{0x8900, "process data monitoring"},
    Words{0x9000, "external error"},
    Words{0xF000, "additional functions"},
    Words{0xF001, "deceleration"},
    Words{0xFF00, "the maker's own error: its manual tells"},
};
static_assert(std::ranges::is_sorted(kWords, {}, &Words::first));

}  // namespace

std::string_view error_words(std::uint16_t code) noexcept {
  for (const unsigned mask : {0xFFFFU, 0xFFF0U, 0xFF00U, 0xF000U}) {
    const auto wanted = static_cast<std::uint16_t>(code & mask);
    const auto found = std::ranges::lower_bound(kWords, wanted, {}, &Words::first);
    if (found != kWords.end() && found->first == wanted) return found->second;
  }
  return "unknown error";
}

}  // namespace tandem::canopen
