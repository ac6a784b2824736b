// SPDX-License-Identifier: Apache-2.0
// Streams two cameras as a robot uses them, for a given time. It prints the numbers of frames and lost frames, and
// every error with the delay after an event until it was reported. Events happen while the pair streams:
//   --at '2.5 control NAME VALUE'   a control of the lower camera's device is set, as by another program
//   --at '2.5 write FILE TEXT'      e.g. into /sys/bus/.../unbind
//   --at '2.5 restart'              the pair is stopped and started
#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "drivers/backends.h"
#include "drivers/v4l2_camera/device.h"
#include "hal/stereo_rig.h"

namespace {

using namespace twocone;
using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

struct Options {
  std::string lower = "/dev/video0", upper = "/dev/video1";
  std::string driver = "v4l2_camera", format;
  double seconds = 10, rate_hz = 25, max_skew_s = 0.025;
  int width_px = 640, height_px = 480;
  std::size_t hold = 0;
  std::vector<std::string> controls, events;
};

/// An event at a camera, and the results of the pair after it.
struct Event {
  double at_s = 0;
  std::string what;
  steady_clock::time_point begun{}, done{};
  std::atomic<bool> has_begun = false;
  std::string failed;
  std::vector<std::pair<std::string, double>> reported{};  ///< each code, and the time of its first report
  std::uint64_t pairs = 0;
  double longest_gap_s = 0;
  double again_s = -1;  ///< time of the first pair after the last error; negative: none
};

struct Eye {
  const char* view;
  std::uint64_t frames = 0, lost = 0, skipped = 0;
  std::vector<double> age_ms{}, interval_ms{};
  std::optional<Timestamp> last{};

  void note(const Frame::Header& header) {
    ++frames;
    lost += header.lost_before;
    skipped += header.skipped_before;
    age_ms.push_back(1e3 * (Seconds(steady_clock::now().time_since_epoch()).count() - header.captured.seconds()));
    if (last && header.lost_before == 0) interval_ms.push_back(1e3 * Seconds(header.captured - *last).count());
    last = header.captured;
  }
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::size_t open_files() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return std::size_t(std::distance(begin(all), end(all)));
}

std::string perform(const std::string& what, const std::string& device) {
  std::istringstream words(what);
  std::string kind, name;
  words >> kind >> name;
  if (kind == "control") {
    std::int64_t value = 0;
    words >> value;
    const auto opened = v4l2::Device::open(device, v4l2::real_kernel());
    if (!opened) return opened.error().message;
    const auto set = (*opened)->set({name, value});
    return set ? "" : set.error().message;
  }
  std::string text;
  words >> text;
  std::ofstream file(name);
  file << text << std::flush;
  return file ? "" : fmt::format("cannot write {}", name);
}

drivers::CameraPart part(const Options& options, const std::string& device) {
  drivers::CameraPart part{options.driver, {options.width_px, options.height_px, options.rate_hz}};
  part.device.name = device;
  part.device.format = options.format;
  for (const std::string& control : options.controls) {
    const auto middle = control.find('=');
    part.device.controls.emplace_back(control.substr(0, middle), std::stod(control.substr(middle + 1)));
  }
  return part;
}

void print(const char* view, const Camera& camera) {
  const CameraFacts facts = camera.facts();
  fmt::print("{}: {}: {} {} x {} at {:g} Hz{}", view, facts.device, facts.format, facts.settings.width_px,
             facts.settings.height_px, facts.settings.rate_hz, facts.has_rate ? "" : " (requested, not reported)");
  for (const auto& [name, value] : facts.controls) fmt::print(", {} {:g}", name, value);
  fmt::print("\n");
}

void print(const Eye& eye) {
  const double middle = quantile(eye.interval_ms, 0.5);
  std::vector<double> off;
  for (const double interval : eye.interval_ms) off.push_back(std::abs(interval - middle));
  fmt::print(
      "{}: frames {}, lost {}, skipped {}, age ms median {:.2f} max {:.2f}, interval ms median {:.3f}, "
      "off it p95 {:.3f} max {:.3f}\n",
      eye.view, eye.frames, eye.lost, eye.skipped, quantile(eye.age_ms, 0.5), quantile(eye.age_ms, 1), middle,
      quantile(off, 0.95), quantile(off, 1));
}

class Probe {
 public:
  Probe(const Options& options, StereoRig rig) : options_(options), rig_(std::move(rig)) {
    for (const std::string& text : options.events) {
      auto& event = events_.emplace_back();
      std::size_t used = 0;
      event.at_s = std::stod(text, &used);
      event.what = text.substr(text.find_first_not_of(' ', used));
    }
  }

