// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "drivers/sim_povray/robot_session.h"
#include "drivers/sim_povray/session_settings.h"
#include "hal/camera.h"
#include "hal/diff_drive.h"
#include "hal/image.h"
#include "hal/result.h"

/// Messages between the two ends of a link: one message per packet. Pixels are not in messages but in shared memory
/// (images.h).
///
///     client                                   server
///     Hello                            ->
///                                      <-      Hello; Failed and the end if the versions differ
///     Take                             ->
///                                      <-      Sessioned, or Failed and the end
///     any request                      ->
///                                      <-      its reply, or Failed
///     ImageOrder, at any time          ->
///                                      <-      ImageDone or ImageFailed, at any time, in any order
///     Leave                            ->
///                                      <-      Done, and the end: the session is free
///
/// One request is open at a time; an image order is not a request. An end that receives an unexpected message sends
/// Failed and closes the link.
namespace twocone::sim_povray::server {

/// The version that both ends must have. It must be raised with any change of a message.
constexpr std::uint32_t kVersion = 4;
constexpr std::uint64_t kMagic = 0x6b6e696c32656e6f;  // "one2link"

constexpr std::size_t kMaxMessage = 16384;  ///< bytes
constexpr std::size_t kMaxText = 4096;      ///< bytes of one text; longer text is cut
constexpr std::uint32_t kMaxNumbers = 64;   ///< in one list
constexpr std::uint32_t kMaxViews = 64;     ///< of one session
constexpr std::uint32_t kMaxSlots = 256;    ///< images of one view that may be unfinished

/// Returns the program's name and version: "twocone 0.1.0".
std::string program_version();

// ---- either way

/// Each end's first message. Its layout is the same in all versions, so that each end can read the other's version.
struct Hello {
  std::uint64_t magic = kMagic;
  std::uint32_t version = kVersion;
  std::string program = program_version();  ///< for people: "twocone 0.1.0"
};
struct Failed {
  ErrorCode code = ErrorCode::kRefused;
  std::string message;
};

// ---- from the client: the calls of RobotSession

struct Take {
  SessionSettings settings;
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
struct ImageOrder {
  std::uint64_t order = 0;  ///< grows with each order of a session
  std::uint32_t view = 0;
  std::uint32_t slot = 0;  ///< free slot of the view's shared memory, for the pixels
};
struct Command {
  WheelSpeeds speeds;
};
struct Halt {};
struct Leave {};

// ---- from the server

struct Sessioned {
  SessionState state;
};
struct Stepped {
  SessionState state;
};
struct ViewOpened {
  std::uint32_t view = 0;
};
/// Carries the descriptor of the view's shared memory: `slots` images, one behind the other.
struct ViewConfigured {
  std::uint32_t slots = 0;
  std::uint64_t slot_bytes = 0;
};
struct Done {};
struct ImageDone {
  std::uint64_t order = 0;
  PixelFormat format = PixelFormat::kRgb8;
};
struct ImageFailed {
  std::uint64_t order = 0;
  ErrorCode code = ErrorCode::kBadData;
  std::string message;
};

/// A packet's first byte is the index in this list. Hello and Failed keep their places in all versions.
using Message = std::variant<Hello, Failed, Take, OpenView, ConfigureView, ReleaseView, Step, ImageOrder, Command, Halt,
                             Leave, Sessioned, Stepped, ViewOpened, ViewConfigured, Done, ImageDone, ImageFailed>;

/// Encodes a message. Numbers are as in this machine's memory, because a link does not leave the machine.
std::vector<std::uint8_t> encode(Message message);

/// Decodes a message; returns nothing if the bytes are not one whole message. Settings, speeds and the like are
/// returned as they were sent, even impossible ones: the receiver checks them.
std::optional<Message> decode(std::span<const std::uint8_t> bytes);

}  // namespace twocone::sim_povray::server
