// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/runs/disk.h"
#include "apps/runs/estimator.h"
#include "apps/runs/new_folder.h"
#include "apps/runs/results_exchange.h"
#include "apps/runs/run_data.h"
#include "hal/image.h"

namespace twocone::runs {

/// One finished frame of a run, with all that is written of it.
struct FrameRecord {
  FrameRow frame;
  DriveRow drive;
  std::optional<PoseRow> truth;
  PoseRow odometry;
  AnswerRows answer;
};

/// What a camera besides the pair saw with a frame: written as NAME/NNNNNN.png beside lower/ and upper/.
struct OtherPicture {
  std::string camera;  ///< its name in the robot file
  std::shared_ptr<const Image> image;
};

/// Writes a run folder frame by frame, and holds its lock. A frame's row in frames.csv comes last: what is in there is
/// wholly on disk.
class RunFolder {
 public:
  /// Makes the folder (NewFolder), which goes again if no frame is added.
  /// @param old kKeep: the folder of a run that was cut off. The caller adds its frames again from the first on; what
  /// is there stays and must be the same, and what is missing is written
  /// @throws DiskError
  explicit RunFolder(const std::filesystem::path& folder, OldLines old = OldLines::kDrop);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

  /// @throws DiskError
  void add(const FrameRecord& record, const Image& lower, const Image& upper,
           const std::vector<OtherPicture>& others = {});

 private:
  void store(const std::filesystem::path& file, const Image& image) const;

  std::filesystem::path folder_;
  OldLines old_;
  NewFolder new_;
  LineFile frames_, drive_, ranges_, fixes_, effort_, truth_, odometry_, estimate_, track_;
  std::optional<LineFile> sightings_;  ///< from the first frame with a sighting on
};

/// Makes summary.json from the tables of a method, which lie in the folder that it is given.
using SummaryOf = std::function<std::string(const std::filesystem::path& results)>;

/// Replaces the results of a method (ResultsExchange). Needs the folder's RunLock.
/// @param summary none: no summary.json. @throws DiskError and what `summary` throws; then nothing has changed
void write_results(const std::filesystem::path& folder, const std::string& method,
                   const std::vector<AnswerRows>& answers, OnTop on_top, const SummaryOf& summary = {});

/// The same with the tables that a live run has written on top. Needs the folder's RunLock.
/// @throws as write_results()
void file_results(const std::filesystem::path& folder, const std::string& method, const SummaryOf& summary = {});

/// Writes summary.json into methods/NAME/. Needs the folder's RunLock. @throws DiskError
void write_summary(const std::filesystem::path& folder, const std::string& method, const std::string& json,
                   OnTop on_top);

/// Reads a stored picture. Errors: kNotFound, kBadData.
Result<Image> read_picture(const std::filesystem::path& file);
/// Writes one, whole or not at all. @throws DiskError
void write_picture(const std::filesystem::path& file, const Image& image);

}  // namespace twocone::runs