  int run() {
    if (!start()) return 1;
    print("lower", rig_.lower());
    print("upper", rig_.upper());
    begin_ = last_pair_ = steady_clock::now();
    std::thread others([this] { perform_events(); });
    while (steady_clock::now() - begin_ < Seconds(options_.seconds)) {
      if (restart_.exchange(false)) {
        rig_.stop();
        (void)start();
      }
      const auto pair = rig_.grab(2s);
      const std::lock_guard lock(mutex_);
      if (pair) {
        note(*pair);
      } else {
        note(pair.error());
      }
    }
    others.join();
    print_all();
    return 0;
  }

 private:
  bool start() {
    const CameraSettings wanted{options_.width_px, options_.height_px, options_.rate_hz};
    const auto started = rig_.start(wanted, wanted);
    if (started) return true;
    const std::lock_guard lock(mutex_);
    note(started.error());
    // A rig that did not start is tried again, as a robot's program does.
    restart_ = true;
    return false;
  }

  void perform_events() {
    for (Event& event : events_) {
      std::this_thread::sleep_until(begin_ + std::chrono::duration_cast<steady_clock::duration>(Seconds(event.at_s)));
      {
        const std::lock_guard lock(mutex_);
        event.begun = steady_clock::now();
        event.has_begun = true;
        fmt::print("{:7.3f} s: {}\n", Seconds(event.begun - begin_).count(), event.what);
      }
      std::string failed;
      if (event.what == "restart") {
        restart_ = true;
      } else {
        failed = perform(event.what, options_.lower);
      }
      const std::lock_guard lock(mutex_);
      event.done = steady_clock::now();
      event.failed = failed;
      if (!failed.empty()) fmt::print("  failed: {}\n", failed);
    }
  }

  /// The last event that has begun.
  Event* now_after() {
    Event* last = nullptr;
    for (Event& event : events_) {
      if (event.has_begun) last = &event;
    }
    return last;
  }

  void note(const StereoFrame& pair) {
    const auto now = steady_clock::now();
    lower_.note(pair.lower.header());
    upper_.note(pair.upper.header());
    skew_ms_.push_back(1e3 * std::abs(Seconds(pair.skew()).count()));
    last_error_.clear();
    if (Event* event = now_after()) {
      const double gap_s = Seconds(now - std::max(last_pair_, event->begun)).count();
      event->longest_gap_s = std::max(event->longest_gap_s, gap_s);
      if (event->again_s < 0) event->again_s = Seconds(now - event->begun).count();
      ++event->pairs;
    }
    last_pair_ = now;
    held_.push_back(pair);
    while (held_.size() > options_.hold) held_.pop_front();
  }

