// One script for all figures through a pipe; names from logs are quoted in octal, because gnuplot
// runs text between backquotes.
#include "report/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "base/open_file.hpp"
#include "base/process.hpp"
#include "report/layout.hpp"

namespace tandem::report {
namespace {

/// Points of a curve in a picture: more cannot be seen and make the page heavy.
constexpr std::size_t kMostPoints = 1600;

const char kSettings[] = R"(set encoding utf8
set border 3 lw 1 lc rgb '#5b6470'
set tics nomirror out scale 0.6 textcolor rgb '#3a424c'
set grid lw 1 lc rgb '#e3e7ec' lt 1 dt solid
set xlabel textcolor rgb '#3a424c'
set style line 1 lw 3.4 lc rgb '#1f5fa8' dt solid
set style line 2 lw 1.7 lc rgb '#ff9d2e' dt (8,6)
set style line 3 lw 1.7 lc rgb '#ff9d2e' dt (8,6)
set style line 4 lw 2.0 lc rgb '#8e4aa8' dt solid
set style line 5 lw 1.6 lc rgb '#8a939e' dt solid
set style line 6 lw 2.0 lc rgb '#3d8b57' dt solid
set style line 7 lw 2.0 lc rgb '#a0612b' dt solid
set style line 8 lw 2.0 lc rgb '#5cb3d6' dt solid
set style line 9 lw 1.7 lc rgb '#8e4aa8' dt (8,6)
set style line 10 lw 2.0 lc rgb '#e07b00' dt solid
set style line 11 lw 1.0 lc rgb '#b4bcc6' dt solid
set style line 12 lw 3.0 lc rgb '#1f5fa8' dt solid pt 7 ps 0.7
set style line 13 lw 3.0 lc rgb '#3a424c' dt solid pt 7 ps 0.7
set style line 14 lw 3.0 lc rgb '#b4bcc6' dt solid pt 7 ps 0.7
set style line 15 lw 1.8 lc rgb "#3a424c" dt (3,4)
set style line 16 lw 1.8 lc rgb "#c0392b" dt solid
)";

int line_style(CurveStyle style) { return static_cast<int>(style) + 1; }

/// A gnuplot text, in double quotes. What could mean anything to gnuplot, which runs what stands
/// between backquotes, is written in octal: names come from logs that anybody may have made.
std::string quoted(const std::string& text) {
  constexpr std::string_view kPlain = " _-.,:()[]/+";
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    const bool plain = code >= 0x80 || (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') ||
                       (c >= 'a' && c <= 'z') || kPlain.find(c) != std::string_view::npos;
    if (code < 0x20 || code == 0x7F) {
      out += ' ';
    } else if (plain) {
      out += c;
    } else {
      out += fmt::format("\\{:03o}", code);
    }
  }
  return out + "\"";
}

std::string block_name(std::size_t figure, std::size_t curve) {
  return fmt::format("$f{}c{}", figure, curve);
}

/// The curve's samples as a datablock; a gap is an empty line.
std::string data_block(const std::string& name, const Curve& curve) {
  std::string out = name + " << EOD\n";
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const bool gap = !std::isfinite(curve.x[i]) || !std::isfinite(curve.y[i]);
    out += gap ? "\n" : fmt::format("{:.6g} {:.6g}\n", curve.x[i], curve.y[i]);
  }
  return out + "EOD\n";
}

std::string mark_style(const Mark& mark, const char* before = "") {
  return fmt::format("{}ls {}", before, mark.fault ? 16 : 15);
}

std::string plot_command(const Figure& figure, std::size_t index) {
  std::string out;
  const auto add = [&out](const std::string& what, const std::string& label) {
    out += (out.empty() ? "plot " : ", ") + what +
           (label.empty() ? " notitle" : " title " + quoted(label) + " noenhanced");
  };
  for (std::size_t i = 0; i < figure.curves.size(); ++i) {
    const Curve& curve = figure.curves[i];
    const bool points = figure.points || curve.style >= CurveStyle::kStick;
    add(fmt::format("{} using 1:2 with {} ls {}{}", block_name(index, i),
                    points ? "linespoints" : "lines", line_style(curve.style),
                    figure.points ? " pt 7 ps 0.7" : ""),
        key_text(curve));
  }
  for (const Level& level : figure.levels) {
    add(fmt::format("{:.9g} with lines ls 15", level.y), level.label);
  }
  for (const Mark& mark : figure.marks) {  // the line itself is an arrow; this is its key
    if (!mark.label.empty()) add(mark_style(mark, "NaN with lines "), mark.label);
  }
  return out + "\n";
}

