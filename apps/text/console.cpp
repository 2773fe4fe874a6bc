#include "apps/text/console.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>
#include <ext/stdio_sync_filebuf.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <vector>

#include "apps/text/columns.hpp"
#include "apps/text/draft.hpp"
#include "base/open_file.hpp"
#include "base/quoting.hpp"
#include "base/utf8.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kLongestCell = 2'000;  // characters
constexpr std::size_t kWidest = 100;         // columns of a line of texts

Diagnostics reported;      // by print_errors(), for write_failure()
bool has_written = false;  // by write_json()
std::string begun_json;    // by begin_json()
std::atomic<int> lost{0};  // errno with which the standard output was last thrown away

Error unwritable(const std::string& file, const std::string& what, const std::string& reason) {
  return {.message = "cannot write the " + what + ": " + reason,
          .hint = "name a file in a folder that can be written",
          .file = file,
          .key = {}};
}

/// Whether a file is there whose text is no JSON of ours: a description, a robot, a log.
bool holds_something_else(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  const Result<Descriptor> in = open_to_read(file, {});
  std::string begins(4096, ' ');  // blanks are no text
  if (in) (void)!::pread(in->get(), begins.data(), begins.size(), 0);
  std::erase_if(begins, [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; });
  begins = (begins + "  ").substr(0, 2);
  if (begins[0] == ' ') return false;  // empty
  return begins[0] != '{' && begins != "[{" && begins != "[]";
}

bool is_full(int error) { return error == ENOSPC || error == EDQUOT || error == EFBIG; }

/// Whether nobody will read the standard output any more: a pipe's other end is closed.
bool reader_is_gone() {
  pollfd output{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&output, 1, 0) > 0 && (output.revents & (POLLERR | POLLHUP)) != 0;
}

/// Standard output or error. It outlives every static object, as what is buffered is written last.
struct Output {
  int fd;
  bool loses;                   // what cannot be written, instead of failing
  std::array<char, 3> begun{};  // bytes of a character whose last has not come
  std::size_t begun_size = 0;
  std::array<char, 4096> buffer{};  // of the stream
};
Output outputs[] = {{STDOUT_FILENO, false}, {STDERR_FILENO, false}};

/// @return whether all of it was written, or lost
bool put(const Output& out, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(out.fd, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      if (!out.loses) return false;
      if (!is_full(errno)) rt::request_stop();
      if (is_full(errno) && out.fd == STDOUT_FILENO) lost = errno;
      return true;
    }
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool is_plain(std::string_view text) {
  return std::ranges::all_of(
      text, [](char c) { return (c >= 0x20 && c < 0x7F) || c == '\n' || c == '\t'; });
}

/// The bytes at the end of a text that may begin a character whose others have not come yet.
std::size_t begun_at_end(std::string_view text) {
  for (std::size_t i = 1; i <= std::min<std::size_t>(3, text.size()); ++i) {
    const auto byte = static_cast<unsigned char>(text[text.size() - i]);
    if (byte < 0x80) return 0;
    if (byte < 0xC0) continue;
    return i < (byte < 0xE0 ? 2U : byte < 0xF0 ? 3U : 4U) ? i : 0;
  }
  return 0;
}

/// What others wrote, such as an escape sequence in a name, is shown and not obeyed: the one way
/// out for all that is printed. Our own sequences go by restart_line().
ssize_t write_harmless(void* cookie, const char* text, std::size_t size) {
  Output& out = *static_cast<Output*>(cookie);
  const std::string_view added(text, size);
  if (out.begun_size == 0 && is_plain(added))
    return put(out, added) ? static_cast<ssize_t>(size) : 0;
  std::string all(out.begun.data(), out.begun_size);
  all += added;
  out.begun_size = begun_at_end(all);
  std::copy(all.end() - static_cast<std::ptrdiff_t>(out.begun_size), all.end(), out.begun.begin());
  all.resize(all.size() - out.begun_size);
  return put(out, harmless(all)) ? static_cast<ssize_t>(size) : 0;
}

/// A stream on a descriptor of the program's, which is not closed.
std::FILE* stream_on(Output& out, int buffering) {
  std::FILE* stream = ::fopencookie(&out, "w", {nullptr, &write_harmless, nullptr, nullptr});
  if (stream == nullptr) return out.fd == STDERR_FILENO ? stderr : stdout;
  std::setvbuf(stream, out.buffer.data(), buffering, out.buffer.size());
  return stream;
}

}  // namespace

