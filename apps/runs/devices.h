// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/frame.h"
#include "hal/stereo_rig.h"

/// What a run on real devices needs beyond one in simulation.
namespace twocone::runs {

/// "lower: Logi (/dev/video0), MJPG 640 x 480 at 30 Hz, gain 16": as applied, for run.yaml; empty without a device.
std::string describe(const std::string& view, const CameraFacts& facts);
/// "drive: /dev/ttyUSB0 at 57600 baud, ros_arduino_bridge, 990 counts a turn, its own time-out 2000 ms, guarded";
/// empty without a device.
std::string describe(const DriveFacts& facts);

/// Puts rgb8 pixels in the place of the camera's own, which must be there already. Errors: those of Frame::image,
/// to_rgb8.
Status decode(Frame& frame);
/// Decodes both views. Errors: the same, with the view's name.
Status decode(StereoFrame& frame);

}  // namespace twocone::runs
