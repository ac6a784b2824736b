// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/figure.h"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/report/kit/html.h"
#include "apps/runlog/storage/disk.h"
#include "base/child_process.h"

namespace twocone::report {
namespace {

/// Far more than a figure of a long run needs; a program that writes without end must not fill the memory.
constexpr std::size_t kLargestOutput = 64U << 20U;
constexpr std::chrono::milliseconds kTimeout{30'000};  // for one figure

/// Returns what a program wrote until it ended by itself.
/// Errors: kUnavailable (cannot be started), kTimeout (killed), kDisconnected (ended by a signal), kBadData (killed
/// because it wrote more than any figure needs).
Result<base::ChildResult> run_program(const std::string& program, std::vector<std::string> arguments) {
  using End = base::ChildResult::End;
  const std::optional<std::string> path = base::find_program(program);
  base::ChildResult run;
  if (path) {
    base::Program started{*path, std::move(arguments), base::own_environment(), ".", {}};
    run = base::run_child({std::move(started), kLargestOutput, kTimeout});
  } else {
    run.errors = std::strerror(ENOENT);
  }
  switch (run.end) {
    case End::kNotStarted:
      return Error(ErrorCode::kUnavailable, "cannot start {}: {}", program, run.errors);
    case End::kTooMuch:
      return Error(ErrorCode::kBadData, "{} wrote over {} MiB and was killed", program, kLargestOutput >> 20U);
    case End::kTimedOut:
    case End::kStopped:
      return Error(ErrorCode::kTimeout, "{} did not end within {} ms and was killed", program, kTimeout.count());
    case End::kEnded:
      break;
  }
  if (!WIFEXITED(run.wait_status)) {
    return Error(ErrorCode::kDisconnected, "{} was ended by signal {}", program, WTERMSIG(run.wait_status));
  }
  return run;
}

/// The common style of every figure: two axes, a light grid, colour for data only.
std::string preamble(const Plot& plot) {
  return fmt::format(
      "# Draw again by hand: gnuplot -d {0}.gp > {0}.svg\n"
      "set encoding utf8\n"
      "set terminal svg size {1},{2} dynamic noenhanced font 'sans-serif,14' background '#ffffff' name {3}\n"
      "set border 3 lc rgb '#777777' lw 1\n"
      "set tics nomirror out scale 0.5 textcolor rgb '#333333'\n"
      "set grid back lc rgb '#e4e4e4' lw 1 dt solid\n"
      "set key textcolor rgb '#333333' samplen 1.6 spacing 1.1\n"
      "set style fill solid 1.0 noborder\n"
      "set datafile missing '?'\n",
      plot.stem, plot.width_px, plot.height_px, gnuplot_string(plot.stem));
}

void replace_between(std::string& text, std::string_view begin, std::string_view end, const std::string& middle) {
  const std::size_t from = text.find(begin);
  const std::size_t to = from == std::string::npos ? from : text.find(end, from);
  if (to != std::string::npos) text.replace(from + begin.size(), to - from - begin.size(), middle);
}

/// Luminance at which a colour's contrast with white is 3 to 1, as WCAG 2.1 requires of graphics: (1 + 0.05) / (Y +
/// 0.05).
constexpr double kLightestLine = 0.30;

int srgb_code(double linear) {
  const double value = std::isfinite(linear) ? std::clamp(linear, 0.0, 1.0) : 0.0;
  const double coded = value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1 / 2.4) - 0.055;  // IEC 61966-2-1
  return int(std::lround(255 * coded));
}

/// Returns a figure with its caption.
std::string figure_html(const Figure& figure) {
  std::string caption = html::text("strong", figure.title + ".");
  if (!figure.number.empty()) caption += html::text("span", fmt::format("The paper's {}. ", figure.number));
  caption = html::element("figcaption", caption + escape(figure.caption));
  return html::element("figure", inline_svg(figure.svg, figure.stem) + caption,
                       fmt::format("id=\"{}\"{}", escape(figure.stem), figure.wide ? " class=\"wide\"" : ""));
}

}  // namespace

Status Gnuplot::prepare() const {
  const Result<base::ChildResult> version = run_program(program, {"--version"});
  const int status = version ? WEXITSTATUS(version->wait_status) : 0;
  if (!version || status != 0 || !version->output.starts_with("gnuplot")) {
    const std::string why =
        version ? fmt::format("'{} --version' ended with {}", program, status) : version.error().message;
    return Error(ErrorCode::kUnavailable,
                 "gnuplot is not installed or does not run ({}); the figures need it: apt install gnuplot-nox", why);
  }
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Error(ErrorCode::kUnavailable, "cannot make {}: {}", folder.string(), error.message());
  }
  return {};
}

