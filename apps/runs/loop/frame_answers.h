// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/estimation/estimator.h"
#include "apps/estimation/track.h"
#include "apps/runlog/run_folder.h"

namespace twocone::runs {

/// Ranges, fix, track and timing of each frame by the run's method, and by method `paper` beside it as the baseline.
class FrameAnswers {
 public:
  /// @throws config::FileError for what the run's method cannot use
  FrameAnswers(const config::Robot& robot, const config::Map& map, estimation::Method method);

  /// Why there is no baseline, although the run's method is another one; empty: there is.
  [[nodiscard]] const std::string& why_no_baseline() const { return why_no_baseline_; }

  /// Fills in record.answer. Frames come in order. Errors: those of Estimator::answer
  Result<localisation::Fix> answer(const Image& lower, const Image& upper, runlog::FrameRecord& record);

  /// The baseline's answers so far.
  [[nodiscard]] const std::vector<runlog::AnswerRows>& baseline() const { return baseline_rows_; }
  /// A sentence about frames that took longer than their time budget; nothing where none did.
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
};

}  // namespace twocone::runs
