// SPDX-License-Identifier: Apache-2.0
// Ranges everything that the mirrors of simulated robots see, at random poses, and compares it with what the native
// renderer's rays meet. OpenCV's StereoSGBM on the same resampled images stands beside it, in accuracy and in processor
// time. Its tables go into docs/evidence/dense.md.
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/robot_file.h"
#include "apps/config/to_layers.h"
#include "base/quantile.h"
#include "bench/robot_scene.h"
#include "drivers/sim_povray/camera/camera_stage.h"
#include "drivers/sim_povray/world/motion.h"
#include "tests/support/value.h"
#include "vision/dense_ranging.h"
#include "vision/srgb.h"

namespace twocone::bench {
namespace {

using sim_povray::NativeView;
using sim_povray::parse_poses;
using sim_povray::PixelTruth;
using testing_support::value;
using vision::DenseRanging;
using vision::DenseVerdict;
using vision::MirrorView;
using vision::RangeImage;
using vision::Rig;
using vision::Side;

struct Options {
  std::vector<std::string> robots;
  int poses = 10;
  unsigned seed = 1;
  double full_well = 10000, read_electrons = 10;
  double gain = 1;  // of the upper camera's light
  int azimuths = vision::DenseSettings{}.azimuths;
  double nearest_m = vision::DenseSettings{}.nearest_m;
  double farthest_m = 5;
  ImageSize size{};
  std::string images;
  std::string json;
  std::string built;
  int repeats = 5;
};

// Fixed beforehand. Textured: somewhere in a window of 9 slopes x 7 azimuths the noise-free gradient along the radius
// is at least 3 sigma of its noise. Plain: nowhere 1 sigma.
constexpr double kTextured = 3;
constexpr double kPlain = 1;
const cv::Size kWindow(9, 7);
// A surface continues where the range changes by no more than this share within the window.
constexpr double kSameSurface = 0.05;
// A point is seen by the upper view if that view's ray meets something within this share of the distance.
constexpr double kSameDistance = 0.02;

double processor_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * double(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

// 0 where nothing was ranged.
double median(const std::vector<double>& values) { return values.empty() ? 0 : base::median(values); }

struct Shot {
  cv::Mat clean;  // CV_32FC3, linear light
  cv::Mat rgb;    // as the camera delivers it
  PixelTruth truth;
};

// @param effects of the camera as built, without noise, which `options` has; null: none
Shot shot(const NativeView& view, const std::string& pose, const Options& options, double gain,
          const sim_povray::CameraEffects* effects, std::mt19937_64& random) {
  Image image{view.width_px(), view.height_px(), PixelFormat::kRgb8,
              Bytes(std::vector<std::uint8_t>(3 * std::size_t(view.width_px() * view.height_px())))};
  Shot shot;
  shot.truth = value(view.empty_truth());
  const NativeView::Moment moment = view.at(*parse_poses(pose));
  for (int band = 0; band < view.bands(); ++band) view.render(moment, band, image, &shot.truth);
  if (effects != nullptr && changes_pixels(*effects)) {
    image = develop(*effects, {std::make_shared<Image>(image)}, options.seed, "camera", 0, {});
  }
  const cv::Mat rgb(image.height_px, image.width_px, CV_8UC3, const_cast<std::uint8_t*>(image.bytes.data()));
  shot.clean.create(rgb.size(), CV_32FC3);
  shot.rgb.create(rgb.size(), CV_8UC3);
  std::normal_distribution<double> normal;
  for (int row = 0; row < rgb.rows; ++row) {
    for (int column = 0; column < rgb.cols; ++column) {
      for (int k = 0; k < 3; ++k) {
        const double light = gain * vision::light_of_code()[rgb.at<cv::Vec3b>(row, column)[k]];
        shot.clean.at<cv::Vec3f>(row, column)[k] = static_cast<float>(light);
        double noisy = light;
        if (options.full_well > 0) {
          const double read = options.read_electrons / options.full_well;
          noisy += std::sqrt(light / options.full_well + read * read) * normal(random);
        }
        shot.rgb.at<cv::Vec3b>(row, column)[k] =
            cv::saturate_cast<std::uint8_t>(vision::linear_to_srgb(std::clamp(noisy, 0.0, 1.0)));
      }
    }
  }
  return shot;
}

// The mean of r, g and b in grey levels over the deviation that noise gives it there, so that gradients are in sigmas.
cv::Mat in_sigmas(const cv::Mat& clean, const Options& options) {
  std::vector<double> table{0};
  constexpr int kSteps = 765;
  for (int k = 0; k < kSteps; ++k) {
    const double code = (k + 0.5) / 3;
    const double light = vision::srgb_to_linear(code);
    const double read = options.full_well > 0 ? options.read_electrons / options.full_well : 0;
    const double variance = options.full_well > 0 ? light / options.full_well + read * read : 0;
    const double grey = std::sqrt(variance) / vision::light_per_grey(code) / std::sqrt(3.0);
    table.push_back(table.back() + 1 / (3 * std::hypot(grey, 0.3)));
  }
  cv::Mat level(clean.size(), CV_32F);
  for (int row = 0; row < clean.rows; ++row) {
    for (int column = 0; column < clean.cols; ++column) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += vision::linear_to_srgb(std::min(1.F, clean.at<cv::Vec3f>(row, column)[k]));
      const auto at = std::min(std::size_t(sum), table.size() - 2);
      level.at<float>(row, column) = static_cast<float>(std::lerp(table[at], table[at + 1], sum - double(at)));
    }
  }
  return level;
}

// The point that the ray through a pixel's centre meets, in the body's frame.
std::optional<Eigen::Vector3d> met(const MirrorView& view, const PixelTruth& truth, int column, int row) {
  if (column < 0 || row < 0 || column >= truth.width_px || row >= truth.height_px) return std::nullopt;
  const auto at = std::size_t(row) * std::size_t(truth.width_px) + std::size_t(column);
  if (truth.object[at] == 0) return std::nullopt;
  const auto ray = view.back_project({column, row});
  if (!ray) return std::nullopt;
  return ray->origin_m + double(truth.distance_m[at]) * ray->direction;
}

struct CellTruth {
  bool is_known = false;   // the lower view's pixels around show one surface
  bool is_shared = false;  // the upper view shows the point, and nothing before it
  bool is_hidden = false;  // the upper view shows something nearer there
  bool is_own = false;
  double range_m = 0;
};

// The view of the rendered image, which a lens distorts afterwards.
MirrorView before_the_lens(const MirrorView& view) {
  vision::MirrorViewSettings settings = view.settings();
  settings.distortion.reset();
  return MirrorView(settings);
}

class Judge {
 public:
  // @param rig the true one
  Judge(const Rig& rig, const DenseRanging& ranging, const Options& options)
      : lens_(rig.lower),
        rig_{before_the_lens(rig.lower), before_the_lens(rig.upper)},
        ranging_(ranging),
        options_(options) {
    const cv::Size size(options.size.width_px, options.size.height_px);
    cv::Mat columns(size, CV_32F);
    cv::Mat rows(size, CV_32F);
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        columns.at<float>(row, column) = static_cast<float>(column);
        rows.at<float>(row, column) = static_cast<float>(row);
      }
    }
    columns_ = ranging.panorama(Side::kLower, columns);
    rows_ = ranging.panorama(Side::kLower, rows);
  }

