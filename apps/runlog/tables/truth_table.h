// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim_povray/reflected_truth.h"

namespace twocone::runlog {

/// Returns the path beside the image: lower/NNNNNN.truth.csv. @param camera `lower`, `upper`
std::filesystem::path truth_file(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame);

/// Writes the true content of a mirror, with a row for each pixel that sees a landmark:
/// column_px,row_px,landmark,distance_m,height_m. Lengths are rounded to 10 micrometres, a tenth of their accuracy.
/// @param landmarks the landmarks to which the pixels refer
/// @throws DiskError
void write_truth(const std::filesystem::path& file, const std::vector<sim_povray::TruePixel>& pixels,
                 const std::vector<Landmark>& landmarks);

}  // namespace twocone::runlog