std::FILE* human_output(const std::string& json_file) { return json_file == "-" ? stderr : stdout; }

bool is_terminal(std::FILE* out) {
  if (out == stdout) return ::isatty(STDOUT_FILENO) != 0;
  if (out == stderr) return ::isatty(STDERR_FILENO) != 0;
  return ::isatty(::fileno(out)) != 0;
}

void show_harmless() {
  static bool done = false;
  if (std::exchange(done, true)) return;
  std::fflush(stdout);
  stdout = stream_on(outputs[0], ::isatty(STDOUT_FILENO) != 0 ? _IOLBF : _IOFBF);
  stderr = stream_on(outputs[1], _IONBF);
  static __gnu_cxx::stdio_sync_filebuf<char> out(stdout), error(stderr);
  std::cout.rdbuf(&out);  // they keep the streams that the program began with
  std::cerr.rdbuf(&error);
}

namespace {

/// Past show_harmless(), which lets no sequence through.
void write_sequence(std::FILE* out, std::string_view sequence) {
  std::fflush(out);
  const int fd = out == stdout ? STDOUT_FILENO : out == stderr ? STDERR_FILENO : ::fileno(out);
  (void)!::write(fd, sequence.data(), sequence.size());
}

}  // namespace

bool has_colours(std::FILE* out) {
  const char* refused = std::getenv("NO_COLOR");
  const char* kind = std::getenv("TERM");
  return is_terminal(out) && (refused == nullptr || *refused == '\0') && kind != nullptr &&
         std::string_view(kind) != "dumb";
}

void say(Said what, const std::string& text) {
  struct Label {
    const char* word;
    const char* colour;  ///< sequence of ECMA-48; empty: as the text
  };
  static constexpr Label kLabels[]{{"error: ", "\x1b[1;31m"},
                                   {"warning: ", "\x1b[1;33m"},
                                   {"fault: ", "\x1b[1;31m"},
                                   {"hint: ", ""}};
  const Label& label = kLabels[static_cast<std::size_t>(what)];
  const bool coloured = *label.colour != '\0' && has_colours(stderr);
  if (coloured) write_sequence(stderr, label.colour);
  std::fputs(label.word, stderr);
  if (coloured) write_sequence(stderr, "\x1b[0m");
  std::fputs((text + "\n").c_str(), stderr);
}

void restart_line(std::FILE* out) {
  if (is_terminal(out)) write_sequence(out, "\r\x1b[K");
}

void outlive_files() {
  std::signal(SIGPIPE, SIG_IGN);
  show_harmless();
  if (std::fflush(stdout) != 0 && is_full(errno)) lost = errno;
  for (Output& out : outputs) out.loses = true;
}

Status flush_output(int before) {
  if (is_full(before)) lost = before;
  errno = 0;
  const bool failed = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
  if (lost == 0 && (!failed || errno == EPIPE || reader_is_gone())) return {};
  const int error = lost != 0 ? lost.load() : errno;
  const std::string reason = error == 0 ? "" : std::string(": ") + std::strerror(error);
  return fail("not all of the standard output could be written" + reason,
              "send it where there is space");
}

Status write_file(const std::filesystem::path& file, const std::string& text) {
  Result<Descriptor> out = open_output(file.string());
  std::string reason = out ? "" : out.error().message;
  if (out) {
    int problem = write_all(*out, text);
    if (::close(out->release()) != 0 && problem == 0) problem = errno;
    if (problem == 0) return {};
    reason = std::strerror(problem);
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored)) std::filesystem::remove(file, ignored);
  }
  return std::unexpected(Error{"the file cannot be written: " + reason,
                               "name a file in a folder that you may write to, and whose disk has "
                               "space",
                               file.string(),
                               0,
                               {}});
}

