// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <optional>
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

/// What an answer took.
struct Effort {
  double vision_s = 0;        ///< processor time of the calling thread, from two pictures to ranges and bearings
  double localisation_s = 0;  ///< likewise, from those to the fix
  double wall_s = 0;          ///< of both together, by the clock on the wall
  int refined = 0;            ///< landmarks taken as far as vision::Stage::kFine in one view or both
  /// Stage `adaptive` with a budget: the answer took longer than that.
  bool is_over_budget = false;
};

/// What one stereo frame tells: a measurement for each landmark in the map's order, and the fix from them.
struct FrameAnswer {
  std::vector<vision::RangeMeasurement> ranges;
  localisation::Fix fix;
  Effort effort{};
};

/// Of std::chrono::steady_clock; its zero means nothing.
double steady_time_s();

/// Ranging and localisation as the robot file and the map say (files::EstimatorKeys; method paper knows only its
/// `landmarks`): the same for a live run and for stored pictures. Without a budget the answer is a function of the two
/// pictures alone. A fix of method `full` is judged by the map's bounds (map_bounds.h).
class Estimator {
 public:
  /// @param clock_s seconds; a budget, and Effort::wall_s, are by it
  /// @throws files::FileError for a rig or a map that the method cannot use, and for a stage or a landmark that there
  /// is not
  Estimator(Method method, const files::Robot& robot, const files::Map& map,
            std::function<double()> clock_s = steady_time_s);

  /// Errors: kBadData for pictures of another size than the robot file says, or that hold too few bytes.
  [[nodiscard]] Result<FrameAnswer> answer(const Image& lower, const Image& upper) const;

 private:
  void answer_by_paper(const vision::PaperRanging& ranging, const cv::Mat& lower, const cv::Mat& upper,
                       FrameAnswer& answer) const;
  void answer_by_full(const vision::FullRanging& ranging, const cv::Mat& lower, const cv::Mat& upper, double begin_s,
                      FrameAnswer& answer) const;

  std::vector<Eigen::Vector2d> landmarks_m_;
  files::Bounds bounds_;
  cv::Size lower_size_;
  cv::Size upper_size_;
  std::array<Eigen::Vector2d, 2> centres_px_;  ///< of lower and upper
  files::EstimatorKeys keys_;
  std::optional<vision::Stage> stage_;  ///< none: adaptive
  std::function<double()> clock_s_;
  std::vector<std::size_t> wanted_;
  std::variant<vision::PaperRanging, vision::FullRanging> ranging_;
};

/// The answer as rows of the tables, judged against the truth where there is one.
struct AnswerRows {
  std::vector<RangeRow> ranges;
  std::vector<FixRow> fixes;  ///< one; two of an ambiguous frame
  std::vector<SightingRow> sightings;
  /// What it took (effort.h).
  std::optional<EffortRow> effort{};
  /// What the track (track.h) makes of it; estimate.tum, too, is written from it.
  std::optional<TrackRow> track{};
};
/// @param answer ranges in the map's order; its fix's outliers are indices of them
/// @param truth where the robot really was; null on hardware
AnswerRows to_rows(std::uint64_t frame, double t_s, const FrameAnswer& answer, const files::Map& map,
                   const PoseRow* truth);

}  // namespace twocone::runs
