// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <optional>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <libcamera/logging.h>

#include "drivers/libcamera_camera/device.h"
#include "drivers/libcamera_camera/libcamera_camera.h"

namespace twocone::libcamera_camera {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

// As in drivers/v4l2_camera: buffers left to the device, limits of a camera's silence, age of a frame that is too old.
constexpr std::size_t kLeftToDevice = 2;
constexpr unsigned kBuffers = 6;
constexpr double kSilentPeriods = 10;
constexpr milliseconds kLeastSilence{500};
constexpr double kStalePeriods = 2;
// A camera that sent nothing for this many periods is checked for its presence before it is stopped.
constexpr double kDoubtfulPeriods = 3;
constexpr std::chrono::seconds kSameClock{10};

nanoseconds steady_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

/// Converts a time of libcamera. Whether it includes the time during which the machine was suspended depends on the
/// kernel's driver.
std::optional<nanoseconds> on_steady_clock(nanoseconds reported) {
  const nanoseconds now = steady_now();
  if (std::chrono::abs(now - reported) < kSameClock) return reported;
  timespec since_boot{};
  ::clock_gettime(CLOCK_BOOTTIME, &since_boot);
  const nanoseconds suspended = std::chrono::seconds(since_boot.tv_sec) + nanoseconds(since_boot.tv_nsec) - now;
  if (std::chrono::abs(now - (reported - suspended)) < kSameClock) return reported - suspended;
  return std::nullopt;
}

class LibcameraCamera final : public Camera {
 public:
  explicit LibcameraCamera(const LibcameraSettings& settings) : settings_(settings) {}
  ~LibcameraCamera() override {
    stop();
    close();
  }

  Status open() {
    close();
    auto device = Device::open(settings_.name);
    if (!device) return device.error();
    device_ = *std::move(device);
    id_ = device_->camera()->id();
    model_ = model_of(*device_->camera());
    return {};
  }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    if (!device_ || device_->is_gone()) {
      if (auto opened = open(); !opened) return opened.error();
    }
    wanted_ = wanted;
    lc::Camera& camera = *device_->camera();
    configuration_ = camera.generateConfiguration(kViewfinder);
    if (!configuration_ || configuration_->empty()) {
      return Error(ErrorCode::kRefused, "{}: no stream to look through", id_);
    }
    if (auto chosen = choose_format(wanted); !chosen) return chosen.error();
    if (const int error = camera.configure(configuration_.get())) {
      return lost_with(device_error(id_ + ": its configuration", -error));
    }
    auto controls = choose_controls(camera, settings_, wanted.rate_hz);
    if (!controls) return controls.error();
    controls_ = *std::move(controls);
    const lc::Size size = configuration_->at(0).size;
    applied_ = {int(size.width), int(size.height), controls_.rate_hz.value_or(wanted.rate_hz)};
    return applied_;
  }

  Status do_start() override {
    if (!device_ || device_->is_gone()) {  // it was lost
      if (const auto again = do_configure(wanted_); !again) return again.error();
    }
    auto stream = Stream::start(device_, configuration_->at(0).stream(), controls_.list);
    if (!stream) return lost_with(stream.error());
    stream_ = *std::move(stream);
    last_sequence_.reset();
    sequence_ = 0;
    return {};
  }

  Result<Frame> do_grab(milliseconds timeout) override {
    const milliseconds limit = std::min(timeout, silence_limit());
    const auto deadline = std::chrono::steady_clock::now() + limit;
    std::uint64_t passed_over = 0;
    while (true) {
      const auto newest = stream_->take_newest(deadline);
      if (!newest) return why_none(limit);
      passed_over += newest->passed_over;
      const lc::FrameMetadata& metadata = newest->buffer->metadata();
      if (metadata.status == lc::FrameMetadata::FrameError) {
        note_sequence(metadata.sequence);
        stream_->give_back(newest->request);
        return Error(ErrorCode::kBadData, "{}: frame {} came damaged", id_, metadata.sequence);
      }
      const bool is_whole = metadata.status == lc::FrameMetadata::FrameSuccess;
      if (is_whole && !(newest->was_starved && is_stale(*newest))) return hand_out(*newest, passed_over);
      if (is_whole) ++passed_over;
      stream_->give_back(newest->request);
    }
  }

  void do_stop() noexcept override {
    const bool is_doubtful = device_->is_gone() || stream_->is_silent(periods(kDoubtfulPeriods));
    if (is_doubtful && !device_->answers()) {
      Stream::abandon(stream_);
      stream_.reset();
      close();
      return;
    }
    stream_->stop();
    stream_.reset();
  }

