// SPDX-License-Identifier: Apache-2.0
#include "apps/config/calibration_file.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Eigenvalues>
#include <nlohmann/json.hpp>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "vision/uncertain_rig.h"

namespace twocone::config {
namespace {

constexpr std::array<const char*, kWheelNumbers> kWheelNames{"wheel_radius_m", "wheel_ratio", "wheel_separation_m"};
constexpr std::array<const char*, vision::kTimeNumbers> kTimeNames{"lower.late_s", "upper.late_s", "lower.readout_s",
                                                                   "upper.readout_s"};
constexpr int kLastNumbers = kWheelNumbers + vision::kTimeNumbers;  // those after the landmarks

/// Numbers are written with all their digits, and the robot file has its own text of each.
bool is_same(double a, double b) { return std::abs(a - b) <= 1e-9 * std::max({1.0, std::abs(a), std::abs(b)}); }

template <typename Value>
Value value_of(const nlohmann::json& belief, const char* key, const std::filesystem::path& file) {
  try {
    return belief.at(key).get<Value>();
  } catch (const nlohmann::json::exception& error) {
    throw FileError("{}: belief.{} is missing or no list of the right kind ({})", file.string(), key, error.what());
  }
}

}  // namespace

std::filesystem::path calibration_file_of(const std::filesystem::path& robot_file) {
  return robot_file.parent_path() / (robot_file.stem().string() + ".calibration.json");
}

std::vector<std::string> belief_names(const Map& map) {
  std::vector<std::string> names;
  names.reserve(vision::kRigNumbers + vision::kLandmarkNumbers * map.landmarks.size() + kLastNumbers);
  for (int i = 0; i < vision::kRigNumbers; ++i) names.push_back(vision::rig_number_name(i));
  for (const Landmark& landmark : map.landmarks) {
    for (const char* number : {"x_m", "y_m", "top_m", "radius_m"}) {
      names.push_back(fmt::format("landmark {} {}", landmark.name, number));
    }
  }
  names.insert(names.end(), kWheelNames.begin(), kWheelNames.end());
  names.insert(names.end(), kTimeNames.begin(), kTimeNames.end());
  return names;
}

Eigen::VectorXd belief_values(const Robot& robot, const Map& map) {
  const auto count = vision::kLandmarkNumbers * Eigen::Index(map.landmarks.size());
  Eigen::VectorXd values(vision::kRigNumbers + count + kLastNumbers);
  values.head<vision::kRigNumbers>() = vision::numbers_of(to_assumed_rig(robot));
  Eigen::Index at = vision::kRigNumbers;
  for (const Landmark& l : map.landmarks) {
    values.segment<vision::kLandmarkNumbers>(at) << l.x_m, l.y_m, l.top_m, l.radius_m;
    at += vision::kLandmarkNumbers;
  }
  const RigView &lower = robot.rig.lower, &upper = robot.rig.upper;
  values.tail<kLastNumbers>() << robot.drive.wheel_radius_m, 1, robot.drive.wheel_separation_m, lower.late_s,
      upper.late_s, lower.readout_s, upper.readout_s;
  return values;
}

Calibration read_calibration(const std::filesystem::path& file) {
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(read_text(file));
  } catch (const nlohmann::json::exception& error) {
    throw FileError("{}: is no JSON: {}", file.string(), error.what());
  }
  if (!json.is_object() || !json.contains("belief") || !json["belief"].is_object()) {
    throw FileError("{}: belief is missing: the covariance that `twocone calibrate` writes", file.string());
  }
  const nlohmann::json& belief = json["belief"];
  Calibration calibration;
  calibration.names = value_of<std::vector<std::string>>(belief, "names", file);
  const auto values = value_of<std::vector<double>>(belief, "values", file);
  const auto rows = value_of<std::vector<std::vector<double>>>(belief, "covariance", file);
  const std::size_t count = calibration.names.size();
  const auto has_size = [count](const auto& list) { return list.size() == count; };
  if (!has_size(values) || !has_size(rows) || !std::ranges::all_of(rows, has_size)) {
    throw FileError("{}: belief has {} names, so it must have as many values, and as many rows and columns",
                    file.string(), count);
  }
  const auto size = Eigen::Index(count);
  calibration.values = Eigen::Map<const Eigen::VectorXd>(values.data(), size);
  calibration.covariance.resize(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    calibration.covariance.row(i) = Eigen::Map<const Eigen::RowVectorXd>(rows[std::size_t(i)].data(), size);
  }
  const nlohmann::json& systematic_px = json.value("systematic_px", nlohmann::json(0));
  if (!systematic_px.is_number() || !(systematic_px.get<double>() >= 0)) {
    throw FileError("{}: systematic_px is {}, must be a number >= 0", file.string(), systematic_px.dump());
  }
  // A calibration allows each sighting three errors of that size: its landmark's, its ring's in the image, and both's.
  calibration.sighting_px = std::sqrt(3.0) * systematic_px.get<double>();
  const Eigen::MatrixXd& c = calibration.covariance;
  if (!calibration.values.allFinite() || !c.allFinite() || size == 0) {
    throw FileError("{}: belief has numbers that are not finite, or none", file.string());
  }
  const Eigen::VectorXd sigma = c.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::MatrixXd scale = sigma * sigma.transpose();
  // Each entry was rounded once when it was computed on either side of the diagonal.
  constexpr double kRounding = 1e-9;
  const bool is_symmetric = ((c - c.transpose()).cwiseAbs().array() <= kRounding * scale.array()).all();
  const bool is_bounded = (c.cwiseAbs().array() <= (1 + kRounding) * scale.array()).all();
  if (!(c.diagonal().minCoeff() >= 0) || !is_symmetric || !is_bounded) {
    throw FileError("{}: belief.covariance is no covariance: it must be symmetric, with correlations from -1 to 1",
                    file.string());
  }
  return calibration;
}

