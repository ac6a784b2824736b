// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_diffdrive/transport.h"

#include <fcntl.h>
#include <libserialport.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/child_process.h"
#include "base/log.h"
#include "drivers/serial_diffdrive/serial_diffdrive.h"
#include "hal/device_info.h"

namespace twocone::serial {
namespace {

namespace fs = std::filesystem;

// The watchdog of a program that was killed keeps the port for at most this time.
constexpr std::chrono::milliseconds kWatchdogGoes{300};

/// Returns libserialport's last error in this thread.
std::string last_error() {
  char* text = sp_last_error_message();
  std::string copy(text != nullptr ? text : "unknown error");
  sp_free_error_message(text);
  return copy;
}

using Port = std::unique_ptr<sp_port, void (*)(sp_port*)>;

ErrorCode code_of(int error) {
  if (error == ENOENT || error == ENODEV || error == ENXIO) return ErrorCode::kNotFound;
  if (error == EACCES || error == EPERM || error == EBUSY) return ErrorCode::kRefused;
  return ErrorCode::kUnavailable;
}

// The text after the semicolon advises what to do about a refusal.
constexpr const char* kEndTheOther = "; another program uses it: end that (fuser shows which)";
constexpr const char* kNamePort = "; name the port of the controller, as twocone devices lists it";

std::string advice_for(int error) {
  if (error == EACCES || error == EPERM)
    return "; join the group dialout: sudo usermod -aG dialout $USER, then log in again";
  if (error == EBUSY) return kEndTheOther;
  return "";
}

std::string text_of(const char* text) { return text != nullptr ? printable(text) : ""; }

/// Returns the by-id link to `path`.
std::string stable_path_of(const fs::path& path) {
  std::error_code error;
  for (const auto& link : fs::directory_iterator("/dev/serial/by-id", error)) {
    if (fs::weakly_canonical(link.path(), error) == path) return link.path().string();
  }
  return "";
}

class SerialPort final : public Transport {
 public:
  /// @param port open
  SerialPort(std::string path, Port port, int descriptor)
      : path_(std::move(path)), port_(std::move(port)), descriptor_(descriptor) {}
  ~SerialPort() override {
    // A port that another program has taken must keep its TIOCEXCL.
    if (is_alone_) ::ioctl(descriptor_, TIOCNXCL);
    sp_close(port_.get());
  }

  /// Takes the port exclusively: TIOCEXCL stops other programs from opening it, except root's; the lock stops every
  /// other twocone.
  Status take_alone(bool& is_busy) {
    ::fcntl(descriptor_, F_SETFD, FD_CLOEXEC);
    is_alone_ = ::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 && ::ioctl(descriptor_, TIOCEXCL) == 0;
    if (is_alone_) return {};
    is_busy = errno == EWOULDBLOCK;
    const int error = errno;
    return Error(ErrorCode::kRefused, "{}: {}{}", path_, is_busy ? "it is taken" : std::strerror(error),
                 is_busy ? kEndTheOther : kNamePort);
  }

  Status set_up(int baud) {
    if (sp_set_baudrate(port_.get(), baud) != SP_OK) {
      return Error(ErrorCode::kRefused, "{}: {} baud: {}; give baud: a rate that the port has", path_, baud,
                   last_error());
    }
    if (sp_set_bits(port_.get(), 8) != SP_OK || sp_set_parity(port_.get(), SP_PARITY_NONE) != SP_OK ||
        sp_set_stopbits(port_.get(), 1) != SP_OK || sp_set_flowcontrol(port_.get(), SP_FLOWCONTROL_NONE) != SP_OK) {
      return Error(ErrorCode::kRefused, "{}: 8 bits, no parity, 1 stop bit, no flow control: {}{}", path_, last_error(),
                   kNamePort);
    }
    sp_flush(port_.get(), SP_BUF_BOTH);
    return {};
  }

  Status write(std::span<const std::uint8_t> bytes, Deadline deadline) override {
    while (!bytes.empty()) {
      const auto sent = sp_nonblocking_write(port_.get(), bytes.data(), bytes.size());
      if (sent < 0) return gone();
      bytes = bytes.subspan(std::size_t(sent));
      if (bytes.empty()) break;
      if (auto ready = wait_for(POLLOUT, deadline); !ready) {
        if (ready.error().code != ErrorCode::kTimeout) return ready;
        return Error(ErrorCode::kTimeout, "{} takes no more bytes", path_);
      }
    }
    return {};
  }

