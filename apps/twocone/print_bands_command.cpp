// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "apps/print_bands/band_pages.h"
#include "apps/runlog/storage/disk.h"
#include "apps/twocone/commands.h"
#include "base/plane.h"
#include "vision/bands/band_code.h"

namespace twocone::cli {
namespace {

struct PrintArguments {
  std::vector<int> numbers;
  std::filesystem::path out;
  std::string paper = "a4";
  double cell_m = Bands{}.cell_m;
  double radius_m = 0.025;
  bool force = false;
};

void print_with(const PrintArguments& options) {
  for (const int number : options.numbers) {
    if (number < 1 || number > vision::kBandNumbers) {
      throw BadUsage("print-bands {}: must be 1 to {}", number, vision::kBandNumbers);
    }
  }
  const print_bands::Paper paper = options.paper == "letter" ? print_bands::Paper{215.9, 279.4} : print_bands::Paper{};
  const double most_m = (paper.height_mm - 2 * print_bands::kMargin_mm) / 1000;
  if (options.cell_m > most_m) throw BadUsage("--cell-m {}: must be at most {:.3f}, a page", options.cell_m, most_m);
  if (!options.force) refuse_overwriting({options.out});
  const print_bands::Sheets sheets = print_bands::sheets_of(paper, options.cell_m, options.radius_m);
  runlog::write_whole(options.out, print_bands::pages(options.numbers, paper, options.cell_m, options.radius_m));
  fmt::print("written: {}, {} page{} for each number\n", options.out.string(), sheets.around * sheets.above,
             sheets.around * sheets.above == 1 ? "" : "s");
  fmt::print(
      "print it at 100 % (the scale at the foot is 100 mm), cut along the frames, and wrap each number round a pipe of "
      "radius {:g} m\nthen measure from the floor to the red mark, for the map:\n",
      options.radius_m);
  const std::string cell = options.cell_m == Bands{}.cell_m ? "" : fmt::format(" cell_m: {:g},", options.cell_m);
  for (const int number : options.numbers) {
    fmt::print("  - {{name: pipe_{0}, bands: {0},{1} x_m: ?, y_m: ?, radius_m: {2:g}, line_m: ?}}\n", number, cell,
               options.radius_m);
  }
}

}  // namespace

void add_print_bands(CLI::App& program) {
  auto options = std::make_shared<PrintArguments>();
  CLI::App* command = program.add_subcommand(
      "print-bands", "Write pages to print: the bands that make a pipe a landmark with a number, whatever its colour");
  command->add_option("NUMBER", options->numbers, fmt::format("Numbers, 1 to {}", vision::kBandNumbers))->required();
  command->add_option("--out", options->out, "HTML file, to be printed by a browser")->required()->type_name("FILE");
  command->add_option("--radius-m", options->radius_m, "Radius of the pipe in metres: how many pages go round it")
      ->check(number_within(0.005, 1))
      ->capture_default_str();
  command->add_option("--cell-m", options->cell_m, "Height of one of the 16 cells in metres; larger ones reach farther")
      ->check(number_within(0.005, 1))
      ->capture_default_str();
  command->add_option("--paper", options->paper, "a4 or letter")
      ->check(CLI::IsMember({"a4", "letter"}))
      ->capture_default_str();
  command->add_flag("--force", options->force, "Replace a file that exists");
  command->callback([options] { print_with(*options); });
}

}  // namespace twocone::cli