  void do_facts(CameraFacts& facts) const override {
    facts.device = fmt::format("{} ({})", model_, id_);
    if (format_) facts.format = format_->name;
    facts.has_rate = controls_.rate_hz.has_value();
    for (const auto& [control, number] : controls_.applied) facts.controls.emplace_back(control->name(), number);
  }

  [[nodiscard]] nanoseconds periods(double count) const {
    return nanoseconds(std::llround(1e9 * count / applied_.rate_hz));
  }
  [[nodiscard]] milliseconds silence_limit() const {
    return std::max(kLeastSilence, std::chrono::ceil<milliseconds>(periods(kSilentPeriods)));
  }

  void close() {
    configuration_.reset();  // must end before its camera
    device_.reset();
  }

  Error lost_with(const Error& error) {
    if (error.code == ErrorCode::kDisconnected) close();
    return error;
  }

  Status choose_format(const CameraSettings& wanted) {
    lc::StreamConfiguration& stream = configuration_->at(0);
    const auto offered = stream.formats().pixelformats();
    for (const Format& candidate : kFormats) {
      if (!settings_.format.empty() && candidate.name != settings_.format) continue;
      if (std::ranges::find(offered, candidate.code) == offered.end()) continue;
      stream.pixelFormat = candidate.code;
      stream.size = {unsigned(wanted.width_px), unsigned(wanted.height_px)};
      stream.bufferCount = std::max(stream.bufferCount, kBuffers);
      // hal/image.h defines Y, U and V by ITU-R BT.601. A camera without a choice keeps its own colour space.
      if (has_yuv(candidate.layout)) stream.colorSpace = lc::ColorSpace::Smpte170m;
      if (configuration_->validate() == lc::CameraConfiguration::Invalid || stream.pixelFormat != candidate.code) {
        continue;
      }
      format_ = candidate;
      return {};
    }
    return Error(ErrorCode::kRefused, "{} has no format {}; it has: {}", id_,
                 settings_.format.empty() ? "that this driver knows" : settings_.format,
                 fmt::join(formats_of(*device_->camera()), ", "));
  }

  /// Returns the reason why no frame came within `limit`.
  [[nodiscard]] Error why_none(milliseconds limit) const {
    if (device_->is_gone()) return Error(ErrorCode::kDisconnected, "{} is disconnected", id_);
    const milliseconds silence = silence_limit();
    if (!stream_->is_silent(silence)) {
      return Error(ErrorCode::kTimeout, "{}: no frame within {} ms", id_, limit.count());
    }
    if (!device_->answers()) {
      return Error(ErrorCode::kDisconnected, "{}: no frame for {} ms, and it does not answer any more", id_,
                   silence.count());
    }
    return Error(ErrorCode::kTimeout, "{}: no frame for {} ms", id_, silence.count());
  }

  /// Returns the time at which the frame began to arrive: the sensor's time if libcamera reports it, which is before
  /// any processing of the image.
  [[nodiscard]] static std::optional<nanoseconds> time_of(const Newest& newest) {
    const auto sensor = newest.request->metadata().get(lc::controls::SensorTimestamp);
    return on_steady_clock(nanoseconds(sensor.value_or(std::int64_t(newest.buffer->metadata().timestamp))));
  }

  [[nodiscard]] bool is_stale(const Newest& newest) const {
    const auto captured = time_of(newest);
    return captured && steady_now() - *captured > periods(kStalePeriods);
  }

  /// Continues the count when the 32-bit number wraps. Returns the number of exposures in between.
  std::uint64_t note_sequence(unsigned sequence) {
    const unsigned step = last_sequence_ ? sequence - *last_sequence_ : 1;
    last_sequence_ = sequence;
    sequence_ += step;
    return step == 0 ? 0 : step - 1;
  }

  Result<Frame> hand_out(const Newest& newest, std::uint64_t passed_over) {
    const bool is_first = !last_sequence_;
    const std::uint64_t lost = note_sequence(newest.buffer->metadata().sequence);
    read_back(newest.request->metadata(), controls_);
    Frame::Header header;
    header.sequence = sequence_ - 1;
    header.lost_before = is_first ? passed_over : lost;
    header.skipped_before = std::min(passed_over, header.lost_before);
    header.captured = {ClockKind::kSteady, time_of(newest).value_or(steady_now())};
    const lc::StreamConfiguration& stream = configuration_->at(0);
    Image image{int(stream.size.width), int(stream.size.height), format_->layout, {}};
    newest.memory->begin_reading();
    auto filled = fill(image, newest);
    if (!image.bytes.is_lent()) {
      newest.memory->end_reading();
      stream_->give_back(newest.request);
    }
    if (!filled) return filled.error();
    return Frame(header, std::move(image));
  }

