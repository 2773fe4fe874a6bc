// The lines of `tandem top` above and below its joints, and what its keys change.
#include "apps/clients/top_picture.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "apps/control/fault_table.hpp"
#include "apps/text/columns.hpp"
#include "apps/text/figures.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kMostFaults = 3;
constexpr std::size_t kMostControllers = 6;
constexpr std::size_t kMostFilter = 40;  // characters of a filter

struct TopKey {
  const char* key;
  const char* does;
};
constexpr TopKey kKeys[]{
    {"q", "quit"},
    {"/", "show the joints whose name has what you type; Enter ends that, Esc takes it back"},
    {"s", "sort: robot's order, name, error, velocity, torque, current, winding, age"},
    {"space", "freeze the picture; the robot goes on"},
    {"up, down", "scroll the joints; also page up and page down"},
    {"?", "this help, on and off"},
};
constexpr const char* kLegend[]{
    "The bar lies between a joint's limits: o is where it is, | its reference, # both,",
    "< or > a place beyond a limit. mode: as the drive says, then what was asked for.",
    "lead by: the controller that claims the joint, or `by hand` (tandem joint move).",
    "sample: fresh, or how old; LOST, FAULT, SENSOR: the figures are not the joint's.",
};

std::string micros(const Json& times, const char* key) {
  return fmt::format("{:.3g}", times.value(key, 0.0) * 1e-3);
}

/// "12 p50, 88 p99, 213 max us".
std::string times_text(const Json& times) {
  if (!times.is_object()) return "not measured";
  return fmt::format("{} p50, {} p99, {} max us", micros(times, "p50"), micros(times, "p99"),
                     micros(times, "max"));
}

std::string pace(const Json& clock) {
  const std::string kind = clock.value("clock", "");
  if (clock.value("paused", false) || clock.value("standing", false)) return "PAUSED";
  const double rate = clock.value("rate", 0.0);
  std::string text = kind == "real"  ? "real time"
                     : kind == "bus" ? "time of the bus"
                     : rate > 0.0    ? fmt::format("{:g} x real time", rate)
                                     : "free running";
  const Json measured = clock.value("realtime_factor", Json());
  if (measured.is_number()) text += fmt::format(" (measured {:.3g} x)", measured.get<double>());
  return text;
}

/// Who stands where; the buses on lines of their own where one is not well.
void add_loop(std::vector<TopLine>& lines, const TopLook& look) {
  const Json& loop = look.loop;
  lines.push_back({fmt::format("{}  {}  {:.3f} s  {}", shown(loop.value("robot", "?")),
                               shown(look.clock.value("phase", "?")),
                               look.clock.value("time_s", 0.0), pace(look.clock)),
                   TopStyle::kHead});
  const auto overruns = loop.value("overruns", std::uint64_t{0});
  lines.push_back(
      {fmt::format("cycle of {:g} us: {}, {}", loop.value("period_ns", 0.0) * 1e-3,
                   times_text(loop.value("cycle_ns", Json())), counted(overruns, "overrun"))});
  const Json buses = loop.value("buses", Json::array());
  const Json answers = loop.value("bus_ns", Json());
  std::string bus = "bus: none, " + shown(loop.value("hal", "?"));
  if (!buses.empty()) bus = "bus:";
  std::vector<TopLine> unwell;
  for (const Json& one : buses) {
    const std::string name = shown(one.value("interface", "?"));
    const std::string status = shown(one.value("status", ""), 400);
    bus += fmt::format(" {} {},", name, status.empty() ? "well" : "NOT WELL");
    if (!status.empty()) unwell.push_back({"BUS " + name + ": " + status, TopStyle::kAlarm});
  }
  if (bus.ends_with(',')) bus.pop_back();
  if (answers.is_object()) bus += "; answers after " + times_text(answers);
  lines.push_back({bus});
  lines.insert(lines.end(), unwell.begin(), unwell.end());
}

