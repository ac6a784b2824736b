// SPDX-License-Identifier: Apache-2.0
#include "localisation/least_squares/starts.h"

#include <algorithm>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "localisation/least_squares/solver.h"

namespace twocone::localisation::least_squares {
namespace {

void add_ranged(const Problem& problem, Starts& starts) {
  // Var(r^2) = 4 r^2 sigma^2 + 2 sigma^4.
  const auto weight = [](const Landmark& l) {
    const double variance = square(1 / l.range_weight);
    return 1 / (4 * square(l.range) * variance + 2 * square(variance) + square(kEps));
  };
  double sum = 0;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range) continue;
    const double w = weight(l);
    sum += w;
    middle += w * l.place();
  }
  middle /= sum;
  // Coordinates are relative to the weighted mean: r^2 = |l|^2 - 2 l.p + |p|^2, with sum w l = 0.
  double xx = 0;
  double xy = 0;
  double yy = 0;
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  double mean_square = 0;
  double widest = 0;
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range) continue;
    const double w = weight(l) / sum;
    const Eigen::Vector2d p = l.place() - middle;
    const double distance = std::hypot(p.x(), p.y());
    const double f = (l.range - distance) * (l.range + distance);
    const Eigen::Vector2d weighted = w * p;
    xx += weighted.x() * p.x();
    xy += weighted.x() * p.y();
    yy += weighted.y() * p.y();
    b -= weighted * f / 2;
    mean_square += w * f;
    widest = std::max(widest, std::sqrt(l.range / l.range_weight));
  }
  const double axis = std::atan2(2 * xy, xx - yy) / 2;
  const double ax = std::cos(axis);
  const double ay = std::sin(axis);
  const double major = xx * ax * ax + 2 * xy * ax * ay + yy * ay * ay;
  const double minor = std::max(0.0, xx * ay * ay - 2 * xy * ax * ay + yy * ax * ax);
  if (!(major > 0)) return;
  const double along = (b.x() * ax + b.y() * ay) / major;
  const auto add = [&](double across) {
    starts.add(with_heading(problem, middle.x() + along * ax - across * ay, middle.y() + along * ay + across * ax));
  };
  // Nearer to the axis than sqrt(2 r sigma), the ranges do not determine the side. On the axis itself the cost has no
  // slope that would lead away from it.
  const double height = std::max(std::sqrt(std::max(0.0, mean_square - along * along)), widest);
  add(height);
  add(-height);
  if (minor > kEps * major) add((b.y() * ax - b.x() * ay) / minor);
}

void add_resection(const Problem& problem, Starts& starts) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_bearing) continue;
    const double c = l.cos_bearing;
    const double s = l.sin_bearing;
    const Eigen::Vector4d row(c * l.y - s * l.x, -c * l.x - s * l.y, -s, c);
    normal += square(std::min(l.bearing_weight, 1 / std::sqrt(kEps))) * row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(normal);
  // Use the second eigenvector too. Near the circle through three landmarks there is a plane of null vectors, and
  // starts are made in directions all round it.
  constexpr double kPlane = 1e-6;  // share of the largest eigenvalue: within a thousandth of the circle's size
  const bool is_plane = eigen.eigenvalues()[1] <= kPlane * eigen.eigenvalues()[3];
  starts.is_one_valley = is_plane;
  const int count = is_plane ? 8 : 2;
  for (int k = 0; k < count; ++k) {
    const double mix = std::numbers::pi * k / count;
    Eigen::Vector4d v = std::cos(mix) * eigen.eigenvectors().col(0) + std::sin(mix) * eigen.eigenvectors().col(1);
    const double turn = std::hypot(v[0], v[1]);
    if (turn < 1e-9) continue;
    v /= turn;
    int ahead = 0;
    for (const Landmark& l : problem.landmarks) {
      if (!l.has_bearing) continue;
      const double forward =
          l.cos_bearing * (v[0] * l.x + v[1] * l.y + v[2]) + l.sin_bearing * (v[0] * l.y - v[1] * l.x + v[3]);
      ahead += forward > 0 ? 1 : -1;
    }
    if (ahead < 0) v = -v;  // the bearings point at the landmarks, not away from them
    starts.add({-(v[0] * v[2] - v[1] * v[3]), -(v[1] * v[2] + v[0] * v[3]), std::atan2(v[1], v[0])});
  }
}

constexpr double kPi = std::numbers::pi;

/// A direction that turns within a cell by no more than this counts as constant.
constexpr double kEvenDirection_rad = 0.1;
/// A landmark within this many sigmas of the most accurate range is near.
constexpr double kNear = 8;
/// A place within this many sigmas of a landmark cannot be distinguished from the landmark's own place.
constexpr double kSpeck = 0.01;

/// A cell in polar coordinates about one landmark: its middle and half of its extents.
struct Sector {
  double turn_rad;
  double half_turn_rad;
  double radius;
  double half_radius;
};