  /// Fills `image` with the buffer's bytes, lent if possible.
  Status fill(Image& image, const Newest& newest) {
    std::size_t used = 0;
    for (const auto& plane : newest.buffer->metadata().planes()) used += plane.bytesused;
    const auto expected = image_bytes(image.format, image.width_px, image.height_px);
    if (used < std::max<std::size_t>(expected.value_or(0), 1)) {
      return Error(ErrorCode::kBadData, "{}: frame {} has {} bytes instead of {}", id_,
                   newest.buffer->metadata().sequence, used, expected.value_or(1));
    }
    const std::size_t size = expected.value_or(used);
    const std::size_t rows = std::size_t(image.height_px) * (image.format == PixelFormat::kNv12 ? 3 : 2) / 2;
    const std::size_t row_bytes = expected ? *expected / rows : 0;
    const std::size_t stride = std::max<std::size_t>(configuration_->at(0).stride, row_bytes);
    const auto whole = newest.memory->whole();
    if ((!expected || stride == row_bytes) && whole && whole->size() >= size) {
      const auto bytes = whole->first(size);
      if (stream_->queued() >= kLeftToDevice) {
        image.bytes = Bytes::lent(bytes, stream_->lend(newest));
      } else {
        image.bytes = Bytes(bytes.begin(), bytes.end());
      }
      return {};
    }
    return pack(image, newest, size, expected ? row_bytes : size, expected ? stride : size);
  }

  /// Copies the rows without the padding between them.
  Status pack(Image& image, const Newest& newest, std::size_t size, std::size_t row_bytes, std::size_t stride) const {
    std::vector<std::uint8_t> packed;
    packed.reserve(size);
    for (const auto& plane : newest.memory->planes()) {
      for (std::size_t at = 0; at + row_bytes <= plane.bytes.size() && packed.size() < size; at += stride) {
        const auto row = plane.bytes.subspan(at, row_bytes);
        packed.insert(packed.end(), row.begin(), row.end());
      }
    }
    if (packed.size() != size) {
      return Error(ErrorCode::kBadData, "{}: a frame of {} bytes instead of {}", id_, packed.size(), size);
    }
    image.bytes = std::move(packed);
    return {};
  }

  const LibcameraSettings settings_;
  std::shared_ptr<Device> device_;
  std::unique_ptr<lc::CameraConfiguration> configuration_;
  std::optional<Format> format_;
  CameraSettings wanted_;
  // As the camera accepted them:
  std::string id_;
  std::string model_;
  CameraSettings applied_;
  ChosenControls controls_;
  std::shared_ptr<Stream> stream_;
  std::optional<unsigned> last_sequence_;
  std::uint64_t sequence_ = 0;  // number of the next frame
};

Result<std::unique_ptr<Camera>> open(const LibcameraSettings& settings) {
  auto camera = std::make_unique<LibcameraCamera>(settings);
  if (auto opened = camera->open(); !opened) return opened.error();
  return std::unique_ptr<Camera>(std::move(camera));
}

/// Suppresses libcamera's messages. libcamera prints complaints on stderr, for example about every device that it may
/// not open. A list of cameras reports that in its own words. If the user has requested libcamera's messages, nothing
/// is changed.
class Silence {
 public:
  Silence() {
    if (is_ours_) lc::logSetTarget(lc::LoggingTargetNone);
  }
  ~Silence() {
    if (is_ours_) lc::logSetStream(&std::cerr);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  static bool was_asked_for() {
    const char* const levels = std::getenv("LIBCAMERA_LOG_LEVELS");
    return std::getenv("LIBCAMERA_LOG_FILE") != nullptr ||
           (levels != nullptr && std::string_view(levels) != kOurLogLevels);
  }
  const bool is_ours_ = !was_asked_for();
};

Result<std::vector<DeviceInfo>> list() {
  const Silence silence;
  const auto manager = use_manager();
  if (!manager) return manager.error();
  std::vector<DeviceInfo> cameras;
  for (const auto& camera : (*manager)->cameras()) {
    cameras.push_back({.name = printable(camera->id()), .what = model_of(*camera), .details = formats_of(*camera)});
  }
  return cameras;
}

constexpr Module kModule{list, open};

}  // namespace

extern "C" __attribute__((visibility("default"))) const Module* twocone_libcamera_module() { return &kModule; }

}  // namespace twocone::libcamera_camera