  [[nodiscard]] CellTruth truth(const Shot& lower, const Shot& upper, int azimuth, int slope) const {
    CellTruth cell;
    const Eigen::Vector2d at_px(columns_.at<float>(azimuth, slope), rows_.at<float>(azimuth, slope));
    if (at_px.isZero()) return cell;
    const auto rendered_px = lens_.undistort_px(at_px);
    if (!rendered_px) return cell;
    const double x = rendered_px->x();
    const double y = rendered_px->y();
    const int column = static_cast<int>(std::floor(x));
    const int row = static_cast<int>(std::floor(y));
    double inverse = 0;
    double least_m = INFINITY;
    double greatest_m = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    const auto name = [&](const PixelTruth& truth, int c, int r) {
      const std::uint16_t number = truth.object[std::size_t(r) * std::size_t(truth.width_px) + std::size_t(c)];
      const auto found = std::ranges::find(*truth.objects, number, &sim_povray::TrueObject::number);
      return found == truth.objects->end() ? std::string() : found->name;
    };
    for (int k = 0; k < 4; ++k) {
      const int c = column + k % 2;
      const int r = row + k / 2;
      const auto point = met(rig_.lower, lower.truth, c, r);
      if (!point) return cell;
      cell.is_own = cell.is_own || name(lower.truth, c, r).starts_with("robot");
      const double weight = (k % 2 == 1 ? x - column : 1 - x + column) * (k / 2 == 1 ? y - row : 1 - y + row);
      const double range_m = point->head<2>().norm();
      inverse += weight / range_m;
      mean += weight * *point;
      least_m = std::min(least_m, range_m);
      greatest_m = std::max(greatest_m, range_m);
    }
    cell.range_m = 1 / inverse;
    cell.is_known = !cell.is_own && greatest_m < (1 + kSameSurface) * least_m;
    if (!cell.is_known) return cell;
    const auto seen = rig_.upper.project(mean);
    if (!seen) return cell;
    for (int k = 0; k < 4; ++k) {
      const auto point = met(rig_.upper, upper.truth, static_cast<int>(std::floor(seen->x())) + k % 2,
                             static_cast<int>(std::floor(seen->y())) + k / 2);
      if (!point) continue;
      const double here_m = point->head<2>().norm();
      if (std::abs(here_m - cell.range_m) < kSameDistance * cell.range_m) cell.is_shared = true;
      if (here_m < (1 - 3 * kSameDistance) * cell.range_m) cell.is_hidden = true;
    }
    cell.is_hidden = cell.is_hidden && !cell.is_shared;
    // The mixtures at rim and tip do not count.
    const double radius_px = (*seen - rig_.upper.settings().centre_px).norm();
    if (radius_px < 25 || radius_px > rig_.upper.settings().rim_radius_px - 3) cell.is_shared = false;
    return cell;
  }

