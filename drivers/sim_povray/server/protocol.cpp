// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/protocol.h"

#include <algorithm>
#include <cstring>
#include <tuple>
#include <type_traits>
#include <utility>

namespace twocone::sim_povray::server {
namespace {

// The fields of each struct, in the order of their bytes. One list serves both ways, so that the two cannot differ.
// A structured binding takes the fields of settings apart, so that a field which is added to a struct and forgotten
// here does not compile.

auto fields(Pose2& pose) {
  auto& [x_m, y_m, heading_rad] = pose;
  return std::tie(x_m, y_m, heading_rad);
}
auto fields(WheelSettings& wheels) {
  auto& [separation_m, radius_m, slip, slip_correlation_s, encoder_counts_per_turn, lag_s] = wheels;
  return std::tie(separation_m, radius_m, slip, slip_correlation_s, encoder_counts_per_turn, lag_s);
}
auto fields(Physics& physics) {
  auto& [mass_kg, wheel_friction, body_friction] = physics;
  return std::tie(mass_kg, wheel_friction, body_friction);
}
auto fields(RobotBody& body) {
  auto& [name, start, radius_m, wheels, command_timeout, physics, seed, begin, start_place] = body;
  return std::tie(name, start, radius_m, wheels, command_timeout, physics, seed, begin, start_place);
}
auto fields(DriveLimits& limits) {
  auto& [max_speed_radps, command_timeout] = limits;
  return std::tie(max_speed_radps, command_timeout);
}
auto fields(SessionSettings& settings) {
  auto& [name, body, drive, map_outline, run_ahead_frames, rendered, stored, truth] = settings;
  (void)rendered, (void)stored, (void)truth;  // functions of the client, which are not sent
  return std::tie(name, body, drive, map_outline, run_ahead_frames);
}
auto fields(CameraEffects& effects) {
  auto& [gain, full_well_electrons, read_noise_electrons, vignetting, defocus_px, exposure_time_s, readout_s,
         shutter_samples, distortion, distortion_focal_px, drop_probability, late_probability, stamp_late_s,
         colour_gain, flicker, jpeg_quality] = effects;
  return std::tie(gain, full_well_electrons, read_noise_electrons, vignetting, defocus_px, exposure_time_s, readout_s,
                  shutter_samples, distortion, distortion_focal_px, drop_probability, late_probability, stamp_late_s,
                  colour_gain, flicker, jpeg_quality);
}
auto fields(ViewSettings& settings) {
  auto& [camera_name, antialias, effects] = settings;
  return std::tie(camera_name, antialias, effects);
}
auto fields(CameraSettings& settings) {
  auto& [width_px, height_px, rate_hz] = settings;
  return std::tie(width_px, height_px, rate_hz);
}
auto fields(WheelSpeeds& speeds) {
  auto& [left_radps, right_radps] = speeds;
  return std::tie(left_radps, right_radps);
}
auto fields(SessionState& state) {
  auto& [step, now, pose, left_rad, right_rad, contact] = state;
  return std::tie(step, now, pose, left_rad, right_rad, contact);
}

auto fields(Hello& message) { return std::tie(message.magic, message.version, message.program); }
auto fields(Failed& message) { return std::tie(message.code, message.message); }
auto fields(Take& message) { return std::tie(message.settings); }
auto fields(OpenView& message) { return std::tie(message.settings); }
auto fields(ConfigureView& message) { return std::tie(message.view, message.settings); }
auto fields(ReleaseView& message) { return std::tie(message.view); }
auto fields(Step& message) { return std::tie(message.remaining); }
auto fields(ImageOrder& message) { return std::tie(message.order, message.view, message.slot); }
auto fields(Command& message) { return std::tie(message.speeds); }
std::tuple<> fields(Halt& /*message*/) { return {}; }
std::tuple<> fields(Leave& /*message*/) { return {}; }
auto fields(Sessioned& message) { return std::tie(message.state); }
auto fields(Stepped& message) { return std::tie(message.state); }
auto fields(ViewOpened& message) { return std::tie(message.view); }
auto fields(ViewConfigured& message) { return std::tie(message.slots, message.slot_bytes); }
std::tuple<> fields(Done& /*message*/) { return {}; }
auto fields(ImageDone& message) { return std::tie(message.order, message.format); }
auto fields(ImageFailed& message) { return std::tie(message.order, message.code, message.message); }

class Writer {
 public:
  template <typename... Fields>
  void operator()(Fields&... each) {
    (put(each), ...);
  }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  template <typename T>
  void put(T& value) {
    if constexpr (std::is_enum_v<T>) {
      bytes_.push_back(static_cast<std::uint8_t>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
      raw(&value, sizeof(value));
    } else {
      std::apply(*this, fields(value));
    }
  }
  void put(std::string& text) {
    const auto size = static_cast<std::uint32_t>(std::min(text.size(), kMaxText));
    put(size);
    raw(text.data(), size);
  }
  void put(std::vector<double>& numbers) {
    const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(numbers.size(), kMaxNumbers));
    put(size);
    raw(numbers.data(), size * sizeof(double));
  }
  void put(std::chrono::nanoseconds& time) {
    const std::int64_t count_ns = time.count();
    put(count_ns);
  }
  template <typename T>
  void put(std::optional<T>& value) {
    const bool there = value.has_value();
    put(there);
    if (value) put(*value);
  }
  void raw(const void* from, std::size_t size) {
    if (size == 0) return;  // `from` may be null
    const std::size_t at = bytes_.size();
    bytes_.resize(at + size);
    std::memcpy(bytes_.data() + at, from, size);
  }