/// What leads out of the faults that are latched.
std::string way_out(const std::string& phase) {
  if (phase == "faulted") return "remove the cause, then tandem fault reset";
  if (phase == "resetting") return "a reset is under way";
  if (phase == "retreating") return "none yet: the robot is on its way to a safe posture";
  if (phase == "shut-down" || phase == "done") return "the run ends: its log has the rest";
  return "remove the cause, then tandem fault reset, or tandem joint reset JOINT";
}

void add_faults(std::vector<TopLine>& lines, const TopLook& look) {
  const std::string phase = look.faults.value("phase", "");
  std::vector<Json> latched;
  for (const Json& fault : look.faults.value("faults", Json::array())) {
    if (fault.value("latched", false)) latched.push_back(fault);
  }
  for (std::size_t i = 0; i < std::min(latched.size(), kMostFaults); ++i) {
    const std::string where = shown(latched[i].value("joint", ""));
    lines.push_back(
        {fmt::format("FAULT at {:.3f} s: {}{}{} ({})", latched[i].value("time_s", 0.0), where,
                     where.empty() ? "" : ": ", shown(latched[i].value("cause", "?"), 400),
                     shown(latched[i].value("reaction", ""))),
         TopStyle::kAlarm});
  }
  if (latched.size() > kMostFaults) {
    lines.push_back(
        {fmt::format("FAULT: {} more are latched: tandem fault show", latched.size() - kMostFaults),
         TopStyle::kAlarm});
  }
  if (!latched.empty()) lines.push_back({"way out: " + way_out(phase), TopStyle::kHead});
  if (latched.empty() && phase == "held") {
    lines.push_back({"HELD after a reset: tandem controller start", TopStyle::kHead});
  }
}

void add_controllers(std::vector<TopLine>& lines, const TopLook& look) {
  const Json all = look.controllers.value("controllers", Json::array());
  if (all.empty()) lines.push_back({"no controller is loaded"});
  for (std::size_t i = 0; i < std::min(all.size(), kMostControllers); ++i) {
    const Json& one = all[i];
    const bool active = one.value("active", false);
    const auto overruns = one.value("overruns", std::uint64_t{0});
    const Json times = one.value("call_ns", Json());
    lines.push_back({fmt::format("controller {}: {}, {}, {}{}", shown(one.value("name", "?")),
                                 one.value("finished", false) ? "done"
                                 : active                     ? "active"
                                 : one.value("shadow", false) ? "shadow"
                                                              : "STOPPED",
                                 counted(one.value("claims", Json::array()).size(), "joint"),
                                 times.is_object() ? "a call " + times_text(times) : "never called",
                                 overruns == 0 ? "" : ", " + counted(overruns, "overrun")),
                     active ? TopStyle::kPlain : TopStyle::kDim});
  }
  if (all.size() > kMostControllers) {
    lines.push_back(
        {fmt::format("and {} more: tandem controller list", all.size() - kMostControllers)});
  }
}

std::vector<TopLine> help_lines() {
  std::vector<TopLine> lines{{}};
  for (const TopKey& key : kKeys) lines.push_back({fmt::format("  {:9} {}", key.key, key.does)});
  lines.emplace_back();
  for (const char* line : kLegend) lines.push_back({std::string("  ") + line});
  return lines;
}

/// What is shown, and by which keys that changes.
std::string foot(const TopView& view, std::size_t first, std::size_t shown_joints,
                 std::size_t found, std::size_t all) {
  if (view.typing) return "name has: " + view.filter + "_   (Enter ends, Esc takes it back)";
  std::string joints = found == all ? std::to_string(all) : fmt::format("{} of {}", found, all);
  joints += all == 1 ? " joint" : " joints";
  if (shown_joints < found) joints += fmt::format(", {}-{} here", first + 1, first + shown_joints);
  if (!view.filter.empty()) joints += " (/" + view.filter + ")";
  return fmt::format("{}  ? help  q quit  / filter  s sort: {}  space freeze", joints,
                     to_string(view.sort));
}

}  // namespace

const char* to_string(TopSort sort) {
  switch (sort) {
    case TopSort::kRobot: return "robot";
    case TopSort::kName: return "name";
    case TopSort::kError: return "error";
    case TopSort::kVelocity: return "velocity";
    case TopSort::kTorque: return "torque";
    case TopSort::kCurrent: return "current";
    case TopSort::kTemperature: return "winding";
    case TopSort::kAge: return "age";
  }
  return "?";
}

