// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <libcamera/libcamera.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/libcamera_camera/libcamera_camera.h"
#include "hal/camera.h"
#include "hal/device_info.h"
#include "hal/image.h"

namespace twocone::libcamera_camera {

namespace lc = libcamera;

// ---- The differences between libcamera's versions. Version 0.0.3 was built and tested. Versions 0.1 to 0.5 were not
// built; only their documentation and headers were read. These changes between them are handled here or by the way of
// calling:
// - Roles are a vector up to 0.0.x, a span later: kViewfinder fits both, a braced list does not.
// - FrameMetadata has a status for frames of a sensor that is not yet stable (FrameStartup): a frame whose status is
//   neither success nor error is skipped, so the name of this status is not needed.
// - Control types of unsigned numbers were added: a control of an unknown type is refused by name.
// - From 0.4 on, ControlId reports whether it is an array.

#define TWOCONE_LIBCAMERA_IS(major, minor) \
  (LIBCAMERA_VERSION_MAJOR > (major) || (LIBCAMERA_VERSION_MAJOR == (major) && LIBCAMERA_VERSION_MINOR >= (minor)))

inline const std::vector<lc::StreamRole> kViewfinder{lc::StreamRole::Viewfinder};

/// Returns whether a control has several numbers. Setting it to one number would end the program by an assertion of
/// libcamera.
inline bool is_array(const lc::ControlId& control) {
#if TWOCONE_LIBCAMERA_IS(0, 4)
  return control.isArray();
#else
  const std::array<const lc::ControlId*, 5> arrays{&lc::controls::ColourGains, &lc::controls::SensorBlackLevels,
                                                   &lc::controls::ColourCorrectionMatrix,
                                                   &lc::controls::FrameDurationLimits, &lc::controls::AfWindows};
  return std::ranges::any_of(arrays, [&](const lc::ControlId* array) { return *array == control.id(); });
#endif
}

// ---- The driver.

inline std::string model_of(const lc::Camera& camera) {
  return printable(camera.properties().get(lc::properties::Model).value_or(camera.id()));
}

struct Format {
  std::string_view name;  ///< V4L2's name
  lc::PixelFormat code;
  PixelFormat layout;
};
/// The formats of kCameraFormats. libcamera names RGB formats by their bits from the highest one, V4L2 by their bytes.
inline constexpr std::array<Format, 7> kFormats{{{kCameraFormats[0], lc::formats::YUYV, PixelFormat::kYuyv},
                                                 {kCameraFormats[1], lc::formats::UYVY, PixelFormat::kUyvy},
                                                 {kCameraFormats[2], lc::formats::NV12, PixelFormat::kNv12},
                                                 {kCameraFormats[3], lc::formats::BGR888, PixelFormat::kRgb8},
                                                 {kCameraFormats[4], lc::formats::RGB888, PixelFormat::kBgr8},
                                                 {kCameraFormats[5], lc::formats::MJPEG, PixelFormat::kMjpeg},
                                                 {kCameraFormats[6], lc::formats::R8, PixelFormat::kGrey8}}};
inline bool has_yuv(PixelFormat layout) {
  return layout == PixelFormat::kYuyv || layout == PixelFormat::kUyvy || layout == PixelFormat::kNv12;
}

/// State that libcamera's thread reports to the program's thread. libcamera's slots hold it, so that it outlives a call
/// in progress.
struct SharedState {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_gone = false;
  std::deque<lc::Request*> completed;
  std::size_t queued = 0;                        ///< requests that libcamera has
  std::chrono::steady_clock::time_point last{};  ///< time of the last completed request
};

/// Returns the running manager, which all users share: libcamera allows only one in a program. Errors: kUnavailable.
Result<std::shared_ptr<lc::CameraManager>> use_manager();

/// A camera that this program has acquired.
class Device {
 public:
  /// @param name id or model
  /// Errors: kNotFound, kRefused, kDisconnected, kUnavailable.
  static Result<std::shared_ptr<Device>> open(const std::string& name);
  /// Requires that the stream is stopped.
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  [[nodiscard]] const std::shared_ptr<lc::Camera>& camera() const { return camera_; }
  [[nodiscard]] const std::shared_ptr<SharedState>& shared() const { return shared_; }
  [[nodiscard]] bool is_gone() const;
  /// Returns whether the camera still answers a query for its formats. This is for a camera that sends nothing, which
  /// libcamera does not report.
  [[nodiscard]] bool answers() const;

