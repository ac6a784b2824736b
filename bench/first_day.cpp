// SPDX-License-Identifier: Apache-2.0
//
// first_day_bench RUN... : calibrates robots whose `rig:` is wrong, from the images of ideal runs.
//
// Each case takes one of the runs, changes its images (mirrored, moved in the image, cameras exchanged) and the robot
// file's rig (centres up to 40 px off, azimuths up to 30 degrees, or any angle where the rig is absent, rims up to 20
// %) by a seed of its own, calibrates, and compares the result with the rig that the changed images have. A case counts
// as found only within the limits below. Refusals follow: each must name what to change.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/calibrate/calibrate.h"
#include "apps/config/to_layers.h"
#include "apps/estimation/image_as_mat.h"
#include "apps/runlog/run_data.h"
#include "apps/runlog/storage/image_file.h"

namespace twocone {
namespace {

namespace fs = std::filesystem;

// The calibrated rig against that of the images. Runs rendered with one ray a pixel are calibrated to a tenth of a
// pixel and some hundredths of a degree; ten times that is still no place where another answer could hide.
constexpr double kCentre_px = 1;
constexpr double kRadius_px = 1;
constexpr double kRelativeAzimuth_rad = 0.0087;  // 0.5 degrees
constexpr double kAzimuth_rad = 0.0175;          // a degree: from the wheels, which slip
constexpr double kResidual_px = 1;

enum class Kind { kCentre, kAzimuth, kRadius, kMirrored, kExchanged, kAbsent, kAll };
constexpr std::array<const char*, 7> kKinds{"40 px",     "30 degrees", "20 %",        "mirrored",
                                            "exchanged", "absent",     "all of these"};

/// A case: what is done to the images, and the rig that they then have.
struct Case {
  Kind kind = Kind::kAll;
  std::array<bool, 2> flipped{};  ///< by the camera's folder, as the next
  std::array<std::array<int, 2>, 2> moved_px{};
  bool exchanged = false;
  config::Rig truth;    ///< of the mirrors
  config::Robot robot;  ///< believes something else
};

void flip(config::RigView& view, int width_px) {
  view.centre_px[0] = width_px - 1 - view.centre_px[0];
  view.mirrored = !view.mirrored;
  view.azimuth_rad = base::wrap_angle_rad(view.azimuth_rad + std::numbers::pi);
}

Case case_of(const runlog::RunData& run, Kind kind, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto is = [&](Kind wanted) { return kind == wanted || kind == Kind::kAll; };
  Case c;
  c.kind = kind;
  c.robot = run.robot;
  c.truth = run.robot.rig;
  if (is(Kind::kMirrored)) {
    const double which = uniform(random);  // both, or one
    c.flipped = {which<0.33, which> - 0.33};
  }
  const std::array<config::RigView*, 2> views{&c.truth.lower, &c.truth.upper};
  for (const std::size_t i : {0, 1}) {
    if (c.flipped[i]) flip(*views[i], run.robot.lower.settings.width_px);
    // With all of these, the image itself moves, so that a part of the rim is outside.
    if (kind == Kind::kAll)
      c.moved_px[i] = {int(std::lround(40 * uniform(random))), int(std::lround(40 * uniform(random)))};
    for (const std::size_t axis : {0, 1}) views[i]->centre_px[axis] += c.moved_px[i][axis];
  }
  config::Rig& believed = c.robot.rig;
  if (kind != Kind::kAll && kind != Kind::kMirrored) believed = c.truth;
  for (config::RigView* view : {&believed.lower, &believed.upper}) {
    if (is(Kind::kCentre)) {
      const double angle = std::numbers::pi * uniform(random);
      view->centre_px[0] += 40 * std::cos(angle);
      view->centre_px[1] += 40 * std::sin(angle);
    }
    if (is(Kind::kAzimuth)) view->azimuth_rad += (uniform(random) > 0 ? 1 : -1) * std::numbers::pi / 6;
    if (is(Kind::kRadius)) view->rim_radius_px *= uniform(random) > 0 ? 1.2 : 0.8;
  }
  c.exchanged = kind == Kind::kExchanged || (kind == Kind::kAll && uniform(random) > 0);
  if (kind == Kind::kAbsent) {
    for (const char* view : {"lower", "upper"}) {
      for (const char* key : {"centre_px", "rim_radius_px", "azimuth_rad"}) {
        believed.missing.push_back(fmt::format("{}.{}", view, key));
      }
    }
    for (config::RigView* view : {&believed.lower, &believed.upper}) {
      *view = {
          .apex_rad = view->apex_rad, .mirror_radius_m = view->mirror_radius_m, .lens_to_tip_m = view->lens_to_tip_m};
      view->centre_px = {(run.robot.lower.settings.width_px - 1) / 2.0, (run.robot.lower.settings.height_px - 1) / 2.0};
      view->rim_radius_px = 0.4 * run.robot.lower.settings.height_px;
    }
  }
  return c;
}

/// Writes the run's images into `folder`, changed. Those of the lower mirror are in upper/ if the case exchanges them.
void write_images(const runlog::RunData& run, const fs::path& folder, const auto& change) {
  for (const char* name : {"lower", "upper"}) fs::create_directories(folder / name);
  for (std::size_t row = 0; row < run.frames.size(); ++row) {
    const auto files = runlog::images_of(run, row);
    for (const std::size_t i : {0, 1}) {
      const auto [image, to] = change(runlog::read_rgb(files[i]).value(), i);
      runlog::write_image(folder / (to == 0 ? "lower" : "upper") / files[i].filename(), estimation::as_image(image));
    }
  }
}

runlog::RunData changed_run(const runlog::RunData& run, const Case& c, const fs::path& folder) {
  write_images(run, folder, [&](cv::Mat image, std::size_t i) {
    if (c.flipped[i]) cv::flip(image, image, 1);
    if (c.moved_px[i] != std::array{0, 0}) {
      const cv::Mat by = (cv::Mat_<double>(2, 3) << 1, 0, c.moved_px[i][0], 0, 1, c.moved_px[i][1]);
      cv::warpAffine(image, image, by, image.size(), cv::INTER_NEAREST);
    }
    return std::pair(image, c.exchanged ? 1 - i : i);
  });
  runlog::RunData changed = run;
  changed.folder = folder;
  return changed;
}

struct Outcome {
  bool found = false;
  std::string why{};
  double centre_px = 0, radius_px = 0, relative_deg = 0, azimuth_deg = 0, seconds = 0;
};

Outcome outcome_of(const runlog::RunData& run, const Case& c, int frames) {
  Outcome outcome;
  const auto begin = std::chrono::steady_clock::now();
  calibrate::Settings settings;
  settings.frames = frames;
  const auto report = calibrate::calibrate({run}, c.robot, settings);
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!report) {
    outcome.why = report.error().message;
    return outcome;
  }
  const config::Rig& rig = report->rig;
  const auto fails = [&](const std::string& why) { outcome.why += (outcome.why.empty() ? "" : "; ") + why; };
  for (const auto& [name, seen, truth] :
       {std::tuple{"lower", &rig.lower, &c.truth.lower}, {"upper", &rig.upper, &c.truth.upper}}) {
    const double centre_px =
        std::hypot(seen->centre_px[0] - truth->centre_px[0], seen->centre_px[1] - truth->centre_px[1]);
    const double radius_px = std::abs(seen->rim_radius_px - truth->rim_radius_px);
    outcome.centre_px = std::max(outcome.centre_px, centre_px);
    outcome.radius_px = std::max(outcome.radius_px, radius_px);
    if (!(centre_px <= kCentre_px)) fails(fmt::format("{} centre {:.2f} px off", name, centre_px));
    if (!(radius_px <= kRadius_px)) fails(fmt::format("{} rim {:.2f} px off", name, radius_px));
    if (seen->mirrored != truth->mirrored) fails(fmt::format("{} mirrored is {}", name, seen->mirrored));
  }
  const auto off = [](double a, double b) { return std::abs(base::wrap_angle_rad(a - b)); };
  const double relative_rad =
      off(rig.upper.azimuth_rad - rig.lower.azimuth_rad, c.truth.upper.azimuth_rad - c.truth.lower.azimuth_rad);
  const double azimuth_rad = off(rig.lower.azimuth_rad, c.truth.lower.azimuth_rad);
  constexpr double kDegrees = 180 / std::numbers::pi;
  outcome.relative_deg = relative_rad * kDegrees;
  outcome.azimuth_deg = azimuth_rad * kDegrees;
  if (!(relative_rad <= kRelativeAzimuth_rad))
    fails(fmt::format("relative azimuth {:.2f} degrees off", outcome.relative_deg));
  if (!(azimuth_rad <= kAzimuth_rad)) fails(fmt::format("azimuth {:.2f} degrees off", outcome.azimuth_deg));
  if (report->exchanged != c.exchanged) fails(fmt::format("exchanged is {}", report->exchanged));
  for (const double rms_px : report->result.rms_after_px) {
    if (!(rms_px <= kResidual_px)) fails(fmt::format("residual {:.2f} px", rms_px));
  }
  outcome.found = outcome.why.empty();
  return outcome;
}

/// A camera that shows no mirror, and the words that its refusal must contain.
struct Refusal {
  const char* name;
  const char* words;
  void (*spoil)(cv::Mat& rgb, std::size_t camera);
};

const Refusal kRefusals[] = {
    {"lens cap on camera upper", "camera upper are dark: take off the lens cap",
     [](cv::Mat& rgb, std::size_t camera) {
       if (camera == 1) rgb.setTo(cv::Scalar::all(4));
     }},
    {"dead camera lower (grey)", "camera lower show nothing, only one brightness",
     [](cv::Mat& rgb, std::size_t camera) {
       if (camera == 0) rgb.setTo(cv::Scalar::all(128));
     }},
    {"camera upper shows something else", "camera upper show something else than a mirror",
     [](cv::Mat& rgb, std::size_t camera) {
       if (camera == 0) return;
       rgb.setTo(cv::Scalar(130, 140, 120));
       std::mt19937 random(7);
       for (int i = 0; i < 60; ++i) {
         const cv::Rect box(int(random() % std::uint32_t(rgb.cols)), int(random() % std::uint32_t(rgb.rows)),
                            20 + int(random() % 120), 20 + int(random() % 90));
         rgb(box & cv::Rect({}, rgb.size()))
             .setTo(cv::Scalar(double(random() % 256), double(random() % 256), double(random() % 256)));
       }
     }},
    {"frozen camera lower", "camera lower repeats one image",
     [](cv::Mat& rgb, std::size_t camera) {
       static const cv::Mat first = rgb.clone();
       if (camera == 0) first.copyTo(rgb);
     }},
    {"one camera for both", "both cameras show the same mirror", nullptr},
};

int bench(const std::vector<fs::path>& folders, int cases, int frames, const fs::path& work) {
  std::vector<runlog::RunData> runs;
  for (const fs::path& folder : folders) runs.push_back(runlog::read_run(folder));
  std::map<Kind, std::pair<int, int>> by_kind;
  std::array<double, 5> worst{};
  int failed = 0;
  for (int i = 0; i < cases; ++i) {
    const runlog::RunData& run = runs[std::size_t(i) % runs.size()];
    const Kind kind = Kind(std::size_t(i) / runs.size() % kKinds.size());
    const Case c = case_of(run, kind, std::uint64_t(i) + 1);
    const fs::path folder = work / "case";
    const Outcome outcome = outcome_of(changed_run(run, c, folder), c, frames);
    fs::remove_all(folder);
    fmt::print(
        "case {:2} {:14} {:10} {} centre {:.3f} px, rim {:.3f} px, azimuths {:.3f} and {:.3f} degrees, {:.1f} s{}\n",
        i + 1, kKinds[std::size_t(kind)], run.robot.name, outcome.found ? "found " : "MISSED", outcome.centre_px,
        outcome.radius_px, outcome.relative_deg, outcome.azimuth_deg, outcome.seconds,
        outcome.found ? "" : ": " + outcome.why);
    std::fflush(stdout);
    auto& [found, all] = by_kind[kind];
    found += outcome.found ? 1 : 0;
    ++all;
    failed += outcome.found ? 0 : 1;
    const std::array now{outcome.centre_px, outcome.radius_px, outcome.relative_deg, outcome.azimuth_deg,
                         outcome.seconds};
    for (std::size_t k = 0; k < worst.size(); ++k) worst[k] = std::max(worst[k], now[k]);
  }
  int refused = 0;
  for (const Refusal& refusal : kRefusals) {
    const runlog::RunData& run = runs.front();
    const fs::path folder = work / "refused";
    runlog::RunData changed = run;
    changed.folder = folder;
    cv::Mat lower;
    write_images(run, folder, [&](cv::Mat image, std::size_t camera) {
      if (camera == 0) lower = image.clone();
      if (refusal.spoil != nullptr) {
        refusal.spoil(image, camera);
      } else {
        image = lower.clone();
      }
      return std::pair(image, camera);
    });
    calibrate::Settings settings;
    settings.frames = frames;
    const auto report = calibrate::calibrate({changed}, run.robot, settings);
    const std::string message = report ? "a calibration" : report.error().message;
    const bool is_right = message.find(refusal.words) != std::string::npos;
    refused += is_right ? 1 : 0;
    fmt::print("refusal: {}: {}: {}\n", refusal.name, is_right ? "right" : "WRONG", message);
    fs::remove_all(folder);
  }
  for (const auto& [kind, counts] : by_kind) {
    fmt::print("{}: {} of {} found\n", kKinds[std::size_t(kind)], counts.first, counts.second);
  }
  fmt::print(
      "all: {} of {} found; worst centre {:.3f} px, rim {:.3f} px, relative azimuth {:.3f} degrees, azimuth {:.3f} "
      "degrees, {:.1f} s\n",
      cases - failed, cases, worst[0], worst[1], worst[2], worst[3], worst[4]);
  fmt::print("refusals: {} of {} right\n", refused, std::size(kRefusals));
  return failed == 0 && refused == int(std::size(kRefusals)) ? 0 : 1;
}

}  // namespace
}  // namespace twocone

int main(int argc, char** argv) {
  CLI::App app("Calibrates robots whose rig is wrong or absent, from the images of ideal runs");
  std::vector<std::filesystem::path> runs;
  int cases = 50;
  int frames = 60;
  std::filesystem::path work = std::filesystem::temp_directory_path() / "first_day_bench";
  app.add_option("RUN", runs, "Run folders of ideal robots")->required();
  app.add_option("--cases", cases, "Number of seeded cases");
  app.add_option("--frames", frames, "Frames that a calibration uses");
  app.add_option("--work", work, "Folder for the changed images; it is emptied");
  CLI11_PARSE(app, argc, argv);
  try {
    return twocone::bench(runs, cases, frames, work);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
