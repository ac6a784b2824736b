// SPDX-License-Identifier: Apache-2.0
#include "apps/runlog/tables/truth_table.h"

#include <iterator>

#include <fmt/format.h>

#include "apps/runlog/storage/disk.h"
#include "apps/runlog/tables/csv_fields.h"

namespace twocone::runlog {

std::filesystem::path truth_file(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame) {
  return run / camera / fmt::format("{:06}.truth.csv", frame);
}

void write_truth(const std::filesystem::path& file, const std::vector<sim_povray::TruePixel>& pixels,
                 const std::vector<Landmark>& landmarks) {
  std::string text = "column_px,row_px,landmark,distance_m,height_m\n";
  for (const sim_povray::TruePixel& pixel : pixels) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{:.5f},{:.5f}\n", pixel.column_px, pixel.row_px,
                   to_field(landmarks.at(pixel.landmark).name), pixel.distance_m, pixel.height_m);
  }
  write_whole(file, text);
}

}  // namespace twocone::runlog
