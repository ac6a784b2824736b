// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "apps/files/map_file.h"
#include "apps/files/robot_file.h"
#include "apps/runs/run_data.h"
#include "hal/image.h"
#include "localisation/fix.h"
#include "vision/full_ranging.h"
#include "vision/paper_ranging.h"

namespace twocone::runs {

/// How ranges and fixes are made from a stereo frame.
enum class Method {
  kPaper,  ///< Burbridge & Spacek 2006, sections 3.2 and 3.3: the baseline
  kFull,   ///< vision/full_ranging.h, localisation/least_squares_fix.h and, for the estimate, pose_filter.h
};
/// What a program uses that is not told otherwise.
constexpr Method kDefaultMethod = Method::kFull;
/// As the command knows them: paper, full.
std::vector<std::string> method_names();
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
  std::variant<vision::PaperRanging, vision::FullRanging> ranging_;
};

/// The answer as rows of the tables, judged against the truth where there is one.
struct AnswerRows {
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;  ///< one; two of an ambiguous frame
  std::vector<SightingRow> sightings;
  /// What the track (track.h) makes of it.
  std::optional<PoseRow> estimate;
};
/// @param answer ranges in the map's order; its fix's outliers are indices of them
/// @param truth where the robot really was; null on hardware
AnswerRows to_rows(std::uint64_t frame, double t_s, const FrameAnswer& answer, const files::Map& map,
                   const PoseRow* truth);

}  // namespace twocone::runs
