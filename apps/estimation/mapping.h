// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "hal/image.h"
#include "hal/result.h"
#include "localisation/map_filter.h"
#include "vision/landmark_search.h"
#include "vision/outline_ranging.h"
#include "vision/unhidden_width.h"

namespace twocone::estimation {

/// Returns the map with bounds and obstacles only.
config::Map without_landmarks(config::Map map);

/// A landmark that was found on the way.
struct MappedLandmark {
  std::string name;                                    ///< by hue and number: red.1
  Landmark landmark;                                   ///< with the standard deviations of its numbers
  Eigen::Matrix2d place_m2 = Eigen::Matrix2d::Zero();  ///< covariance of x and y
  std::size_t sightings = 0;                           ///< frames that showed it
};

/// What one frame gave.
struct MappedFrame {
  TrackAnswer track;
  Timing timing;
};

/// Finds landmarks and the pose from them at the same time, frame by frame, in a room of which no map lists landmarks.
///
/// 1. The hues that stand out in the images so far (vision/landmark_search.h), looked for again every kHuesEvery
///    frames.
/// 2. Things of these hues in both views, roughly; a new one becomes a landmark of the filter
///    (localisation/map_filter.h).
/// 3. Landmarks that enough frames have shown are measured by their outlines
///    (vision/outline_ranging.h), where the filter expects them, in one view or both. An outline that is narrower than
///    others of that landmark is left out: something hides a part of it (vision/unhidden_width.h).
/// 4. A landmark that was near for long, inside a view, and not seen, compared with how often it was seen, is removed:
///    it was something that passed by. One that is far away stays, also for a whole way round.
/// 5. A landmark of which something hid a part at first, so that its place is wrong, is removed too, and found again.
///    Either most of its widths turn out to be those of a part, or something of its hue was seen in its place more
///    often than it was seen itself.
///
/// The world is that of the start pose, which is exact by definition. The answers depend on the images and the wheels
/// alone.
class Mapping {
 public:
  static constexpr std::size_t kHuesEvery = 10;

  /// @param map its bounds count, its landmarks do not. @throws config::FileError for a rig that the method cannot use
  Mapping(const config::Robot& robot, const config::Map& map);

  /// Answers a frame. Requires the frames in order.
  /// @param motion of the body while the images are exposed; nothing: the robot stands
  /// @param t_s,left_rad,right_rad the wheels' total angles at the frame's time
  /// Errors: those of Estimator::answer
  Result<MappedFrame> answer(const Image& lower, const Image& upper, const std::optional<vision::FrameMotion>& motion,
                             double t_s, double left_rad, double right_rad);

  /// Returns the landmarks that enough frames have shown.
  [[nodiscard]] std::vector<MappedLandmark> landmarks() const;

 private:
  void find_hues(const cv::Mat& lower, const cv::Mat& upper);
  [[nodiscard]] MappedLandmark landmark(std::size_t index) const;
  /// Returns whether enough frames have shown a landmark.
  [[nodiscard]] static bool is_settled(const localisation::FoundLandmark& landmark);
  /// Returns the filter's indices of the landmarks that enough frames have shown.
  [[nodiscard]] std::vector<std::size_t> settled() const;
  void renew_ranging();
  [[nodiscard]] std::vector<vision::RoughLandmark> measured(const cv::Mat& lower, const cv::Mat& upper,
                                                            const std::optional<vision::FrameMotion>& motion);
  /// Returns whether a rough thing adds nothing to what outlines have measured, or to what is known well, or may be a
  /// part of it.
  [[nodiscard]] bool is_known(const vision::RoughLandmark& thing,
                              const std::vector<vision::RoughLandmark>& measured) const;
  /// Remembers that something of a landmark's hue is where that landmark is expected.
  void note_presence(const vision::RoughLandmark& thing);
  /// Names the landmarks that enough frames have shown, and removes those that passed by or are contradicted.
  void follow();
  /// Compares the radii of the landmarks that have been seen for long enough with those of the others, each once.
  void compare_radii();
  /// Forgets things of vivid colours once there are vision::kBandsAlone banded landmarks.
  void go_by_bands();

  config::Robot robot_;
  config::Map map_;  ///< its landmarks are those that ranging_ measures
  vision::Rig rig_;
  vision::BeliefErrors errors_;
  cv::Size lower_size_, upper_size_;
  std::vector<Eigen::Vector3d> colours_;
  std::optional<vision::LandmarkSearch> search_;
  bool has_bands_ = false;  ///< bands alone are searched for
  localisation::MapFilter filter_;
  struct Follow {
    std::string name{};      ///< empty until enough frames have shown it
    double farthest_m = 0;   ///< greatest range at which it was seen
    std::size_t missed = 0;  ///< frames in which it was near, inside a view, and not seen
    vision::UnhiddenWidth width{};
    std::size_t left_out = 0;      ///< widths of sightings that were left out, as those of a part of it
    bool is_hidden = false;        ///< in part, in this frame
    bool is_there = false;         ///< something of its hue is where it is expected, in this frame
    std::size_t contradicted = 0;  ///< frames in which it was so, but it was not seen itself
    bool is_compared = false;      ///< its radius, with those of the others
  };
  std::vector<Follow> follows_;         ///< of the filter's landmarks
  std::map<std::string, int> numbers_;  ///< how many landmarks had a hue's name
  std::optional<vision::OutlineRanging> ranging_;
  std::vector<std::size_t> ranged_;  ///< the filter's indices of those that ranging_ measures
  std::size_t ranging_since_ = 0;    ///< MapFilter::frames() at which it was made
};

}  // namespace twocone::estimation
