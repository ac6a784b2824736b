// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/plane.h"
#include "drivers/sim_povray/pixel_truth.h"

/// The folder truth/ of a run (run --truth, docs/file-formats.md).
namespace twocone::runlog {

/// Writes truth/CAMERA_NNNNNN_object.png (16-bit grey), ..._distance.npy (float32, rows x columns) and ..._normal.npy
/// (float32, rows x columns x 3). @throws DiskError
void write_truth(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame,
                 const sim_povray::PixelTruth& truth);

/// Returns whether the run has all files of an image's truth.
[[nodiscard]] bool has_truth(const std::filesystem::path& run, const std::string& camera, std::uint64_t frame);

/// Writes truth/objects.csv: number,kind,name,landmark,file,line. An object that stands still belongs to a landmark if
/// its box lies within the landmark's, to 1 mm. @throws DiskError
void write_true_objects(const std::filesystem::path& run, const std::vector<sim_povray::TrueObject>& objects,
                        const std::vector<Landmark>& landmarks);

}  // namespace twocone::runlog
