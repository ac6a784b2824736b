// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/estimation/estimator.h"
#include "apps/estimation/mapping.h"
#include "apps/estimation/track.h"
#include "apps/runlog/run_folder.h"

namespace twocone::runs {

/// Computes ranges, fix, track and timing of each frame by the run's method, and by method `paper` as the baseline.
class FrameAnswers {
 public:
  /// @throws config::FileError for a robot or map that the run's method cannot use
  /// @param maps the map's landmarks are not used, but found on the way; there is no baseline then
  FrameAnswers(const config::Robot& robot, const config::Map& map, estimation::Method method, bool maps = false);

  /// Returns why method `paper` cannot be the baseline. Empty: it can, or it is the run's method itself.
  [[nodiscard]] const std::string& why_no_baseline() const { return why_no_baseline_; }

  /// Fills in record.answer, and record.scan with estimator.plan. Requires the frames in order. Returns the position by
  /// which to steer, if there is one. Errors: those of Estimator::answer
  Result<std::optional<Eigen::Vector2d>> answer(const Image& lower, const Image& upper, runlog::FrameRecord& record);

  /// Returns the baseline's answers so far.
  [[nodiscard]] const std::vector<runlog::AnswerRows>& baseline() const { return baseline_rows_; }
  /// Returns the landmarks that were found on the way.
  [[nodiscard]] std::vector<estimation::MappedLandmark> found() const;
  /// Returns a sentence about the frames that took longer than their time budget, or nothing if there are none.
  [[nodiscard]] std::optional<std::string> over_budget() const;

 private:
  struct Chain {
    estimation::Method method;
    estimation::Estimator estimator;
    estimation::Track track;
  };
  [[nodiscard]] std::optional<vision::FrameMotion> motion_of(const runlog::FrameRecord& record) const;
  Result<std::optional<Eigen::Vector2d>> map_on(const Image& lower, const Image& upper, runlog::FrameRecord& record);
  /// @param rows where the answer goes; a scan goes into the record
  Result<localisation::Fix> answer(Chain& chain, const Image& lower, const Image& upper, runlog::FrameRecord& record,
                                   runlog::AnswerRows& rows) const;

  const config::Robot& robot_;
  const config::Map map_;  ///< without landmarks where they are found on the way
  const estimation::Method method_;
  std::optional<Chain> chain_;  ///< empty where landmarks are found on the way
  std::optional<estimation::Mapping> mapping_;
  std::optional<Chain> baseline_;
  std::string why_no_baseline_;
  std::vector<runlog::AnswerRows> baseline_rows_;
  std::vector<runlog::TimingRow> timing_;
  std::optional<runlog::DriveRow> last_drive_;  ///< of the frame before
};

}  // namespace twocone::runs