  std::vector<std::uint8_t> bytes_;
};

/// Reads values from bytes. After the first error, every later value is an error too.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  template <typename... Fields>
  void operator()(Fields&... each) {
    (get(each), ...);
  }
  [[nodiscard]] bool read_all() const { return good_ && rest_.empty(); }

 private:
  template <typename T>
  void get(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      get(byte);
      good_ = good_ && byte <= 1;
      value = byte == 1;
    } else if constexpr (std::is_enum_v<T>) {
      std::uint8_t byte = 0;
      get(byte);
      good_ = good_ && byte <= static_cast<std::uint8_t>(last(T{}));
      if (good_) value = static_cast<T>(byte);
    } else if constexpr (std::is_arithmetic_v<T>) {
      raw(&value, sizeof(value));
    } else {
      std::apply(*this, fields(value));
    }
  }
  void get(std::string& text) {
    const std::uint32_t size = count(kMaxText, 1);
    text.assign(reinterpret_cast<const char*>(rest_.data()), size);
    rest_ = rest_.subspan(size);
  }
  void get(std::vector<double>& numbers) {
    numbers.resize(count(kMaxNumbers, sizeof(double)));
    raw(numbers.data(), numbers.size() * sizeof(double));
  }
  void get(std::chrono::nanoseconds& time) {
    std::int64_t count_ns = 0;
    get(count_ns);
    time = std::chrono::nanoseconds(count_ns);
  }
  template <typename T>
  void get(std::optional<T>& value) {
    bool there = false;
    get(there);
    if (there) get(value.emplace());
  }

  static constexpr ErrorCode last(ErrorCode /*type*/) { return ErrorCode::kRefused; }
  static constexpr PixelFormat last(PixelFormat /*type*/) { return PixelFormat::kGrey8; }

  /// Reads the number of items that follow; 0 if they are too many or not all there.
  std::uint32_t count(std::size_t most, std::size_t item_bytes) {
    std::uint32_t size = 0;
    get(size);
    if (size > most || size * item_bytes > rest_.size()) good_ = false;
    return good_ ? size : 0;
  }
  void raw(void* to, std::size_t size) {
    if (!good_ || size > rest_.size()) {
      good_ = false;
      return;
    }
    if (size != 0) std::memcpy(to, rest_.data(), size);
    rest_ = rest_.subspan(size);
  }

  std::span<const std::uint8_t> rest_;
  bool good_ = true;
};

template <std::size_t Kind = 0>
std::optional<Message> decode_kind(std::size_t kind, Reader& reader) {
  if constexpr (Kind == std::variant_size_v<Message>) {
    return std::nullopt;
  } else {
    if (kind != Kind) return decode_kind<Kind + 1>(kind, reader);
    std::variant_alternative_t<Kind, Message> message;
    reader(message);
    if (!reader.read_all()) return std::nullopt;
    return message;
  }
}

}  // namespace

std::string program_version() { return "twocone " TWOCONE_VERSION; }

std::vector<std::uint8_t> encode(Message message) {
  Writer writer;
  const auto kind = static_cast<std::uint8_t>(message.index());
  writer(kind);
  std::visit(writer, message);
  return writer.take();
}

std::optional<Message> decode(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  std::uint8_t kind = 0;
  reader(kind);
  return decode_kind(kind, reader);
}

}  // namespace twocone::sim_povray::server
