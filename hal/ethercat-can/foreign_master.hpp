// Whether another master is active on a bus, found by listening before anything is sent.
// Layer: hal/ethercat-can.  Thread: non-RT.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.hpp"
#include "canopen/frame.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/ethercat-can/line/link.hpp"

namespace tandem::hal::can {

/// What only a master sends: "SYNC (080)", "NMT commands (000)", "a master's heartbeat (77F)";
/// null for every other frame.
[[nodiscard]] const char* sent_by_master(const canopen::Frame& frame) noexcept;

/// How long to listen so that an active master is heard: two of its periods and two of its
/// heartbeats, when it drives this robot too; 0.1 s to 2 s.
[[nodiscard]] std::int64_t listening_ns(const RobotConfig& robot, std::int64_t period_ns) noexcept;

/// What a bus has brought since it was opened.
/// @param bus   an end that hears every frame and sends none
/// @param name  of its interface
/// Errors: frames of a master, with what they are.
[[nodiscard]] Status expect_no_master(Bus& bus, const std::string& name);

/// The same of an EtherCAT interface: slaves say nothing by themselves, so every frame is a
/// master's.
/// @param link  nothing was sent through it
[[nodiscard]] Status expect_silence(ecat::DataLink& link, const std::string& name);

}  // namespace tandem::hal::can
