#include "log/import/csv_rows.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "base/bounds.hpp"
#include "base/quoting.hpp"

namespace tandem::log {
namespace {

constexpr std::string_view kBlanks = " \t\r";

std::string_view bare(std::string_view cell) {
  const auto begin = cell.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  cell = cell.substr(begin, cell.find_last_not_of(kBlanks) - begin + 1);
  const bool quoted = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return quoted ? cell.substr(1, cell.size() - 2) : cell;
}

/// The whole text as a number, whatever the locale is.
template <class T>
std::optional<T> whole_number(std::string_view digits) {
  if (digits.starts_with('+')) digits.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) return std::numeric_limits<T>::quiet_NaN();
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

/// Takes digits and signs off the front of a text; the first thing that does not fit sticks.
class DateReader {
 public:
  explicit DateReader(std::string_view text) : rest_(text) {}

  /// Exactly so many digits.
  int number(std::size_t digits) {
    int value = 0;
    const bool all = rest_.size() >= digits && rest_.substr(0, digits).find_first_not_of(
                                                   "0123456789") == std::string_view::npos;
    good = good && all;
    if (!good) return 0;
    (void)std::from_chars(rest_.data(), rest_.data() + digits, value);
    rest_.remove_prefix(digits);
    return value;
  }
  int one_or_two() {
    const bool two = rest_.size() > 1 && rest_[1] >= '0' && rest_[1] <= '9';
    return number(two ? 2 : 1);
  }
  /// One of these characters. @return 0: none of them is next
  char any(std::string_view of) {
    if (rest_.empty() || of.find(rest_.front()) == std::string_view::npos) return '\0';
    const char found = rest_.front();
    rest_.remove_prefix(1);
    return found;
  }
  void need(std::string_view of) { good = good && any(of) != '\0'; }
  /// The digits of a fraction of a second [ns].
  std::int64_t fraction_ns() {
    std::int64_t value_ns = 0, digit_ns = 100'000'000;
    for (char c = any("0123456789"); c != '\0'; c = any("0123456789"), digit_ns /= 10)
      value_ns += (c - '0') * digit_ns;
    return value_ns;
  }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }

  bool good = true;

 private:
  std::string_view rest_;
};

/// A date in the basic form of ISO 8601, 20261126T220212.5Z, in its usual one, and Z for UTC and
/// GMT at the end; any other text as it is.
std::string usual_form(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789";
  std::string out(text);
  if (out.ends_with("UTC") || out.ends_with("GMT")) out.replace(out.size() - 3, 3, "Z");
  const auto digits = [&](std::size_t from) {
    return std::min(out.find_first_not_of(kDigits, from), out.size()) - from;
  };
  const bool date = digits(0) == 8 && out.size() > 9 && std::string_view("Tt ").contains(out[8]);
  if (!date || (digits(9) != 4 && digits(9) != 6)) return out;
  if (digits(9) == 6) out.insert(13, ":");
  return out.insert(11, ":").insert(6, "-").insert(4, "-");
}

}  // namespace

std::optional<std::int64_t> date_time_ns(std::string_view text) {
  using namespace std::chrono;
  DateReader in(text);
  const bool day_first = text.substr(0, 3).find('.') != std::string_view::npos;
  const std::string_view between = day_first ? "." : "-/";
  const int first = day_first ? in.one_or_two() : in.number(4);
  in.need(between);
  const int m = day_first ? in.one_or_two() : in.number(2);
  in.need(between);
  const int last = in.number(day_first ? 4 : 2);
  const int y = day_first ? last : first, d = day_first ? first : last;
  in.need("T t");
  const int hour = in.number(2);
  in.need(":");
  const int minute = in.number(2);
  const int second = in.any(":") != '\0' ? in.number(2) : 0;
  const std::int64_t rest_ns = in.any(".,") != '\0' ? in.fraction_ns() : 0;
  (void)in.any(" ");
  minutes east{0};
  if (in.any("Zz") == '\0') {
    if (const char sign = in.any("+-"); sign != '\0') {
      const int of_hour = in.number(2) * 60;
      const bool more = in.any(":") != '\0' || !in.at_end();
      east = minutes((sign == '-' ? -1 : 1) * (of_hour + (more ? in.number(2) : 0)));
    }
  }
  const year_month_day date{year(y), month(static_cast<unsigned>(m)),
                            day(static_cast<unsigned>(d))};
  const bool clock = hour < 24 && minute < 60 && second <= 60;  // 60: a leap second
  if (!in.good || !in.at_end() || !date.ok() || !clock || y < 1700 || y > 2250) return std::nullopt;
  const auto since =
      sys_days(date).time_since_epoch() + hours(hour) + minutes(minute) - east + seconds(second);
  return duration_cast<nanoseconds>(since).count() + rest_ns;
}

bool is_ambiguous_date(std::string_view text) {
  const auto digits = [&text](std::size_t most) {
    std::size_t count = 0;
    while (count < most && count < text.size() && text[count] >= '0' && text[count] <= '9') ++count;
    text.remove_prefix(count);
    return count;
  };
  const auto slash = [&text] {
    const bool there = text.starts_with('/');
    if (there) text.remove_prefix(1);
    return there;
  };
  return digits(2) > 0 && slash() && digits(2) > 0 && slash() && digits(4) == 4;
}

