#include "report/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <limits>

extern char** environ;

namespace tandem::report {
namespace {

/// Points of a curve in a picture: more cannot be seen and make the page heavy.
constexpr std::size_t kMostPoints = 1600;

const char kSettings[] = R"(set encoding utf8
set border 3 lw 1 lc rgb '#5b6470'
set tics nomirror out scale 0.6 textcolor rgb '#3a424c'
set grid lw 1 lc rgb '#e3e7ec' lt 1 dt solid
set xlabel textcolor rgb '#3a424c'
set ylabel textcolor rgb '#3a424c'
set style line 1 lw 3.4 lc rgb '#1f5fa8' dt solid
set style line 2 lw 1.7 lc rgb '#ff9d2e' dt (8,6)
set style line 3 lw 1.7 lc rgb '#ff9d2e' dt (8,6)
set style line 4 lw 2.0 lc rgb '#8e4aa8' dt solid
set style line 5 lw 1.6 lc rgb '#8a939e' dt solid
set style line 6 lw 2.0 lc rgb '#3d8b57' dt solid
set style line 7 lw 2.0 lc rgb '#a0612b' dt solid
set style line 8 lw 2.0 lc rgb '#5cb3d6' dt solid
set style line 9 lw 3.0 lc rgb '#1f5fa8' dt solid pt 7 ps 0.7
set style line 10 lw 3.0 lc rgb '#3a424c' dt solid pt 7 ps 0.7
set style line 11 lw 3.0 lc rgb '#b4bcc6' dt solid pt 7 ps 0.7
set style line 12 lw 1.8 lc rgb "#3a424c" dt (3,4)
set key at graph 0, graph 1.085 left top horizontal reverse Left samplen 1.8 font ',12'
)";

int line_style(CurveStyle style) { return static_cast<int>(style) + 1; }

/// A gnuplot text in double quotes, without enhanced markup.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c == '\n' ? ' ' : c;
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

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// A margin of `share` on both sides; at least something when all values are equal.
  void widen(double share) {
    if (!(low <= high)) low = high = 0.0;
    const double margin = std::max((high - low) * share, 1e-6 + 1e-3 * std::abs(high));
    low -= margin;
    high += margin;
  }
};

/// Both axes logarithmic: half as much again beyond the positive values.
std::string log_ranges(const Figure& figure) {
  Extent x;
  Extent y;
  for (const Curve& curve : figure.curves) {
    for (const double value : curve.x) x.include(value > 0.0 ? value : NAN);
    for (const double value : curve.y) y.include(value > 0.0 ? value : NAN);
  }
  for (const Level& level : figure.levels) y.include(level.y);
  if (!(x.low <= x.high)) x = {1.0, 10.0};
  if (!(y.low <= y.high)) y = {1.0, 10.0};
  return fmt::format(
      "set logscale xy\nset format y '%g'\nset xrange [{:.6g}:{:.6g}]\nset yrange "
      "[{:.6g}:{:.6g}]\n",
      x.low / 1.5, x.high * 1.5, y.low / 1.5, y.high * 1.5);
}

/// Ranges of both axes. With equal axes the room beside the figure is shared on both sides.
/// @param aspect  width by height of the drawing area.
std::string ranges(const Figure& figure, double aspect) {
  if (figure.log_axes) return log_ranges(figure);
  Extent x;
  Extent y;
  for (const Curve& curve : figure.curves) {
    for (const double value : curve.x) x.include(value);
    for (const double value : curve.y) y.include(value);
  }
  for (const Level& level : figure.levels) y.include(level.y);
  for (const Note& note : figure.notes) y.include(note.y);
  y.widen(0.08);
  if (figure.equal_axes) {
    const double wide = std::max(1.06 * (x.high - x.low), aspect * (y.high - y.low));
    const double more = 0.5 * (wide - (x.high - x.low));
    x = {x.low - more, x.high + more};
    y.high = y.low + wide / aspect;
  } else {
    x.widen(0.0);
  }
  return fmt::format("set xrange [{:.6g}:{:.6g}]\nset yrange [{:.6g}:{:.6g}]\n", x.low, x.high,
                     y.low, y.high);
}

std::string plot_command(const Figure& figure, std::size_t index) {
  std::string out;
  for (std::size_t i = 0; i < figure.curves.size(); ++i) {
    const Curve& curve = figure.curves[i];
    const bool stick = curve.style >= CurveStyle::kStick;
    const std::string title =
        curve.label.empty() ? "notitle" : "title " + quoted(curve.label) + " noenhanced";
    out += fmt::format("{}{} using 1:2 with {} ls {} {}", out.empty() ? "plot " : ", ",
                       block_name(index, i), stick ? "linespoints" : "lines",
                       line_style(curve.style), title);
  }
  for (const Level& level : figure.levels) {
    out += fmt::format("{}{:.9g} with lines ls 12 notitle", out.empty() ? "plot " : ", ", level.y);
  }
  return out + "\n";
}