  Result<std::size_t> read(std::span<std::uint8_t> room, Deadline deadline) override {
    while (true) {
      const auto got = sp_nonblocking_read(port_.get(), room.data(), room.size());
      if (got < 0) return gone();
      if (got > 0) return std::size_t(got);
      if (auto ready = wait_for(POLLIN, deadline); !ready) return ready.error();
      // The port is readable but has nothing to read: its device is gone.
      if (sp_input_waiting(port_.get()) <= 0 && std::chrono::steady_clock::now() >= deadline) return gone();
    }
  }

  Status discard_input() override {
    if (sp_input_waiting(port_.get()) < 0 || sp_flush(port_.get(), SP_BUF_INPUT) != SP_OK) return gone();
    return {};
  }

 private:
  [[nodiscard]] Error gone() const { return Error(ErrorCode::kDisconnected, "{} is gone: unplugged?", path_); }
  /// Waits for `events`. Errors: kTimeout, kDisconnected.
  [[nodiscard]] Status wait_for(short events, Deadline deadline) const {
    while (true) {
      pollfd entry{descriptor_, events, 0};
      const int ready = ::poll(&entry, 1, base::milliseconds_until(deadline));
      if (ready < 0 && errno != EINTR) return gone();
      if (ready > 0) {
        if ((entry.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return gone();
        return {};
      }
      if (std::chrono::steady_clock::now() >= deadline) {
        // A port whose device is gone may look like a silent one.
        if (sp_input_waiting(port_.get()) < 0) return gone();
        return Error{ErrorCode::kTimeout, "no answer"};
      }
    }
  }

  const std::string path_;
  const Port port_;
  const int descriptor_;
  bool is_alone_ = false;
};

Result<Connection> open_once(const std::string& path, int baud, bool& is_busy) {
  std::error_code none;
  const fs::path device = fs::canonical(path, none);
  if (none) return Error(ErrorCode::kNotFound, "{}: {}", path, none.message());
  sp_port* raw = nullptr;
  if (sp_get_port_by_name(device.c_str(), &raw) != SP_OK) {
    return Error(ErrorCode::kRefused, "{} is no serial port{}", path, kNamePort);
  }
  Port port(raw, sp_free_port);
  if (sp_open(port.get(), SP_MODE_READ_WRITE) != SP_OK) {
    const int error = sp_last_error_code();
    is_busy = error == EBUSY;
    return Error(code_of(error), "{}: {}{}", path, last_error(), advice_for(error));
  }
  int descriptor = -1;
  if (sp_get_port_handle(port.get(), &descriptor) != SP_OK) {
    sp_close(port.get());
    return Error(ErrorCode::kRefused, "{} has no descriptor{}", path, kNamePort);
  }
  auto opened = std::make_unique<SerialPort>(path, std::move(port), descriptor);
  if (auto ours = opened->take_alone(is_busy); !ours) return ours.error();
  if (auto set = opened->set_up(baud); !set) return set.error();
  return Connection{std::move(opened), descriptor};
}

}  // namespace

std::string_view why_not() { return ""; }

std::vector<DeviceInfo> list_ports() {
  sp_port** ports = nullptr;
  if (sp_list_ports(&ports) != SP_OK) return {};
  std::map<std::string, DeviceInfo> by_path;
  for (sp_port** port = ports; *port != nullptr; ++port) {
    const std::string path = sp_get_port_name(*port);
    const std::string stable_path = stable_path_of(path);
    std::string description = text_of(sp_get_port_description(*port));
    const std::string serial = text_of(sp_get_port_usb_serial(*port));
    if (!serial.empty()) description += fmt::format(", serial number {}", serial);
    by_path[path] = {.name = stable_path.empty() ? path : stable_path,
                     .what = description.empty() ? path : fmt::format("{} ({})", description, path)};
  }
  sp_free_port_list(ports);
  std::vector<DeviceInfo> found;
  found.reserve(by_path.size());
  for (auto& [path, info] : by_path) found.push_back(std::move(info));
  return found;
}

Result<Connection> open_port(const std::string& path, int baud) {
  for (const auto deadline = std::chrono::steady_clock::now() + kWatchdogGoes;;) {
    bool is_busy = false;
    auto port = open_once(path, baud, is_busy);
    if (port || !is_busy || std::chrono::steady_clock::now() >= deadline) return port;
    base::Logger("serial").info(path + ": in use; tried again");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

}  // namespace twocone::serial
