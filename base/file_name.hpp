// Which names may be part of a file's or a topic's name, name a network interface, or be shown.
// Layer: base.  Thread: non-RT only.
#pragma once

#include <string>
#include <string_view>

namespace tandem {

/// The most characters of such a name: with what is added to it, it stays a file name anywhere.
inline constexpr std::size_t kLongestFileName = 64;

/// Why `name` cannot be part of a file's name, or empty when it can: letters, digits, `_`, `-`
/// and `.` of ASCII, no `.` or `-` at the front, 1 to kLongestFileName characters. So it leads
/// to no other folder, hides no file and is no program's option.
[[nodiscard]] std::string file_name_problem(std::string_view name);

/// Why `name` cannot be part of a ROS 2 topic's name, or empty when it can: letters, digits and `_`
/// of ASCII, no digit at the front, 1 to kLongestFileName characters.
[[nodiscard]] std::string topic_name_problem(std::string_view name);

/// Why `name` cannot be shown to people, or empty when it can: 1 to kLongestFileName bytes of UTF-8
/// without control characters, which a terminal obeys.
[[nodiscard]] std::string shown_name_problem(std::string_view name);

/// Why no network interface of Linux can have the name, or empty when one can: 1 to 15 characters,
/// none of them a blank, `/` or `:`, and neither `.` nor `..`.
[[nodiscard]] std::string interface_name_problem(std::string_view name);

/// The nearest name that can: what is neither letter nor digit becomes `_`, and a digit at the
/// front has one before it. Names that differ may have the same one: who makes topics of them has
/// to ask.
[[nodiscard]] std::string topic_token(std::string_view name);

/// What to write in place of a name that topic_name_problem() refuses.
[[nodiscard]] std::string topic_name_hint(std::string_view name);

}  // namespace tandem
