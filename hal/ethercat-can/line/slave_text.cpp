// Why a slave is down, in words.
#include <fmt/format.h>

#include <utility>

#include "hal/ethercat-can/line/slave_master.hpp"

namespace tandem::hal::ecat {

namespace {

std::string identity_text(const ethercat::sii::Identity& identity) {
  return fmt::format("vendor {:08X}, product {:08X}, revision {:08X}, serial number {}",
                     identity.vendor, identity.product, identity.revision, identity.serial);
}

std::string code_text(ethercat::AlCode code) {
  return fmt::format("{} (AL status code {:04X})", to_string(code), std::to_underlying(code));
}

std::string step_text(const CoeStep& step, const CoeClient& coe) {
  const auto object = fmt::format("object {:04X}:{:02X}", step.index, step.sub);
  if (coe.status() == CoeClient::Status::kDone) {
    return object + " has another value than it should have";
  }
  return fmt::format("{} was refused: {} (abort code {:08X})", object, to_string(coe.abort_code()),
                     std::to_underlying(coe.abort_code()));
}

}  // namespace

std::string SlaveMaster::text() const {
  if (stage_ != SlaveStage::kDown) return {};
  const auto say = [this](const std::string& what) {
    return fmt::format("slave {} ({}): {}", position_, plan_.name, what);
  };
  switch (error_) {
    case LineError::kWrongIdentity:
      return say("is another device: " + identity_text(content_.identity) + "; expected " +
                 identity_text(plan_.identity));
    case LineError::kSdo: return say(step_text(steps_[step_], coe_));
    case LineError::kRefused:
      return say(fmt::format("refused {}: {}", to_string(wanted_), code_text(al_code_)));
    case LineError::kStateTimeout:
      return say(fmt::format("did not enter {} in time", to_string(wanted_)));
    case LineError::kClock:
      return say(
          fmt::format("its clock, {} ns off the reference, or its SYNC0 was not ready in "
                      "time (a master in lockstep needs `tandem emulate --lockstep`)",
                      clock_.difference_ns()));
    case LineError::kLeftState:
      return say(fmt::format("is in {}: {}", to_string(al_state_), code_text(al_code_)));
    case LineError::kGone:
      if (position_ == 0) {
        return say("is gone: its cable from the master is cut, or it has no power");
      }
      break;
    default: break;
  }
  return error_ == LineError::kNone ? std::string() : say(to_string(error_));
}

}  // namespace tandem::hal::ecat
