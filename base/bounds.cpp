#include "base/bounds.hpp"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

namespace tandem {
namespace {

constexpr const char* kNotListed = " more are not listed";

/// One pass over the bytes, which knows strings, comments, brackets and keys' dots.
class TomlScan {
 public:
  explicit TomlScan(std::string_view text) : text_(text) {}

  /// The bound that is broken; null: none.
  const Bound* run() {
    while (at_ < text_.size() && broken_ == nullptr && !unfinished_) step(text_[at_]);
    return broken_;
  }
  [[nodiscard]] int line() const { return line_; }

 private:
  void step(char c) {
    switch (c) {
      case '#': at_ = std::min(text_.find('\n', at_), text_.size()); return;
      case '"':
      case '\'': return skip_text(c);
      case '\n': end_line(); break;
      case '[':
      case '{': open(c); break;
      case ']':
      case '}': close(); break;
      case '.': count_dot(); break;
      case '=':
      case ',': end_part(c); break;
      case ' ':
      case '\t':
      case '\r': word_ = 0; break;
      default:
        fresh_ = false;
        if (++word_ > bounds::kTomlWord.most) broken_ = &bounds::kTomlWord;
    }
    ++at_;
  }

  /// From the quotes on; one that is not closed is where the parser will stop.
  void skip_text(char quote) {
    fresh_ = false;
    const std::string_view three = text_.substr(at_, 3);
    const bool lines = three.size() == 3 && three[1] == quote && three[2] == quote;
    const std::size_t begin = at_ += lines ? 3 : 1;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\\' && quote == '"') {
        ++at_;
        if (at_ < text_.size() && text_[at_] == '\n') ++line_;
        continue;
      }
      if (c == '\n' && !lines) break;
      if (c == '\n') ++line_;
      if (c != quote || (lines && text_.substr(at_, 3) != three)) continue;
      if (at_ - begin > bounds::kTomlText.most) broken_ = &bounds::kTomlText;
      for (at_ += lines ? 3 : 1; lines && at_ < text_.size() && text_[at_] == quote;) ++at_;
      return;
    }
    unfinished_ = true;
  }

  void end_line() {
    ++line_;
    word_ = 0;
    if (!open_.empty()) return;
    if (header_) table_ = 1 + dots_;
    dots_ = 0;
    header_ = false;
    fresh_ = true;
  }

  void open(char c) {
    word_ = 0;
    if (c == '[' && open_.empty() && (fresh_ || header_)) {
      fresh_ = false;
      header_ = true;
      table_ = 0;
      return count_value();
    }
    fresh_ = false;
    open_.push_back(1 + std::exchange(dots_, 0));
    inside_ += open_.back();
    check_depth();
    count_value();
  }

  void close() {
    word_ = 0;
    if (open_.empty()) return;
    inside_ -= open_.back();
    open_.pop_back();
    dots_ = 0;
  }

  void count_dot() {
    word_ = 0;
    ++dots_;
    check_depth();
  }

  /// A key ends at its `=`, but its dots count for what is in its value.
  void end_part(char c) {
    word_ = 0;
    if (c == ',') dots_ = 0;
    count_value();
  }

  void check_depth() {
    if (table_ + inside_ + dots_ > bounds::kTomlDepth.most) broken_ = &bounds::kTomlDepth;
  }
  void count_value() {
    if (++values_ > bounds::kTomlValues.most) broken_ = &bounds::kTomlValues;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  const Bound* broken_ = nullptr;
  bool unfinished_ = false;
  bool fresh_ = true;    // nothing but blanks in this line so far
  bool header_ = false;  // in [a.b]
  std::size_t table_ = 0, inside_ = 0, dots_ = 0, word_ = 0, values_ = 0;
  std::vector<std::size_t> open_;  // levels that each open bracket adds
};

}  // namespace

Error beyond(const Bound& bound, std::string file, int line, std::string key) {
  return {.message = "has more than " + std::to_string(bound.most) + " " + std::string(bound.unit),
          .hint = "no more is read",
          .file = std::move(file),
          .line = line,
          .key = std::move(key)};
}

void add_error(Diagnostics& errors, Error error) {
  const std::size_t most = bounds::kErrors.most;
  if (errors.size() < most) return errors.push_back(std::move(error));
  std::size_t count = 0;
  if (errors.size() > most) {
    const std::string& last = errors.back().message;
    std::from_chars(last.data(), last.data() + last.size(), count);
  } else {
    errors.push_back({.message = {}, .hint = "correct these first", .file = error.file, .key = {}});
  }
  errors.back().message = std::to_string(count + 1) + kNotListed;
}

Status check_toml_bounds(std::string_view text, const std::string& file) {
  TomlScan scan(text);
  if (const Bound* broken = scan.run()) return std::unexpected(beyond(*broken, file, scan.line()));
  return {};
}

}  // namespace tandem
