// SPDX-License-Identifier: Apache-2.0
#include "apps/doctor/stream.h"

#include <algorithm>

namespace twocone::doctor {
namespace {

using std::chrono::milliseconds;

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

/// Keeps count of consecutive frames.
class Take {
 public:
  Take(double seconds, const Surroundings& surroundings) : seconds_(seconds), surroundings_(surroundings) {}

  void add(const Frame& frame) {
    const Frame::Header& header = frame.header();
    if (!first_) first_ = header.captured;
    if (is_settled()) {
      count(header);
    } else if (header.captured.seconds() - first_->seconds() >= kSettling_s) {
      begin_ = header.captured;
    }
    last_ = header;
  }

  [[nodiscard]] double done_s() const { return is_settled() ? last_->captured.seconds() - begin_->seconds() : 0; }
  [[nodiscard]] bool is_done() const { return done_s() >= seconds_; }
  Footage stream;

 private:
  [[nodiscard]] bool is_settled() const { return begin_.has_value(); }

  void count(const Frame::Header& header) {
    ++stream.frames;
    stream.skipped += std::min(header.skipped_before, header.lost_before);
    stream.lost += header.lost_before - std::min(header.skipped_before, header.lost_before);
    const double time_s = header.captured.seconds() - last_->captured.seconds();
    const auto steps = header.sequence > last_->sequence ? header.sequence - last_->sequence : 1;
    stream.periods_s.push_back(time_s / double(steps));
    if (steps == 1) stream.neighbours_s.push_back(time_s);
    const Timestamp now = surroundings_.clock.now();
    if (now.clock == header.captured.clock) stream.ages_s.push_back(now.seconds() - header.captured.seconds());
  }

  const double seconds_;
  const Surroundings& surroundings_;
  std::optional<Timestamp> first_, begin_;
  std::optional<Frame::Header> last_;
};

}  // namespace

FrameWait::FrameWait(double seconds, double rate_hz, milliseconds least, const Surroundings& surroundings)
    : surroundings_(surroundings),
      patience_(std::max(least, std::min(milliseconds(std::int64_t(1000 * kPatientPeriods / rate_hz)), kMostPatience))),
      give_up_s_(surroundings.now_s() + kMostTime * seconds + kSpare_s),
      most_grabs_(kMostTime * (seconds + kSettling_s) * rate_hz + kSpareGrabs) {}

bool FrameWait::goes_on() {
  if (grabs_++ >= most_grabs_ || surroundings_.now_s() >= give_up_s_) return false;
  end_if_asked(surroundings_);
  return true;
}

bool FrameWait::outlasts(const Error& error) {
  const bool may_pass = error.code == ErrorCode::kTimeout || error.code == ErrorCode::kBadData;
  return may_pass && ++troubles_ < kTroublesInARow;
}

Footage take_stream(Camera& camera, double seconds, const std::string& what, const Surroundings& surroundings) {
  FrameWait wait(seconds, camera.facts().settings.rate_hz, kNextFrame, surroundings);
  Take take(seconds, surroundings);
  std::optional<Frame> last;
  while (!take.is_done() && wait.goes_on()) {
    auto frame = camera.grab(last ? wait.patience() : std::max(wait.patience(), kFirstFrame));
    if (frame) {
      wait.came();
      take.add(*frame);
      last = *std::move(frame);
      surroundings.progress(what, take.done_s() / seconds);
      continue;
    }
    if (frame.error().code == ErrorCode::kBadData) ++take.stream.damaged;
    if (!wait.outlasts(frame.error())) {
      take.stream.ended_by = frame.error();
      break;
    }
  }
  if (last) {
    const auto pixels = last->image(kImageTime);
    take.stream.image = pixels ? to_rgb8(**pixels) : Result<Image>(pixels.error());
  }
  return take.stream;
}

}  // namespace twocone::doctor
