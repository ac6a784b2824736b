// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/server/protocol.h"

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>

namespace twocone::sim_povray::server {
namespace {

/// Mutable for a reader, const for a writer: so one list of fields serves both ways, and the two cannot differ.
template <typename Archive, typename T>
using In = std::conditional_t<Archive::kReads, T, const T>;

class Writer {
 public:
  static constexpr bool kReads = false;

  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  template <typename T>
  void put(const T& value) {
    if constexpr (std::is_enum_v<T> || std::is_same_v<T, bool>) {
      put(static_cast<std::uint8_t>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
      raw(&value, sizeof(value));
    } else {
      fields_of(*this, value);
    }
  }
  void put(const std::string& text) {
    const auto size = static_cast<std::uint32_t>(std::min(text.size(), kMaxText));
    put(size);
    raw(text.data(), size);
  }
  void put(const std::vector<double>& numbers) {
    const auto size = static_cast<std::uint32_t>(std::min<std::size_t>(numbers.size(), kMaxNumbers));
    put(size);
    raw(numbers.data(), size * sizeof(double));
  }
  void put(const std::chrono::nanoseconds& time) { put(std::int64_t{time.count()}); }
  template <typename T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
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

/// After the first error, everything that follows is an error too.
class Reader {
 public:
  static constexpr bool kReads = true;

  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  template <typename... Fields>
  void operator()(Fields&... fields) {
    (get(fields), ...);
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
      fields_of(*this, value);
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

// A structured binding takes each list of fields apart, so that a field which is added to a struct and forgotten here
// does not compile.

template <typename A>
void fields_of(A& archive, In<A, Pose2>& pose) {
  auto& [x_m, y_m, heading_rad] = pose;
  archive(x_m, y_m, heading_rad);
}
template <typename A>
void fields_of(A& archive, In<A, WheelSettings>& wheels) {
  auto& [separation_m, radius_m, slip, slip_correlation_s, encoder_counts_per_turn, lag_s] = wheels;
  archive(separation_m, radius_m, slip, slip_correlation_s, encoder_counts_per_turn, lag_s);
}
template <typename A>
void fields_of(A& archive, In<A, Physics>& physics) {
  auto& [mass_kg, wheel_friction, body_friction] = physics;
  archive(mass_kg, wheel_friction, body_friction);
}
template <typename A>
void fields_of(A& archive, In<A, RobotBody>& body) {
  auto& [name, start, radius_m, wheels, command_timeout, physics, seed, begin, start_place] = body;
  archive(name, start, radius_m, wheels, command_timeout, physics, seed, begin, start_place);
}
template <typename A>
void fields_of(A& archive, In<A, DriveLimits>& limits) {
  auto& [max_speed_radps, command_timeout] = limits;
  archive(max_speed_radps, command_timeout);
}
template <typename A>
void fields_of(A& archive, In<A, SessionSettings>& settings) {
  auto& [name, body, drive, map_outline, run_ahead_frames, rendered, stored] = settings;
  archive(name, body, drive, map_outline, run_ahead_frames);
  (void)rendered, (void)stored;  // functions of the client, which are not sent
}
template <typename A>
void fields_of(A& archive, In<A, CameraEffects>& effects) {
  auto& [gain, full_well_electrons, read_noise_electrons, vignetting, defocus_px, exposure_time_s, readout_s,
         shutter_samples, distortion, distortion_focal_px, drop_probability, late_probability, stamp_late_s] = effects;
  archive(gain, full_well_electrons, read_noise_electrons, vignetting, defocus_px, exposure_time_s, readout_s,
          shutter_samples, distortion, distortion_focal_px, drop_probability, late_probability, stamp_late_s);
}
template <typename A>
void fields_of(A& archive, In<A, ViewSettings>& settings) {
  auto& [camera_name, antialias, effects] = settings;
  archive(camera_name, antialias, effects);
}
template <typename A>
void fields_of(A& archive, In<A, CameraSettings>& settings) {
  auto& [width_px, height_px, rate_hz] = settings;
  archive(width_px, height_px, rate_hz);
}
template <typename A>
void fields_of(A& archive, In<A, WheelSpeeds>& speeds) {
  auto& [left_radps, right_radps] = speeds;
  archive(left_radps, right_radps);
}
template <typename A>
void fields_of(A& archive, In<A, SessionState>& state) {
  auto& [step, now, pose, left_rad, right_rad, contact] = state;
  archive(step, now, pose, left_rad, right_rad, contact);
}

template <typename A>
void fields_of(A& archive, In<A, Hello>& message) {
  archive(message.magic, message.version, message.program);
}
template <typename A>
void fields_of(A& archive, In<A, Failed>& message) {
  archive(message.code, message.message);
}
template <typename A>
void fields_of(A& archive, In<A, Take>& message) {
  archive(message.settings);
}
template <typename A>
void fields_of(A& archive, In<A, OpenView>& message) {
  archive(message.settings);
}
template <typename A>
void fields_of(A& archive, In<A, ConfigureView>& message) {
  archive(message.view, message.settings);
}
template <typename A>
void fields_of(A& archive, In<A, ReleaseView>& message) {
  archive(message.view);
}
template <typename A>
void fields_of(A& archive, In<A, Step>& message) {
  archive(message.remaining);
}
template <typename A>
void fields_of(A& archive, In<A, ImageOrder>& message) {
  archive(message.order, message.view, message.slot);
}
template <typename A>
void fields_of(A& archive, In<A, Command>& message) {
  archive(message.speeds);
}
template <typename A>
void fields_of(A& /*archive*/, In<A, Halt>& /*message*/) {}
template <typename A>
void fields_of(A& /*archive*/, In<A, Leave>& /*message*/) {}
template <typename A>
void fields_of(A& archive, In<A, Sessioned>& message) {
  archive(message.state);
}
template <typename A>
void fields_of(A& archive, In<A, Stepped>& message) {
  archive(message.state);
}
template <typename A>
void fields_of(A& archive, In<A, ViewOpened>& message) {
  archive(message.view);
}
template <typename A>
void fields_of(A& archive, In<A, ViewConfigured>& message) {
  archive(message.slots, message.slot_bytes);
}
template <typename A>
void fields_of(A& /*archive*/, In<A, Done>& /*message*/) {}
template <typename A>
void fields_of(A& archive, In<A, ImageDone>& message) {
  archive(message.order, message.format);
}
template <typename A>
void fields_of(A& archive, In<A, ImageFailed>& message) {
  archive(message.order, message.code, message.message);
}

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

std::vector<std::uint8_t> encode(const Message& message) {
  Writer writer;
  writer(static_cast<std::uint8_t>(message.index()));
  std::visit([&writer](const auto& content) { writer(content); }, message);
  return writer.take();
}

std::optional<Message> decode(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  std::uint8_t kind = 0;
  reader(kind);
  return decode_kind(kind, reader);
}

}  // namespace twocone::sim_povray::server
