#include "runtime/expectation_rows.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

namespace tandem::runtime {
namespace {

/// A row as its keys are; one of the first says what is expected.
struct ExpectationKeys {
  std::string always, never, eventually, bounds, rms, mean, final_value, work, settles, as_in;
  bool stays_up = false;
  std::string name, above, below, after, signal, within;
  double in_s = 0.0, from_s = 0.0, to_s = std::numeric_limits<double>::infinity();
};

using Keys = ExpectationKeys;
// A key a line.
// clang-format off
constexpr Key<Keys> kExpect[] = {
  key<&Keys::name>("name", "of the expectation; unique").by_default("what is expected"),
  key<&Keys::always>("always", "a [condition](expectations.md#conditions) that holds in every cycle of the window").by_default("–"),
  key<&Keys::never>("never", "one that holds in none").by_default("–"),
  key<&Keys::eventually>("eventually", "one that holds in at least one").by_default("–"),
  key<&Keys::stays_up>("stays_up", "short for `always = \"tilt() < 60deg and not fault(fell)\"`"),
  key<&Keys::bounds>("bounds", "a number, such as `\"height()\"`, that is within `above` and `below` in every cycle").by_default("–"),
  key<&Keys::rms>("rms", "a number whose root mean square is").by_default("–"),
  key<&Keys::mean>("mean", "a number whose mean is").by_default("–"),
  key<&Keys::final_value>("final", "a number that is, in the last cycle of the window").by_default("–"),
  key<&Keys::work>("work", "a joint, or `\"*\"` for all of them: the work that drives did, in J, is; what they took back while they braked does not count").by_default("–"),
  key<&Keys::settles>("settles", "a number that is, from `in_s` on to the end of the window").by_default("–"),
  key<&Keys::as_in>("as_in", "a log whose run has the same `signal`, `within` a difference, at each time").within("path, from this file's folder").by_default("–"),
  key<&Keys::signal>("signal", "with `as_in`: a number; `*` in it stands for each joint in turn, as in `\"position(*)\"`").by_default("–"),
  key<&Keys::within>("within", "with `as_in`: the largest difference, with its unit: `\"1mrad\"`").by_default("–"),
  key<&Keys::above>("above", "with a number: its lower bound, with its unit: `\"0.4m\"`").by_default("none"),
  key<&Keys::below>("below", "its upper bound").by_default("none"),
  key<&Keys::in_s>("in_s", {0.0, 1e6}, "with `settles`: how long it may take"),
  key<&Keys::from_s>("from_s", {0.0, 1e6}, "the window's begin, since the controllers start, or since `after`"),
  key<&Keys::to_s>("to_s", {0.0, 1e6}, "its end; it has to be reached").by_default("the run's end"),
  key<&Keys::after>("after", "a condition: the times count from the first cycle in which it holds").by_default("the controllers' start"),
};
// clang-format on

/// A key that says what is expected.
struct KindRow {
  std::string_view key;
  ExpectationKind kind;
  std::string Keys::*text;
};
constexpr KindRow kKinds[] = {{"always", ExpectationKind::kAlways, &Keys::always},
                              {"never", ExpectationKind::kNever, &Keys::never},
                              {"eventually", ExpectationKind::kEventually, &Keys::eventually},
                              {"bounds", ExpectationKind::kBounds, &Keys::bounds},
                              {"rms", ExpectationKind::kRms, &Keys::rms},
                              {"mean", ExpectationKind::kMean, &Keys::mean},
                              {"final", ExpectationKind::kFinal, &Keys::final_value},
                              {"work", ExpectationKind::kWork, &Keys::work},
                              {"settles", ExpectationKind::kSettles, &Keys::settles},
                              {"as_in", ExpectationKind::kAsIn, &Keys::as_in}};

constexpr char kOneOf[] =
    "give one of always, never, eventually, stays_up, bounds, rms, mean, final, work, "
    "settles, as_in";

/// Which of them the row has. None, or several, are errors.
void read_kind(TomlTable& table, const Keys& row, ExpectationSpec& spec) {
  std::string first;
  const auto found = [&](std::string_view key, ExpectationKind kind, const std::string& text) {
    if (!first.empty()) {
      table.error(key, "the row has " + first + " already",
                  "write a row [[expect]] for each of them");
      return;
    }
    first = key;
    spec.kind = kind;
    spec.text = text;
    spec.line = table.line(key);
    if (text.empty() && table.is_text(key))
      table.error(key, "is empty", "write a condition, or a number of the run");
  };
  for (const KindRow& one : kKinds)
    if (table.has(one.key)) found(one.key, one.kind, row.*one.text);
  spec.stays_up = row.stays_up;
  if (row.stays_up)
    found("stays_up", ExpectationKind::kAlways, "tilt() < 60deg and not fault(fell)");
  if (first.empty() && !table.has_errors()) table.error("", "expects nothing", kOneOf);
}

/// What compares with a log: the row's text is the signal.
void check_recorded(TomlTable& table, const Keys& row, ExpectationSpec& spec) {
  const bool recorded = spec.kind == ExpectationKind::kAsIn;
  for (const auto& [key, value] : {std::pair{"signal", &row.signal}, {"within", &row.within}}) {
    if (recorded && value->empty() && !table.has_errors())
      table.error(table.has(key) ? key : "as_in",
                  std::string("does not say ") +
                      (value == &row.signal ? "what is compared" : "how far it may differ"),
                  value == &row.signal ? "add signal = \"position(JOINT)\", for one"
                                       : "add within = \"1mrad\", for one");
    if (!recorded && table.has(key))
      table.error(key, "is of no use without `as_in`", "leave it out, or name a log");
  }
  if (!recorded) return;
  spec.log = (std::filesystem::path(table.folder()) / row.as_in).lexically_normal().string();
  spec.text = row.signal;
  spec.line = table.line("signal");
  spec.within = row.within;
  spec.within_line = table.line("within");
}

void check_bounds(TomlTable& table, const ExpectationSpec& row) {
  const bool number = row.kind >= ExpectationKind::kBounds && row.kind != ExpectationKind::kAsIn;
  for (const char* bound : {"above", "below"}) {
    if (!number && table.has(bound))
      table.error(bound,
                  row.kind == ExpectationKind::kAsIn ? "is of no use beside `as_in`"
                                                     : "is of no use beside a condition",
                  row.kind == ExpectationKind::kAsIn
                      ? "give `within`"
                      : "write the bound into the condition, or use `bounds`");
  }
  if (number && row.above.empty() && row.below.empty() && !table.has_errors())
    table.error("", "has no bound", "give `above`, `below` or both, such as below = \"0.01rad\"");
  const bool settles = row.kind == ExpectationKind::kSettles;
  if (table.has("in_s") && !settles)
    table.error("in_s", "is of no use without `settles`", "use from_s and to_s for a window");
  if (settles && !table.has("in_s"))
    table.error("settles", "does not say how long it may take", "add in_s = 0.5, for one");
  if (row.to_s <= row.from_s)
    table.error("to_s", "the window ends before it begins", "give a to_s that is more than from_s");
  if (settles && row.to_s - row.from_s < row.in_s)
    table.error("in_s", "is longer than the window", "give a later to_s, or none");
}

/// What it is called without a name: "rms of torque(j)", "never fault(any)".
std::string name_of(const ExpectationSpec& spec) {
  if (spec.stays_up) return "stays up";
  if (spec.kind == ExpectationKind::kAlways || spec.kind == ExpectationKind::kBounds)
    return spec.text;
  if (spec.kind == ExpectationKind::kAsIn)
    return spec.text + " as in " + std::filesystem::path(spec.log).filename().string();
  const auto* row = std::ranges::find(kKinds, spec.kind, &KindRow::kind);
  const bool number = spec.kind > ExpectationKind::kBounds;
  return std::string(row->key) + (number ? " of " : " ") + spec.text;
}

}  // namespace

std::vector<ExpectationSpec> read_expectations(TomlTable& root) {
  std::vector<ExpectationSpec> all;
  for (TomlTable& table : root.tables("expect")) {
    Keys row;
    read_keys(table, kExpect, row);
    ExpectationSpec spec{.name = row.name,
                         .text = {},
                         .above = row.above,
                         .below = row.below,
                         .in_s = row.in_s,
                         .log = {},
                         .within = row.within,
                         .from_s = row.from_s,
                         .to_s = row.to_s,
                         .after = row.after,
                         .above_line = table.line("above"),
                         .below_line = table.line("below"),
                         .after_line = table.line("after")};
    read_kind(table, row, spec);
    check_recorded(table, row, spec);
    check_bounds(table, spec);
    if (spec.name.empty()) spec.name = name_of(spec);
    if (std::ranges::find(all, spec.name, &ExpectationSpec::name) != all.end() &&
        !table.has_errors()) {
      table.error(table.has("name") ? "name" : "",
                  "two expectations are called '" + spec.name + "'",
                  "give this one a `name` of its own");
    }
    if (all.size() == kMostExpectations)
      table.error("", "is one expectation too many", "split the experiment");
    table.finish();
    if (all.size() < kMostExpectations) all.push_back(std::move(spec));
  }
  return all;
}

void describe_expectations(KeyPage& page) { page.add("[[expect]]", kExpect); }

}  // namespace tandem::runtime
