// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2_camera/v4l2_camera.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "base/log.h"
#include "drivers/v4l2_camera/device.h"

namespace twocone::v4l2 {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using SteadyTime = std::chrono::steady_clock::time_point;

// If the device has fewer buffers left to fill, frames are copied instead of lent.
constexpr std::size_t kLeftToDevice = 2;
// A camera that sends nothing for this many periods, and for at least this time, is reported.
constexpr double kSilentPeriods = 10;
constexpr milliseconds kLeastSilence{500};
// Many cameras need more time before the first frame.
constexpr milliseconds kFirstSilence{3'000};
// If every buffer was full, the age of the newest frame is the reader's delay. If it is older than this, grab() waits
// for the next frame.
constexpr double kStalePeriods = 2;
// A capture time that is farther from now than this belongs to another clock, whatever its flag is.
constexpr std::chrono::seconds kSameClock{10};

nanoseconds steady_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

class V4l2Camera final : public Camera {
 public:
  V4l2Camera(const V4l2Settings& settings, std::shared_ptr<Kernel> kernel)
      : settings_(settings), kernel_(std::move(kernel)) {}
  ~V4l2Camera() override { stop(); }

  Status open() {
    device_.reset();
    const auto path = find_device(settings_.name, kernel_);
    if (!path) return path.error();
    auto device = Device::open(*path, kernel_);
    if (!device) return device.error();
    device_ = *std::move(device);
    path_ = *path;
    applied_.device = fmt::format("{} ({})", device_->card(), path_);
    return {};
  }

 private:
  Result<CameraSettings> do_configure(const CameraSettings& wanted) override {
    if (!device_) {
      if (auto opened = open(); !opened) return away(opened.error());
    }
    wanted_ = wanted;
    auto negotiated = device_->negotiate(wanted, settings_.format);
    if (!negotiated) return lost_with(negotiated.error());
    format_ = *negotiated;
    applied_.controls.clear();
    for (const auto& [name, value] : settings_.controls) {
      const auto set = device_->set({name, std::llround(value)});
      if (!set) return lost_with(set.error());
      applied_.controls.emplace_back(set->first, double(set->second));
    }
    applied_.format = format_->format.name;
    applied_.has_rate = format_->rate_hz.has_value();
    applied_.settings = {format_->width_px, format_->height_px, format_->rate_hz.value_or(wanted.rate_hz)};
    return applied_.settings;
  }

  Status do_start() override {
    if (!device_) {  // it was lost, or its buffers could not be freed
      const CameraSettings before = applied_.settings;
      const auto again = do_configure(wanted_);
      if (!again) return again.error();
      if (*again != before) {
        return Error(ErrorCode::kRefused,
                     "{}: it came back with {} x {} pixels at {:g} Hz instead of {} x "
                     "{} at {:g}; plug the right camera into its place",
                     path_, again->width_px, again->height_px, again->rate_hz, before.width_px, before.height_px,
                     before.rate_hz);
      }
    }
    auto stream = Stream::start(*device_);
    if (!stream) return lost_with(stream.error());
    stream_ = *std::move(stream);
    last_handed_out_.reset();
    passed_over_ = 0;
    watch_source();
    return {};
  }

  Result<Frame> do_grab(milliseconds timeout) override {
    const SteadyTime begin = std::chrono::steady_clock::now();
    const milliseconds silence = silence_limit();
    const milliseconds limit = std::min(timeout, silence);
    while (true) {
      if (auto source = note_source(); !source) return source.error();
      if (auto taken = take_newest(); !taken) return taken.error();
      if (!source_trouble_.empty()) pass_over();  // an image without a source
      if (newest_ && !newest_is_stale_) return hand_out();
      const auto left = std::chrono::ceil<milliseconds>(begin + limit - std::chrono::steady_clock::now());
      if (left.count() <= 0) {
        if (newest_ && limit < silence) return hand_out();  // a late frame is better than none
        return nothing_within(limit, limit == silence);
      }
      pollfd entry{device_->file(), short(watches_source_ ? POLLIN | POLLPRI : POLLIN), 0};
      const int ready = kernel_->poll(entry, int(left.count()));
      if (ready < 0 && errno != EINTR) return broken(std::strerror(errno));
      if (ready > 0 && (entry.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
        if (auto taken = take_newest(); !taken) return taken.error();
        if (!newest_ || newest_is_stale_) return broken("its stream broke");
      }
    }
  }

  void do_stop() noexcept override {
    newest_.reset();
    // A device that keeps its buffers would refuse the next start, so it is opened again, as after a broken stream.
    if (!stream_->stop() || is_broken_) device_.reset();
    stream_.reset();
    is_broken_ = false;
  }

  void do_facts(CameraFacts& facts) const override { facts = applied_; }

  [[nodiscard]] milliseconds silence_limit() const {
    const double periods_ms = std::min(1000 * kSilentPeriods / applied_.settings.rate_hz, double(kLongestWait.count()));
    return std::max(last_handed_out_ ? kLeastSilence : kFirstSilence, milliseconds(std::llround(periods_ms)));
  }

  Error lost_with(const Error& error) {
    if (error.code == ErrorCode::kDisconnected) device_.reset();
    return error;
  }

  /// Reports a camera that was found before and cannot be found now as disconnected.
  static Error away(const Error& error) {
    return {error.code == ErrorCode::kNotFound ? ErrorCode::kDisconnected : error.code, error.message};
  }

  Error broken(const std::string& why) {
    is_broken_ = true;
    return Error(ErrorCode::kDisconnected, "{}: {}", path_, why);
  }

  [[nodiscard]] Error nothing_within(milliseconds limit, bool is_silent) const {
    if (!is_silent) {
      return Error(ErrorCode::kTimeout, "{}: no frame within {} ms", path_, limit.count());
    }
    const std::string trouble = device_->input_trouble();
    return Error(ErrorCode::kTimeout, "{}: no frame for {} ms{}{}", path_, limit.count(), trouble.empty() ? "" : ": ",
                 trouble);
  }

  /// Subscribes to changes of the source. A video signal can be cut off at its source; the device then continues to
  /// send images without content.
  void watch_source() {
    v4l2_event_subscription changes{};
    changes.type = V4L2_EVENT_SOURCE_CHANGE;
    changes.id = device_->input();
    watches_source_ = device_->call(VIDIOC_SUBSCRIBE_EVENT, &changes) == 0;
    source_trouble_.clear();
    if (!watches_source_) return;
    take_source_changes();
    source_trouble_ = device_->input_trouble();
  }

  bool take_source_changes() {
    bool any = false;
    v4l2_event event{};
    while (device_->call(VIDIOC_DQEVENT, &event) == 0) any = true;
    return any;
  }

  Status note_source() {
    if (!watches_source_ || !take_source_changes()) return {};
    source_trouble_ = device_->input_trouble();
    // The image may have another size now.
    if (source_trouble_.empty()) return broken("its source changed");
    base::Logger("v4l2").warning(fmt::format("{}: {}; its images are passed over", path_, source_trouble_));
    return {};
  }

  /// Takes all filled buffers and keeps the newest.
  Status take_newest() {
    const std::size_t at_device = stream_->queued();
    std::size_t filled = 0;
    while (true) {
      auto taken = stream_->take();
      if (!taken) return broken(taken.error().message);
      if (!*taken) break;
      ++filled;
      if ((*taken)->is_damaged) {
        stream_->give_back((*taken)->index);
        return Error(ErrorCode::kBadData, "{}: frame {} came damaged", path_, (*taken)->sequence);
      }
      pass_over();
      newest_ = **taken;
    }
    // If the device had no buffer left to fill, the age of the newest frame is the reader's delay.
    if (filled > 0) newest_is_stale_ = filled >= at_device && is_stale(*newest_);
    return {};
  }

  void pass_over() {
    if (!newest_) return;
    ++passed_over_;
    stream_->give_back(newest_->index);
    newest_.reset();
  }

  [[nodiscard]] bool is_stale(const Filled& filled) const {
    const auto age = steady_now() - filled.captured;
    return has_good_time(filled) &&
           std::chrono::duration<double>(age).count() > kStalePeriods / applied_.settings.rate_hz;
  }

  static bool has_good_time(const Filled& filled) {
    return filled.is_monotonic && std::chrono::abs(steady_now() - filled.captured) < kSameClock;
  }

  Result<Frame> hand_out() {
    const Filled filled = *std::exchange(newest_, std::nullopt);
    Image image{format_->width_px, format_->height_px, format_->format.layout, {}};
    const Status filled_in = fill(image, filled);
    if (!image.bytes.is_lent()) stream_->give_back(filled.index);
    if (!filled_in) return filled_in.error();
    Frame::Header header;
    header.sequence = filled.sequence;
    header.lost_before = last_handed_out_ ? filled.sequence - *last_handed_out_ - 1 : filled.sequence;
    header.skipped_before = std::min(std::exchange(passed_over_, 0), header.lost_before);
    header.captured = {ClockKind::kSteady, has_good_time(filled) ? filled.captured : steady_now()};
    last_handed_out_ = filled.sequence;
    return Frame(header, std::move(image));
  }

  /// Fills `image` with the buffer's bytes, lent if possible.
  Status fill(Image& image, const Filled& filled) {
    const auto expected = image_bytes(image.format, image.width_px, image.height_px);
    if (!expected) {  // MJPG: any number of bytes is valid
      if (filled.bytes.empty()) return Error(ErrorCode::kBadData, "{}: an empty frame", path_);
      lend_or_copy(image, filled, filled.bytes);
      return {};
    }
    const std::size_t rows = std::size_t(image.height_px) * (image.format == PixelFormat::kNv12 ? 3 : 2) / 2;
    const std::size_t row_bytes = *expected / rows;
    const std::size_t stride = std::max(format_->row_bytes, row_bytes);
    if (filled.bytes.size() < stride * (rows - 1) + row_bytes) {
      return Error(ErrorCode::kBadData, "{}: frame {} has {} bytes instead of {}", path_, filled.sequence,
                   filled.bytes.size(), stride * rows);
    }
    if (stride == row_bytes) {
      lend_or_copy(image, filled, filled.bytes.first(*expected));
      return {};
    }
    std::vector<std::uint8_t> packed(*expected);
    for (std::size_t row = 0; row < rows; ++row) {
      std::memcpy(packed.data() + row * row_bytes, filled.bytes.data() + row * stride, row_bytes);
    }
    image.bytes = std::move(packed);
    return {};
  }

  void lend_or_copy(Image& image, const Filled& filled, std::span<const std::uint8_t> bytes) {
    if (device_->spares_lent_buffers() && stream_->queued() >= kLeftToDevice) {
      image.bytes = Bytes::lent(bytes, stream_->lend(filled.index));
    } else {
      image.bytes = Bytes(bytes.begin(), bytes.end());
    }
  }

  const V4l2Settings settings_;
  const std::shared_ptr<Kernel> kernel_;
  std::unique_ptr<Device> device_;
  CameraSettings wanted_;
  std::optional<Negotiated> format_;
  std::string path_;
  CameraFacts applied_;
  std::shared_ptr<Stream> stream_;
  bool is_broken_ = false;
  bool watches_source_ = false;
  std::string source_trouble_;     ///< empty: none
  std::optional<Filled> newest_;   ///< taken, but not yet returned
  bool newest_is_stale_ = false;   ///< grab() waits for a newer one
  std::uint64_t passed_over_ = 0;  ///< frames skipped since the last one that was returned
  std::optional<std::uint64_t> last_handed_out_;
};

}  // namespace

std::string_view why_not() { return ""; }

Result<std::unique_ptr<Camera>> open_camera(const V4l2Settings& settings, std::shared_ptr<Kernel> kernel) {
  check(settings);
  auto camera = std::make_unique<V4l2Camera>(settings, std::move(kernel));
  if (auto opened = camera->open(); !opened) return opened.error();
  return std::unique_ptr<Camera>(std::move(camera));
}

}  // namespace twocone::v4l2
