// SPDX-License-Identifier: Apache-2.0
// Prints the position error, the coverage of the ellipses and the bound over very many frames (many_frames.h).
#include <chrono>
#include <cstdio>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "apps/runlog/storage/disk.h"
#include "apps/runlog/version.h"
#include "bench/many_frames.h"

namespace twocone::bench {
namespace {

void print(const FixStatistics& s) {
  fmt::print("frames {}, with a fix {} ({:.3f} %):", s.frames, s.with_fix, 100.0 * s.with_fix / s.frames);
  for (const auto& [verdict, count] : s.verdicts) fmt::print("  {} {}", verdict, count);
  fmt::print("\nposition error, mm: mean {:.4f} +- {:.4f}, rmse {:.4f}", 1e3 * s.mean_m, 1e3 * s.mean_half_width_m,
             1e3 * s.rmse_m);
  for (const auto& [share, error_m] : s.quantiles_m) fmt::print(", {} % {:.3f}", 100 * share, 1e3 * error_m);
  fmt::print(", max {:.2f}\n", 1e3 * s.max_m);
  fmt::print("95 % ellipses that hold the truth: {} of {}, {:.3f} % ({:.3f} to {:.3f})\n", s.in_ellipse, s.with_ellipse,
             100 * s.coverage, 100 * s.coverage_low, 100 * s.coverage_high);
  fmt::print("Cramer-Rao bound of {} fixes, mm: rms {:.4f}, their rmse {:.4f}, ratio {:.3f}\n", s.with_bound,
             1e3 * s.bound_rms_m, 1e3 * s.rmse_of_bounded_m,
             s.bound_rms_m > 0 ? s.rmse_of_bounded_m / s.bound_rms_m : 0);
  fmt::print("processor time of a frame, ms: rendering {:.1f}, vision and fix {:.1f}\n", 1e3 * s.render_s,
             1e3 * s.vision_s);
}

nlohmann::json json_of(const FixStatistics& s) {
  nlohmann::json quantiles;
  for (const auto& [share, error_m] : s.quantiles_m) quantiles[fmt::format("{}", 100 * share)] = error_m;
  return {{"frames", s.frames},
          {"with_fix", s.with_fix},
          {"verdicts", s.verdicts},
          {"mean_m", s.mean_m},
          {"mean_half_width_m", s.mean_half_width_m},
          {"rmse_m", s.rmse_m},
          {"quantiles_m", quantiles},
          {"max_m", s.max_m},
          {"with_ellipse", s.with_ellipse},
          {"in_ellipse", s.in_ellipse},
          {"coverage", s.coverage},
          {"coverage_low", s.coverage_low},
          {"coverage_high", s.coverage_high},
          {"with_bound", s.with_bound},
          {"bound_rms_m", s.bound_rms_m},
          {"rmse_of_bounded_m", s.rmse_of_bounded_m},
          {"render_s", s.render_s},
          {"vision_s", s.vision_s}};
}

int run(int argc, char** argv) {
  cv::setNumThreads(1);  // the frames are shared among threads
  std::string robot, json;
  ManyFramesOptions options;
  CLI::App app("Fixes of very many frames at independent poses, rendered natively and not stored");
  app.add_option("ROBOT", robot, "robot file of a simulated robot")->required();
  app.add_option("--frames", options.frames, "stereo frames")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--seed", options.seed, "of the poses and of the cameras' noise")->capture_default_str();
  app.add_option("--antialias", options.antialias, "rays per pixel side (default: the robot file's)")
      ->check(CLI::Range(1, 9));
  app.add_option("--threads", options.threads)->check(CLI::Range(1, 256))->capture_default_str();
  app.add_option("--rows", options.rows, "file for a row for each frame; a cut-off command continues it");
  app.add_option("--json", json, "file for the numbers");
  CLI11_PARSE(app, argc, argv);
  const auto begin = std::chrono::steady_clock::now();
  std::atomic<int> taken = 0;
  options.progress = [&](int frames) { std::fprintf(stderr, "\r%d frames", taken += frames); };
  const auto records = take_frames(config::read_robot(robot), options);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::fprintf(stderr, "\n");
  const auto statistics = statistics_of(records);
  fmt::print("{}, seed {}, native renderer; twocone {}, commit {}, {}\n", robot, options.seed, runlog::version(),
             runlog::commit(), runlog::compiler());
  print(statistics);
  fmt::print("{} frames in {:.1f} s, {:.1f} a second, {} threads\n", taken.load(), wall_s, taken / wall_s,
             options.threads);
  if (!json.empty()) {
    auto numbers = json_of(statistics);
    numbers["taken_now"] = taken.load();
    numbers["wall_s"] = wall_s;
    runlog::write_whole(json, numbers.dump(2) + '\n');
  }
  return 0;
}

}  // namespace
}  // namespace twocone::bench

int main(int argc, char** argv) {
  try {
    return twocone::bench::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "many_frames: %s\n", e.what());
    return 1;
  }
}
