// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/runlog/run_data.h"
#include "hal/result.h"
#include "vision/calibration.h"

namespace twocone::calibrate {

/// The frames of several runs that a calibration uses.
struct ChosenFrames {
  struct Frame {
    const runlog::RunData* run;
    std::size_t row;                           ///< of run->frames
    std::size_t first_landmark;                ///< index in `landmarks` of the first landmark of the run's map
    std::vector<vision::WheelReading> wheels;  ///< since the previous chosen frame, as in CalibrationFrame
  };
  std::vector<Frame> frames;
  std::vector<Landmark> landmarks;  ///< of the maps of all runs, run by run
};

/// Chooses about `count` frames, spread evenly from the first to the last of each run.
ChosenFrames choose_frames(const std::vector<runlog::RunData>& runs, int count);

/// The sightings of the landmarks with `rig`.
struct Sighted {
  std::vector<vision::CalibrationFrame> frames;
  std::vector<Error> unreadable;  ///< errors of images; their frames have no sightings
};
Sighted sight(const std::vector<runlog::RunData>& runs, const ChosenFrames& chosen, const vision::Rig& rig,
              const std::function<void(double)>& progress);

/// Returns about thirty images of one view from the chosen frames. Unreadable images are left out.
std::vector<cv::Mat> images_for_circles(const ChosenFrames& chosen, vision::Side side);

}  // namespace twocone::calibrate
