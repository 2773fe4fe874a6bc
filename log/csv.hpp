// A topic of a log as comma-separated values, for spreadsheets and scripts.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <iosfwd>
#include <span>
#include <string>

#include "log/log_file.hpp"

namespace tandem::log {

/// One line of names, then one line per message: `time_s`, then every number of the topic with
/// as many digits as reading it back exactly needs. Joint fields carry the joint's name
/// ("position_rad.LHipMot"), the field `sensor` its sensor's name and channel.
/// Events are written as time_s,cycle,kind,joint,code,text.
/// @param every   1: each message; n: every n-th.
/// @param fields  the fields to write, in the layout's order; empty: all. An unknown one is an
///                error that suggests the nearest. Events have all of theirs.
[[nodiscard]] Status write_csv(const LogFile& log, const std::string& topic, std::size_t every,
                               std::ostream& out, std::span<const std::string> fields = {});

}  // namespace tandem::log