bool TopView::press(std::string_view key) {
  const std::size_t page = height > 12 ? height - 10 : 5;
  const auto up = [&](std::size_t by) { first -= std::min(first, by); };
  if (key == "\x1b[A" || key == "\x1bOA") {
    up(1);
  } else if (key == "\x1b[B" || key == "\x1bOB") {
    first += 1;
  } else if (key == "\x1b[5~") {
    up(page);
  } else if (key == "\x1b[6~") {
    first += page;
  } else if (typing) {
    if (key == "\r" || key == "\n" || key == "\x1b") typing = false;
    if (key == "\x1b") filter.clear();
    if ((key == "\x7f" || key == "\b") && !filter.empty()) filter.pop_back();
    if (key.size() == 1 && key[0] > ' ' && key[0] < '\x7f' && filter.size() < kMostFilter)
      filter += key;
    first = 0;
  } else if (key == "q" || key == "Q") {
    return false;
  } else if (key == "/") {
    typing = true;
  } else if (key == "\x1b") {
    filter.clear();
    help = false;
  } else if (key == "s") {
    sort = static_cast<TopSort>((static_cast<int>(sort) + 1) % kTopSorts);
    first = 0;
  } else if (key == " ") {
    frozen = !frozen;
  } else if (key == "?") {
    help = !help;
  }
  return true;
}

std::vector<TopLine> top_lines(const TopLook& look, const TopView& view) {
  std::vector<TopLine> lines;
  add_loop(lines, look);
  if (view.frozen) lines.push_back({"FROZEN picture: the robot goes on", TopStyle::kHead});
  const bool old = view.old_s >= kTopOld_s;
  if (old) {
    lines.push_back({fmt::format("NO ANSWER for {:.1f} s: what is shown is old", view.old_s),
                     TopStyle::kAlarm});
  }
  add_faults(lines, look);
  add_controllers(lines, look);
  const std::vector<Json> joints = top_joints(look, view);
  const std::size_t all = look.joints.value("joints", Json::array()).size();
  std::size_t first = 0, count = joints.size();
  std::vector<TopLine> body;
  if (view.help) {
    body = help_lines();
  } else {
    body = joint_table(joints, view);
    if (joints.empty()) body = {{"no joint's name has '" + view.filter + "'"}};
  }
  if (view.height > 0) {
    const std::size_t room = view.height - std::min(view.height, lines.size() + 2);
    const std::size_t head = view.help || joints.empty() ? 0 : 1;
    if (head == 1) {
      count = std::min(count, room > head ? room - head : 0);
      first = std::min(view.first, joints.size() - count);
      body.erase(body.begin() + 1, body.begin() + 1 + static_cast<std::ptrdiff_t>(first));
    }
    body.resize(std::min(body.size(), room));
    body.push_back({foot(view, first, count, joints.size(), all), TopStyle::kHead});
  }
  lines.emplace_back();
  lines.insert(lines.end(), body.begin(), body.end());
  if (view.height > 0 && lines.size() > view.height)  // the line about keys stays
    lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(view.height) - 1, lines.end() - 1);
  for (TopLine& line : lines) {
    line.text = cut_to(std::move(line.text), view.width);
    if (old && line.style != TopStyle::kAlarm) line.style = TopStyle::kDim;
  }
  return lines;
}

std::string painted(const TopLine& line, const TopView& view) {
  const bool red = line.style == TopStyle::kAlarm && view.colours;
  const bool bold = line.style == TopStyle::kHead || line.style == TopStyle::kAlarm;
  const bool dim = line.style == TopStyle::kDim;
  if (!view.dims || !(red || bold || dim)) return line.text;
  return fmt::format("\x1b[{}{}m{}\x1b[0m",
                     bold  ? "1"
                     : dim ? "2"
                           : "",
                     red ? ";31" : "", line.text);
}

}  // namespace tandem::apps