Result<CsvRows> CsvRows::open(std::string_view text, const std::string& file,
                              const CsvFormat& format) {
  CsvRows rows;
  rows.format_ = format;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  rows.rest_ = text;
  const auto refuse = [&](std::string message, std::string hint) {
    return std::unexpected(Error{std::move(message), std::move(hint), file, rows.line_, {}});
  };
  for (int i = 0; i < format.skip_lines; ++i) {
    const auto end = rows.rest_.find('\n');
    rows.rest_.remove_prefix(
        std::min(end == std::string_view::npos ? end : end + 1, rows.rest_.size()));
    ++rows.line_;
  }
  if (!rows.next_line()) return refuse("has no rows", "is this the whole file?");
  rows.split(rows.text_line_);
  if (!rows.cells_.empty() && rows.cells_.back().empty()) rows.cells_.pop_back();
  if (rows.cells_.size() > bounds::kCsvColumns.most)
    return std::unexpected(beyond(bounds::kCsvColumns, file, rows.line_));
  for (std::size_t i = 0; i < rows.cells_.size(); ++i) {
    std::string name = format.header ? std::string(rows.cells_[i]) : "c" + std::to_string(i + 1);
    if (name.empty()) {
      return refuse("column " + std::to_string(i + 1) + " of the header has no name",
                    "say [csv] header = false when the file has none, or skip_lines");
    }
    if (std::ranges::find(rows.names_, name) != rows.names_.end()) {
      return refuse("the header has two columns '" + name + "'",
                    "say [csv] header = false when the file has none, or rename one");
    }
    rows.names_.push_back(std::move(name));
  }
  rows.pending_ = !format.header;
  return rows;
}

bool CsvRows::next_line() {
  while (!rest_.empty()) {
    const auto end = std::min(rest_.find('\n'), rest_.size());
    text_line_ = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++line_;
    const auto first = text_line_.find_first_not_of(kBlanks);
    if (first == std::string_view::npos) continue;
    if (format_.comment != '\0' && text_line_[first] == format_.comment) continue;
    return true;
  }
  return false;
}

void CsvRows::split(std::string_view line) {
  cells_.clear();
  if (format_.delimiter == ' ') {
    for (auto at = line.find_first_not_of(kBlanks); at != std::string_view::npos;
         at = line.find_first_not_of(kBlanks, at)) {
      const auto end = std::min(line.find_first_of(kBlanks, at), line.size());
      cells_.push_back(bare(line.substr(at, end - at)));
      at = end;
    }
    return;
  }
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] != format_.delimiter || quoted) continue;
    cells_.push_back(bare(line.substr(begin, i - begin)));
    begin = i + 1;
  }
  cells_.push_back(bare(line.substr(begin)));
}

bool CsvRows::next() {
  if (std::exchange(pending_, false)) return true;
  if (!next_line()) return false;
  split(text_line_);
  if (cells_.size() == names_.size() + 1 && cells_.back().empty()) cells_.pop_back();
  return true;
}

std::string CsvRows::digits_of(std::size_t column) const {
  std::string digits(cells_[column]);
  if (format_.decimal_comma) std::ranges::replace(digits, ',', '.');
  return digits;
}

std::optional<double> CsvRows::number(std::size_t column) const {
  if (cells_[column].empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto value = whole_number<double>(digits_of(column));
  if (value && !std::isfinite(*value)) return std::numeric_limits<double>::quiet_NaN();
  return value;
}

std::optional<std::int64_t> CsvRows::time_ns(std::size_t column, std::int64_t unit_ns) const {
  if (unit_ns == 0) return date_time_ns(usual_form(cells_[column]));
  const auto value = whole_number<long double>(digits_of(column));
  constexpr long double kMost = 9.2e18L;
  if (!value) return std::nullopt;
  const long double ns = *value * static_cast<long double>(unit_ns);
  if (!(std::abs(ns) < kMost)) return std::nullopt;
  return std::llround(ns);
}

std::optional<Error> refused_time(std::string_view cell) {
  const auto digits = [&](std::size_t from) {
    return std::min(cell.find_first_not_of("0123456789", from), cell.size()) - from;
  };
  const auto refuse = [&](const std::string& what, std::string hint) {
    return Error{"'" + shown(cell) + "' " + what, std::move(hint), {}, 0, {}};
  };
  const std::size_t colon = cell.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  std::size_t word = cell.size();
  while (word > 0 && std::isalpha(static_cast<unsigned char>(cell[word - 1])) != 0) --word;
  const std::string zone(cell.substr(word));
  if (zone == "AM" || zone == "PM" || zone == "am" || zone == "pm")
    return refuse("is a time of a 12-hour clock", "write the hours 0 to 23");
  if (zone.size() > 1 && word > colon) {
    return refuse(
        "names the zone '" + zone + "', which has several meanings",
        "write how far it is from UTC, such as +01:00: sed 's/" + zone + "/+01:00/' FILE > NEW");
  }
  const bool bare = (colon == 1 || colon == 2) && digits(0) == colon && digits(colon + 1) == 2 &&
                    cell.find_first_not_of("0123456789:.,") == std::string_view::npos;
  if (!bare) return std::nullopt;
  const bool whole = colon == 2 && cell.substr(colon + 3).starts_with(':');
  return refuse("is a time without a date",
                whole ? "put the date before it: sed -E 's#[0-9]{2}:[0-9]{2}:[0-9]{2}#2026-01-31 "
                        "&#' FILE > NEW; after midnight it is the next"
                      : "write a date and hours, minutes and seconds, or seconds alone");
}

}  // namespace tandem::log
