// SPDX-License-Identifier: Apache-2.0
// Compares rendering with the obvious method, in one run on one machine. The same recorded stereo frames and the same
// closed loop are rendered once with a POV-Ray process per image, started as by hand, and once with held processes.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/child_process.h"
#include "bench/memory_meter.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "drivers/sim_povray/scene/scene.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value.h"

namespace twocone::bench {
namespace {

using namespace twocone::sim_povray;
using twocone::testing_support::value;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Options {
  std::string scene = TWOCONE_SOURCE_DIR "/scenes/lab.pov";
  double unit_m = 0.05;
  int frames = 450;
  int obvious_frames = 0;  ///< 0: all
  int width_px = 640, height_px = 480;
  int loop_frames = 30;
  int loop_width_px = 320, loop_height_px = 240;
  int processes = 8;
  int compared_frames = 10;
  std::string json;
};

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

/// Returns the processor time of this program and of all processes that it has started and reaped. It does not depend
/// on other programs.
double processor_s() {
  double sum = 0;
  for (const int processes : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    ::getrusage(processes, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) sum += double(t.tv_sec) + 1e-6 * double(t.tv_usec);
  }
  return sum;
}

/// Returns the robot's motion in a frame, on a circle of 1 m diameter through its start.
FloorMotion motion(int frame) {
  const double a = 0.021 * frame;
  return motion_between({0, 0, 0}, {0.5 * std::sin(a), 0.5 - 0.5 * std::cos(a), std::remainder(a, 2 * M_PI)});
}

/// Two views, each rendered by the obvious method and by ours.
struct Stereo {
  Scene scene;
  NamedBlock robot;
  std::vector<NamedBlock> cameras;
  double unit_m;
};

struct Size {
  int width_px, height_px;
};

struct View {
  std::shared_ptr<const ViewTemplate> view_template;
  std::optional<MirrorSight> sight;
};

View our_view(const Stereo& stereo, const Povray& povray, const NamedBlock& camera, Size size) {
  View view;
  view.sight = value(find_mirror(povray, stereo.scene, stereo.robot, camera, size.width_px, size.height_px, -1));
  ViewTemplate view_template = stereo.scene.view_template({stereo.robot}, camera, view.sight ? view.sight->mask : "");
  view_template.width_px = size.width_px;
  view_template.height_px = size.height_px;
  if (view.sight) view_template.window = view.sight->window;
  view.view_template = std::make_shared<const ViewTemplate>(std::move(view_template));
  return view;
}

/// Makes an image as by hand: writes the scene into a file and runs POV-Ray on it. Returns the path of the PNG.
fs::path obvious_image(const Stereo& stereo, const std::string& program, const fs::path& folder, int frame,
                       std::size_t view, Size size, const std::vector<std::string>& more = {}) {
  const std::string name = fmt::format("{:06}_{}", frame, view);
  const fs::path pov = folder / (name + ".pov");
  const fs::path png = folder / (name + ".png");
  const FloorMotion m = motion(frame);
  std::ofstream(pov) << with_pose(stereo.scene.view_template({stereo.robot}, stereo.cameras[view], ""),
                                  stereo.scene.pose_text({m}, m, stereo.unit_m));
  base::ChildRequest request;
  request.program.path = program;
  request.program.arguments = {"+I" + pov.string(), "+O" + png.string(), fmt::format("+W{}", size.width_px),
                               fmt::format("+H{}", size.height_px), "-D"};
  request.program.arguments.insert(request.program.arguments.end(), more.begin(), more.end());
  for (char** entry = environ; *entry != nullptr; ++entry) request.program.environment.emplace_back(*entry);
  request.program.folder = fs::absolute(stereo.scene.path()).parent_path().string();
  request.max_output = std::size_t{1} << 20;
  request.timeout = std::chrono::minutes(5);
  const base::ChildResult result = base::run_child(request);
  if (result.end != base::ChildResult::End::kEnded || result.wait_status != 0) throw std::runtime_error(result.errors);
  return png;
}

/// Runs `count` jobs on `threads` threads, in the order of their numbers.
void in_threads(int threads, int count, const std::function<void(int)>& work) {
  std::mutex mutex;
  int next = 0;
  std::vector<std::thread> workers;
  for (int t = 0; t < threads; ++t) {
    workers.emplace_back([&] {
      while (true) {
        int i = 0;
        {
          const std::lock_guard lock(mutex);
          if (next == count) return;
          i = next++;
        }
        work(i);
      }
    });
  }
  for (auto& worker : workers) worker.join();
}

cv::Mat bgr(const Image& image) {
  const cv::Mat rgb(image.height_px, image.width_px, CV_8UC3, const_cast<std::uint8_t*>(image.bytes.data()));
  cv::Mat result;
  cv::cvtColor(rgb, result, cv::COLOR_RGB2BGR);
  return result;
}

/// Returns the number of pixels inside the mirror that differ.
int different_inside(const cv::Mat& a, const cv::Mat& b, const MirrorSight& sight) {
  int count = 0;
  for (int row = 0; row < a.rows; ++row) {
    for (int column = 0; column < a.cols; ++column) {
      const double off = std::hypot(column - sight.circle.centre.column_px, row - sight.circle.centre.row_px);
      if (off < sight.circle.radius_px && a.at<cv::Vec3b>(row, column) != b.at<cv::Vec3b>(row, column)) ++count;
    }
  }
  return count;
}

/// Records a run by our method, with many frames in progress, and writes each image as PNG. Returns seconds.
double record(const Stereo& stereo, Renderer& renderer, const std::vector<View>& views, int frames,
              const fs::path& folder) {
  constexpr int kUnderWay = 24;  // images
  std::mutex mutex;
  std::condition_variable changed;
  int under_way = 0;
  std::deque<std::pair<fs::path, std::shared_ptr<const Image>>> finished;
  std::string error;
  bool done = false;
  std::thread writer([&] {
    while (true) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return done || !finished.empty(); });
      if (finished.empty()) return;
      const auto [path, image] = std::move(finished.front());
      finished.pop_front();
      lock.unlock();
      cv::imwrite(path.string(), bgr(*image),
                  {cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_DEFAULT});  // as apps/runlog does
    }
  });
  const auto begin = Clock::now();
  for (int frame = 0; frame < frames; ++frame) {
    const FloorMotion m = motion(frame);
    for (std::size_t v = 0; v < views.size(); ++v) {
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [&] { return under_way < kUnderWay; });
        ++under_way;
      }
      const fs::path path = folder / fmt::format("{:06}_{}.png", frame, v);
      renderer.submit({fmt::format("frame {}, view {}", frame, v), views[v].view_template,
                       stereo.scene.pose_text({m}, m, stereo.unit_m)},
                      [&, path](ImageResult image) {
                        const std::lock_guard lock(mutex);
                        --under_way;
                        if (image) {
                          finished.emplace_back(path, *image);
                        } else {
                          error = image.error().message;
                        }
                        changed.notify_all();
                      });
    }
  }
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return under_way == 0; });
    done = true;
  }
  changed.notify_all();
  writer.join();
  if (!error.empty()) throw std::runtime_error(error);
  return seconds_since(begin);
}

