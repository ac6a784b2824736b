// SPDX-License-Identifier: Apache-2.0
// Writes docs/numerical-stability.md and its figures, which show the effect of rounding on our formulas and on the
// textbook's.
#include <sys/wait.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include "tests/numerics/experiments.h"
#include "tests/numerics/judge.h"

namespace twocone::numerics {
namespace {

namespace fs = std::filesystem;

/// Line styles: the textbook's formulas are orange, ours are blue; float is hollow and broken, double filled and whole.
const char* look(Look look) {
  switch (look) {
    case Look::kTextbookFloat:
      return "lw 1.5 dt (6,4) pt 6 ps 0.5 lc rgb '#e08a3c'";
    case Look::kTextbookDouble:
      return "lw 1.8 pt 7 ps 0.5 lc rgb '#c44e00'";
    case Look::kOursFloat:
      return "lw 1.5 dt (6,4) pt 4 ps 0.5 lc rgb '#5b9bd5'";
    case Look::kOursDouble:
      return "lw 1.8 pt 5 ps 0.5 lc rgb '#0b5394'";
    case Look::kReference:
      return "lw 1.8 dt (2,3) pt 8 ps 0.6 lc rgb '#2e8b57'";
  }
  return "";
}

/// The gnuplot script, in the style of the report's figures (apps/report/kit/gnuplot.cpp), with logarithmic axes.
std::string script(const Experiment& e) {
  std::string text = fmt::format(
      "set encoding utf8\n"
      "set terminal svg size 900,460 dynamic noenhanced font 'sans-serif,14' background '#ffffff' name '{}'\n"
      "set border 3 lc rgb '#777777' lw 1\n"
      "set tics nomirror out scale 0.5 textcolor rgb '#333333'\n"
      "set grid back lc rgb '#e4e4e4' lw 1 dt solid\n"
      "set key outside right center vertical Left reverse textcolor rgb '#333333' samplen 2.4 spacing 1.2\n"
      "set logscale xy\n"
      "set format '%.0e'\n"
      "set title '{}' textcolor rgb '#222222'\n"
      "set xlabel '{}' textcolor rgb '#333333'\n"
      "set ylabel '{}' textcolor rgb '#333333'\n"
      "set xrange [{}:{}]\n"
      "set yrange [{}:{}]\n",
      e.stem, e.title, e.x_label, e.y_label, e.x_range.first, e.x_range.second, e.y_range.first, e.y_range.second);
  // Tics are at whole decades, few enough to be legible.
  const double decades = std::log10(e.x_range.second / e.x_range.first);
  text += decades > 9   ? "set xtics 1000\n"
          : decades < 3 ? "set format x '%g'\nset xtics (0.5, 1, 2, 3, 5, 10, 20, 30)\n"
                        : "set xtics 10\n";
  text += std::log10(e.y_range.second / e.y_range.first) > 10 ? "set ytics 1000\nset mytics 1\n"
                                                              : "set ytics 10\nset mytics 1\n";
  std::string plots;
  for (std::size_t i = 0; i < e.series.size(); ++i) {
    text += fmt::format("$s{} << EOD\n", i);
    for (const auto& [x, y] : e.series[i].points)
      text += fmt::format("{:.6g} {:.6g}\n", x, std::max(y, e.y_range.first));
    text += "EOD\n";
    plots += fmt::format("{}$s{} using 1:2 with linespoints {} title '{}'", i == 0 ? "" : ", ", i,
                         look(e.series[i].look), e.series[i].name);
  }
  return text + "plot " + plots + "\n";
}

void draw(const Experiment& e, const fs::path& folder) {
  const fs::path file = folder / (e.stem + ".svg");
  const std::string command = fmt::format("timeout 60 gnuplot -d > '{}'", file.string());
  std::FILE* const pipe = popen(command.c_str(), "w");
  if (pipe == nullptr) throw std::runtime_error("cannot start a shell for gnuplot");
  const std::string text = script(e);
  const bool written = std::fwrite(text.data(), 1, text.size(), pipe) == text.size();
  const int status = pclose(pipe);
  if (!written || status != 0) {
    throw std::runtime_error(
        fmt::format("gnuplot did not draw {} (status {}); it is needed for the figures: apt install gnuplot-nox",
                    file.string(), WIFEXITED(status) ? WEXITSTATUS(status) : status));
  }
}

void write_page(std::ostream& out, const std::vector<exact::Record>& records,
                const std::vector<Experiment>& experiments, int cases, int draws) {
  fmt::print(out,
             "# Numerical stability\n\n"
             "Written by the program `numerical_stability`, not by hand. To repeat it, byte for byte with the same "
             "compiler and C library:\n\n"
             "```\n"
             "cmake --preset release && cmake --build --preset release --target numerical_stability\n"
             "build/release/tests/numerics/numerical_stability --cases {} --draws {}\n"
             "```\n\n"
             "This one: twocone {}, compiler {} {}, doubles of eps = 2.2e-16, floats of eps = 1.2e-07, fixed seeds.\n\n"
             "## What is measured\n\n"
             "Every error is the distance from the answer in 50 decimal digits (Boost.Multiprecision) to the same "
             "question, asked with the very "
             "numbers that the function was given, so that no rounding of input counts.\n\n"
             "The *condition* of a question is `|f| + sum |df/dx_i| |x_i|`, from differences in 50 digits: how far one "
             "rounding of each input and of "
             "the answer would move it. `condition x eps` is the error that no algorithm in doubles can be blamed for; "
             "the table says how many "
             "times that the worst error over all cases is. Below 1 a function is as good as its input; the bound, "
             "counted from its operations, is what "
             "`numerics_test` holds it to. Two questions are put as the code puts them: pose_bound inverts a sum, so "
             "its condition is that of the "
             "sum; triangulate takes one last step of at most a millionth of a sigma, which is counted in.\n\n"
             "## Worst error of each function, in units of condition x eps\n\n"
             "| function | cases | worst | bound | generated from |\n|---|---|---|---|---|\n",
             cases, draws, TWOCONE_VERSION, TWOCONE_COMPILER, __VERSION__);
  for (const exact::Record& r : records) {
    fmt::print(out, "| {} | {} | {:.2g} | {:g} | {} |\n", r.function, r.cases, r.worst, r.bound, r.cases_of);
  }
  fmt::print(out,
             "\n## The textbook's formulas and ours\n\n"
             "Each point is the worst of {} generated cases. Orange is the textbook's formula, blue is ours; float is "
             "broken and hollow, double is whole "
             "and filled. Errors below the lowest tic are drawn on it. Answers that are no number are left out of the "
             "lines and counted in the "
             "sentence below the figure, which is written from the data.\n",
             draws);
  for (const Experiment& e : experiments) {
    fmt::print(out, "\n### {}\n\n{}\n\n![{}: {} against {}](figures/{}.svg)\n\n{}\n", e.title, e.what, e.title,
               e.y_label, e.x_label, e.stem, e.conclusion);
  }
}

int run(int argc, char** argv) {
  std::string folder = std::string(TWOCONE_SOURCE_DIR) + "/docs";
  int cases = 2000;
  int draws = 100;
  CLI::App app("Measures what rounding does to our formulas and to the textbook's, and writes numerical-stability.md");
  app.add_option("--out", folder, "folder of numerical-stability.md and figures/")->capture_default_str();
  app.add_option("--cases", cases, "generated cases of a function")
      ->check(CLI::Range(8, 1000000))
      ->capture_default_str();
  app.add_option("--draws", draws, "generated cases of a point in a figure")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  const fs::path figures = fs::path(folder) / "figures";
  fs::create_directories(figures);
  const std::vector<Experiment> experiments = {
      circles_near_tangency(draws),      trilateration_far_from_the_origin(draws),
      arcs_of_little_turn(draws),        least_squares_of_mixed_sigmas(draws),
      ranges_of_little_disparity(draws), angles_between_near_directions(draws)};
  for (const Experiment& e : experiments) {
    draw(e, figures);
    std::cout << e.title << ": " << e.conclusion << "\n";
  }
  std::vector<exact::Record> records;
  for (const auto& measure : exact::measures()) {
    for (const exact::Record& r : measure.second(cases)) {
      std::cout << fmt::format("{:55} {:8.3g} of {:g}\n", r.function, r.worst, r.bound);
      records.push_back(r);
    }
  }
  const fs::path page = fs::path(folder) / "numerical-stability.md";
  std::ofstream out(page);
  write_page(out, records, experiments, cases, draws);
  out.close();
  if (!out) throw std::runtime_error("cannot write " + page.string());
  std::cout << "wrote " << page.string() << "\n";
  return 0;
}

}  // namespace
}  // namespace twocone::numerics

int main(int argc, char** argv) {
  try {
    return twocone::numerics::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "numerical_stability: " << error.what() << "\n";
    return 1;
  }
}