  void note(const Error& error) {
    const auto now = steady_clock::now();
    ++errors_;
    const double since_pair_s = Seconds(now - last_pair_).count();
    std::string after = fmt::format("{:.3f} s after the last pair", since_pair_s);
    if (Event* event = now_after()) {
      const double since_s = Seconds(now - event->begun).count();
      after += fmt::format(", {:.3f} s after '{}'", since_s, event->what);
      const std::string code(to_string(error.code));
      const auto is_it = [&](const auto& report) { return report.first == code; };
      auto& reported = event->reported;
      if (std::none_of(reported.begin(), reported.end(), is_it)) reported.emplace_back(code, since_s);
      event->again_s = -1;
    }
    // An error that is reported repeatedly is printed once.
    if (error.message != last_error_) {
      fmt::print("{:7.3f} s: {}: {} ({})\n", Seconds(now - begin_).count(), to_string(error.code), error.message,
                 after);
    }
    last_error_ = error.message;
  }

  void print_all() {
    fmt::print("pairs {}, unpaired {}, recoveries {}, errors {}\n", skew_ms_.size(), rig_.unpaired(), rig_.recoveries(),
               errors_);
    print(lower_);
    print(upper_);
    fmt::print("skew ms median {:.3f} max {:.3f}\n", quantile(skew_ms_, 0.5), quantile(skew_ms_, 1));
    for (const Event& event : events_) {
      std::string codes;
      for (const auto& [code, at_s] : event.reported) codes += fmt::format(" {} {:.3f}", code, at_s);
      fmt::print("event | {} | reported{} | pairs {} | again {:.3f} | gap {:.3f} | {}\n", event.what,
                 codes.empty() ? " nothing" : codes, event.pairs, event.again_s, event.longest_gap_s,
                 event.failed.empty() ? "done" : "failed");
    }
  }

  const Options options_;
  StereoRig rig_;
  std::deque<Event> events_;
  std::mutex mutex_;
  steady_clock::time_point begin_ = steady_clock::now(), last_pair_ = begin_;
  std::atomic<bool> restart_ = false;
  Eye lower_{"lower"}, upper_{"upper"};
  std::vector<double> skew_ms_;
  std::deque<StereoFrame> held_;
  std::uint64_t errors_ = 0;
  std::string last_error_;
};

int probe(const Options& options) {
  const std::size_t before = open_files();
  int status = 1;
  {
    auto lower = drivers::open_camera("lower", part(options, options.lower));
    auto upper = drivers::open_camera("upper", part(options, options.upper));
    for (const auto* camera : {&lower, &upper}) {
      if (*camera) continue;
      fmt::print("{}: {}\n", to_string(camera->error().code), camera->error().message);
      return 1;
    }
    const auto max_skew = std::chrono::duration_cast<std::chrono::nanoseconds>(Seconds(options.max_skew_s));
    status = Probe(options, StereoRig(*std::move(lower), *std::move(upper), max_skew)).run();
  }
  fmt::print("files open: {} before, {} after\n", before, open_files());
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  Options options;
  CLI::App app{"Streams a pair of cameras and prints the results"};
  app.add_option("lower", options.lower, "device of the lower camera")->capture_default_str();
  app.add_option("upper", options.upper, "device of the upper camera")->capture_default_str();
  app.add_option("--driver", options.driver)->capture_default_str();
  app.add_option("--format", options.format, "empty: the driver chooses");
  app.add_option("--seconds", options.seconds)->capture_default_str();
  app.add_option("--width", options.width_px)->capture_default_str();
  app.add_option("--height", options.height_px)->capture_default_str();
  app.add_option("--rate", options.rate_hz, "Hz")->capture_default_str();
  app.add_option("--max-skew", options.max_skew_s, "s; free-running cameras are up to half a period apart")
      ->capture_default_str();
  app.add_option("--hold", options.hold, "number of pairs that are kept, as by a slow reader")->capture_default_str();
  app.add_option("--control", options.controls, "NAME=VALUE, for both cameras")->take_all();
  app.add_option("--at", options.events, "an event: SECONDS control NAME VALUE, write FILE TEXT or restart")
      ->take_all();
  CLI11_PARSE(app, argc, argv);
  try {
    return probe(options);
  } catch (const std::exception& complaint) {
    std::cerr << complaint.what() << "\n";
    return 2;
  }
}