namespace {

/// Makes the folders that a file lacks, and removes them. @return why they cannot be made
std::error_code try_folders(const std::filesystem::path& file) {
  std::error_code problem, ignored;
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  std::vector<std::filesystem::path> missing;
  for (auto one = folder; one.has_relative_path() && !std::filesystem::exists(one, ignored);
       one = one.parent_path())
    missing.push_back(one);
  std::filesystem::create_directories(folder, problem);
  for (const auto& one : missing) ::rmdir(one.c_str());  // unless somebody has filled it
  return problem;
}

}  // namespace

Status check_overwrites(const std::string& file, std::string_view begins, const std::string& what) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return {};
  std::string start(begins.size(), '\0');
  const Result<Descriptor> in = open_to_read(file, {});
  if (!in || ::pread(in->get(), start.data(), start.size(), 0) <= 0 || start == begins) return {};
  return std::unexpected(Error{"this file is there, and it is no " + what + ": it would be lost",
                               "name another file, or remove it first",
                               file,
                               0,
                               {}});
}

Status check_writable(const std::string& file, std::string_view begins, const std::string& what) {
  if (file.empty() || file == "-") return {};
  if (!begins.empty()) {
    if (Status kept = check_overwrites(file, begins, what); !kept) return kept;
  } else if (holds_something_else(file)) {
    return std::unexpected(Error{"this file is there, and it is no JSON: it would be lost",
                                 "name another file, or remove it first",
                                 file,
                                 0,
                                 {}});
  }
  std::error_code ignored;
  const bool there = std::filesystem::exists(file, ignored);
  const std::filesystem::path folder = std::filesystem::path(file).parent_path();
  if (!folder.empty() && !std::filesystem::exists(folder, ignored)) {
    const std::error_code problem = try_folders(file);
    return problem ? std::unexpected(unwritable(file, what, std::strerror(problem.value())))
                   : Status{};
  }
  if (there) {
    const bool is_folder = std::filesystem::is_directory(file, ignored);
    if (!is_folder && ::faccessat(AT_FDCWD, file.c_str(), W_OK, AT_EACCESS) == 0) return {};
    return std::unexpected(unwritable(file, what, std::strerror(is_folder ? EISDIR : errno)));
  }
  const Result<Descriptor> out = open_new(file);
  if (!out) return std::unexpected(unwritable(file, what, out.error().message));
  std::filesystem::remove(file, ignored);
  return {};
}

