// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "apps/runlog/run_folder.h"

namespace twocone::runs {

/// Computes ranges, fix, track and timing of each frame by the run's method, and by method `paper` as the baseline.
class FrameAnswers {
 public:
  /// @throws config::FileError for a robot or map that the run's method cannot use
  FrameAnswers(const config::Robot& robot, const config::Map& map, estimation::Method method);

  /// Returns why method `paper` cannot be the baseline. Empty: it can, or it is the run's method itself.
  [[nodiscard]] const std::string& why_no_baseline() const { return why_no_baseline_; }

  /// Fills in record.answer. Requires the frames in order. Errors: those of Estimator::answer
  Result<localisation::Fix> answer(const Image& lower, const Image& upper, runlog::FrameRecord& record);

  /// Returns the baseline's answers so far.
  [[nodiscard]] const std::vector<runlog::AnswerRows>& baseline() const { return baseline_rows_; }
  /// Returns a sentence about the frames that took longer than their time budget, or nothing if there are none.
  [[nodiscard]] std::optional<std::string> over_budget() const;

 private:
  struct Chain {
    estimation::Method method;
    estimation::Estimator estimator;
    estimation::Track track;
  };
  Result<localisation::Fix> answer(Chain& chain, const Image& lower, const Image& upper,
                                   const runlog::FrameRecord& record, runlog::AnswerRows& rows) const;

  const config::Robot& robot_;
  const config::Map& map_;
  Chain chain_;
  std::optional<Chain> baseline_;
  std::string why_no_baseline_;
  std::vector<runlog::AnswerRows> baseline_rows_;
  std::vector<runlog::TimingRow> timing_;
  std::optional<runlog::DriveRow> last_drive_;  ///< of the frame before
};

}  // namespace twocone::runs