Result<std::string> Gnuplot::draw(const Plot& plot) const {
  const std::filesystem::path script = folder / (plot.stem + ".gp");
  if (const Status written = write_file(script, preamble(plot) + plot.commands); !written) return written.error();
  Result<base::ChildResult> drawn = run_program(program, {"-d", script.string()});
  if (!drawn) return drawn.error();
  std::string& svg = drawn->output;
  if (WEXITSTATUS(drawn->wait_status) != 0 || svg.find("</svg>") == std::string::npos) {
    return Error(ErrorCode::kBadData, "gnuplot could not draw {} (ended with {}): {}", script.string(),
                 WEXITSTATUS(drawn->wait_status), drawn->errors.substr(0, 2000));
  }
  replace_between(svg, "<title>", "</title>", escape(plot.title));
  // The image is inserted afterwards, because gnuplot would write a plotted image as a separate file beside the SVG.
  const std::size_t behind = svg.find("<defs>");  // follows the background
  if (!plot.underlay.empty() && behind == std::string::npos) {
    return Error(ErrorCode::kBadData, "gnuplot's SVG of {} has no <defs> element to insert the image before",
                 script.string());
  }
  if (!plot.underlay.empty()) svg.insert(behind, plot.underlay);
  if (const Status written = write_file(folder / (plot.stem + ".svg"), svg); !written) return written.error();
  return std::move(svg);
}

std::string gnuplot_string(std::string_view text) {
  std::string safe = "'";
  for (const char c : cleaned(text)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\'') safe += c;  // a quote is written twice
    safe += byte < 0x20 || byte == 0x7F ? ' ' : c;
  }
  return safe + "'";
}

std::string number(std::optional<double> value) {
  return value && std::isfinite(*value) ? fmt::format("{:.9g}", *value) : "NaN";
}

std::string data_block(std::string_view name, std::string_view rows) {
  return fmt::format("${} << END_OF_DATA\n{}END_OF_DATA\n", name, rows);
}

std::string plot_command(const std::vector<std::string>& plots) {
  return fmt::format("plot {}\n", plots.empty() ? "NaN notitle" : fmt::format("{}", fmt::join(plots, ", \\\n     ")));
}

double readable_limit(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double most = values[(values.size() * 98 + 99) / 100 - 1];
  return most > 0 && values.back() > 3 * most ? 1.5 * most : values.back();
}

Status write_file(const std::filesystem::path& file, std::string_view content) {
  try {
    runlog::write_whole(file, content);
  } catch (const runlog::DiskError& error) {
    return Error{ErrorCode::kUnavailable, error.what()};
  }
  return {};
}

std::string own_colour(const std::array<double, 3>& colour) {
  return fmt::format("#{:02x}{:02x}{:02x}", srgb_code(colour[0]), srgb_code(colour[1]), srgb_code(colour[2]));
}

std::string line_colour(const std::array<double, 3>& colour) {
  const double luminance = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2];  // ITU-R BT.709
  const double factor = luminance > kLightestLine ? kLightestLine / luminance : 1.0;
  return own_colour({colour[0] * factor, colour[1] * factor, colour[2] * factor});
}

Figure drawn(const DrawingTools& tools, Figure figure, Plot plot) {
  plot.stem = figure.stem;
  plot.title = figure.title;
  if (Result<std::string> svg = tools.gnuplot.draw(plot)) {
    figure.svg = *std::move(svg);
  } else {
    tools.notes.push_back("The figure \"" + figure.title + "\" is missing: " + svg.error().message);
  }
  return figure;
}

std::string figures_html(const std::vector<Figure>& figures) {
  std::string text;
  for (const Figure& figure : figures) {
    if (!figure.svg.empty()) text += figure_html(figure);
  }
  return text.empty() ? "" : html::element("div", text, "class=\"figures\"");
}

}  // namespace twocone::report
