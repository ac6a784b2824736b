// SPDX-License-Identifier: Apache-2.0
// Compares the native renderer with POV-Ray on the scenes of robot files: pixels at random poses, and processor time of
// stereo frames with the program's own pool of POV-Ray processes beside it.
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <future>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "apps/config/robot_file.h"
#include "bench/robot_scene.h"
#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "drivers/sim_povray/world/motion.h"
#include "tests/support/value.h"

namespace twocone::bench {
namespace {

using sim_povray::FloorMotion;
using sim_povray::motion_between;
using sim_povray::NativeView;
using sim_povray::parse_poses;
using sim_povray::PoolRenderer;
using sim_povray::Renderer;
using twocone::testing_support::value;

struct Options {
  std::vector<std::string> robots;
  int poses = 100;
  bool anywhere = false;
  ImageSize size{};
  int timed_frames = 10;
  int repeats = 5;
  int processes = 8;
  std::string json;
};

double seconds_of(int who) {
  rusage usage{};
  ::getrusage(who, &usage);
  double sum = 0;
  for (const timeval& t : {usage.ru_utime, usage.ru_stime}) sum += double(t.tv_sec) + 1e-6 * double(t.tv_usec);
  return sum;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0 : values[values.size() / 2];
}

/// Returns a pose on the circle of 0.6 m diameter through the robot's start, where nothing stands.
std::string pose_of_drive(const RobotScene& stage, int frame) {
  const double a = 0.021 * frame;
  return stage.text_of(
      motion_between({0, 0, 0}, {0.3 * std::sin(a), 0.3 - 0.3 * std::cos(a), std::remainder(a, 2 * M_PI)}));
}

/// Returns the wall time of a stereo frame whose bands are shared among this number of threads, in seconds.
double wall_s(const RobotScene& stage, int threads) {
  const auto poses = parse_poses(pose_of_drive(stage, 0));
  const auto begin = std::chrono::steady_clock::now();
  for (const RobotView& view : stage.views()) {
    const int width = view.native->width_px(), height = view.native->height_px();
    Image image{width, height, PixelFormat::kRgb8, Bytes(std::vector<std::uint8_t>(3 * std::size_t(width * height)))};
    const NativeView::Moment moment = view.native->at(*poses);
    std::atomic<int> next = 0;
    std::vector<std::jthread> workers;
    workers.reserve(std::size_t(threads));
    for (int i = 0; i < threads; ++i) {
      workers.emplace_back([&] {
        for (int band = next++; band < view.native->bands(); band = next++) view.native->render(moment, band, image);
      });
    }
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::future<ImageResult> ordered(Renderer& renderer, const RobotView& view, const std::string& pose) {
  auto promise = std::make_shared<std::promise<ImageResult>>();
  auto image = promise->get_future();
  renderer.submit({"frame", view.view_template, pose},
                  [promise](ImageResult result) { promise->set_value(std::move(result)); });
  return image;
}

std::size_t different(const Image& a, const Image& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.bytes.size(); i += 3) {
    bool differs = false;
    for (std::size_t k = i; k < i + 3; ++k) differs = differs || std::abs(int(a.bytes[k]) - int(b.bytes[k])) > 1;
    count += differs ? 1 : 0;
  }
  return count;
}

nlohmann::json measure(const std::string& robot_file, const Options& options) {
  const RobotScene stage(config::read_robot(robot_file), options.size);
  nlohmann::json result{{"robot", robot_file}};
  if (!stage.obstacle().empty()) {
    result["falls_back"] = stage.obstacle();
    return result;
  }
  std::mt19937_64 random(7);
  std::vector<std::string> poses;
  poses.reserve(std::size_t(options.poses));
  for (int i = 0; i < options.poses; ++i) {
    poses.push_back(stage.text_of(options.anywhere ? stage.pose_anywhere(random) : stage.free_pose(random)));
  }
  std::vector<double> shares;
  std::vector<double> native_s, povray_s;
  {
    PoolRenderer pool(stage.povray(), {.processes = options.processes});
    std::vector<std::future<ImageResult>> expected;
    for (const std::string& pose : poses) {
      for (const RobotView& view : stage.views()) expected.push_back(ordered(pool, view, pose));
    }
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const RobotView& view = stage.views()[i % 2];
      const auto image = value(expected[i].get());
      const std::size_t mirror = std::max<std::size_t>(1, view.native->mirror_pixels());
      shares.push_back(double(different(rendered(*view.native, poses[i / 2]), *image)) / double(mirror));
    }
  }
  // A child's processor time counts when it is reaped: each repeat has a pool of its own, and its start is left out by
  // the difference between many and few frames.
  const auto pool_s = [&](int frames) {
    const double before = seconds_of(RUSAGE_CHILDREN);
    {
      PoolRenderer pool(stage.povray(), {.processes = 2});
      std::vector<std::future<ImageResult>> images;
      for (int i = 0; i < frames; ++i) {
        for (const RobotView& view : stage.views()) images.push_back(ordered(pool, view, pose_of_drive(stage, i)));
      }
      for (auto& image : images) (void)value(image.get());
    }
    return seconds_of(RUSAGE_CHILDREN) - before;
  };
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    const double before = seconds_of(RUSAGE_SELF);
    for (int i = 0; i < options.timed_frames; ++i) {
      for (const RobotView& view : stage.views()) (void)rendered(*view.native, pose_of_drive(stage, i));
    }
    native_s.push_back((seconds_of(RUSAGE_SELF) - before) / options.timed_frames);
    povray_s.push_back((pool_s(options.timed_frames + 1) - pool_s(1)) / options.timed_frames);
  }
  double mean = 0;
  for (const double share : shares) mean += share / double(shares.size());
  result["images"] = shares.size();
  result["different_mean"] = mean;
  const auto worst = std::max_element(shares.begin(), shares.end());
  result["different_worst"] = *worst;
  result["worst_image"] = (worst - shares.begin()) % 2 == 0 ? "lower" : "upper";
  result["worst_pose"] = poses[std::size_t(worst - shares.begin()) / 2];
  result["images_over_a_thousandth"] = std::count_if(shares.begin(), shares.end(), [](double s) { return s > 1e-3; });
  result["native_ms"] = 1e3 * median(native_s);
  result["povray_ms"] = 1e3 * median(povray_s);
  result["ratio"] = median(povray_s) / median(native_s);
  for (const int threads : {1, 2, 4}) {
    std::vector<double> walls;
    walls.reserve(std::size_t(options.repeats) * std::size_t(options.timed_frames));
    for (int i = 0; i < options.repeats * options.timed_frames; ++i) walls.push_back(wall_s(stage, threads));
    result["wall_ms"][std::to_string(threads)] = 1e3 * median(walls);
  }
  return result;
}

void print(const nlohmann::json& r) {
  if (r.contains("falls_back")) {
    fmt::print("{:<36} POV-Ray: {}\n", r["robot"].get<std::string>(), r["falls_back"].get<std::string>());
    return;
  }
  fmt::print("{:<36}{:>8.4f} %{:>9.4f} %{:>7}{:>10.1f}{:>10.1f}{:>8.1f} x\n", r["robot"].get<std::string>(),
             100 * r["different_mean"].get<double>(), 100 * r["different_worst"].get<double>(),
             r["images_over_a_thousandth"].get<int>(), r["native_ms"].get<double>(), r["povray_ms"].get<double>(),
             r["ratio"].get<double>());
  fmt::print("  wall time of a frame, by threads:");
  for (const auto& [threads, ms] : r["wall_ms"].items()) fmt::print("  {}: {:.1f} ms", threads, ms.get<double>());
  fmt::print("\n");
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("The native renderer against POV-Ray");
  app.add_option("ROBOT", options.robots, "robot files of simulated robots")->required();
  app.add_option("--poses", options.poses, "random poses that are compared by pixel")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--anywhere", options.anywhere, "poses also inside of furniture");
  app.add_option("--antialias", options.size.antialias, "rays per pixel side")->capture_default_str();
  app.add_option("--frames", options.timed_frames, "stereo frames of a timed repeat")->capture_default_str();
  app.add_option("--repeats", options.repeats)->capture_default_str();
  app.add_option("--width", options.size.width_px)->capture_default_str();
  app.add_option("--height", options.size.height_px)->capture_default_str();
  app.add_option("--json", options.json, "file for the numbers");
  CLI11_PARSE(app, argc, argv);
  fmt::print("{}x{}, {} x {} rays per pixel; pixels off by more than a level, and processor time of a stereo frame\n\n",
             options.size.width_px, options.size.height_px, options.size.antialias, options.size.antialias);
  fmt::print("{:<36}{:>10}{:>11}{:>7}{:>10}{:>10}{:>10}\n", "robot", "mean", "worst", "> 0.1%", "native ms", "POV ms",
             "ratio");
  nlohmann::json results = nlohmann::json::array();
  int failed = 0;
  for (const std::string& robot : options.robots) {
    try {
      results.push_back(measure(robot, options));
      print(results.back());
    } catch (const std::exception& e) {
      std::fprintf(stderr, "native_bench: %s: %s\n", robot.c_str(), e.what());
      failed = 1;
    }
  }
  if (!options.json.empty()) std::ofstream(options.json) << results.dump(2) << '\n';
  return failed;
}

}  // namespace
}  // namespace twocone::bench

int main(int argc, char** argv) {
  try {
    return twocone::bench::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "native_bench: %s\n", e.what());
    return 1;
  }
}