/// The weight of each number of a landmark by itself, whatever its other number is. This is a lower bound: chi-squared
/// of two correlated numbers is at least the sum of their own squares over 1 + |correlation|.
struct Sure {
  double range;    // 1 / sigma; 0 for none
  double bearing;  // 1 / sigma; 0 for none
};

Sure sure_of(const Landmark& l) {
  Sure sure{0, 0};
  double share = 1;
  if (l.has_range && l.has_bearing) share = 1 + std::min(1.0, std::abs(l.bearing_on_range) / l.sigma_bearing_rad);
  if (l.has_range) sure.range = l.range_weight / std::sqrt(share);
  if (l.has_bearing) sure.bearing = 1 / (l.sigma_bearing_rad * std::sqrt(share));
  return sure;
}

/// The heading that follows from a bearing, anywhere in a sector.
struct Vote {
  double c;  // cosine and sine of the heading, times the distance
  double s;
  double spread_rad;  // to either side, within the sector
  double sigma_rad;
};

/// Returns the greatest distance from the middle to a place of the sector. Its square is
/// (radius - radius')^2 + 4 radius radius' sin^2(turn / 2).
double reach_of(const Sector& s) {
  return std::sqrt(s.half_radius * s.half_radius +
                   s.radius * (s.radius + s.half_radius) * s.half_turn_rad * s.half_turn_rad);
}

class Search {
 public:
  Search(const Problem& problem, double limit) : problem_(problem), limit_(limit) {
    for (const Landmark& l : problem.landmarks) {
      sure_.push_back(sure_of(l));
      if (!l.has_range) continue;
      if (centre_ == nullptr || sure_.back().range > sure_[centre_index_].range) {
        centre_ = &l;
        centre_index_ = sure_.size() - 1;
      }
    }
    votes_.resize(problem.landmarks.size());
  }

  std::vector<Cell> run() {
    constexpr int kSectors = 16;
    const double reach = std::sqrt(limit_) / sure_[centre_index_].range;
    const double inner = std::max(0.0, centre_->range - reach);
    const double outer = centre_->range + reach;
    std::vector<Sector> open;
    open.reserve(kSectors);
    for (int k = 0; k < kSectors; ++k) {
      open.push_back({2 * kPi * (k + 0.5) / kSectors, kPi / kSectors, (inner + outer) / 2, (outer - inner) / 2});
    }
    std::vector<Cell> cells;
    std::vector<Sector> halves;
    while (!open.empty() && open.size() + cells.size() <= std::size_t(kMostCells)) {
      halves.clear();
      for (const Sector& s : open) {
        const Candidate judged = judge(s);
        if (judged.least > limit_) continue;
        if (judged.is_small) {
          cells.push_back(cell_of(s, true, judged.is_fine));
          continue;
        }
        Sector a = s;
        Sector b = s;
        if (s.half_radius > s.radius * s.half_turn_rad) {
          a.half_radius = b.half_radius = s.half_radius / 2;
          a.radius -= a.half_radius;
          b.radius += b.half_radius;
        } else {
          a.half_turn_rad = b.half_turn_rad = s.half_turn_rad / 2;
          a.turn_rad -= a.half_turn_rad;
          b.turn_rad += b.half_turn_rad;
        }
        halves.push_back(a);
        halves.push_back(b);
      }
      open.swap(halves);
    }
    for (const Sector& s : open) cells.push_back(cell_of(s, false, false));
    std::stable_sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) { return a.cost < b.cost; });
    return cells;
  }

 private:
  struct Candidate {
    double least;   // lower bound of chi-squared in the sector
    bool is_small;  // it need not be halved
    bool is_fine;   // no whitened residual in it changes by more than kCellSigmas
  };

  Candidate judge(const Sector& sector) {
    const double x = centre_->x + sector.radius * std::cos(sector.turn_rad);
    const double y = centre_->y + sector.radius * std::sin(sector.turn_rad);
    const double reach = reach_of(sector);
    // Within a landmark's own sigma, cells need not be smaller than the direction to that landmark requires.
    const bool is_within_sigma = reach * sure_[centre_index_].range <= kCellSigmas;
    const bool is_speck = reach * sure_[centre_index_].range <= kSpeck;
    Candidate judged{0, true, true};
    int votes = 0;
    const auto off = [](double error, double change) { return std::max(0.0, std::abs(error) - change); };
    for (std::size_t i = 0; i < sure_.size(); ++i) {
      const Landmark& l = problem_.landmarks[i];
      const bool is_centre = i == centre_index_;
      const double dx = l.x - x;
      const double dy = l.y - y;
      const double distance = is_centre ? sector.radius : std::sqrt(dx * dx + dy * dy);
      if (l.has_range) {
        const double change = (is_centre ? sector.half_radius : reach) * sure_[i].range;
        const double e = off((l.range - distance) * sure_[i].range, change);
        judged.least += e * e;
        if (change > kCellSigmas) judged.is_small = judged.is_fine = false;
      }
      if (!l.has_bearing) continue;
      double spread_rad = kPi;
      if (is_centre && sector.half_radius < sector.radius) {
        spread_rad = sector.half_turn_rad;
      } else if (reach < distance) {
        // asin(a) <= a / sqrt(1 - a^2)
        spread_rad = std::min(kPi, reach / std::sqrt((distance - reach) * (distance + reach)));
      }
      if (spread_rad * sure_[i].bearing > kCellSigmas) {
        const bool is_near = distance * sure_[centre_index_].range <= kNear;
        judged.is_fine = false;
        if (!(is_within_sigma && is_near && spread_rad <= kEvenDirection_rad) && !is_speck) judged.is_small = false;
      }
      votes_[std::size_t(votes++)] = {dx * l.cos_bearing + dy * l.sin_bearing, dy * l.cos_bearing - dx * l.sin_bearing,
                                      spread_rad, 1 / sure_[i].bearing};
    }
    if (judged.least > limit_ || votes < 2) return judged;
    // Compare the most accurate bearing here with each other one: their difference does not depend on the heading.
    const auto surest = std::min_element(votes_.begin(), votes_.begin() + votes, [](const Vote& a, const Vote& b) {
      return a.spread_rad + a.sigma_rad < b.spread_rad + b.sigma_rad;
    });
    double worst = 0;
    for (auto v = votes_.begin(); v != votes_.begin() + votes; ++v) {
      if (v == surest) continue;
      const double change = v->spread_rad + surest->spread_rad;
      if (change >= kPi) continue;
      const double e =
          off(std::atan2(v->s * surest->c - v->c * surest->s, v->c * surest->c + v->s * surest->s), change);
      worst = std::max(worst, e * e / (v->sigma_rad * v->sigma_rad + surest->sigma_rad * surest->sigma_rad));
    }
    judged.least += worst;
    return judged;
  }

  [[nodiscard]] Cell cell_of(const Sector& sector, bool is_small, bool is_fine) const {
    const double x = centre_->x + sector.radius * std::cos(sector.turn_rad);
    const double y = centre_->y + sector.radius * std::sin(sector.turn_rad);
    Cell cell{with_heading(problem_, x, y), reach_of(sector), 0, is_small, is_fine};
    cell.cost = cost_at(problem_, cell.middle);
    return cell;
  }

  const Problem& problem_;
  double limit_;
  std::vector<Sure> sure_;
  const Landmark* centre_ = nullptr;
  std::size_t centre_index_ = 0;
  std::vector<Vote> votes_;
};

}  // namespace

