// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>

namespace twocone::runs {

/// The files that a method's results are, in methods/NAME/ and on top of the run folder. Not every method makes each.
inline constexpr std::array kResultFiles{"ranges.csv",   "fixes.csv", "sightings.csv", "effort.csv",
                                         "estimate.tum", "track.csv", "summary.json"};

/// Whether a method's results also go to the top of the folder, where those of the method asked for last are.
enum class OnTop { kNo, kYes };

/// How two folders change places.
enum class Exchange {
  kAtomic,      ///< in one step (renameat2), where the file system can do that; else as below
  kTwoRenames,  ///< the old one away, then the new one to its place
};

/// Replaces methods/NAME/ as one folder, and the files on top of the run folder after that.
///
/// New results are gathered in stage(), which no reader looks at. commit() writes a journal into it: from then on the
/// exchange is completed, if not by this program, then by the next one that locks the folder. So a program that fails
/// or is killed before leaves the old results, one that is killed later leaves the new ones; none leaves a mixture.
///
/// Needs the folder's RunLock.
class ResultsExchange {
 public:
  /// Makes an empty stage. @throws DiskError
  ResultsExchange(std::filesystem::path folder, const std::string& method);
  /// Without a commit, removes the stage.
  ~ResultsExchange();
  ResultsExchange(const ResultsExchange&) = delete;
  ResultsExchange& operator=(const ResultsExchange&) = delete;

  [[nodiscard]] const std::filesystem::path& stage() const { return stage_; }

  /// @param before_step called before each change that the disk sees: a test ends the program there by an exception
  /// @throws DiskError
  void commit(OnTop on_top, Exchange how = Exchange::kAtomic, const std::function<void()>& before_step = {});

 private:
  std::filesystem::path folder_, place_, stage_;
  bool committed_ = false;
};

/// Completes or clears away what a killed program has left of its exchanges; nothing to do: touches nothing. Needs the
/// folder's RunLock. @throws DiskError
void complete_exchanges(const std::filesystem::path& folder, const std::function<void()>& before_step = {});

/// Where the results on top are to be read: on top, or, while they are being replaced, in the methods/NAME/ that
/// replaces them.
std::filesystem::path top_results(const std::filesystem::path& folder);

/// Tells two states of the results apart: changes with every exchange, and not while tables grow. For readers without
/// a lock, who read again when it has changed.
std::string results_state(const std::filesystem::path& folder);

}  // namespace twocone::runs
