// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/runs/disk.h"
#include "apps/runs/estimator.h"
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

/// Writes a run folder frame by frame. A frame's row in frames.csv comes last: what is in there is wholly on disk.
class RunFolder {
 public:
  /// Makes the folder; one that holds a run already is refused, so that no run is lost to another.
  /// @throws DiskError
  explicit RunFolder(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

  /// @throws DiskError
  void add(const FrameRecord& record, const Image& lower, const Image& upper,
           const std::vector<OtherPicture>& others = {});

 private:
  std::filesystem::path folder_;
  LineFile frames_, drive_, ranges_, fixes_, effort_, truth_, odometry_, estimate_, track_;
  std::optional<LineFile> sightings_;  ///< from the first frame with a sighting on
};

/// Whether a method's results also go to the top of the folder, where those of the method asked for last are.
enum class OnTop { kNo, kYes };

/// Writes the tables of one method into methods/NAME/, whole files only. @throws DiskError
void write_results(const std::filesystem::path& folder, const std::string& method,
                   const std::vector<AnswerRows>& answers, OnTop on_top);

/// Copies the tables on top into methods/NAME/, after a live run has written them. @throws DiskError
void file_results(const std::filesystem::path& folder, const std::string& method);

/// Writes summary.json into methods/NAME/. @throws DiskError
void write_summary(const std::filesystem::path& folder, const std::string& method, const std::string& json,
                   OnTop on_top);

/// Reads a stored picture. Errors: kNotFound, kBadData.
Result<Image> read_picture(const std::filesystem::path& file);
/// Writes one, whole or not at all. @throws DiskError
void write_picture(const std::filesystem::path& file, const Image& image);

}  // namespace twocone::runs