/// Everything of one figure but terminal and output.
std::string body(const Figure& figure, std::size_t index, double aspect) {
  std::string out = "unset label\nunset logscale\nset format y\n" + ranges(figure, aspect);
  out += fmt::format(
      "set label 1 {} at graph 0, graph 1.145 left font ',15' "
      "textcolor rgb '#1d242c' noenhanced\n",
      quoted(figure.title));
  for (const Note& note : figure.notes) {
    out += fmt::format("set label {} at {:.6g},{:.6g} center textcolor rgb '#3a424c' noenhanced\n",
                       quoted(note.text), note.x, note.y);
  }
  for (const Level& level : figure.levels) {
    out += fmt::format(
        "set label {} at graph 0.99, first {:.9g} right offset 0,{} font ',12' "
        "textcolor rgb '#3a424c' noenhanced front\n",
        quoted(level.label), level.y, level.label_below ? "-0.7" : "0.65");
  }
  out += fmt::format("set xlabel {} noenhanced\nset ylabel {} noenhanced\n", quoted(figure.x_label),
                     quoted(figure.y_label));
  out += figure.equal_axes ? "set format x ''\n" : "set format x\n";
  return out + plot_command(figure, index);
}

/// All figures in two columns, as one picture.
std::string overview(std::span<const Figure> figures, const std::string& folder) {
  constexpr double kWidth = 1800.0;
  constexpr double kRowHeight = 560.0;
  constexpr double kTop = 0.17, kBottom = 0.13, kBetween = 0.30;  // shares of a row
  const double rows = static_cast<double>((figures.size() + 1) / 2);
  const double plot_height = (rows - kTop - kBottom - kBetween * (rows - 1.0)) / rows * kRowHeight;
  const double aspect = (0.985 - 0.06 - 0.08) / 2.0 * kWidth / plot_height;
  std::string out = "unset lmargin\nunset rmargin\nunset bmargin\nunset tmargin\n";
  out += fmt::format(
      "set terminal pngcairo size {:.0f},{:.0f} fontscale 1.15 linewidth 1.4 rounded "
      "font 'DejaVu Sans,13'\nset output {}\n",
      kWidth, rows * kRowHeight, quoted(folder + "/overview.png"));
  out += fmt::format(
      "set multiplot layout {:.0f},2 margins 0.06,0.985,{:.4f},{:.4f} "
      "spacing 0.08,{:.4f}\n",
      rows, kBottom / rows, 1.0 - kTop / rows, kBetween / rows);
  for (std::size_t f = 0; f < figures.size(); ++f) out += body(figures[f], f, aspect);
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

/// Runs gnuplot on `script`; what it says on standard error goes to the file `complaints`.
Status run_gnuplot(const std::string& script, const std::string& complaints) {
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) return fail("no pipe: " + std::string(strerror(errno)));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[0], 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 2, complaints.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  char program[] = "gnuplot";
  char from_standard_input[] = "-";
  char* arguments[] = {program, from_standard_input, nullptr};
  pid_t child = 0;
  const int spawned = posix_spawnp(&child, program, &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_ends[0]);
  if (spawned != 0) {
    close(pipe_ends[1]);
    return fail("gnuplot could not be started: " + std::string(strerror(spawned)),
                "install it: apt-get install gnuplot-nox");
  }
  const auto former = std::signal(SIGPIPE, SIG_IGN);
  const Status written = write_all(pipe_ends[1], script);
  close(pipe_ends[1]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::signal(SIGPIPE, former);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127) {
    return fail("gnuplot could not be started", "install it: apt-get install gnuplot-nox");
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return fail("gnuplot failed");
  return written;
}

std::string read_text(const std::string& file) {
  std::string text;
  if (std::FILE* in = std::fopen(file.c_str(), "rb")) {
    char buffer[512];
    for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof buffer, in)) > 0;) {
      text.append(buffer, n);
    }
    std::fclose(in);
  }
  return text;
}

}  // namespace

std::string gnuplot_script(std::span<const Figure> figures, const std::string& folder) {
  std::string out = kSettings;
  for (std::size_t f = 0; f < figures.size(); ++f) {
    for (std::size_t c = 0; c < figures[f].curves.size(); ++c) {
      out += data_block(block_name(f, c), decimated(figures[f].curves[c], kMostPoints));
    }
  }
  constexpr double kSingleAspect = (0.975 - 0.105) * 760.0 / ((0.84 - 0.145) * 430.0);
  for (std::size_t f = 0; f < figures.size(); ++f) {
    const std::string drawing = body(figures[f], f, kSingleAspect);
    const std::string path = folder + "/" + figures[f].name;
    out +=
        "set lmargin at screen 0.105\nset rmargin at screen 0.975\n"
        "set bmargin at screen 0.145\nset tmargin at screen 0.84\n";
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
  Status drawn = run_gnuplot(gnuplot_script(figures, folder), complaints);
  if (!drawn && drawn.error().hint.empty()) drawn.error().hint = read_text(complaints);
  std::error_code ignored;
  std::filesystem::remove(complaints, ignored);
  return drawn;
}

}  // namespace tandem::report
