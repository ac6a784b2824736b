// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "apps/doctor/doctor.h"
#include "apps/doctor/report.h"
#include "drivers/backends.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/image.h"
#include "hal/stereo_rig.h"
#include "vision/rim.h"

namespace twocone::doctor {

// ---- time, and the end from outside

/// Thrown by a check that was stopped from outside.
class Interrupted : public std::exception {
 public:
  [[nodiscard]] const char* what() const noexcept override { return "stopped from outside"; }
};

inline double seconds_of(std::chrono::nanoseconds time) { return std::chrono::duration<double>(time).count(); }
inline std::chrono::nanoseconds nanoseconds_of(double seconds) {
  return std::chrono::nanoseconds(std::int64_t(1e9 * seconds));
}

/// Stops a device at the end of a block, however it ends.
template <typename Device>
class Stopping {
 public:
  explicit Stopping(Device& device) : device_(device) {}
  ~Stopping() { static_cast<void>(device_.stop()); }
  Stopping(const Stopping&) = delete;
  Stopping& operator=(const Stopping&) = delete;

 private:
  Device& device_;
};

/// @throws Interrupted if the check was stopped from outside
inline void end_if_asked(const Surroundings& surroundings) {
  if (surroundings.stop) throw Interrupted();
}

// ---- frames

/// Largest relative difference between a measured rate and the requested one that is accepted.
inline constexpr double kRateShare = 0.05;

/// Limits the wait for `seconds` of frames, because a broken camera must not block the doctor. Gives up after a few
/// consecutive failures, or when slow frames or wrong times would make the wait several times as long. The seconds
/// begin after a short part of the stream, in which a camera adjusts its exposure.
class FrameWait {
 public:
  /// @param seconds of the frames' own time, > 0. @param least lower limit of patience()
  FrameWait(double seconds, double rate_hz, std::chrono::milliseconds least, const Surroundings& surroundings);

  /// Returns the longest wait for the next frame.
  [[nodiscard]] std::chrono::milliseconds patience() const { return patience_; }
  /// Returns whether to grab once more. @throws Interrupted
  [[nodiscard]] bool goes_on();
  /// Notes a frame. Returns whether it counts, which requires that the seconds began with an earlier frame.
  bool came(double captured_s);
  /// Returns the time from the frame with which the seconds began to the latest one.
  [[nodiscard]] double done_s() const { return begin_s_ ? last_s_ - *begin_s_ : 0; }
  /// Notes a failure. Returns whether the next grab may succeed.
  [[nodiscard]] bool outlasts(const Error& error);