/// Runs a closed loop: the next pose follows only after both images of a frame. Returns seconds from pose to images for
/// each frame.
std::vector<double> loop(int frames, const std::function<void(int)>& both_images) {
  std::vector<double> latencies;
  for (int frame = 0; frame < frames; ++frame) {
    const auto begin = Clock::now();
    both_images(frame);
    latencies.push_back(seconds_since(begin));
  }
  return latencies;
}

void both_held(const Stereo& stereo, Renderer& renderer, const std::vector<View>& views, int frame) {
  const FloorMotion m = motion(frame);
  std::vector<std::future<ImageResult>> images;
  for (const View& view : views) {
    auto promise = std::make_shared<std::promise<ImageResult>>();
    images.push_back(promise->get_future());
    renderer.submit({fmt::format("frame {}", frame), view.view_template, stereo.scene.pose_text({m}, m, stereo.unit_m)},
                    [promise](ImageResult image) { promise->set_value(std::move(image)); });
  }
  for (auto& image : images) (void)value(image.get());
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

nlohmann::json measure(const Options& options) {
  const std::string program = value(find_povray("povray"));
  Scene scene = value(Scene::read(options.scene));
  const Stereo stereo{scene,
                      value(scene.object("robot")),
                      {value(scene.camera("lower")), value(scene.camera("upper"))},
                      options.unit_m};
  const Povray povray(program, options.scene, std::chrono::minutes(5));
  const Size size{options.width_px, options.height_px};
  const Size loop_size{options.loop_width_px, options.loop_height_px};
  const int obvious_frames =
      options.obvious_frames > 0 ? std::min(options.obvious_frames, options.frames) : options.frames;
  const int compared = std::min(options.compared_frames, obvious_frames);
  const testing_support::TemporaryFolder ours, theirs, bounded;
  PoolSettings pool{.processes = options.processes};
  nlohmann::json result;
  result["cores"] = std::thread::hardware_concurrency();
  result["frames"] = options.frames;
  result["obvious_frames"] = obvious_frames;
  result["processes"] = options.processes;

  std::fprintf(stderr, "our way, recorded\n");
  auto begin = Clock::now();
  std::vector<View> views;
  for (const NamedBlock& camera : stereo.cameras) views.push_back(our_view(stereo, povray, camera, size));
  result["set_up_s"] = seconds_since(begin);
  MemoryMeter memory;
  double processor = processor_s();
  {
    PoolRenderer renderer(povray, pool);
    result["recorded_ours_s"] = record(stereo, renderer, views, options.frames, ours.path());
    result["rendering"] = renderer.describe();
  }
  result["memory_mib"] = memory.stop();
  result["recorded_ours_processor_s"] = processor_s() - processor;

  std::fprintf(stderr, "the obvious way, recorded, %d of %d frames\n", obvious_frames, options.frames);
  begin = Clock::now();
  processor = processor_s();
  for (int i = 0; i < 2 * obvious_frames; ++i) {
    (void)obvious_image(stereo, program, theirs.path(), i / 2, std::size_t(i % 2), size);
  }
  const double scale = double(options.frames) / obvious_frames;
  result["recorded_obvious_s"] = seconds_since(begin) * scale;
  result["recorded_obvious_processor_s"] = (processor_s() - processor) * scale;
  begin = Clock::now();
  in_threads(2, 2 * obvious_frames,
             [&](int i) { (void)obvious_image(stereo, program, theirs.path(), i / 2, std::size_t(i % 2), size); });
  result["recorded_two_at_once_s"] = seconds_since(begin) * scale;

  std::fprintf(stderr, "comparing pixels\n");
  int with_default = 0, with_bsp = 0;
  for (int i = 0; i < 2 * compared; ++i) {
    const auto view = std::size_t(i % 2);
    if (!views[view].sight) throw std::runtime_error("the scene's views have no mirror to compare");
    const MirrorSight& sight = *views[view].sight;
    const std::string name = fmt::format("{:06}_{}.png", i / 2, view);
    const cv::Mat got = cv::imread((ours.path() / name).string());
    const fs::path again = obvious_image(stereo, program, bounded.path(), i / 2, view, size, {"+BM2"});
    with_default += different_inside(got, cv::imread((theirs.path() / name).string()), sight);
    with_bsp += different_inside(got, cv::imread(again.string()), sight);
  }
  result["compared_images"] = 2 * compared;
  result["different_pixels_against_default"] = with_default;
  result["different_pixels_against_bm2"] = with_bsp;

  std::fprintf(stderr, "closed loops\n");
  const auto obvious_frame = [&](int threads) {
    return [&, threads](int frame) {
      in_threads(threads, 2, [&](int view) {
        (void)obvious_image(stereo, program, theirs.path(), frame, std::size_t(view), loop_size);
      });
    };
  };
  result["loop_obvious_s"] = median(loop(options.loop_frames, obvious_frame(1)));
  result["loop_two_at_once_s"] = median(loop(options.loop_frames, obvious_frame(2)));
  std::vector<View> loop_views;
  for (const NamedBlock& camera : stereo.cameras) loop_views.push_back(our_view(stereo, povray, camera, loop_size));
  PoolRenderer renderer(povray, pool);
  const auto ours_frame = [&](int frame) { both_held(stereo, renderer, loop_views, frame); };
  (void)loop(options.processes, ours_frame);  // until all processes have started
  const auto latencies = loop(2 * options.loop_frames, ours_frame);
  result["loop_ours_s"] = median(latencies);
  result["loop_ours_slowest_s"] = *std::max_element(latencies.begin(), latencies.end());
  return result;
}

void print(const Options& options, const nlohmann::json& r) {
  const auto number = [&r](const char* key) { return r.at(key).get<double>(); };
  const double ours = number("recorded_ours_s"), loop_ours = number("loop_ours_s");
  fmt::print("{}: {} stereo frames on {} cores; the obvious way timed on {} of them\n\n", options.scene, options.frames,
             r.at("cores").get<int>(), r.at("obvious_frames").get<int>());
  fmt::print("recorded run, {} x {}           seconds   against ours\n", options.width_px, options.height_px);
  const auto row = [](const char* name, double seconds, double against, int digits) {
    fmt::print("  {:<30}{:>9.{}f}{:>12.2f} x\n", name, seconds, digits, seconds / against);
  };
  row("povray, one after another", number("recorded_obvious_s"), ours, 1);
  row("povray, two at once", number("recorded_two_at_once_s"), ours, 1);
  row("held processes", ours, ours, 1);
  fmt::print("  processor time: {:.1f} s against {:.1f} s\n", number("recorded_obvious_processor_s"),
             number("recorded_ours_processor_s"));
  fmt::print("\nclosed loop, {} x {}, a frame   seconds   against ours\n", options.loop_width_px,
             options.loop_height_px);
  row("povray, one after another", number("loop_obvious_s"), loop_ours, 3);
  row("povray, two at once", number("loop_two_at_once_s"), loop_ours, 3);
  row("held processes", loop_ours, loop_ours, 3);
  fmt::print("  {:<30}{:>9.3f}\n", "held processes, slowest frame", number("loop_ours_slowest_s"));
  fmt::print("\npixels inside the mirrors that differ, in {} images: {} from povray's as it is, {} from povray +BM2\n",
             r.at("compared_images").get<int>(), r.at("different_pixels_against_default").get<int>(),
             r.at("different_pixels_against_bm2").get<int>());
  fmt::print("most memory, this program and all its processes: {:.0f} MiB; finding the mirrors once: {:.1f} s\n",
             number("memory_mib"), number("set_up_s"));
  fmt::print("{}\n", r.at("rendering").get<std::string>());
}

}  // namespace
}  // namespace twocone::bench

