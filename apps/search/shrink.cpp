#include "apps/search/shrink.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace tandem::apps {
namespace {

/// Remembers what did not fail: ddmin and the turns come to the same candidates again.
class Asker {
 public:
  explicit Asker(const FirstFailing& first_failing) : first_failing_(first_failing) {}

  /// Takes the first candidate that fails for `rows`. @return whether there is one
  bool take_first(std::vector<ScenarioRows> candidates, ScenarioRows& rows) {
    std::erase_if(candidates, [&](const ScenarioRows& one) { return known_.contains(text(one)); });
    if (candidates.empty()) return false;
    const auto first = first_failing_(candidates);
    for (std::size_t i = 0; i < first.value_or(candidates.size()); ++i)
      known_.insert(text(candidates[i]));
    if (first) rows = candidates[*first];
    return first.has_value();
  }

 private:
  static std::string text(const ScenarioRows& rows) {
    std::string all;
    for (const ScenarioRow& row : rows) all += std::to_string(row.place) + '\n' + row.text + '\n';
    return all;
  }

  const FirstFailing& first_failing_;
  std::set<std::string> known_;
};

/// Each of `parts` parts of about the same size by itself, then all but each.
std::vector<ScenarioRows> parts_of(const ScenarioRows& rows, std::size_t parts) {
  std::vector<ScenarioRows> each, without;
  for (std::size_t part = 0; part < parts; ++part) {
    const auto from = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() * part / parts);
    const auto to = rows.begin() + static_cast<std::ptrdiff_t>(rows.size() * (part + 1) / parts);
    each.emplace_back(from, to);
    without.emplace_back(rows.begin(), from);
    without.back().insert(without.back().end(), to, rows.end());
  }
  if (parts > 2) each.insert(each.end(), without.begin(), without.end());
  return each;
}

void leave_out(ScenarioRows& rows, Asker& asker) {
  if (rows.empty() || asker.take_first({{}}, rows)) return;
  std::size_t parts = 2;
  while (rows.size() >= 2) {
    const std::size_t before = rows.size();
    if (asker.take_first(parts_of(rows, parts), rows)) {
      // A part by itself is divided anew; of all but one, the parts stay as large as they were.
      const bool part = rows.size() <= (before + parts - 1) / parts;
      parts = part ? 2 : std::max<std::size_t>(parts - 1, 2);
      parts = std::min(parts, std::max<std::size_t>(rows.size(), 2));
    } else if (parts < rows.size()) {
      parts = std::min(rows.size(), 2 * parts);
    } else {
      return;
    }
  }
}

void make_simpler(ScenarioRows& rows, Asker& asker) {
  for (std::size_t row = 0; row < rows.size(); ++row) {
    for (const std::string& key : keys_of_row(rows[row].text)) {
      bool simpler = true;
      while (simpler) {
        std::vector<ScenarioRows> candidates;
        for (std::string& text : simpler_rows(rows[row].text, key)) {
          candidates.push_back(rows);
          candidates.back()[row].text = std::move(text);
        }
        simpler = asker.take_first(std::move(candidates), rows);
      }
    }
  }
}

}  // namespace

ScenarioRows shrunk(const ScenarioRows& rows, const FirstFailing& first_failing) {
  Asker asker(first_failing);
  ScenarioRows now = rows;
  for (ScenarioRows before; now != before;) {
    before = now;
    leave_out(now, asker);
    make_simpler(now, asker);
  }
  return now;
}

}  // namespace tandem::apps
