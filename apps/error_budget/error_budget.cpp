// SPDX-License-Identifier: Apache-2.0
#include "apps/error_budget/error_budget.h"

#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>

#include <Eigen/Dense>

#include "apps/behaviours/behaviour.h"
#include "apps/config/to_layers.h"
#include "apps/error_budget/viewpoint.h"
#include "base/errors.h"

namespace twocone::error_budget {
namespace {

/// Step of the central differences, in standard deviations. Their relative error is about its square, far below the
/// printed digits. The step is large compared with the rounding errors of the solvers.
constexpr double kStep_sigmas = 0.01;
/// Number of bearings at which a range is evaluated. It is odd, so no two bearings are on one axis of the images.
constexpr int kBearings = 9;

void check(const ErrorBudgetSettings& s) {
  base::Complaints bad;
  bad.require_field(base::is_positive(s.edge_noise_px), "edge_noise_px", s.edge_noise_px, "> 0 px");
  bad.require_field(base::is_positive(s.range_m), "range_m", s.range_m, "> 0 m");
  bad.require_field(s.draws >= 1, "draws", s.draws, ">= 1");
  for (const auto& [name, size] : {std::pair{"rim_radius_px", s.rim_radius_px},
                                   {"centre_px", s.centre_px},
                                   {"focal_share", s.focal_share},
                                   {"lens_to_tip_m", s.lens_to_tip_m},
                                   {"separation_m", s.separation_m},
                                   {"tilt_rad", s.tilt_rad},
                                   {"axis_offset_m", s.axis_offset_m},
                                   {"apex_rad", s.apex_rad},
                                   {"azimuth_rad", s.azimuth_rad},
                                   {"skew_s", s.skew_s},
                                   {"landmark_place_m", s.landmark_place_m},
                                   {"landmark_top_m", s.landmark_top_m},
                                   {"landmark_radius_m", s.landmark_radius_m}}) {
    bad.require_field(size >= 0 && std::isfinite(size), name, size, ">= 0");
  }
  bad.require_field(std::isfinite(s.speed_mps), "speed_mps", s.speed_mps, "a finite number of m/s");
  bad.require_field(std::isfinite(s.turn_rate_radps), "turn_rate_radps", s.turn_rate_radps, "a finite number of rad/s");
  bad.raise("error_budget");
}

/// Computes the mean of the squares that were added, and counts the missing answers.
class MeanSquare {
 public:
  void add(const std::optional<double>& square) {
    if (square) {
      sum_ += *square;
      ++count_;
    } else {
      ++withheld_;
    }
  }
  [[nodiscard]] double root() const { return count_ > 0 ? std::sqrt(sum_ / count_) : 0; }
  [[nodiscard]] int withheld() const { return withheld_; }

 private:
  double sum_ = 0;
  int count_ = 0;
  int withheld_ = 0;
};

Eigen::Vector2d difference(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return {a.x() - b.x(), localisation::wrap_angle_rad(a.y() - b.y())};
}

/// Returns d (range, bearing) of a landmark for one standard deviation of `part`.
std::optional<Eigen::Vector2d> slope(const Viewpoint& viewpoint, const World& truth, const Part& part, int landmark) {
  const auto answer_at = [&](double sigmas) {
    World believed = truth;
    part.apply(believed, sigmas);
    return viewpoint.answer(believed, rig_of(believed), landmark);
  };
  const auto below = answer_at(-kStep_sigmas);
  const auto above = answer_at(kStep_sigmas);
  if (!below || !above) return std::nullopt;
  return difference(above->range_bearing, below->range_bearing) / (2 * kStep_sigmas);
}

/// The linear model of a fix: the pose error is the sum over landmarks of gain * (error of range and bearing - the
/// change that a wrong place in the map predicts).
class Gain {
 public:
  Gain(const Viewpoint& viewpoint, const World& truth) {
    const vision::Rig rig = rig_of(truth);
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    for (const int landmark : viewpoint.seen()) {
      const auto found = viewpoint.answer(truth, rig, landmark);
      if (!found) continue;
      const localisation::Pose& pose = viewpoint.pose();
      const Eigen::Vector2d to_m =
          vision::place_m(truth.landmarks[std::size_t(landmark)]) - Eigen::Vector2d(pose.x_m, pose.y_m);
      const double range_m = to_m.norm();
      Eigen::Matrix<double, 2, 3> jacobian;
      jacobian << -to_m.x() / range_m, -to_m.y() / range_m, 0,  //
          to_m.y() / (range_m * range_m), -to_m.x() / (range_m * range_m), -1;
      const Eigen::Matrix<double, 3, 2> weighted = jacobian.transpose() * found->covariance.inverse();
      information += weighted * jacobian;
      landmarks_.push_back({landmark, jacobian, weighted});
    }
    const Eigen::LLT<Eigen::Matrix3d> root(information);
    if (landmarks_.size() < 2 || root.info() != Eigen::Success) {
      landmarks_.clear();
      return;
    }
    for (Row& row : landmarks_) row.gain = root.solve(row.gain);
  }

