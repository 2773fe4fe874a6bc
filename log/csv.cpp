// Streams a log once; numbers are written with the fewest digits that read back the same.
#include "log/csv.hpp"

#include <algorithm>
#include <charconv>
#include <ostream>

#include "base/nearest.hpp"
#include "base/quoting.hpp"
#include "log/schema.hpp"
#include "log/signal_name.hpp"
#include "log/unmeasured.hpp"

namespace tandem::log {
namespace {

void append_number(std::string& line, double value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  line.append(digits, end);
}

/// A text of others as one cell of one line.
std::string cell(const std::string& text) {
  std::string out = shown(text, text.size());
  for (auto at = out.find('"'); at != std::string::npos; at = out.find('"', at + 2))
    out.insert(at, 1, '"');
  return "\"" + out + "\"";
}
/// The same of a name, which has no quotes where it needs none.
std::string name_cell(const std::string& name) {
  const bool plain = name.find_first_of(",\"\n\r") == std::string::npos;
  return plain ? name : cell(name);
}

/// Seconds, all of their nanoseconds and no more: 0.217.
void append_time(std::string& line, std::int64_t time_ns) {
  constexpr std::uint64_t kSecond_ns = 1'000'000'000;
  const auto size =
      time_ns < 0 ? 0 - static_cast<std::uint64_t>(time_ns) : static_cast<std::uint64_t>(time_ns);
  std::string part = std::to_string(kSecond_ns + size % kSecond_ns);  // a 1, and nine digits
  part.front() = '.';
  while (part.back() == '0') part.pop_back();
  if (part == ".") part.clear();
  line += (time_ns < 0 ? "-" : "") + std::to_string(size / kSecond_ns) + part;
}

Status write_events(const LogFile& log, std::ostream& out) {
  const auto events = log.events();
  if (!events) return std::unexpected(events.error());
  out << "time_s,cycle,kind,joint,code,text\n";
  for (const auto& [event, text] : *events) {
    std::string time;
    append_time(time, event.time_ns);
    out << time << ',' << event.cycle << ',' << to_string(event.kind) << ',' << event.joint << ','
        << event.code << ',' << cell(text) << "\n";
  }
  return {};
}

/// The topic's fields that `names` asks for; all when it asks for none.
Result<std::vector<const hal::Field*>> choose(const LogFile& log, const LoggedTopic* topic,
                                              std::span<const std::string> names) {
  std::vector<const hal::Field*> chosen;
  if (topic == nullptr) return chosen;  // for_each() says so
  std::vector<std::string> known;
  for (const hal::Field& field : topic->layout.fields()) {
    known.push_back(field.name);
    if (names.empty() || std::ranges::find(names, field.name) != names.end()) {
      chosen.push_back(&field);
    }
  }
  for (const std::string& name : names) {
    if (std::ranges::find(known, name) != known.end()) continue;
    const std::string why = log.left_out(topic->name, name);
    return fail("the topic '" + topic->name + "' has no field '" + name + "'" +
                    (why.empty() ? "" : ": " + why),
                why.empty() ? suggest(name, known) : "");
  }
  return chosen;
}

std::string header(const std::vector<const hal::Field*>& fields, const RunInfo& info) {
  std::string line = "time_s";
  for (const hal::Field* field : fields) {
    for (std::size_t i = 0; i < field->count; ++i)
      line += "," + name_cell(signal_name(*field, i, info));
  }
  return line;
}

}  // namespace

Status write_csv(const LogFile& log, const std::string& topic, std::size_t every, std::ostream& out,
                 std::span<const std::string> fields) {
  if (topic == "/tandem/event") return write_events(log, out);
  const LoggedTopic* found = log.find(topic);
  if (found != nullptr && found->layout.fields().empty()) {
    return fail("the messages of '" + topic + "' are no numbers of a fixed count",
                "take another topic, /tandem/state for one, or a ROS viewer");
  }
  const auto chosen = choose(log, found, fields);
  if (!chosen) return std::unexpected(chosen.error());
  if (found != nullptr) out << header(*chosen, log.info()) << "\n";
  Result<Unmeasured> unknown = found == nullptr ? Unmeasured() : Unmeasured::of(log, *found);
  if (!unknown) return std::unexpected(unknown.error());
  std::string line;
  std::size_t count = 0;
  bool begun = false;  // rows before the first measurement are left out
  Status done = log.for_each(topic, [&](std::int64_t time_ns, std::span<const std::byte> body) {
    if (count++ % every != 0) return;
    line.clear();
    append_time(line, time_ns);
    bool measures = false, measured = false;
    for (const hal::Field* field : *chosen) {
      const auto number = static_cast<std::size_t>(field - found->layout.fields().data());
      const bool tells = unknown->tells(number);
      for (std::size_t i = 0; i < field->count; ++i) {
        line += ',';
        const bool unmeasured = tells && unknown->is(number, i, body);
        if (!unmeasured) append_number(line, element(*field, body, i));
        measures |= tells;
        measured |= tells && !unmeasured;
      }
    }
    begun |= measured || !measures;
    if (begun) out << line << "\n";
  });
  if (!done) return done;
  out.flush();
  if (!out) return fail("writing the CSV failed", "check the space on the disk");
  return {};
}

}  // namespace tandem::log