  // The greatest gradient along the radius, in sigmas of its noise, of what each cell shows: in its window, where the
  // same surface continues. The outline of a nearer thing is no texture of what is behind it.
  [[nodiscard]] cv::Mat contrast(const Shot& lower, const std::vector<CellTruth>& truths) const {
    const cv::Mat level = ranging_.panorama(Side::kLower, in_sigmas(lower.clean, options_));
    const int azimuths = level.rows;
    const int slopes = level.cols;
    cv::Mat greatest(level.size(), CV_32F, cv::Scalar(0));
    const auto truth = [&](int a, int i) -> const CellTruth& {
      return truths[std::size_t((a + azimuths) % azimuths) * std::size_t(slopes) + std::size_t(i)];
    };
    const auto continues = [](const CellTruth& one, const CellTruth& other) {
      return other.is_known && std::abs(other.range_m - one.range_m) < kSameSurface * one.range_m;
    };
    for (int a = 0; a < azimuths; ++a) {
      for (int i = 0; i < slopes; ++i) {
        const CellTruth& here = truth(a, i);
        if (!here.is_known) continue;
        for (int k = a - kWindow.height / 2; k <= a + kWindow.height / 2; ++k) {
          const auto* row = level.ptr<float>((k + azimuths) % azimuths);
          for (int j = std::max(1, i - kWindow.width / 2); j <= std::min(slopes - 2, i + kWindow.width / 2); ++j) {
            if (!continues(here, truth(k, j - 1)) || !continues(here, truth(k, j)) ||
                !continues(here, truth(k, j + 1))) {
              continue;
            }
            const float gradient = std::abs(row[j + 1] - row[j - 1]) / std::numbers::sqrt2_v<float>;
            greatest.at<float>(a, i) = std::max(greatest.at<float>(a, i), gradient);
          }
        }
      }
    }
    return greatest;
  }

 private:
  MirrorView lens_;
  Rig rig_;
  const DenseRanging& ranging_;
  Options options_;
  cv::Mat columns_, rows_;
};

struct Score {
  long textured = 0, ranged = 0, plain = 0, plain_unknown = 0, weak = 0, weak_ranged = 0, hidden = 0, hidden_ranged = 0;
  long wrong = 0, held = 0;
  double relative = 0;
  std::vector<double> disparity_errors;
  std::vector<double> normalised;
  std::array<long, 7> verdicts{};

