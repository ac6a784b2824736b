// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "apps/mcap/mcap.h"

/// Runs as MCAP files, which other programs open (docs/recordings.md).
namespace twocone::recording {

struct ExportCounts {
  std::size_t frames = 0;
  std::size_t without_images = 0;  ///< frames of which a file is missing: the rest of them is there
  std::size_t messages = 0;
};

/// Writes a run folder as an MCAP file, whole or not at all. Times are those of the run, since its first frame. Topics:
///
///     /lower/image, /upper/image              foxglove.CompressedImage: the run's PNG files, byte by byte
///     /lower/camera_info, /upper/camera_info  foxglove.CameraCalibration: the lens and its distortion, as believed
///     /odometry, /fix, /track, /truth         foxglove.PoseInFrame, frame `world`; where there are any
///     /tf                                     foxglove.FrameTransform: the body by its track, and both lenses
///     /scan                                   foxglove.LaserScan of the run's scan.csv, frame `body`
///     /landmarks                              foxglove.SceneUpdate: the map's landmarks and those that were found on
///     the
///                                             way, with their covariances in `metadata` and as 95 % ellipses
///     /events                                 foxglove.Log: events of the run, and verdicts that are not `ok`
///     /telemetry                              JSON, a line of docs/telemetry.md per frame: all numbers
///
/// @throws config::FileError for a folder that is no run; mcap::McapError, runlog::DiskError
ExportCounts export_run(const std::filesystem::path& run, const std::filesystem::path& file,
                        const std::function<void(double done)>& progress);

}  // namespace twocone::recording
