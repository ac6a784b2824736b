// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/runs/run_data.h"
#include "hal/result.h"
#include "vision/calibration.h"

namespace twocone::calibrate {

/// The frames of several runs that a calibration looks at.
struct ChosenFrames {
  struct Frame {
    const runs::RunData* run;
    std::size_t row;                           ///< of run->frames
    std::size_t first_landmark;                ///< where the landmarks of the run's map begin among `landmarks`
    std::vector<vision::WheelReading> wheels;  ///< since the frame before, as CalibrationFrame has them
  };
  std::vector<Frame> frames;
  std::vector<vision::KnownLandmark> landmarks;  ///< of all runs' maps, run by run
};

/// About `count` frames, evenly from first to last of each run.
ChosenFrames choose_frames(const std::vector<runs::RunData>& runs, int count);

vision::WheelBelief to_wheel_belief(const files::Robot& robot);

/// What is seen of the landmarks under `rig`.
struct Sighted {
  std::vector<vision::CalibrationFrame> frames;
  std::size_t without_answer = 0;
  std::vector<Error> unreadable;  ///< of pictures; their frames have no sightings
};
Sighted sight(const std::vector<runs::RunData>& runs, const ChosenFrames& chosen, const vision::Rig& rig,
              const std::function<void(double)>& progress);

/// Some thirty of the chosen frames' pictures of one view; those that cannot be read are left out.
std::vector<cv::Mat> pictures_for_circles(const ChosenFrames& chosen, vision::Side side);

}  // namespace twocone::calibrate
