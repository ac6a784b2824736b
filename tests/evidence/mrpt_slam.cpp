// SPDX-License-Identifier: Apache-2.0
//
// The range-bearing EKF-SLAM in the plane that MRPT's kf-slam runs (mrpt::slam::CRangeBearingKFSLAM2D, package
// libmrpt-slam-dev), on frames from standard input. survey.sh compiles it; it is no part of the build.
//
//   mrpt_slam SIGMA_RANGE_M SIGMA_BEARING_RAD <FRAMES
//
// A frame is one line of numbers: the motion since the last frame (x_m y_m heading_rad, and the standard deviations of
// the three), and for each landmark seen its number, range_m and bearing_rad. Prints NUMBER X_M Y_M of each landmark.
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CObservationBearingRange.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPosePDFGaussian.h>
#include <mrpt/slam/CRangeBearingKFSLAM2D.h>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: mrpt_slam SIGMA_RANGE_M SIGMA_BEARING_RAD <FRAMES\n";
    return 2;
  }
  mrpt::slam::CRangeBearingKFSLAM2D slam;
  slam.options.std_sensor_range = std::strtof(argv[1], nullptr);
  slam.options.std_sensor_yaw = std::strtof(argv[2], nullptr);
  slam.KF_options.verbosity_level = mrpt::system::LVL_ERROR;
  for (std::string line; std::getline(std::cin, line);) {
    std::istringstream numbers(line);
    double x_m, y_m, heading_rad, sigma_x_m, sigma_y_m, sigma_heading_rad;
    numbers >> x_m >> y_m >> heading_rad >> sigma_x_m >> sigma_y_m >> sigma_heading_rad;
    mrpt::obs::CActionRobotMovement2D motion;
    auto change = std::make_shared<mrpt::poses::CPosePDFGaussian>(mrpt::poses::CPose2D(x_m, y_m, heading_rad));
    change->cov.setZero();
    change->cov(0, 0) = sigma_x_m * sigma_x_m;
    change->cov(1, 1) = sigma_y_m * sigma_y_m;
    change->cov(2, 2) = sigma_heading_rad * sigma_heading_rad;
    motion.poseChange = change;
    auto actions = std::make_shared<mrpt::obs::CActionCollection>();
    actions->insert(motion);

    auto seen = std::make_shared<mrpt::obs::CObservationBearingRange>();
    seen->maxSensorDistance = 100;
    seen->fieldOfView_yaw = 2 * M_PIf;
    for (int landmark = 0; numbers >> landmark;) {
      mrpt::obs::CObservationBearingRange::TMeasurement one;
      numbers >> one.range >> one.yaw;
      one.pitch = 0;
      one.landmarkID = landmark;
      seen->sensedData.push_back(one);
    }
    auto frame = std::make_shared<mrpt::obs::CSensoryFrame>();
    frame->insert(seen);
    slam.processActionObservation(actions, frame);
  }
  mrpt::poses::CPosePDFGaussian pose;
  std::vector<mrpt::math::TPoint2D> places_m;
  std::map<unsigned int, mrpt::maps::CLandmark::TLandmarkID> numbers;
  mrpt::math::CVectorDouble state;
  mrpt::math::CMatrixDouble covariance;
  slam.getCurrentState(pose, places_m, numbers, state, covariance);
  for (const auto& [index, number] : numbers) {
    std::cout << number << ' ' << places_m.at(index).x << ' ' << places_m.at(index).y << '\n';
  }
}