  void add(const CellTruth& truth, double contrast, bool has_range, double range_m, double error_px, double sigma_m,
           int verdict, double farthest_m) {
    if (!truth.is_known || truth.range_m > farthest_m) return;
    if (truth.is_hidden) {
      ++hidden;
      hidden_ranged += has_range ? 1 : 0;
      return;
    }
    if (!truth.is_shared) return;
    if (contrast < kPlain) {
      ++plain;
      plain_unknown += has_range ? 0 : 1;
      return;
    }
    if (contrast < kTextured) {
      ++weak;
      weak_ranged += has_range ? 1 : 0;
      return;
    }
    ++textured;
    ++verdicts[std::size_t(verdict)];
    if (!has_range) return;
    ++ranged;
    relative += std::abs(range_m - truth.range_m) / truth.range_m;
    disparity_errors.push_back(std::abs(error_px));
    wrong += std::abs(error_px) > 1 ? 1 : 0;
    held += std::abs(range_m - truth.range_m) <= 1.96 * sigma_m ? 1 : 0;
    normalised.push_back(std::abs(range_m - truth.range_m) / sigma_m);
  }

  [[nodiscard]] nlohmann::json json() const {
    const auto share = [](double part, double whole) { return whole > 0 ? part / whole : 0; };
    nlohmann::json j{{"textured", textured},
                     {"ranged", share(double(ranged), double(textured))},
                     {"relative_error", share(relative, double(ranged))},
                     {"median_px", median(disparity_errors)},
                     {"over_1px", share(double(wrong), double(ranged))},
                     {"held_95", share(double(held), double(ranged))},
                     {"median_sigmas", median(normalised)},
                     {"plain", plain},
                     {"plain_unknown", share(double(plain_unknown), double(plain))},
                     {"weak", weak},
                     {"weak_ranged", share(double(weak_ranged), double(weak))},
                     {"hidden", hidden},
                     {"hidden_ranged", share(double(hidden_ranged), double(hidden))}};
    for (std::size_t k = 0; k < verdicts.size(); ++k) {
      j["verdicts"][std::string(to_string(DenseVerdict(k)))] = share(double(verdicts[k]), double(textured));
    }
    return j;
  }
};

// OpenCV's semi-global matching of the same panoramas. It gives no disparity to columns below its greatest one, so the
// images are extended by as many.
cv::Mat of_opencv(const cv::Mat& lower, const cv::Mat& upper, int greatest_px) {
  const int disparities = (greatest_px + 15) / 16 * 16;
  cv::Mat left;
  cv::Mat right;
  cv::copyMakeBorder(lower, left, 0, 0, disparities, 0, cv::BORDER_CONSTANT);
  cv::copyMakeBorder(upper, right, 0, 0, disparities, 0, cv::BORDER_CONSTANT);
  constexpr int kBlock = 5;
  const auto matcher = cv::StereoSGBM::create(0, disparities, kBlock, 8 * kBlock * kBlock, 32 * kBlock * kBlock, 1, 0,
                                              10, 50, 2, cv::StereoSGBM::MODE_SGBM);
  cv::Mat disparity;
  matcher->compute(left, right, disparity);
  cv::Mat px;
  disparity.colRange(disparities, disparity.cols).convertTo(px, CV_32F, 1.0 / 16);
  return px;
}

cv::Mat grey(const cv::Mat& rgb) {
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

// By verdict, b g r. Ranges are grey.
const std::array<cv::Vec3b, 7> kColours{
    {{}, {0, 80, 0}, {0, 0, 0}, {80, 0, 0}, {0, 0, 160}, {0, 160, 160}, {160, 0, 160}}};
// By how a textured cell is judged, b g r.
const cv::Vec3b kRight{80, 160, 0};
const cv::Vec3b kWrong{0, 0, 255};
const cv::Vec3b kMissing{0, 200, 255};

// What the lower view shows, ranges and verdicts, and the judgement of the cells that count. Outer circles on top.
cv::Mat painted(const RangeImage& image, const cv::Mat& panorama, const cv::Mat& judged) {
  cv::Mat shown(panorama.size(), CV_8UC3);
  for (int a = 0; a < shown.rows; ++a) {
    for (int i = 0; i < shown.cols; ++i) {
      const DenseVerdict verdict = image.verdict_at(a, i);
      cv::Vec3b colour = kColours[std::size_t(verdict)];
      if (verdict == DenseVerdict::kOk) {
        colour = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(255 / std::max(1.F, image.range_m.at<float>(a, i))));
      }
      shown.at<cv::Vec3b>(a, i) = colour;
    }
  }
  cv::Mat all;
  cv::Mat colours;
  cv::cvtColor(panorama, colours, cv::COLOR_GRAY2BGR);
  cv::hconcat(std::vector<cv::Mat>{judged, colours, shown}, all);
  cv::rotate(all, all, cv::ROTATE_90_COUNTERCLOCKWISE);
  return all;
}

