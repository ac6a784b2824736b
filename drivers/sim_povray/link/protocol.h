// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim_povray/seat.h"
#include "drivers/sim_povray/sim_povray.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/image.h"
#include "hal/result.h"

/// What the two ends of a link say to each other: one message per packet. Pixels do not travel in messages but through
/// shared memory (shared_frames.h).
///
///     client                                   server
///     Hello                            ->
///                                      <-      Hello; Failed and the end if the versions differ
///     Take                             ->
///                                      <-      Seated, or Failed and the end
///     any request                      ->
///                                      <-      its reply, or Failed
///     PictureOrder, at any time        ->
///                                      <-      PictureDone or PictureFailed, at any time, in any order
///     Leave                            ->
///                                      <-      Done, and the end: the seat is free
///
/// One request at a time; an order is none. Whoever gets what does not belong here says Failed and closes.
namespace twocone::sim_povray::link {

/// Both ends are of this version or do not talk. To be raised with any change of a message.
constexpr std::uint32_t kVersion = 4;
constexpr std::uint64_t kMagic = 0x6b6e696c32656e6f;  // "one2link"

constexpr std::size_t kMaxMessage = 16384;  ///< bytes
constexpr std::size_t kMaxText = 4096;      ///< bytes of one text; what is longer is cut
constexpr std::uint32_t kMaxNumbers = 64;   ///< in one list
constexpr std::uint32_t kMaxViews = 64;     ///< of one seat
constexpr int kMaxSide_px = 16384;          ///< of a picture
constexpr std::uint32_t kMaxSlots = 256;    ///< pictures of one view that may be on their way

/// "twocone 0.1.0"
std::string program_version();

// ---- either way

/// Its layout is the same in all versions, so that each end can tell which one the other speaks.
struct Hello {
  std::uint64_t magic = kMagic;
  std::uint32_t version = kVersion;
  std::string program = program_version();  ///< for people: "twocone 0.1.0"
};
struct Failed {
  ErrorCode code = ErrorCode::kRefused;
  std::string message;
};

// ---- from the client: the calls of Seat

struct Take {
  SeatSettings settings;
};
struct OpenView {
  ViewSettings settings;
};
struct ConfigureView {
  std::uint32_t view = 0;
  CameraSettings settings;
};
struct ReleaseView {
  std::uint32_t view = 0;
};
struct Step {
  std::chrono::nanoseconds remaining{0};  ///< until the deadline; the two ends' clocks need not agree
};
struct PictureOrder {
  std::uint64_t order = 0;  ///< grows with each order of a seat
  std::uint32_t view = 0;
  std::uint32_t slot = 0;  ///< of the view's shared memory, where the pixels shall go; not in use
};
struct Command {
  WheelSpeeds speeds;
};
struct Halt {};
struct Leave {};

// ---- from the server

struct Seated {
  SeatState state;
};
struct Stepped {
  SeatState state;
};
struct ViewOpened {
  std::uint32_t view = 0;
};
/// Comes with the descriptor of the view's shared memory: `slots` pictures, one behind the other.
struct ViewConfigured {
  std::uint32_t slots = 0;
  std::uint64_t slot_bytes = 0;
};
struct Done {};
struct PictureDone {
  std::uint64_t order = 0;
  PixelFormat format = PixelFormat::kRgb8;
};
struct PictureFailed {
  std::uint64_t order = 0;
  ErrorCode code = ErrorCode::kBadData;
  std::string message;
};

/// A packet's first byte is the index in this list. Hello and Failed stay where they are in all versions.
using Message =
    std::variant<Hello, Failed, Take, OpenView, ConfigureView, ReleaseView, Step, PictureOrder, Command, Halt, Leave,
                 Seated, Stepped, ViewOpened, ViewConfigured, Done, PictureDone, PictureFailed>;

/// Numbers as they lie in this machine's memory: a link does not leave it.
std::vector<std::uint8_t> encode(const Message& message);

/// Nothing if the bytes are not one whole message. Settings, speeds and the like come as they were sent, also
/// impossible ones: the receiver checks them.
std::optional<Message> decode(std::span<const std::uint8_t> bytes);

}  // namespace twocone::sim_povray::link