 private:
  Device(std::shared_ptr<lc::CameraManager> manager, std::shared_ptr<lc::Camera> camera);

  const std::shared_ptr<lc::CameraManager> manager_;
  std::shared_ptr<lc::Camera> camera_;
  const std::shared_ptr<SharedState> shared_ = std::make_shared<SharedState>();
};

/// Returns the formats of kCameraFormats that the camera has, each with its largest size: "NV12 up to 1920x1080".
std::vector<std::string> formats_of(lc::Camera& camera);

/// The controls with which a stream starts.
struct ChosenControls {
  lc::ControlList list;
  /// The requested controls, in that order, within the limits that the camera reports.
  std::vector<std::pair<const lc::ControlId*, double>> applied;
  std::optional<double> rate_hz;  ///< if the camera has a control for it
};

/// Chooses the controls of a stream. Errors: kRefused, naming the existing controls.
Result<ChosenControls> choose_controls(const lc::Camera& camera, const LibcameraSettings& settings, double rate_hz);

/// Stores in `applied` the values that the camera used for a frame, if it reports them.
void read_back(const lc::ControlList& metadata, ChosenControls& applied);

/// Converts a (positive) errno to an error of the camera.
Error device_error(const std::string& what, int code);

/// The memory of one buffer, mapped as long as this object exists.
class Memory {
 public:
  /// Maps a buffer. Returns nullptr and sets errno if it cannot be mapped.
  static std::shared_ptr<const Memory> of(const lc::FrameBuffer& buffer);
  Memory() = default;
  ~Memory();
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  struct Plane {
    decltype(lc::FrameBuffer::Plane::fd) file;
    void* mapped;  ///< from the start of the file
    std::size_t offset;
    std::span<const std::uint8_t> bytes;
  };
  [[nodiscard]] const std::vector<Plane>& planes() const { return planes_; }
  /// Returns all planes as one contiguous span; nothing if they do not follow each other.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> whole() const;

  /// Mark the beginning and the end of reading. A device may write past the processor's caches, so reading requires
  /// both.
  void begin_reading() const;
  void end_reading() const;

 private:
  void sync(std::uint64_t flags) const;

  std::vector<Plane> planes_;
};

/// A completed request, which libcamera does not use until it is given back.
struct Newest {
  lc::Request* request = nullptr;
  const lc::FrameBuffer* buffer = nullptr;
  std::shared_ptr<const Memory> memory;
  std::uint64_t passed_over = 0;  ///< older requests that were given back unread
  bool was_starved = false;       ///< libcamera had no request left to fill
};

/// A running stream: requests that circulate between libcamera and the program. Lent frames keep it alive and give
/// their requests back from any thread; after stop() they keep only the memory.
class Stream : public std::enable_shared_from_this<Stream> {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;

  /// Errors: kRefused, kUnavailable, kDisconnected.
  static Result<std::shared_ptr<Stream>> start(std::shared_ptr<Device> device, lc::Stream* stream,
                                               const lc::ControlList& controls);
  ~Stream();
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  /// Waits until `deadline` and returns the newest request; nothing: none was completed, or the camera is gone.
  std::optional<Newest> take_newest(SteadyTime deadline);
  void give_back(lc::Request* request);
  /// Keeps the bytes valid as long as a copy of the result exists; then gives the request back.
  std::shared_ptr<const void> lend(const Newest& newest);
  /// Returns the number of requests that libcamera has to fill.
  [[nodiscard]] std::size_t queued() const;
  /// Returns whether no request was completed for this time.
  [[nodiscard]] bool is_silent(std::chrono::nanoseconds time) const;

  /// Stops the stream. Requires that the device is present: libcamera ends the program if requests do not come back.
  void stop();
  /// Replaces stop() for a device that is gone: keeps the stream unchanged until the program ends.
  static void abandon(const std::shared_ptr<Stream>& stream);

 private:
  explicit Stream(std::shared_ptr<Device> device) : device_(std::move(device)), shared_(device_->shared()) {}

  Status prepare(lc::Stream* stream);
  Status run(const lc::ControlList& controls);
  void queue(lc::Request* request);

  std::shared_ptr<Device> device_;  // only until stop(), so that a kept frame does not keep the camera
  const std::shared_ptr<SharedState> shared_;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<lc::Request>> requests_;
  std::map<const lc::FrameBuffer*, std::shared_ptr<const Memory>> memories_;
  bool running_ = false;  // protected by shared_->mutex
};

}  // namespace twocone::libcamera_camera