/// `set xtics` of chosen numbers. @param zero  where "0" stands; 0: nowhere
std::string ticks_text(const char* axis, const std::vector<double>& ticks, double zero) {
  std::string numbers = zero > 0.0 ? fmt::format("\"0\" {:.6g}", zero) : "";
  for (const double tick : ticks)
    numbers += fmt::format("{}{:.6g}", numbers.empty() ? "" : ", ", tick);
  return fmt::format("set format {0} '%g'\nset {0}tics nomirror ({1}) textcolor rgb '#3a424c'\n",
                     axis, numbers);
}

std::string axes_text(const Figure& figure, const Axes& axes) {
  std::string out = fmt::format("set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\n",
                                axes.x.low, axes.x.high, axes.y.low, axes.y.high);
  if (figure.log_axes) {
    return out + "set logscale xy\n" + ticks_text("x", axes.x_ticks, figure.zero_x) +
           ticks_text("y", axes.y_ticks, 0.0);
  }
  out += "unset logscale\n";
  if (axes.step == 0.0) {
    out += "set format y '%g'\nset ytics nomirror autofreq\n";
  } else {
    out += fmt::format("set format y '%.{}f'\nset ytics nomirror {:.12g},{:.12g},{:.12g}\n",
                       axes.decimals, axes.lowest, axes.step, axes.y.high);
  }
  return out + (figure.equal_axes
                    ? "unset xtics\n"
                    : "set xtics nomirror autofreq textcolor rgb '#3a424c'\nset format x\n");
}

/// Everything of one figure but terminal and output.
std::string body(const Figure& figure, std::size_t index, const Cell& cell) {
  Axes axes = axes_of(figure);
  const FigureLayout at = layout_of(figure, axes, cell);
  if (figure.equal_axes) make_equal(axes, at);
  const auto x = [&cell](double pixels) { return pixels / cell.picture_width; };
  const auto y = [&cell](double pixels) { return pixels / cell.picture_height; };
  std::string out = fmt::format(
      "unset label\nunset arrow\nset lmargin at screen {:.6f}\nset rmargin at screen {:.6f}\n"
      "set bmargin at screen {:.6f}\nset tmargin at screen {:.6f}\n",
      x(at.left), x(at.right), y(at.bottom), y(at.top));
  out += axes_text(figure, axes);
  out += fmt::format(
      "set key at screen {:.6f},{:.6f} left top horizontal maxcols {} reverse Left samplen 1.8 "
      "font ',{:.0f}'\n",
      x(at.left), y(at.key_y), at.key_columns, kKeyFont);
  out += fmt::format(
      "set label 1 {} at screen {:.6f},{:.6f} left font ',{:.1f}' "
      "textcolor rgb '#1d242c' noenhanced\n",
      quoted(figure.title), x(at.left), y(at.title_y), at.title_font);
  out += fmt::format(
      "set label 2 {} at screen {:.6f},{:.6f} center rotate by 90 textcolor rgb '#3a424c' "
      "noenhanced\n",
      quoted(figure.y_label), x(at.label_x), y(0.5 * (at.bottom + at.top)));
  for (const Note& note : figure.notes) {
    out += fmt::format("set label {} at {:.6g},{:.6g} center textcolor rgb '#3a424c' noenhanced\n",
                       quoted(note.text), note.x, note.y);
  }
  for (const Mark& mark : figure.marks) {
    out += fmt::format("set arrow from {0:.9g}, graph 0 to {0:.9g}, graph 1 nohead {1} front\n",
                       mark.x, mark_style(mark));
  }
  out += fmt::format("set xlabel {} noenhanced\n", quoted(figure.x_label));
  return out + plot_command(figure, index);
}

/// All figures in two columns, as one picture.
std::string overview(std::span<const Figure> figures, const std::string& folder) {
  constexpr double kWidth = 1800.0;
  constexpr double kRowHeight = 560.0;
  const std::size_t rows = (figures.size() + 1) / 2;
  const double height = kRowHeight * static_cast<double>(rows);
  std::string out = fmt::format(
      "set terminal pngcairo size {:.0f},{:.0f} fontscale 1.15 linewidth 1.4 rounded "
      "font 'DejaVu Sans,13'\nset output {}\nset multiplot\n",
      kWidth, height, quoted(folder + "/overview.png"));
  for (std::size_t f = 0; f < figures.size(); ++f) {
    const double left = f % 2 == 0 ? 0.0 : 0.5 * kWidth;
    const std::size_t row = f / 2 + 1;
    const double bottom = height - kRowHeight * static_cast<double>(row);
    out += body(figures[f], f, {kWidth, height, left, bottom, 0.5 * kWidth, kRowHeight, 20.0});
  }
  return out + "unset multiplot\nunset output\n";
}