namespace {

/// Compares the numbers of a belief with those of a calibration.
class Agreement {
 public:
  Agreement(const Calibration& calibration, const Robot& robot, const Map& map)
      : names_(belief_names(map)), values_(belief_values(robot, map)), calibration_(calibration) {
    for (std::size_t i = 0; i < calibration.names.size(); ++i) known_[calibration.names[i]] = Eigen::Index(i);
  }

  [[nodiscard]] const std::string& name(Eigen::Index i) const { return names_[std::size_t(i)]; }
  [[nodiscard]] double value(Eigen::Index i) const { return values_[i]; }
  /// Returns the index of the number in the calibration, or -1.
  [[nodiscard]] Eigen::Index index_of(Eigen::Index i) const {
    const auto found = known_.find(name(i));
    return found == known_.end() ? Eigen::Index(-1) : found->second;
  }
  /// Returns whether the calibration is of that value.
  [[nodiscard]] bool agrees(Eigen::Index i) const {
    const Eigen::Index k = index_of(i);
    return k >= 0 && is_same(values_[i], calibration_.values[k]);
  }
  [[nodiscard]] bool agree(Eigen::Index from, Eigen::Index numbers) const {
    for (Eigen::Index i = from; i < from + numbers; ++i) {
      if (!agrees(i)) return false;
    }
    return true;
  }
  void take(Eigen::Index from, Eigen::Index numbers) {
    for (Eigen::Index i = from; i < from + numbers; ++i) {
      here_.push_back(i);
      there_.push_back(index_of(i));
    }
  }
  void take_if_same(Eigen::Index from, Eigen::Index numbers) {
    if (agree(from, numbers)) take(from, numbers);
  }
  /// Returns the index of the first number behind the landmarks.
  [[nodiscard]] Eigen::Index wheels() const { return Eigen::Index(names_.size()) - kLastNumbers; }
  void take_same_landmarks() {
    for (Eigen::Index at = vision::kRigNumbers; at < wheels(); at += vision::kLandmarkNumbers) {
      take_if_same(at, vision::kLandmarkNumbers);
    }
  }
  /// Replaces what was taken.
  [[nodiscard]] Eigen::MatrixXd replaced(Eigen::MatrixXd covariance) const {
    covariance(here_, Eigen::indexing::all).setZero();
    covariance(Eigen::indexing::all, here_).setZero();
    covariance(here_, here_) = calibration_.covariance(there_, there_);
    return covariance;
  }

