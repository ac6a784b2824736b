// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim_povray/reflected_truth.h"

namespace twocone::runs {

/// Beside the picture that it belongs to: lower/NNNNNN.truth.csv. @param camera `lower`, `upper`
std::filesystem::path truth_file(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame);

/// Writes what a mirror really showed, a row for each pixel that sees a landmark:
/// column_px,row_px,landmark,distance_m,height_m. Metres to 10 micrometres, a tenth of what they are good for.
/// @param landmarks those that the pixels were asked for
/// @throws DiskError
void write_truth(const std::filesystem::path& file, const std::vector<sim_povray::TruePixel>& pixels,
                 const std::vector<sim_povray::TrueLandmark>& landmarks);

}  // namespace twocone::runs
