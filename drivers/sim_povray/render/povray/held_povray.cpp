// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/povray/povray_pool.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/unique_fd.h"

namespace twocone::sim_povray {
namespace {

/// The least lease-break-time. With less, a loaded machine might break a lease although nothing has failed.
constexpr int kLeastBreakTime_s = 4;

/// Last frame of the animation: more than a process lives to render. Its digits are those in the files' names.
constexpr int kLastFrame = 999'999;
constexpr const char* kStale = "twocone: stale pose";

base::Program program_for(const Povray& povray, const ViewTemplate& view_template, int scene_fd, int pose_fd,
                          const std::filesystem::path& folder) {
  if (::mkdir(folder.c_str(), 0700) != 0) throw std::system_error(errno, std::generic_category(), folder.string());
  base::Program program = povray.program(view_template);
  // The clock is constant, so that `clock` has the value that it has in a single image.
  for (const char* option : {"+KFI1", "+KI0", "+KF0"}) program.arguments.emplace_back(option);
  program.arguments.push_back(fmt::format("+KFF{}", kLastFrame));
  program.arguments.push_back(fmt::format("+O{}/f", folder.string()));
  program.inputs = {scene_fd, pose_fd};
  program.output = false;
  program.writable = folder.string();
  return program;
}

}  // namespace

PoseLease::PoseLease(const std::string& text) {
  const base::UniqueFd first = base::memory_file("pose.inc", "");
  // A write lease requires that the file is open only once. Creating a memory file counts as another opening; opening
  // it by its path does not.
  fd_ = base::UniqueFd(::open(fmt::format("/proc/self/fd/{}", first.get()).c_str(), O_RDWR | O_CLOEXEC));
  if (!fd_.valid()) base::throw_errno("opening a memory file again");
  write(text);
}

bool PoseLease::take() {
  // The owner is set before F_SETLEASE, which would notify the whole process: any thread of it could get the signal. It
  // is set each time, because giving a lease back resets the owner.
  f_owner_ex owner{F_OWNER_TID, ::gettid()};
  if (::fcntl(fd_.get(), F_SETOWN_EX, &owner) != 0) base::throw_errno("F_SETOWN_EX");
  if (::fcntl(fd_.get(), F_SETLEASE, F_WRLCK) == 0) return true;
  if (errno != EAGAIN) base::throw_errno("F_SETLEASE");
  return false;
}

bool PoseLease::wanted() const { return ::fcntl(fd_.get(), F_GETLEASE) != F_WRLCK; }

void PoseLease::write(const std::string& text) {
  std::size_t done = 0;
  while (done < text.size()) {
    const auto written = ::pwrite(fd_.get(), text.data() + done, text.size() - done, off_t(done));
    if (written < 0 && errno != EINTR) base::throw_errno("writing a memory file");
    if (written > 0) done += std::size_t(written);
  }
  if (::ftruncate(fd_.get(), off_t(text.size())) != 0) base::throw_errno("writing a memory file");
}

void PoseLease::give(const std::string& text) {
  write(text);
  if (::fcntl(fd_.get(), F_SETLEASE, F_UNLCK) != 0 && errno != EAGAIN) base::throw_errno("F_SETLEASE");
}

int lease_break_time_s() {
  std::ifstream file("/proc/sys/fs/lease-break-time");
  int seconds = 0;
  return file >> seconds ? seconds : 0;
}

std::string lease_obstacle() {
  try {
    const int seconds = lease_break_time_s();
    if (seconds < kLeastBreakTime_s) {
      return fmt::format("/proc/sys/fs/lease-break-time is {} s, must be >= {} s", seconds, kLeastBreakTime_s);
    }
    PoseLease lease("");
    // A child that another thread forks at this moment also has the file open until it calls exec.
    for (int attempt = 0; attempt < 100; ++attempt) {
      if (lease.take()) return "";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return "F_SETLEASE: a file of our own counts as open elsewhere";
  } catch (const std::system_error& e) {
    return e.what();
  }
}

HeldScene::HeldScene(const ViewTemplate& view_template) : serial_name_("Twocone_Serial") {
  while (view_template.scene.find(serial_name_) != std::string::npos) serial_name_ += '_';
  // The text is inserted into an existing line, so that POV-Ray's line numbers stay those of the scene. The file is
  // sealed, because several processes read it, and a scene could open it for writing.
  fd_ = base::sealed_file(
      "scene.pov",
      with_pose(view_template, fmt::format("#include \"/proc/self/fd/{}\" #if ({} != frame_number) #error \"{}\" #end",
                                           base::kChildInput + 1, serial_name_, kStale)));
}

std::string HeldScene::pose_text(int frame, const std::string& pose) const {
  return fmt::format("#declare {} = {}; {}\n", serial_name_, frame, pose);
}

bool HeldScene::is_stale(const std::string& errors) { return errors.find(kStale) != std::string::npos; }

HeldPovray::HeldPovray(const Povray& povray, const ViewTemplate& view_template, const HeldScene& scene,
                       const std::filesystem::path& folder)
    : scene_(scene),
      folder_(folder),
      lease_(scene.pose_text(-1, "")),  // of no frame
      leased_(lease_.take()),
      child_(program_for(povray, view_template, scene.fd(), lease_.fd(), folder)) {}

void HeldPovray::enter(State state) {
  state_ = state;
  since_ = std::chrono::steady_clock::now();
}

void HeldPovray::look() {
  if (state_ == State::kDrawing) return;
  if (!leased_) {
    // If POV-Ray opens the file before that, it finds an old pose and stops. The pool then starts another process.
    leased_ = lease_.take();
  } else if (state_ == State::kComing && lease_.wanted()) {
    enter(State::kWaiting);
  }
}

void HeldPovray::draw(Order order) {
  assert(state_ == State::kWaiting);
  const std::string text = scene_.pose_text(frame_, order.job.pose);
  order_ = std::move(order);
  enter(State::kDrawing);
  leased_ = false;
  lease_.give(text);
}

std::filesystem::path HeldPovray::image() const {
  return folder_ / fmt::format("f{:0{}}.ppm", frame_, fmt::formatted_size("{}", kLastFrame));
}

Order HeldPovray::finish() {
  assert(state_ == State::kDrawing);
  ++frame_;
  if (const auto cpu = child_.cpu()) {
    order_->use = {*cpu - cpu_until_last_, order_->job.used ? base::peak_memory_bytes(child_.pid()) : 0};
    cpu_until_last_ = *cpu;
  }
  errors_.clear();  // warnings about the finished frame
  enter(State::kComing);
  look();
  return *std::exchange(order_, std::nullopt);
}

bool HeldPovray::drain_errors() {
  const bool open = base::drain(child_.errors_fd(), errors_);
  base::keep_newest(errors_);
  return open;
}

}  // namespace twocone::sim_povray