std::string json_text(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

Status write_json(const std::string& file, const Json& value) {
  if (file.empty()) return {};
  if (Status writable = check_writable(file); !writable) return writable;
  has_written = true;
  const std::string text = json_text(value, 2) + "\n";
  if (file == "-") {
    errno = 0;  // flush_output() says what is lost
    if ((std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0) && is_full(errno))
      lost = errno;
    return {};
  }
  Draft draft = Draft::file(file);
  const Status written = write_file(draft.path(), text);
  if (!written) return std::unexpected(draft.placed(written.error()));
  return draft.place();
}

Json errors_json(const Diagnostics& errors) {
  Json list = Json::array();
  for (const Error& error : errors) {
    list.push_back({{"file", error.file},
                    {"line", error.line},
                    {"key", error.key},
                    {"message", error.message},
                    {"hint", error.hint}});
  }
  return list;
}

void remember_error(Error error) { reported.push_back(std::move(error)); }

// One behind a link, or in a folder where nothing can be removed, is emptied.
void begin_json(const std::string& file) {
  begun_json = file;
  std::error_code problem;
  if (file.empty() || file == "-" || !std::filesystem::is_regular_file(file, problem)) return;
  if (std::filesystem::is_symlink(file, problem) || !std::filesystem::remove(file, problem))
    (void)open_output(file);  // not through a stranger's link
}

void fail_begun_json(Error error) {
  remember_error(std::move(error));
  write_failure(begun_json);
}

void write_failure(const std::string& file) {
  if (has_written) return;
  (void)write_json(file, {{"ok", false}, {"errors", errors_json(reported)}});
}

Exit end_with_json(const std::string& file, const Json& value, Exit exit) {
  const Status written = write_json(file, value);
  return written ? exit : refuse(written.error());
}

Json percentiles_json(const rt::Histogram& of) {
  if (of.count() == 0) return nullptr;
  return percentiles_json(of.percentiles());
}

Json percentiles_json(const rt::Percentiles& p) {
  return {{"p50", p.p50}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
}

namespace {

/// An error's words; where they have lines, as a compiler's do, no line looks like one of ours.
std::string indented(const std::string& text) {
  constexpr std::size_t kMost = 20'000;
  std::string out;
  for (const char c : whole_characters(text, kMost))
    out += c == '\n' ? std::string("\n    ") : std::string(1, c);
  return harmless(out + (text.size() > kMost ? "…" : ""));
}

}  // namespace

void print_errors(const Diagnostics& errors) {
  reported.insert(reported.end(), errors.begin(), errors.end());
  for (const Error& error : errors) say(Said::kError, indented(error.to_string()));
}

Exit refuse(const Diagnostics& errors) {
  print_errors(errors);
  return Exit::kUsage;
}

Exit refuse(const Error& error) { return refuse(Diagnostics{error}); }

void print_warnings(const Diagnostics& warnings) {
  for (const Error& warning : warnings) say(Said::kWarning, indented(warning.to_string()));
}

namespace {

/// The longest word of a column, where no line can be broken.
std::size_t longest_word(const std::vector<std::vector<std::string>>& rows, std::size_t column) {
  std::size_t longest = 0;
  for (const auto& row : rows) {
    if (column >= row.size()) continue;
    std::istringstream words(row[column]);
    for (std::string word; words >> word;) longest = std::max(longest, columns_of(word));
  }
  return longest;
}

/// Makes the widest column that has blanks so narrow that a line has at most `most` characters, or
/// the column has 24, or its longest word.
void narrow(std::vector<std::size_t>& columns, const std::vector<std::vector<std::string>>& rows,
            std::size_t most) {
  constexpr std::size_t kLeast = 24;
  std::size_t line = 0;
  for (const std::size_t column : columns) line += column + 2;
  std::size_t widest = 0, gain = 0;
  for (std::size_t i = 0; line > most && i < columns.size(); ++i) {
    const std::size_t least = std::max(kLeast, longest_word(rows, i));
    if (columns[i] <= least || (gain > 0 && columns[i] <= columns[widest])) continue;
    widest = i;
    gain = columns[i] - least;
  }
  if (gain > 0) columns[widest] -= std::min(gain, line - most);
}

}  // namespace

void Table::add(std::vector<std::string> row) {
  for (std::string& cell : row) cell = shown(cell, kLongestCell);
  rows_.push_back(std::move(row));
}

void Table::print(std::FILE* out) const {
  std::vector<std::size_t> columns;
  for (const auto& row : rows_) {
    columns.resize(std::max(columns.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i)
      columns[i] = std::max(columns[i], columns_of(row[i]));
  }
  if (left_) narrow(columns, rows_, line_columns(out, kWidest, kWidest));
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (rows_[r].empty()) continue;
    std::vector<std::vector<std::string>> cells;
    std::size_t lines = 1;
    for (std::size_t i = 0; i < rows_[r].size(); ++i) {
      cells.push_back(wrapped(rows_[r][i], columns[i]));
      lines = std::max(lines, cells.back().size());
    }
    for (std::size_t l = 0; l < lines; ++l) {
      std::string line;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const std::string cell = l < cells[i].size() ? cells[i][l] : "";
        line += "  " + (i == 0 || left_ ? left(cell, columns[i]) : right(cell, columns[i]));
      }
      line.erase(line.find_last_not_of(' ') + 1);
      fmt::print(out, "{}\n", line);
    }
    if (r > 0) continue;
    std::size_t rule = 0;
    for (const std::size_t column : columns) rule += column + 2;
    std::string dashes;
    for (std::size_t i = 2; i < rule; ++i) dashes += "─";
    fmt::print(out, "  {}\n", dashes);
  }
}

void Facts::add(const std::string& name, const std::string& value) {
  facts_.emplace_back(shown(name), shown(value, kLongestCell));
}

void Facts::print(std::FILE* out) const {
  std::size_t column = 0;
  for (const auto& [name, value] : facts_) column = std::max(column, columns_of(name));
  for (const auto& [name, value] : facts_) {
    // Elsewhere than on a terminal each stays in its line, for grep.
    const std::size_t line = line_columns(out, kWidest, kWidest);
    const std::size_t room = line - std::min(line - 20, column + 4);
    std::string begin = left(name, column);
    for (const std::string& part : wrapped(value, is_terminal(out) ? room : columns_of(value))) {
      fmt::print(out, "  {}  {}\n", begin, part);
      begin = std::string(column, ' ');
    }
  }
}

namespace {

/// As much of a line that is drawn again and again as one of the terminal's holds.
std::string in_a_line(const std::string& text, std::FILE* out) {
  return cut_to(text, line_columns(out, kLongestCell, kLongestCell) - 1);
}

}  // namespace

StatusLine::StatusLine(std::FILE* out)
    : out_(out), terminal_(is_terminal(out)), next_(std::chrono::steady_clock::now()) {}

StatusLine::~StatusLine() {
  if (drawn_) std::fputs("\n", out_);  // which throws nothing
}

bool StatusLine::due() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return false;
  next_ = now + std::chrono::seconds(terminal_ ? 1 : 10);
  return true;
}