// The effects of a camera but its noise, at rest.
sim_povray::CameraEffects still_and_quiet(sim_povray::CameraEffects effects) {
  effects.exposure_time_s = effects.readout_s = 0;
  effects.full_well_electrons = effects.read_noise_electrons = 0;
  return effects;
}

nlohmann::json measured(const std::string& file, const Options& given) {
  Options options = given;
  const config::Robot robot = config::read_robot(file);
  const RobotScene scene(robot, options.size);
  if (!scene.obstacle().empty()) throw std::runtime_error(scene.obstacle());
  const Rig rig = config::to_rig(robot);
  const cv::Size size(options.size.width_px, options.size.height_px);
  Rig true_rig = rig;
  vision::UncertainRig uncertain(rig);
  std::optional<std::array<sim_povray::CameraEffects, 2>> effects;
  if (!options.built.empty()) {
    true_rig = config::to_rig(config::read_robot(options.built));
    uncertain = vision::UncertainRig(rig, config::to_belief_errors(robot, scene.map()).vision.rig);
    effects = {still_and_quiet(robot.lower.effects), still_and_quiet(robot.upper.effects)};
    options.full_well = robot.lower.effects.full_well_electrons;
    options.read_electrons = robot.lower.effects.read_noise_electrons;
  }
  const DenseRanging ranging(uncertain, size, {.azimuths = options.azimuths, .nearest_m = options.nearest_m});
  const DenseRanging half(uncertain, size,
                          {.azimuths = options.azimuths / 2, .rounds = 1, .nearest_m = options.nearest_m});
  const Judge judge(true_rig, ranging, options);
  std::mt19937_64 random(options.seed);
  Score ours;
  Score theirs;
  std::vector<double> our_s;
  std::vector<double> half_s;
  std::vector<double> their_s;
  const auto& grid = ranging.grid();
  const double behind_m = rig.lower.settings().cone.lens_to_tip_m * std::sin(rig.lower.settings().cone.apex_rad);
  const double px_m = rig.mirror_separation_m() / grid.slope_step;
  const int greatest_px = static_cast<int>(px_m / (options.nearest_m + behind_m));
  // Of upright mirrors, also where the robot's are tilted: so errors of different robots can be compared.
  const auto disparity_px = [&](double range_m) { return px_m / (range_m + behind_m); };
  for (int k = 0; k < options.poses; ++k) {
    const std::string pose = scene.text_of(scene.free_pose(random));
    const Shot lower = shot(*scene.views()[0].native, pose, options, 1, effects ? effects->data() : nullptr, random);
    const Shot upper =
        shot(*scene.views()[1].native, pose, options, options.gain, effects ? &effects->back() : nullptr, random);
    RangeImage image;
    for (int r = 0; r < options.repeats; ++r) {
      double begin = processor_s();
      image = ranging.measure(lower.rgb, upper.rgb);
      our_s.push_back(processor_s() - begin);
      begin = processor_s();
      static_cast<void>(half.measure(lower.rgb, upper.rgb));
      half_s.push_back(processor_s() - begin);
    }
    std::vector<CellTruth> truths;
    for (int a = 0; a < grid.azimuths; ++a) {
      for (int i = 0; i < grid.slopes; ++i) truths.push_back(judge.truth(lower, upper, a, i));
    }
    const cv::Mat contrast = judge.contrast(lower, truths);
    cv::Mat opencv;
    for (int r = 0; r < options.repeats; ++r) {
      const double begin = processor_s();
      opencv = of_opencv(ranging.panorama(Side::kLower, grey(lower.rgb)),
                         ranging.panorama(Side::kUpper, grey(upper.rgb)), std::min(greatest_px, grid.slopes));
      their_s.push_back(processor_s() - begin);
    }
    cv::Mat judged(grid.azimuths, grid.slopes, CV_8UC3, cv::Scalar::all(0));
    for (int a = 0; a < grid.azimuths; ++a) {
      for (int i = 0; i < grid.slopes; ++i) {
        const CellTruth& truth = truths[std::size_t(a) * std::size_t(grid.slopes) + std::size_t(i)];
        if (!truth.is_known) continue;
        const double true_px = disparity_px(truth.range_m);
        const bool has = image.verdict_at(a, i) == DenseVerdict::kOk;
        if (truth.is_shared && truth.range_m <= options.farthest_m && contrast.at<float>(a, i) >= kTextured) {
          const bool is_right = std::abs(disparity_px(image.range_m.at<float>(a, i)) - true_px) <= 1;
          judged.at<cv::Vec3b>(a, i) = !has ? kMissing : is_right ? kRight : kWrong;
        }
        ours.add(truth, contrast.at<float>(a, i), has, image.range_m.at<float>(a, i),
                 disparity_px(image.range_m.at<float>(a, i)) - true_px, image.sigma_m.at<float>(a, i),
                 image.verdict.at<std::uint8_t>(a, i), options.farthest_m);
        const double d = opencv.at<float>(a, i);
        // No sigma: the usual quarter of a pixel.
        const double range_m = px_m / std::max(d, 0.1) - behind_m;
        theirs.add(truth, contrast.at<float>(a, i), d > 0, range_m, d - true_px,
                   (range_m + behind_m) * (range_m + behind_m) / px_m * 0.25, 0, options.farthest_m);
      }
    }
    if (!options.images.empty() && k < 3) {
      cv::imwrite(fmt::format("{}_{}.png", options.images, k),
                  painted(image, ranging.panorama(Side::kLower, grey(lower.rgb)), judged));
    }
  }
  nlohmann::json j{{"robot", robot.name},
                   {"azimuths", grid.azimuths},
                   {"slopes", grid.slopes},
                   {"ours", ours.json()},
                   {"opencv", theirs.json()},
                   {"ours_ms", 1e3 * median(our_s)},
                   {"half_ms", 1e3 * median(half_s)},
                   {"opencv_ms", 1e3 * median(their_s)}};
  return j;
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Ranges to everything, compared with the native renderer's distances and OpenCV's StereoSGBM");
  app.add_option("robots", options.robots, "Robot files")->required();
  app.add_option("--poses", options.poses, "Poses of each robot");
  app.add_option("--seed", options.seed, "Seed of poses and noise");
  app.add_option("--full-well", options.full_well, "Electrons; 0: no noise");
  app.add_option("--read-noise", options.read_electrons, "Electrons");
  app.add_option("--gain", options.gain, "Gain of the upper camera");
  app.add_option("--azimuths", options.azimuths, "Columns of the range image");
  app.add_option("--nearest", options.nearest_m, "Nearest distance, m");
  app.add_option("--antialias", options.size.antialias, "Rays per pixel side");
  app.add_option("--repeats", options.repeats, "Timed repetitions for each pose");
  app.add_option("--images", options.images, "Prefix of images of the first poses");
  app.add_option("--json", options.json, "File for the figures");
  app.add_option("--built", options.built,
                 "The robot as it is (built.yaml of twocone as-built), of which `robots` has one that is believed; "
                 "effects and noise of the cameras are those of its file");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  nlohmann::json all = nlohmann::json::array();
  for (const std::string& robot : options.robots) {
    try {
      all.push_back(measured(robot, options));
      fmt::print("{}\n", all.back().dump(1));
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}: {}\n", robot, error.what());
    }
  }
  if (!options.json.empty()) std::ofstream(options.json) << all.dump(1) << '\n';
  return 0;
}

}  // namespace
}  // namespace twocone::bench

int main(int argc, char** argv) {
  try {
    return twocone::bench::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "dense_bench: {}\n", error.what());
    return 1;
  }
}
