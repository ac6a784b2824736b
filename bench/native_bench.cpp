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

#include "apps/config/to_layers.h"
#include "drivers/sim_povray/effects/scene_calls.h"
#include "drivers/sim_povray/render/mirror_finder.h"
#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "drivers/sim_povray/render/povray/scene_access.h"
#include "tests/support/value.h"

namespace twocone::bench {
namespace {

using namespace twocone::sim_povray;
using twocone::testing_support::value;

struct Options {
  std::vector<std::string> robots;
  int poses = 100;
  int antialias = 1;
  int timed_frames = 10;
  int repeats = 5;
  int width_px = 640, height_px = 480;
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

struct View {
  std::shared_ptr<const ViewTemplate> view_template;
  std::shared_ptr<const NativeView> native;
};

constexpr double kBody_m = 0.3;

bool is_near(const Solid& solid, const Pose2& pose) {
  if (const auto* disc = std::get_if<Disc>(&solid.shape)) {
    return std::hypot(pose.x_m - disc->centre.x_m, pose.y_m - disc->centre.y_m) < disc->radius_m + kBody_m;
  }
  // Its bounds are enough: obstacles are small.
  FloorPoint low{1e9, 1e9}, high{-1e9, -1e9};
  for (const FloorPoint& corner : std::get<Outline>(solid.shape)) {
    low = {std::min(low.x_m, corner.x_m), std::min(low.y_m, corner.y_m)};
    high = {std::max(high.x_m, corner.x_m), std::max(high.y_m, corner.y_m)};
  }
  return pose.x_m > low.x_m - kBody_m && pose.x_m < high.x_m + kBody_m && pose.y_m > low.y_m - kBody_m &&
         pose.y_m < high.y_m + kBody_m;
}

/// A robot in its scene: poses, and views as a run has them.
class Stage {
 public:
  Stage(const config::Robot& robot, const Options& options)
      : map_(config::read_map(robot.map)), place_(config::to_place(map_)), scene_(value(Scene::read(place_.scene))) {
    const NamedBlock carrier = value(scene_.robot(robot.name));
    for (const std::string& name : scene_.names()) {
      if (name != "robot" && !name.starts_with("robot.") && !name.starts_with("moving.")) continue;
      if (name == carrier.name) carrier_ = movers_.size();
      movers_.push_back(value(scene_.object(name)));
    }
    start_ = config::to_start_pose(robot);
    povray_ = std::make_unique<Povray>(value(confined_povray(place_, scene_)));
    for (const char* const camera : {"lower", "upper"}) views_.push_back(view(carrier, camera, options));
  }

  [[nodiscard]] const std::vector<View>& views() const { return views_; }
  [[nodiscard]] const Povray& povray() const { return *povray_; }
  [[nodiscard]] std::string obstacle() const { return obstacle_; }

