// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/estimation/estimator.h"
#include "apps/runlog/answer_rows.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/disk.h"
#include "apps/runlog/storage/locked_folder.h"
#include "apps/runlog/storage/results_exchange.h"
#include "drivers/sim_povray/pixel_truth.h"
#include "hal/image.h"

namespace twocone::runlog {

/// One finished frame of a run, with everything that is written about it.
struct FrameRecord {
  FrameRow frame;
  DriveRow drive;
  std::optional<PoseRow> truth;
  PoseRow odometry;
  AnswerRows answer;
  std::vector<vision::Beam> scan{};  ///< of a run that scans
};

/// What the pixels of a camera's image show (run --truth).
struct CameraTruth {
  std::string camera;  ///< `lower`, `upper`, or its name in the robot file
  sim_povray::PixelTruth pixels;
};

/// The image of a camera outside the pair. It is written as NAME/NNNNNN.png beside lower/ and upper/.
struct OtherImage {
  std::string camera;  ///< its name in the robot file
  std::shared_ptr<const Image> image;
};

/// The tables of answers in a folder, which grow frame by frame.
class AnswerTables {
 public:
  /// @throws DiskError
  explicit AnswerTables(const std::filesystem::path& folder, OldLines old = OldLines::kDrop);
  /// @throws DiskError
  void add(const AnswerRows& rows);

 private:
  std::filesystem::path folder_;
  OldLines old_;
  LineFile ranges_, fixes_, timing_, estimate_, track_;
  std::optional<LineFile> sightings_;  ///< exists after the first frame with a sighting
  std::optional<LineFile> landmarks_;  ///< exists after the first frame with one
};

/// Writes a run folder frame by frame and holds its lock. A frame's row in frames.csv is written last, so every frame
/// in frames.csv is completely on disk.
class RunFolder {
 public:
  /// Creates the folder (NewFolder). The folder is removed if no frame is added.
  /// @param old kKeep: the folder of a run that was cut off. The caller adds its frames again from the first one.
  /// Existing content stays and must be the same, and missing content is written
  /// @throws DiskError
  explicit RunFolder(const std::filesystem::path& folder, OldLines old = OldLines::kDrop);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }

  /// @throws DiskError
  void add(const FrameRecord& record, const Image& lower, const Image& upper,
           const std::vector<OtherImage>& others = {}, const std::vector<CameraTruth>& truth = {});

 private:
  void store(const std::filesystem::path& file, const Image& image) const;

  std::filesystem::path folder_;
  OldLines old_;
  NewFolder new_;
  LineFile frames_, drive_, truth_, odometry_;
  std::optional<LineFile> scans_;
  AnswerTables answers_;
};

/// Replaces the results of a method (ResultsExchange). Requires the folder's RunLock.
/// @param info of the run, for summary.json; null: there is none
/// @throws DiskError, config::FileError; then nothing has changed
void write_results(const std::filesystem::path& folder, const std::string& method,
                   const std::vector<AnswerRows>& answers, OnTop on_top, const RunInfo* info = nullptr);

/// Like write_results, with the tables that a live run wrote at the top of the folder. Requires the folder's RunLock.
/// @throws as write_results()
void file_results(const std::filesystem::path& folder, const std::string& method, const RunInfo* info = nullptr);

/// Writes summary.json of a run's method, from its tables, into methods/NAME/ and at the top. Requires the folder's
/// RunLock. @throws DiskError
void write_summary(const RunData& run);

/// Returns the images of a run folder by camera and sequence number, for simulated cameras
/// (sim_povray::SessionSettings::stored).
class StoredImages {
 public:
  /// Reads the list of frames from frames.csv. @throws config::FileError
  /// @param with_truth an image without the files of its truth counts as missing
  explicit StoredImages(std::filesystem::path folder, bool with_truth = false);

  [[nodiscard]] int frames() const { return frames_; }
  /// Returns FrameRow::host_t_s of the last frame; 0: none.
  [[nodiscard]] double last_host_t_s() const { return last_host_t_s_; }

  /// Returns null if the image is missing or unreadable. The camera then renders it again.
  [[nodiscard]] std::shared_ptr<const Image> operator()(const std::string& camera, std::uint64_t sequence) const;

 private:
  std::filesystem::path folder_;
  bool with_truth_;
  std::map<std::pair<std::string, std::uint64_t>, std::uint64_t> frame_of_;
  int frames_ = 0;
  double last_host_t_s_ = 0;
};

}  // namespace twocone::runlog