 private:
  std::vector<std::string> names_;
  Eigen::VectorXd values_;
  const Calibration& calibration_;
  std::map<std::string, Eigen::Index> known_;
  std::vector<Eigen::Index> here_, there_;
};

}  // namespace

Eigen::MatrixXd belief_covariance(const Calibration& calibration, const Robot& robot, const Map& map,
                                  const Eigen::VectorXd& sigmas) {
  Agreement agreement(calibration, robot, map);
  for (Eigen::Index i = 0; i < vision::kRigNumbers; ++i) {
    if (agreement.agrees(i)) continue;
    const Eigen::Index k = agreement.index_of(i);
    throw FileError("{}: rig: {} is {}, but {} is of a rig with {}: calibrate again, or state `sigma:` in its place",
                    robot.file.string(), agreement.name(i), agreement.value(i), robot.rig.calibration.string(),
                    k >= 0 ? fmt::format("{}", calibration.values[k]) : "none");
  }
  agreement.take(0, vision::kRigNumbers);
  agreement.take_same_landmarks();
  agreement.take_if_same(agreement.wheels(), kWheelNumbers);
  agreement.take_if_same(agreement.wheels() + kWheelNumbers, vision::kTimeNumbers);
  return agreement.replaced(sigmas.cwiseAbs2().asDiagonal());
}

Eigen::MatrixXd with_survey(const Calibration& survey, const Robot& robot, const Map& map, Eigen::MatrixXd covariance) {
  Agreement agreement(survey, robot, map);
  agreement.take_if_same(0, vision::kRigNumbers);
  agreement.take_same_landmarks();
  agreement.take_if_same(agreement.wheels() + kWheelNumbers, vision::kTimeNumbers);
  return agreement.replaced(std::move(covariance));
}

Eigen::MatrixXd root_of(const Eigen::MatrixXd& covariance) {
  std::vector<Eigen::Index> uncertain;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    if (covariance(i, i) > 0) uncertain.push_back(i);
  }
  const auto count = Eigen::Index(uncertain.size());
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(covariance.rows(), count);
  if (count == 0) return root;
  const Eigen::MatrixXd block = covariance(uncertain, uncertain);
  const Eigen::VectorXd sigma = block.diagonal().cwiseSqrt();
  if (Eigen::MatrixXd(block.diagonal().asDiagonal()) == block) {
    for (Eigen::Index i = 0; i < count; ++i) root(uncertain[std::size_t(i)], i) = sigma[i];
    return root;
  }
  // Metres, pixels and radians are mixed, so the eigenvectors are those of the correlations.
  const Eigen::VectorXd inverse = sigma.cwiseInverse();
  const Eigen::MatrixXd correlation = inverse.asDiagonal() * block * inverse.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen((correlation + correlation.transpose()) / 2);
  constexpr double kNone = 1e-12;  // of the largest: rounding of the entries
  const double least = kNone * eigen.eigenvalues()[count - 1];
  const auto none = (eigen.eigenvalues().array() <= least).count();
  const Eigen::VectorXd lengths = eigen.eigenvalues().tail(count - none).cwiseSqrt();
  const Eigen::MatrixXd rows = sigma.asDiagonal() * eigen.eigenvectors().rightCols(count - none) * lengths.asDiagonal();
  root = Eigen::MatrixXd::Zero(covariance.rows(), count - none);
  for (Eigen::Index i = 0; i < count; ++i) root.row(uncertain[std::size_t(i)]) = rows.row(i);
  return root;
}

vision::BeliefErrors vision_errors(const Eigen::MatrixXd& by_shared, std::size_t landmarks, double sighting_px) {
  vision::BeliefErrors errors;
  errors.rig = by_shared.topRows(vision::kRigNumbers);
  errors.times = by_shared.bottomRows<vision::kTimeNumbers>();
  errors.sighting_px = sighting_px;
  for (std::size_t i = 0; i < landmarks; ++i) {
    const Eigen::Index at = vision::kRigNumbers + vision::kLandmarkNumbers * Eigen::Index(i);
    errors.landmarks.emplace_back(by_shared.middleRows(at, vision::kLandmarkNumbers));
  }
  return errors;
}

}  // namespace twocone::config
