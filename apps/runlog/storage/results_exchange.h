// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>

namespace twocone::runlog {

/// The files of a method's results, in methods/NAME/ and at the top of the run folder. Not every method makes all.
inline constexpr std::array kResultFiles{"ranges.csv", "fixes.csv",    "sightings.csv", "landmarks.csv",
                                         "timing.csv", "estimate.tum", "track.csv",     "summary.json"};

/// States whether results are also copied to the top of the folder, which holds those of the method requested last.
enum class OnTop { kNo, kYes };

/// The way in which two folders are exchanged.
enum class Exchange {
  kAtomic,      ///< in one step (renameat2), if the file system supports it; otherwise as below
  kTwoRenames,  ///< moves the old one away, then the new one to its place
};

/// Replaces methods/NAME/ as one folder, and then the files at the top of the run folder.
///
/// New results are written to stage(), which no reader uses. commit() writes a journal there. From then on the exchange
/// is completed, either by this program or by the next one that locks the folder. A program that fails or is killed
/// before the journal leaves the old results, and one that is killed later leaves the new ones. A mixture is
/// impossible.
///
/// Requires the folder's RunLock.
class ResultsExchange {
 public:
  /// Creates an empty stage. @throws DiskError
  ResultsExchange(std::filesystem::path folder, const std::string& method);
  /// Removes the stage if there was no commit.
  ~ResultsExchange();
  ResultsExchange(const ResultsExchange&) = delete;
  ResultsExchange& operator=(const ResultsExchange&) = delete;

  [[nodiscard]] const std::filesystem::path& stage() const { return stage_; }

  /// @param before_step called before each visible change on disk; a test can end the program there by an exception
  /// @throws DiskError
  void commit(
      OnTop on_top, Exchange how = Exchange::kAtomic, const std::function<void()>& before_step = [] {});

 private:
  std::filesystem::path folder_, place_, stage_;
  bool committed_ = false;
};

/// Completes or removes the exchanges that a killed program left. It touches nothing if there are none. Requires the
/// folder's RunLock. @throws DiskError
void complete_exchanges(
    const std::filesystem::path& folder, const std::function<void()>& before_step = [] {});

/// Returns the folder from which the top results are read: the top itself or, while they are replaced, the folder
/// methods/NAME/ that replaces them.
std::filesystem::path top_results(const std::filesystem::path& folder);

/// Returns a text that changes with every exchange of results, and not while tables grow. Readers without a lock read
/// again if it has changed.
std::string results_state(const std::filesystem::path& folder);

}  // namespace twocone::runlog