int main(int argc, char** argv) {
  using namespace twocone::bench;
  Options options;
  CLI::App app("Rendering against the obvious way");
  app.add_option("--scene", options.scene, "POV-Ray file with robot, lower and upper")->capture_default_str();
  app.add_option("--unit", options.unit_m, "metres in one of its units")->capture_default_str();
  app.add_option("--frames", options.frames, "stereo frames of the recorded run")->capture_default_str();
  app.add_option("--obvious-frames", options.obvious_frames, "of them, timed in the obvious way (default: all)");
  app.add_option("--width", options.width_px)->capture_default_str();
  app.add_option("--height", options.height_px)->capture_default_str();
  app.add_option("--loop-frames", options.loop_frames, "frames of the closed loop")->capture_default_str();
  app.add_option("--processes", options.processes, "held processes")->capture_default_str();
  app.add_option("--compared-frames", options.compared_frames, "frames compared by pixel")->capture_default_str();
  app.add_option("--json", options.json, "file for the numbers");
  CLI11_PARSE(app, argc, argv);
#ifndef NDEBUG
  std::fprintf(stderr, "warning: a debug build\n");
#endif
  try {
    const nlohmann::json result = measure(options);
    print(options, result);
    if (!options.json.empty()) std::ofstream(options.json) << result.dump(2) << '\n';
  } catch (const std::exception& e) {
    std::fprintf(stderr, "render_bench: %s\n", e.what());
    return 1;
  }
}