  [[nodiscard]] bool determined() const { return !landmarks_.empty(); }

  /// Returns d position for one standard deviation of `part`.
  [[nodiscard]] std::optional<Eigen::Vector2d> slope_m(const Viewpoint& viewpoint, const World& truth,
                                                       const Part& part) const {
    World believed = truth;
    part.apply(believed, 1);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Row& row : landmarks_) {
      if (part.landmark >= 0 && part.landmark != row.landmark) continue;
      const auto answer = slope(viewpoint, truth, part, row.landmark);
      if (!answer) return std::nullopt;
      const std::size_t k = std::size_t(row.landmark);
      // A shift of a landmark changes range and bearing as the opposite shift of the robot does.
      const Eigen::Vector2d shift_m = vision::place_m(believed.landmarks[k]) - vision::place_m(truth.landmarks[k]);
      sum += row.gain * (*answer + row.jacobian.leftCols<2>() * shift_m);
    }
    return sum.head<2>();
  }

 private:
  struct Row {
    int landmark;
    Eigen::Matrix<double, 2, 3> jacobian;
    Eigen::Matrix<double, 3, 2> gain;
  };
  std::vector<Row> landmarks_;
};

/// Returns worlds with one landmark each: every kind in the map, at kBearings bearings from a robot at the origin.
std::vector<World> range_worlds(const World& world, double range_m) {
  std::set<std::pair<double, double>> kinds;
  for (const Landmark& landmark : world.landmarks) kinds.insert({landmark.radius_m, landmark.top_m});
  std::vector<World> worlds;
  for (const auto& [radius_m, top_m] : kinds) {
    for (int i = 0; i < kBearings; ++i) {
      const double bearing_rad = 2 * std::numbers::pi * (i + 0.3) / kBearings;
      World& one = worlds.emplace_back(world);
      one.landmarks = {{.x_m = range_m * std::cos(bearing_rad),
                        .y_m = range_m * std::sin(bearing_rad),
                        .radius_m = radius_m,
                        .top_m = top_m}};
    }
  }
  return worlds;
}

/// Returns the believed rig, or nothing if no camera can have it. This counts as a withheld answer.
std::optional<vision::Rig> possible_rig(const World& believed) {
  try {
    return rig_of(believed);
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

/// One answer in a true world, with its errors.
struct Case {
  const World* truth;
  /// The square of the answer's error for one standard deviation of a part, by linear propagation.
  std::function<std::optional<double>(const Part& part)> linear_m2;
  /// The square of the error of the complete answer.
  std::function<std::optional<double>(const World& believed, const vision::Rig& rig)> complete_m2;
};

/// Computes the effect of the sources on one kind of answer: ranges or positions.
struct Answers {
  std::vector<Source> sources;
  std::vector<Case> cases;

  [[nodiscard]] MeanSquare analytic(const Source& source) const {
    MeanSquare mean;
    for (const Case& one : cases) {
      std::optional<double> square_m2 = 0;
      for (const Part& part : source.parts) {
        const auto of_part_m2 = one.linear_m2(part);
        square_m2 = of_part_m2 && square_m2 ? std::optional(*square_m2 + *of_part_m2) : std::nullopt;
      }
      mean.add(square_m2);
    }
    return mean;
  }

  /// Returns the error over `draws` draws of all parts of the sources `of` at once.
  [[nodiscard]] MeanSquare drawn(std::span<const Source> of, int draws, std::uint64_t seed) const {
    MeanSquare mean;
    std::mt19937_64 engine(seed);
    std::normal_distribution<> normal;
    for (int i = 0; i < draws && !cases.empty(); ++i) {
      const Case& one = cases[std::size_t(i) % cases.size()];
      World believed = *one.truth;
      for (const Source& source : of) {
        for (const Part& part : source.parts) part.apply(believed, normal(engine));
      }
      const auto rig = possible_rig(believed);
      mean.add(rig ? one.complete_m2(believed, *rig) : std::nullopt);
    }
    return mean;
  }
};

Contribution contribution(const Answers& answers, std::span<const Source> sources, int draws, std::uint64_t seed,
                          int& withheld) {
  double square_m2 = 0;
  for (const Source& source : sources) square_m2 += std::pow(answers.analytic(source).root(), 2);
  const MeanSquare drawn = answers.drawn(sources, draws, seed);
  withheld += drawn.withheld();
  return {std::sqrt(square_m2), drawn.root()};
}

}  // namespace

ErrorBudgetSettings settings_for(const config::Robot& robot) {
  ErrorBudgetSettings settings;
  settings.speed_mps = robot.drive.max_speed_mps / 2;
  settings.turn_rate_radps = robot.drive.max_speed_mps / robot.drive.wheel_separation_m;
  return settings;
}

ErrorBudget error_budget(const config::Robot& robot, const config::Map& map, std::span<const localisation::Pose> poses,
                         const ErrorBudgetSettings& settings) {
  check(settings);
  const vision::Rig true_rig = config::to_rig(robot);
  const World truth{true_rig.lower.settings(), true_rig.upper.settings(), map.landmarks, 0, {}};
  const behaviours::Motion motion{settings.speed_mps, settings.turn_rate_radps};
  const auto viewpoint = [&](const World& world, const localisation::Pose& pose) {
    return Viewpoint(world, pose, motion, settings.edge_noise_px, settings.tops_known);
  };

  const std::vector<World> worlds = range_worlds(truth, settings.range_m);
  Answers ranges{all_sources(settings, 1), {}};
  for (const World& world : worlds) {
    const Viewpoint here = viewpoint(world, {});
    if (here.seen().empty()) continue;
    const auto linear_m2 = [here, &world](const Part& part) -> std::optional<double> {
      const auto d = slope(here, world, part, 0);
      return d ? std::optional(d->x() * d->x()) : std::nullopt;
    };
    const auto complete_m2 = [here](const World& believed, const vision::Rig& rig) -> std::optional<double> {
      const auto answer = here.answer(believed, rig, 0);
      if (!answer) return std::nullopt;
      return std::pow(answer->range_bearing.x() - here.true_range_m(0), 2);
    };
    ranges.cases.push_back({&world, linear_m2, complete_m2});
  }

  Answers positions{all_sources(settings, int(truth.landmarks.size())), {}};
  for (const localisation::Pose& pose : poses) {
    const Viewpoint here = viewpoint(truth, pose);
    const Gain gain(here, truth);
    if (!gain.determined()) continue;
    const auto linear_m2 = [here, gain, &truth](const Part& part) -> std::optional<double> {
      const auto d_m = gain.slope_m(here, truth, part);
      return d_m ? std::optional(d_m->squaredNorm()) : std::nullopt;
    };
    const auto complete_m2 = [here, pose](const World& believed, const vision::Rig& rig) -> std::optional<double> {
      const auto fix = here.fix(believed, rig);
      if (!fix) return std::nullopt;
      return (*fix->position_m - Eigen::Vector2d(pose.x_m, pose.y_m)).squaredNorm();
    };
    positions.cases.push_back({&truth, linear_m2, complete_m2});
  }

  ErrorBudget error_budget;
  error_budget.range_m = settings.range_m;
  error_budget.ranges = int(ranges.cases.size());
  error_budget.poses = int(positions.cases.size());
  error_budget.draws = settings.draws;
  const auto line = [&](std::string name, std::string size, std::size_t first, std::size_t count, std::uint64_t seed) {
    return ErrorBudgetLine{std::move(name), std::move(size),
                           contribution(ranges, std::span(ranges.sources).subspan(first, count), settings.draws, seed,
                                        error_budget.withheld_ranges),
                           contribution(positions, std::span(positions.sources).subspan(first, count), settings.draws,
                                        seed, error_budget.withheld_positions)};
  };
  const std::size_t count = positions.sources.size();
  for (std::size_t i = 0; i < count; ++i) {
    error_budget.lines.push_back(line(positions.sources[i].name, positions.sources[i].size, i, 1, settings.seed + i));
  }
  error_budget.total = line("all together", "", 0, count, settings.seed + count);
  return error_budget;
}

std::vector<localisation::Pose> grid_poses(const config::Robot& robot, const config::Map& map) {
  constexpr int kSteps = 6;
  // The golden angle spreads the headings over the circle without repetition, for any number of poses.
  constexpr double kTurn_rad = 2.399963229728653;
  const behaviours::Arena arena = config::to_arena(map);
  const Eigen::Vector2d size_m = arena.max_m - arena.min_m;
  const double step_m = size_m.maxCoeff() / kSteps;
  std::vector<localisation::Pose> poses;
  for (int column = 0; column < kSteps; ++column) {
    for (int row = 0; row < kSteps; ++row) {
      const double x_m = arena.min_m.x() + (column + 0.5) * step_m;
      const double y_m = arena.min_m.y() + (row + 0.5) * step_m;
      if (!(x_m < arena.max_m.x()) || !(y_m < arena.max_m.y())) continue;
      if (arena.clearance_m({x_m, y_m}) < robot.body_radius_m) continue;
      poses.push_back({x_m, y_m, localisation::wrap_angle_rad(kTurn_rad * double(poses.size()))});
    }
  }
  return poses;
}

}  // namespace twocone::error_budget
