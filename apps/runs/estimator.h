// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/runs/run_data.h"
#include "hal/image.h"
#include "localisation/fix.h"
#include "vision/paper_ranging.h"

namespace twocone::runs {

/// How ranges and fixes are made from a stereo frame.
enum class Method {
  kPaper,  ///< Burbridge & Spacek 2006, sections 3.2 and 3.3
};
std::string_view to_string(Method method);
/// @throws std::invalid_argument listing the methods of this build
Method method_named(std::string_view name);

/// What one stereo frame tells: a measurement for each landmark in the map's order, and the fix from them.
struct FrameAnswer {
  std::vector<vision::RangeMeasurement> ranges;
  localisation::Fix fix;
};

/// Ranging and localisation as the robot file and the map say: the same for a live run and for stored pictures.
/// The answer is a function of the two pictures alone.
class Estimator {
 public:
  /// @throws files::FileError for a rig or a map that the method cannot use
  Estimator(Method method, const files::Robot& robot, const files::Map& map);

  /// Errors: kBadData for pictures of another size than the robot file says, or that hold too few bytes.
  [[nodiscard]] Result<FrameAnswer> answer(const Image& lower, const Image& upper) const;

 private:
  std::vector<Eigen::Vector2d> landmarks_m_;
  cv::Size lower_size_;
  cv::Size upper_size_;
  vision::PaperRanging ranging_;
};

/// The answer as rows of the tables, judged against the truth where there is one.
struct AnswerRows {
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;  ///< one; two of an ambiguous frame
  /// The fix with the odometry's heading, while no filter gives a better one.
  std::optional<PoseRow> estimate;
};
/// @param truth where the robot really was; null on hardware
AnswerRows to_rows(std::uint64_t frame, double t_s, const FrameAnswer& answer, const files::Map& map,
                   const PoseRow* truth, const PoseRow& odometry);

}  // namespace twocone::runs
