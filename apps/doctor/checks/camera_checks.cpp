// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/checks/checks.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/quantile.h"

namespace twocone::doctor {
namespace {

using std::chrono::milliseconds;

// Time at the start of a stream in which a camera adjusts its exposure.
constexpr double kSettling_s = 0.5;
// Some cameras need seconds for the first frame.
constexpr milliseconds kFirstFrame{5'000};
constexpr milliseconds kNextFrame{1'000};
constexpr double kPatientPeriods = 10;
constexpr milliseconds kMostPatience{60'000};
constexpr int kTroublesInARow = 3;
constexpr double kMostTime = 4;
constexpr double kSpare_s = 10;
constexpr double kSpareGrabs = 100;
// A simulated image may still be rendering.
constexpr milliseconds kImageTime{150'000};

/// Measurements of a streaming camera over some time.
struct Footage {
  /// Capture time from one exposure to the next; if frames were lost in between, the mean over these exposures.
  std::vector<double> periods_s;
  /// Capture time between consecutive exposures only.
  std::vector<double> neighbours_s;
  /// Age of frames when they were received; empty if their times come from another clock than the doctor's.
  std::vector<double> ages_s;
  std::uint64_t frames = 0;   ///< received
  std::uint64_t lost = 0;     ///< never received
  std::uint64_t skipped = 0;  ///< received, but skipped for a newer one
  std::uint64_t damaged = 0;  ///< reported as kBadData
  std::optional<Error> ended_by;
  std::optional<Result<Image>> image;  ///< the last one, kRgb8
};

/// Adds the frame `now`, which follows `before`, to the measurements.
void count(const Frame::Header& before, const Frame::Header& now, const Clock& clock, Footage& stream) {
  ++stream.frames;
  stream.skipped += std::min(now.skipped_before, now.lost_before);
  stream.lost += now.lost_before - std::min(now.skipped_before, now.lost_before);
  const double time_s = now.captured.seconds() - before.captured.seconds();
  const auto steps = now.sequence > before.sequence ? now.sequence - before.sequence : 1;
  stream.periods_s.push_back(time_s / double(steps));
  if (steps == 1) stream.neighbours_s.push_back(time_s);
  const Timestamp here = clock.now();
  if (here.clock == now.captured.clock) stream.ages_s.push_back(here.seconds() - now.captured.seconds());
}

/// Takes frames for `seconds` of their own time, after a short time in which the camera adjusts its exposure. Gives up
/// as FrameWait does.
/// @param camera streaming. @param what for the progress. @throws Interrupted
Footage take_stream(Camera& camera, double seconds, const std::string& what, const Surroundings& surroundings) {
  FrameWait wait(seconds, camera.facts().settings.rate_hz, kNextFrame, surroundings);
  Footage stream;
  std::optional<Frame> last;
  while (wait.goes_on()) {
    auto frame = camera.grab(last ? wait.patience() : std::max(wait.patience(), kFirstFrame));
    if (frame) {
      const Frame::Header& header = frame->header();
      if (wait.came(header.captured.seconds())) count(last->header(), header, surroundings.clock, stream);
      last = *std::move(frame);
      surroundings.progress(what, wait.done_s() / seconds);
      continue;
    }
    if (frame.error().code == ErrorCode::kBadData) ++stream.damaged;
    if (!wait.outlasts(frame.error())) {
      stream.ended_by = frame.error();
      break;
    }
  }
  if (last) {
    const auto pixels = last->image(kImageTime);
    stream.image = pixels ? to_rgb8(**pixels) : Result<Image>(pixels.error());
  }
  return stream;
}

// The device returns controls as they were set, except for rounding.
constexpr double kControlShare = 1e-3;
// If capture times scatter by more than this fraction of a period, chance decides which frame is a frame's nearest
// partner.
constexpr double kJitterShare = 0.25;
constexpr double kJitterQuantile = 0.95;
// The readout of a frame takes one period, and its delivery another.
constexpr double kAgePeriods = 2;
constexpr double kFewLost = 0.01, kManyLost = 0.2;
constexpr double kFewSkipped = 0.05;

bool is_near(double value, double wanted, double share) { return std::abs(value - wanted) <= share * std::abs(wanted); }

Row judge_rate(double period_s, double asked_hz) {
  if (!(period_s > 0)) {
    return {"", "rate", "the capture times do not advance", kFailed,
            "its driver gives no capture times: use another camera"};
  }
  Row row{"", "rate", fmt::format("{:.2f} Hz of {:g}", 1 / period_s, asked_hz)};
  if (is_near(1 / period_s, asked_hz, kRateShare)) return row;
  row.judge(kFailed,
            1 / period_s < asked_hz
                ? fmt::format("use more light or a shorter exposure, format: MJPG, or rate_hz: {:.3g}", 1 / period_s)
                : fmt::format("set rate_hz: {:.3g}", 1 / period_s));
  return row;
}

Row judge_jitter(const std::vector<double>& neighbours_s, double asked_hz) {
  if (neighbours_s.empty()) return {"", "jitter", "no two consecutive frames", kNotRun, "see lost frames"};
  const double middle_s = base::quantile(neighbours_s, 0.5);
  std::vector<double> off_s;
  off_s.reserve(neighbours_s.size());
  for (const double time_s : neighbours_s) off_s.push_back(std::abs(time_s - middle_s));
  const double jitter_s = base::quantile(off_s, kJitterQuantile);
  Row row{"", "jitter", fmt::format("95 % within {:.1f} ms of {:.1f} ms", 1e3 * jitter_s, 1e3 * middle_s)};
  if (jitter_s > kJitterShare / asked_hz) {
    row.judge(kWarning, "give each camera its own USB port; reduce the load; fix the exposure");
  }
  return row;
}

Row judge_losses(const Footage& s) {
  const double all = double(s.frames + s.lost + s.skipped + s.damaged);
  Row row{"", "lost frames",
          fmt::format("{} of {:.0f} lost, {} damaged, {} skipped", s.lost, all, s.damaged, s.skipped)};
  const double lost = double(s.lost + s.damaged) / all;
  if (lost > kFewLost) {
    row.judge(lost > kManyLost ? kFailed : kWarning,
              "check cable and hub; give each camera its own USB port; lower the rate or the size");
  } else if (double(s.skipped) / all > kFewSkipped) {
    row.judge(kWarning, "this machine is too busy: reduce its load or the rate");
  }
  return row;
}

Row judge_age(const std::vector<double>& ages_s, double asked_hz) {
  if (ages_s.empty()) {
    return {"", "age", "its times come from another clock", kNotRun, "nothing: a real camera uses the steady clock"};
  }
  const double median_s = base::quantile(ages_s, 0.5);
  Row row{"", "age",
          fmt::format("median {:.1f} ms, at most {:.1f} ms", 1e3 * median_s, 1e3 * std::ranges::max(ages_s))};
  if (median_s > kAgePeriods / asked_hz) {
    row.judge(
        kWarning,
        fmt::format("older than {:g} frame periods: lower the rate, use another format, reduce the load", kAgePeriods));
  } else if (median_s < 0) {
    row.judge(kWarning, "frames from the future: its capture times are wrong");
  }
  return row;
}

Row judge_format(const drivers::CameraPart& asked, const CameraFacts& applied) {
  const CameraSettings& want = asked.settings;
  const CameraSettings& got = applied.settings;
  Row row{"", "format",
          fmt::format("{}: {} {} x {}, {:g} Hz{}", applied.device, applied.format, got.width_px, got.height_px,
                      got.rate_hz, applied.has_rate ? "" : " as requested (the camera does not report it)")};
  if (got.width_px != want.width_px || got.height_px != want.height_px) {
    row.judge(
        kFailed,
        fmt::format("width_px: {}, height_px: {}, then calibrate; or a size that the camera has (twocone devices)",
                    got.width_px, got.height_px));
  } else if (!asked.device.format.empty() && !applied.format.empty() && asked.device.format != applied.format) {
    row.judge(kWarning, fmt::format("format: {}, or one that the camera has (twocone devices)", applied.format));
  } else if (!is_near(got.rate_hz, want.rate_hz, kRateShare)) {
    row.judge(kWarning, fmt::format("{:g} Hz were requested: set rate_hz: {:.4g}, another format, or a smaller size",
                                    want.rate_hz, got.rate_hz));
  }
  return row;
}

/// Adds a row for each control that the robot file sets.
void check_controls(const CameraUnderTest& test, const CameraFacts& facts, Report& report) {
  for (const auto& [name, want] : test.asked.device.controls) {
    const auto got = std::ranges::find(facts.controls, name, &std::pair<std::string, double>::first);
    Row row{test.name, "control", ""};
    if (got == facts.controls.end()) {
      row.measured = fmt::format("{}: requested {:g}, not reported back", name, want);
      row.judge(kWarning, "check whether the image follows it");
    } else {
      row.measured = fmt::format("{}: requested {:g}, is {:g}", name, want, got->second);
      if (!is_near(got->second, want, kControlShare)) {
        row.judge(kWarning,
                  fmt::format("{}: {:g}; v4l2-ctl --list-ctrls lists the possible values", name, got->second));
      }
    }
    report.add(std::move(row));
  }
}

}  // namespace

FrameWait::FrameWait(double seconds, double rate_hz, milliseconds least, const Surroundings& surroundings)
    : surroundings_(surroundings),
      patience_(std::max(least, std::min(milliseconds(std::int64_t(1000 * kPatientPeriods / rate_hz)), kMostPatience))),
      seconds_(seconds),
      give_up_s_(surroundings.now_s() + kMostTime * seconds + kSpare_s),
      most_grabs_(kMostTime * (seconds + kSettling_s) * rate_hz + kSpareGrabs) {}

bool FrameWait::goes_on() {
  if (done_s() >= seconds_) return false;
  if (grabs_++ >= most_grabs_ || surroundings_.now_s() >= give_up_s_) return false;
  end_if_asked(surroundings_);
  return true;
}

bool FrameWait::came(double captured_s) {
  troubles_ = 0;
  const bool counts = begin_s_.has_value();
  if (!first_s_) first_s_ = captured_s;
  if (!counts && captured_s - *first_s_ >= kSettling_s) begin_s_ = captured_s;
  last_s_ = captured_s;
  return counts;
}

bool FrameWait::outlasts(const Error& error) {
  const bool may_pass = error.code == ErrorCode::kTimeout || error.code == ErrorCode::kBadData;
  return may_pass && ++troubles_ < kTroublesInARow;
}

std::optional<Image> check_camera(const CameraUnderTest& test, Camera& camera, double seconds,
                                  const Surroundings& surroundings, Report& report) {
  const auto failed = [&](const char* check, const Error& error) {
    report.add(failed_row(test.name, check, error, camera_advice(error.code)));
    return std::nullopt;
  };
  const Stopping stopping(camera);
  if (const auto applied = camera.configure(test.asked.settings); !applied) return failed("format", applied.error());
  const CameraFacts facts = camera.facts();
  report.add(test.name, judge_format(test.asked, facts));
  check_controls(test, facts, report);
  if (const auto started = camera.start(); !started) return failed("stream", started.error());

  const Footage stream = take_stream(camera, seconds, fmt::format("camera {}", test.name), surroundings);
  if (stream.ended_by) std::ignore = failed("stream", *stream.ended_by);
  if (!stream.periods_s.empty()) {
    const double asked_hz = test.asked.settings.rate_hz;
    report.add(test.name, judge_rate(base::quantile(stream.periods_s, 0.5), asked_hz));
    report.add(test.name, judge_jitter(stream.neighbours_s, asked_hz));
    report.add(test.name, judge_losses(stream));
    report.add(test.name, judge_age(stream.ages_s, asked_hz));
  } else if (!stream.ended_by) {
    report.add({test.name, "stream", "too few frames were received", kFailed, camera_advice(ErrorCode::kTimeout)});
  }
  if (!stream.image) return std::nullopt;
  if (!*stream.image) return failed("image", stream.image->error());
  check_image(test.name, **stream.image, test.rim, report);
  return **stream.image;
}

}  // namespace twocone::doctor