void StatusLine::show(const std::string& text) {
  restart_line(out_);
  const std::string line = "  " + shown(text, kLongestCell);
  fmt::print(out_, "{}{}", terminal_ ? in_a_line(line, out_) : line, terminal_ ? "" : "\n");
  std::fflush(out_);
  drawn_ = terminal_;
}

ProgressBar::ProgressBar(std::FILE* out, double total_s)
    : out_(out),
      total_s_(total_s),
      terminal_(is_terminal(out)),
      started_(std::chrono::steady_clock::now()),
      next_(started_) {}

void ProgressBar::update(double done_s, const std::string& note) {
  if (total_s_ <= 0.0) return update_endless(done_s, note);
  const double share = std::clamp(done_s / total_s_, 0.0, 1.0);
  if (!terminal_) {
    const int tenth = static_cast<int>(share * 10.0 + 1e-9);
    if (tenth <= tenth_) return;
    tenth_ = tenth;
    fmt::print(out_, "  {:3d} %  {:6.2f} of {:.2f} s  {}\n", tenth * 10, done_s, total_s_,
               shown(note));
    std::fflush(out_);
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now < next_ && share < 1.0) return;
  next_ = now + std::chrono::milliseconds(50);
  constexpr int kCells = 30;
  const int full = static_cast<int>(share * kCells);
  std::string bar;
  for (int i = 0; i < kCells; ++i) bar += i < full ? "█" : "░";
  const double wall_s = std::chrono::duration<double>(now - started_).count();
  restart_line(out_);
  fmt::print(out_, "{}",
             in_a_line(fmt::format("  {} {:6.2f} / {:.2f} s  {:5.1f} s elapsed  {}", bar, done_s,
                                   total_s_, wall_s, shown(note)),
                       out_));
  std::fflush(out_);
  drawn_ = true;
}

void ProgressBar::update_endless(double done_s, const std::string& note) {
  const auto now = std::chrono::steady_clock::now();
  const bool news = !noted_ || *noted_ != note;
  noted_ = note;
  if (!terminal_) {
    if (news) fmt::print(out_, "  {:8.2f} s  {}\n", done_s, note.empty() ? "running" : shown(note));
    std::fflush(out_);
    return;
  }
  if (now < next_ && !news) return;
  next_ = now + std::chrono::milliseconds(50);
  const double wall_s = std::chrono::duration<double>(now - started_).count();
  restart_line(out_);
  fmt::print(
      out_, "{}",
      in_a_line(fmt::format("  {:8.2f} s  {:5.1f} s elapsed  {}", done_s, wall_s, shown(note)),
                out_));
  std::fflush(out_);
  drawn_ = true;
}

void ProgressBar::finish() {
  if (drawn_) fmt::print(out_, "\n");
  drawn_ = false;
}

}  // namespace tandem::apps