State with_heading(const Problem& problem, double x, double y) {
  double c = 0;
  double s = 0;
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_bearing) continue;
    const double dx = l.x - x;
    const double dy = l.y - y;
    const double distance = std::hypot(dx, dy);
    if (distance == 0) continue;
    const double w = l.bearing_weight / distance;
    c += w * (dx * l.cos_bearing + dy * l.sin_bearing);
    s += w * (dy * l.cos_bearing - dx * l.sin_bearing);
  }
  return {x, y, problem.has_heading ? std::atan2(s, c) : 0};
}

Alignment align(const Problem& problem) {
  const auto weight = [](const Landmark& l) {
    return 1 / (square(1 / l.range_weight) + square(l.range * l.sigma_bearing_rad));
  };
  double sum = 0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector2d seen = Eigen::Vector2d::Zero();
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range || !l.has_bearing) continue;
    const double w = weight(l);
    sum += w;
    place += w * l.place();
    seen += w * l.range * Eigen::Vector2d(l.cos_bearing, l.sin_bearing);
  }
  place /= sum;
  seen /= sum;
  double c = 0;
  double s = 0;
  for (const Landmark& l : problem.landmarks) {
    if (!l.has_range || !l.has_bearing) continue;
    const double w = weight(l);
    const Eigen::Vector2d a = l.range * Eigen::Vector2d(l.cos_bearing, l.sin_bearing) - seen;
    const Eigen::Vector2d b = l.place() - place;
    c += w * a.dot(b);
    s += w * (a.x() * b.y() - a.y() * b.x());
  }
  Alignment a;
  a.strength = std::hypot(c, s);
  const double heading_rad = std::atan2(s, c);
  c = std::cos(heading_rad);
  s = std::sin(heading_rad);
  a.state = {place.x() - (c * seen.x() - s * seen.y()), place.y() - (s * seen.x() + c * seen.y()), heading_rad};
  return a;
}

void add_starts(const Problem& problem, Starts& starts) {
  if (problem.places.ranged >= 2) add_ranged(problem, starts);
  if (problem.places.bearing >= 3) add_resection(problem, starts);
}

std::vector<Cell> cells_below(const Problem& problem, double limit) { return Search(problem, limit).run(); }

}  // namespace twocone::localisation::least_squares