  /// Returns a pose between the walls where the robot stands in no obstacle. Inside of one, where faces lie on each
  /// other, the two programs choose differently.
  template <class Random>
  std::string pose(Random& random) const {
    const auto between = [&random](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    const Bounds& b = map_.bounds;
    Pose2 there;
    do {
      there = {between(b.min_x_m + kBody_m, b.max_x_m - kBody_m), between(b.min_y_m + kBody_m, b.max_y_m - kBody_m),
               between(-M_PI, M_PI)};
    } while (std::ranges::any_of(place_.solids, [&](const Solid& solid) { return is_near(solid, there); }));
    return text(motion_between(start_, there));
  }
  /// Returns a pose on the circle of 0.6 m diameter through the robot's start, where nothing stands.
  [[nodiscard]] std::string pose_of_drive(int frame) const {
    const double a = 0.021 * frame;
    return text(motion_between({0, 0, 0}, {0.3 * std::sin(a), 0.3 - 0.3 * std::cos(a), std::remainder(a, 2 * M_PI)}));
  }

 private:
  [[nodiscard]] std::string text(const FloorMotion& motion) const {
    std::vector<FloorMotion> motions(movers_.size());
    motions[carrier_] = motion;
    return scene_.pose_text(motions, motion, map_.unit_m);
  }

  View view(const NamedBlock& carrier, const std::string& name, const Options& options) {
    const NamedBlock camera = value(scene_.camera_of(carrier, name));
    const auto sight = value(find_mirror(*povray_, scene_, carrier, camera, options.width_px, options.height_px, -1));
    ViewTemplate view_template = scene_.view_template(movers_, camera, sight ? sight->mask : "");
    if (sight) view_template.window = sight->window;
    view_template.carrier = int(carrier_);
    view_template.width_px = options.width_px;
    view_template.height_px = options.height_px;
    view_template.antialias = options.antialias;
    view_template.quality = kPlainQuality;
    SceneAccess access(place_.scene, place_.scene_paths);
    auto native = NativeView::make(view_template, scene_.path(), include_reader(access));
    if (!native) obstacle_ = native.error().message;
    return {std::make_shared<const ViewTemplate>(view_template), native ? *native : nullptr};
  }

  config::Map map_;
  PlaceSettings place_;
  Scene scene_;
  std::vector<NamedBlock> movers_;
  std::size_t carrier_ = 0;
  Pose2 start_{};
  std::unique_ptr<Povray> povray_;
  std::vector<View> views_;
  std::string obstacle_;
};

Image rendered(const NativeView& view, const std::string& pose) {
  const auto poses = parse_poses(pose);
  Image image{view.width_px(), view.height_px(), PixelFormat::kRgb8,
              Bytes(std::vector<std::uint8_t>(3 * std::size_t(view.width_px()) * std::size_t(view.height_px())))};
  for (int band = 0; band < view.bands(); ++band) view.render(*poses, band, image);
  return image;
}

/// Returns the wall time of a stereo frame whose bands are shared among this number of threads, in seconds.
double wall_s(const Stage& stage, int threads) {
  const auto poses = parse_poses(stage.pose_of_drive(0));
  const auto begin = std::chrono::steady_clock::now();
  for (const View& view : stage.views()) {
    const int width = view.native->width_px(), height = view.native->height_px();
    Image image{width, height, PixelFormat::kRgb8, Bytes(std::vector<std::uint8_t>(3 * std::size_t(width * height)))};
    std::atomic<int> next = 0;
    std::vector<std::jthread> workers;
    for (int i = 0; i < threads; ++i) {
      workers.emplace_back([&] {
        for (int band = next++; band < view.native->bands(); band = next++) view.native->render(*poses, band, image);
      });
    }
  }
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

std::future<ImageResult> ordered(Renderer& renderer, const View& view, const std::string& pose) {
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
  const Stage stage(config::read_robot(robot_file), options);
  nlohmann::json result{{"robot", robot_file}};
  if (!stage.obstacle().empty()) {
    result["falls_back"] = stage.obstacle();
    return result;
  }
  std::mt19937_64 random(7);
  std::vector<std::string> poses;
  poses.reserve(std::size_t(options.poses));
  for (int i = 0; i < options.poses; ++i) poses.push_back(stage.pose(random));
  std::vector<double> shares;
  std::vector<double> native_s, povray_s;
  {
    PoolRenderer pool(stage.povray(), {.processes = options.processes});
    std::vector<std::future<ImageResult>> expected;
    for (const std::string& pose : poses) {
      for (const View& view : stage.views()) expected.push_back(ordered(pool, view, pose));
    }
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const View& view = stage.views()[i % 2];
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
        for (const View& view : stage.views()) images.push_back(ordered(pool, view, stage.pose_of_drive(i)));
      }
      for (auto& image : images) (void)value(image.get());
    }
    return seconds_of(RUSAGE_CHILDREN) - before;
  };
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    const double before = seconds_of(RUSAGE_SELF);
    for (int i = 0; i < options.timed_frames; ++i) {
      for (const View& view : stage.views()) (void)rendered(*view.native, stage.pose_of_drive(i));
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

}  // namespace
}  // namespace twocone::bench

int main(int argc, char** argv) {
  using namespace twocone::bench;
  Options options;
  CLI::App app("The native renderer against POV-Ray");
  app.add_option("ROBOT", options.robots, "robot files of simulated robots")->required();
  app.add_option("--poses", options.poses, "random poses that are compared by pixel")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--antialias", options.antialias, "rays per pixel side")->capture_default_str();
  app.add_option("--frames", options.timed_frames, "stereo frames of a timed repeat")->capture_default_str();
  app.add_option("--repeats", options.repeats)->capture_default_str();
  app.add_option("--width", options.width_px)->capture_default_str();
  app.add_option("--height", options.height_px)->capture_default_str();
  app.add_option("--json", options.json, "file for the numbers");
  CLI11_PARSE(app, argc, argv);
  fmt::print("{}x{}, {} x {} rays per pixel; pixels off by more than a level, and processor time of a stereo frame\n\n",
             options.width_px, options.height_px, options.antialias, options.antialias);
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