Status write_all(int pipe, const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const ssize_t n = write(pipe, text.data() + done, text.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return fail("gnuplot stopped reading its script");
    done += static_cast<std::size_t>(n);
  }
  return {};
}

/// Runs gnuplot on `script` in `folder`; what it says goes to the file `complaints`.
Status run_gnuplot(const std::string& script, const Descriptor& folder,
                   const std::string& complaints) {
  const std::string hint = "install it: apt-get install gnuplot-nox";
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) return fail("no pipe: " + std::string(strerror(errno)));
  const Result<pid_t> child = spawn({.command = {"gnuplot", "-"},
                                     .output = complaints,
                                     .directory = "/proc/self/fd/" + std::to_string(folder.get()),
                                     .input = pipe_ends[0]});
  close(pipe_ends[0]);
  if (!child) {
    close(pipe_ends[1]);
    return fail(child.error().message, hint);
  }
  const auto former = std::signal(SIGPIPE, SIG_IGN);
  const Status written = write_all(pipe_ends[1], script);
  close(pipe_ends[1]);
  const int status = wait_for(*child);
  std::signal(SIGPIPE, former);
  if (status == 127) return fail("gnuplot could not be started", hint);
  if (status != 0) return fail("gnuplot failed");
  return written;
}

std::string read_text(const std::string& file) {
  return read_file(file, {}, kMostOtherBytes).value_or("");
}

/// gnuplot says nothing of a full disk.
Status check_whole(const std::string& file, std::string_view end) {
  const std::string text = read_text(file);
  const std::size_t last = text.find_last_not_of("\r\n");
  if (text.substr(0, last + 1).ends_with(end)) return {};
  return std::unexpected(Error{"gnuplot could not write the whole picture",
                               "check the folder's permissions, the disk's free space and the "
                               "limit on the size of files (ulimit -f)",
                               file,
                               0,
                               {}});
}

Status check_pictures(std::span<const Figure> figures, const std::string& folder) {
  constexpr std::string_view kPngEnd = "IEND\xAE\x42\x60\x82";
  for (const Figure& figure : figures) {
    const std::string file = folder + "/" + figure.name;
    if (Status whole = check_whole(file + ".svg", "</svg>"); !whole) return whole;
    if (Status whole = check_whole(file + ".png", kPngEnd); !whole) return whole;
  }
  return check_whole(folder + "/overview.png", kPngEnd);
}

}  // namespace

std::string gnuplot_script(std::span<const Figure> figures, const std::string& folder) {
  std::string out = kSettings;
  for (std::size_t f = 0; f < figures.size(); ++f) {
    for (std::size_t c = 0; c < figures[f].curves.size(); ++c) {
      out += data_block(block_name(f, c), decimated(figures[f].curves[c], kMostPoints));
    }
  }
  for (std::size_t f = 0; f < figures.size(); ++f) {
    const std::string drawing = body(figures[f], f, {760.0, 430.0, 0.0, 0.0, 760.0, 430.0, 13.0});
    const std::string path = folder + "/" + figures[f].name;
    out +=
        "set terminal svg size 760,430 dynamic rounded font 'DejaVu Sans,13' background "
        "rgb '#ffffff'\n";
    out += fmt::format("set output {}\n{}unset output\n", quoted(path + ".svg"), drawing);
    out +=
        "set terminal pngcairo size 1520,860 fontscale 1.45 linewidth 1.7 rounded "
        "font 'DejaVu Sans,13'\n";
    out += fmt::format("set output {}\n{}unset output\n", quoted(path + ".png"), drawing);
  }
  return out + overview(figures, folder);
}

Status draw(std::span<const Figure> figures, const std::string& folder) {
  if (figures.empty()) return fail("there is nothing to draw");
  const std::string complaints = folder + "/gnuplot.err";
  // In the folder that is open, so that nobody can put another in its place meanwhile.
  const Result<Descriptor> open = open_folder(folder);
  if (!open) return std::unexpected(open.error());
  Status drawn = run_gnuplot(gnuplot_script(figures, "."), *open, complaints);
  if (!drawn && drawn.error().hint.empty()) {
    drawn.error().hint = read_text(complaints);
    drawn.error().file = folder;
  }
  if (drawn) drawn = check_pictures(figures, folder);
  std::error_code ignored;
  std::filesystem::remove(complaints, ignored);
  return drawn;
}

}  // namespace tandem::report