 private:
  const Surroundings& surroundings_;
  const std::chrono::milliseconds patience_;
  const double seconds_, give_up_s_, most_grabs_;
  double grabs_ = 0;
  int troubles_ = 0;
  std::optional<double> first_s_, begin_s_;
  double last_s_ = 0;
};

// ---- a camera

struct CameraUnderTest {
  std::string name;  ///< as after `cameras:`
  drivers::CameraPart asked;
  std::optional<vision::RimCircle> rim{};  ///< rim of the mirror according to `rig:`; none: a camera without mirror
};

/// Configures the camera, streams for `seconds` and checks the frames. The camera is stopped at the end.
/// @throws Interrupted; the camera is stopped then, too
/// @returns the last image, kRgb8, if there is one
std::optional<Image> check_camera(const CameraUnderTest& test, Camera& camera, double seconds,
                                  const Surroundings& surroundings, Report& report);

// ---- an image

/// Returns the blur of the rim's edge in pixels. It is the step of brightness divided by its steepest slope, as the
/// median over all directions in which the step is clear. The sharpest possible edge has 1 to 2. A Gaussian blur of
/// sigma gives sqrt(2 pi) sigma. The blur shows the focus at the rim's distance, which is a little nearer than the
/// mirror's image. Returns nothing if the rim is visible in too few directions.
std::optional<double> edge_width_px(const cv::Mat& rgb, const vision::RimCircle& rim);

/// Returns the measurement and the advice. The caller sets the part.
/// @param found nothing: there is no rim near the believed one. The robot file is then reported as wrong only if
/// `may_show` (vision::rim_may_show)
/// @param view as in `rig:`
/// @param elsewhere the mirror that find_mirror() finds somewhere else
Row judge_mirror(const std::optional<vision::RimCircle>& found, bool may_show, const vision::RimCircle& believed,
                 const std::string& view, const std::optional<vision::RimMeasurement>& elsewhere = std::nullopt);

/// Adds the rows exposure, mirror and focus of an image. Adds only exposure without a believed rim, and no focus
/// without a rim in the image.
/// @param image kRgb8
void check_image(const std::string& part, const Image& image, const std::optional<vision::RimCircle>& believed,
                 Report& report);

// ---- what both images show of the rig

struct RigUnderTest {
  const config::Robot& robot;
  const config::Map& map;  ///< landmarks with colours and tops
  cv::Mat lower_rgb, upper_rgb;
  std::filesystem::path images;  ///< folder for lower.png and upper.png, which are replaced; empty: none
};

/// Finds the rig in one image of each camera (vision/self_rig.h) and compares it with the robot file: exchanged,
/// mirrored and turned cameras, if the map has three landmarks. Stores both images with the circles of the file and
/// those that were found.
void check_rig(const RigUnderTest& test, Report& report);

// ---- the pair of cameras

struct PairUnderTest {
  CameraSettings lower, upper;
  std::chrono::nanoseconds max_skew{0};
  std::chrono::nanoseconds command_timeout{0};
};

/// Opens both cameras again, with another limit of the skew.
using OpenPair = std::function<Result<StereoRig>(std::chrono::nanoseconds max_skew)>;

/// Measurements of a pair of cameras over some time.
struct Pairs {
  std::vector<double> skews_s{};      ///< from the lower camera's exposure to the upper one's
  std::vector<double> intervals_s{};  ///< from pair to pair
  std::uint64_t unpaired = 0;         ///< frames without a partner
  std::optional<Error> ended_by{};
};

/// Returns the rows for the rate of pairs, the frames without a partner and the longest wait. The pairs were taken with
/// the skew limit of the robot file.
std::vector<Row> judge_pairs(const Pairs& pairs, const PairUnderTest& test);
/// Returns the row for the skew, which also judges whether the limit suits these cameras.
/// @param any pairs that were taken with a limit that pairs every frame
Row judge_skew(const Pairs& any, const PairUnderTest& test);

/// Opens the pair and checks it. Opens it again with a wide limit if that of the robot file leaves frames unpaired.
/// @throws Interrupted
void check_pair(const PairUnderTest& test, const OpenPair& open, double seconds, const Surroundings& surroundings,
                Report& report);

// ---- the drive

/// States whether the wheels may be turned.
enum class Permission { kGiven, kRefused };

struct DriveUnderTest {
  drivers::DrivePart asked;
  double period_s = 0;  ///< period of the frames: the angles are read once in each
};

/// Checks controller, time-out, reading, and whether the wheels stand still without a command. It gives no command.
/// @return whether the moving tests make sense. @throws Interrupted
bool check_standing_drive(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings,
                          Report& report);

/// Asks whether both wheels are off the ground, unless the user has stated it before. Only "yes" permits the moving
/// tests. Any other answer adds a row `not run`.
Permission ask_off_the_ground(bool was_stated, const Surroundings& surroundings, Report& report);

/// Performs the moving tests: which wheel turns in which direction, the speed, the least speed, the counts per turn and
/// the two ways of stopping. Requires wheels off the ground. Stops them afterwards in every case. @throws Interrupted
void check_wheels(const DriveUnderTest& test, DiffDrive& drive, const Surroundings& surroundings, Report& report);

}  // namespace twocone::doctor
