// The joints' table of `tandem top`: its columns shrink to the screen, and the least needed ones
// go.
#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "apps/clients/joint_print.hpp"
#include "apps/clients/top_picture.hpp"
#include "apps/text/columns.hpp"
#include "base/counted.hpp"

namespace tandem::apps {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double top_number(const Json& joint, const char* key) {
  const auto found = joint.find(key);
  return found != joint.end() && found->is_number() ? found->get<double>() : kNone;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// With as many of the decimals as fit.
std::string fitting(double value, int decimals, std::size_t most, const char* suffix = "") {
  if (!std::isfinite(value)) return "-";
  std::string text;
  for (int d = decimals; d >= 0; --d) {
    // No "-0.00": what rounds to zero has no sign.
    const bool zero = std::abs(value) < 0.5 * std::pow(10.0, -d);
    text = fmt::format("{:.{}f}{}", zero ? 0.0 : value, d, suffix);
    if (text.size() <= most) return text;
  }
  return cut_to(fmt::format("{:.0e}{}", value, suffix), most);
}

/// The mode as the drive says, and the one that was asked for where that is another.
std::string mode_in(const Json& joint, std::size_t most) {
  const auto brief = [](const std::string& mode) {
    return mode == "position"    ? std::string("pos")
           : mode == "velocity"  ? "vel"
           : mode == "torque"    ? "torq"
           : mode == "current"   ? "curr"
           : mode == "open_loop" ? "open"
                                 : mode;
  };
  const std::string is = joint.value("mode_in_force", ""), asked = joint.value("mode", "");
  std::string whole = is == asked ? is : is + ", asked " + asked;
  if (columns_of(whole) <= most) return whole;
  return cut_to(is == asked ? brief(is) : brief(is) + "/" + brief(asked), most);
}

std::string lead_of(const Json& joint, std::size_t most) {
  const std::string owner = joint.value("controller", "");
  if (!owner.empty()) return cut_to(shown(owner), most, true);
  return joint.value("moving", false) ? "by hand" : "-";
}

/// What the figures of a joint are worth; a fault of its drive before all else.
std::string sample_in(const Json& joint, std::size_t most) {
  const std::string feedback = joint.value("feedback", "");
  const auto fault = joint.value("fault", 0U);
  const auto age = joint.value("age_cycles", std::uint64_t{0});
  const bool never = !joint.value("position_rad", Json()).is_number();
  std::string whole = "fresh", brief = "fresh";
  if (never) {
    whole = brief = "never";
  } else if (feedback == "lost") {
    whole = fmt::format("LOST, {} old", counted(age, "cycle"));
    brief = "LOST";
  } else if (fault != 0) {
    whole = fmt::format("FAULT 0x{:04X}", fault);
    brief = "FAULT";
  } else if (feedback == "sensor_fault") {
    whole = "SENSOR FAULT";
    brief = "SENSOR";
  } else if (age > 0) {
    whole = fmt::format("{} old", counted(age, "cycle"));
    brief = fmt::format("{} old", age);
  }
  return cut_to(columns_of(whole) <= most ? whole : brief, most);
}

/// Position and reference between the limits: "[--o--|-----]", # where they are in one place. What
/// is beyond a limit is an arrow there.
std::string bar_of(const Json& joint, std::size_t most) {
  const double min = top_number(joint, "min_position_rad");
  const double max = top_number(joint, "max_position_rad");
  if (most < 5) return "";
  if (!(max > min)) return cut_to("no limits", most);
  std::string bar(most - 2, '-');
  const auto place = [&](double value) {
    const double share = std::clamp((value - min) / (max - min), 0.0, 1.0);
    return static_cast<std::size_t>(std::lround(share * static_cast<double>(bar.size() - 1)));
  };
  const double reference = top_number(joint, "commanded_position_rad");
  const double position = top_number(joint, "position_rad");
  if (std::isfinite(reference)) bar[place(reference)] = '|';
  if (std::isfinite(position)) {
    char& at = bar[place(position)];
    at = position < min ? '<' : position > max ? '>' : at == '|' ? '#' : 'o';
  }
  return "[" + bar + "]";
}

/// The unit behind the number of a slide, among joints that turn.
const char* slide_unit(const Json& joint, bool mixed, const char* unit) {
  return mixed && slides(joint) ? unit : "";
}

struct TopColumn {
  std::string head;        ///< where there is room
  std::string brief_head;  ///< where there is not
  std::size_t least;
  std::size_t most;  ///< 0: as its texts need
  int keep;          ///< the least one goes first on a screen that is too narrow
  bool left;
  std::string (*cell)(const Json& joint, std::size_t most, bool mixed);
  std::size_t width = 0;
};

std::vector<TopColumn> columns_for(const std::vector<Json>& joints, bool mixed) {
  const bool slide = !joints.empty() && slides(joints.front());
  const std::string rad = mixed ? "" : slide ? "m" : "rad";
  const std::string torque = mixed ? "" : slide ? "N" : "Nm";
  const auto with = [](const std::string& name, const std::string& unit) {
    return unit.empty() ? name : name + " [" + unit + "]";
  };
  const std::string speed = rad.empty() ? "" : rad + "/s";
  const std::string behind = rad.empty() ? "" : " " + rad;
  using Text = std::string;
  return {
      {"joint", "joint", 8, 0, 10, true,
       [](const Json& j, std::size_t most, bool) -> Text {
         return cut_to(shown(j.value("joint", "")), most, true);
       }},
      {"lead by", "lead", 6, 0, 6, true,
       [](const Json& j, std::size_t most, bool) -> Text { return lead_of(j, most); }},
      {"mode", "mode", 8, 0, 5, true,
       [](const Json& j, std::size_t most, bool) -> Text { return mode_in(j, most); }},
      {with("position", rad), "pos" + behind, 7, 0, 9, false,
       [](const Json& j, std::size_t most, bool mix) -> Text {
         return fitting(top_number(j, "position_rad"), 3, most, slide_unit(j, mix, "m"));
       }},
      {with("reference", rad), "ref" + behind, 7, 0, 7, false,
       [](const Json& j, std::size_t most, bool mix) -> Text {
         return fitting(top_number(j, "commanded_position_rad"), 3, most, slide_unit(j, mix, "m"));
       }},
      {"o is, | should be", "limits", 8, 24, 4, true,
       [](const Json& j, std::size_t most, bool) -> Text {
         return bar_of(j, std::min<std::size_t>(most, 24));
       }},
      {with("velocity", speed), mixed ? "vel" : speed, 6, 0, 3, false,
       [](const Json& j, std::size_t most, bool mix) -> Text {
         return fitting(top_number(j, "velocity_rad_s"), 2, most, slide_unit(j, mix, "m/s"));
       }},
      {with("torque", torque), mixed ? "torque" : torque, 6, 0, 8, false,
       [](const Json& j, std::size_t most, bool mix) -> Text {
         return fitting(top_number(j, "torque_Nm"), 2, most, slide_unit(j, mix, "N"));
       }},
      {"current [A]", "A", 5, 0, 2, false,
       [](const Json& j, std::size_t most, bool) -> Text {
         return fitting(top_number(j, "current_A"), 2, most);
       }},
      {"winding [C]", "C", 3, 0, 1, false,
       [](const Json& j, std::size_t most, bool) -> Text {
         return fitting(top_number(j, "temperature_C"), 0, most);
       }},
      {"sample", "sample", 6, 0, 11, true,
       [](const Json& j, std::size_t most, bool) -> Text { return sample_in(j, most); }},
  };
}

/// Gives each column its width, and leaves out those for which there is no room.
void lay_out(std::vector<TopColumn>& columns, const std::vector<Json>& joints, bool mixed,
             std::size_t width) {
  const auto needed = [&] {
    std::size_t sum = columns.size() - 1;
    for (const TopColumn& one : columns) sum += one.least;
    return sum;
  };
  while (columns.size() > 2 && needed() > width)
    columns.erase(std::ranges::min_element(columns, {}, &TopColumn::keep));
  std::size_t left = width - std::min(width, needed());
  for (TopColumn& one : columns) one.width = one.least;
  std::vector<TopColumn*> by_need;
  for (TopColumn& one : columns) by_need.push_back(&one);
  std::ranges::stable_sort(by_need, std::greater<>(), &TopColumn::keep);
  for (TopColumn* one : by_need) {  // texts and numbers first
    std::size_t most = one->least;
    for (const Json& joint : joints)
      most = std::max(most, columns_of(one->cell(joint, TopView::kAnyWidth, mixed)));
    const std::size_t more = std::min(left, (one->most > 0 ? one->most : most) - one->least);
    one->width += more;
    left -= more;
  }
  for (TopColumn* one : by_need) {  // then the headings
    const std::size_t head = columns_of(one->head);
    if (head <= one->width || head - one->width > left) continue;
    left -= head - one->width;
    one->width = head;
  }
}

std::string aligned(const std::string& text, std::size_t width, bool left) {
  const std::string blanks(width - std::min(width, columns_of(text)), ' ');
  return left ? text + blanks : blanks + text;
}

bool is_stale(const Json& joint) {
  return joint.value("feedback", "fresh") != "fresh" ||
         !joint.value("position_rad", Json()).is_number();
}

double sort_value(const Json& joint, TopSort sort) {
  switch (sort) {
    case TopSort::kRobot:
    case TopSort::kName: return 0.0;
    case TopSort::kError:
      return top_number(joint, "position_rad") - top_number(joint, "commanded_position_rad");
    case TopSort::kVelocity: return top_number(joint, "velocity_rad_s");
    case TopSort::kTorque: return top_number(joint, "torque_Nm");
    case TopSort::kCurrent: return top_number(joint, "current_A");
    case TopSort::kTemperature: return top_number(joint, "temperature_C");
    case TopSort::kAge: return top_number(joint, "age_cycles");
  }
  return 0.0;
}

}  // namespace

std::vector<Json> top_joints(const TopLook& look, const TopView& view) {
  std::vector<Json> joints;
  const std::string part = lower(view.filter);
  for (const Json& joint : look.joints.value("joints", Json::array())) {
    if (lower(joint.value("joint", "")).find(part) != std::string::npos) joints.push_back(joint);
  }
  if (view.sort == TopSort::kRobot) return joints;
  std::ranges::stable_sort(joints, [&](const Json& a, const Json& b) {
    if (view.sort == TopSort::kName) return a.value("joint", "") < b.value("joint", "");
    const auto size = [&](const Json& joint) {
      const double value = std::abs(sort_value(joint, view.sort));
      return std::isfinite(value) ? value : -1.0;  // what is not measured comes last
    };
    return size(a) > size(b);
  });
  return joints;
}

std::vector<TopLine> joint_table(const std::vector<Json>& joints, const TopView& view) {
  const bool mixed = std::ranges::any_of(
      joints, [&](const Json& one) { return slides(one) != slides(joints.front()); });
  std::vector<TopColumn> columns = columns_for(joints, mixed);
  lay_out(columns, joints, mixed, view.width);
  std::vector<TopLine> lines(1);
  lines.front().style = TopStyle::kHead;
  const auto add = [&](std::string& line, const TopColumn& column, const std::string& text) {
    if (&column != &columns.front()) line += ' ';
    line += aligned(text, column.width, column.left);
  };
  for (const TopColumn& one : columns) {
    const bool whole = columns_of(one.head) <= one.width;
    add(lines.front().text, one, cut_to(whole ? one.head : one.brief_head, one.width));
  }
  for (const Json& joint : joints) {
    TopLine line;
    for (const TopColumn& one : columns) add(line.text, one, one.cell(joint, one.width, mixed));
    if (is_stale(joint)) line.style = TopStyle::kDim;
    if (joint.value("fault", 0U) != 0) line.style = TopStyle::kAlarm;
    lines.push_back(std::move(line));
  }
  for (TopLine& line : lines) {
    line.text.erase(line.text.find_last_not_of(' ') + 1);
    line.text = cut_to(line.text, view.width);
  }
  return lines;
}

}  // namespace tandem::apps
