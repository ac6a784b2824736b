// SPDX-License-Identifier: Apache-2.0
#include "vision/full/outline_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace twocone::vision {
namespace {

constexpr std::size_t kNeighbours = 1;  // stations either side whose colours are averaged
constexpr int kSamples = 3;             // pixels that a colour beside the outline is taken from, in each row
constexpr double kLeastContrast = 8;    // grey levels: below, an edge tells less than its noise
constexpr float kAlike = 12;            // grey levels: more is another surface rather than noise
// Pixels on the background's side of an edge show whether the background is what it was taken for. Noise alone makes
// two degrees of misfit, of which the largest of some pixels is taken.
constexpr double kDoubtReach_px = 1.2;
constexpr float kDoubtShare = 0.6F;
constexpr double kDoubtVariances = 12;
constexpr float kLimb = 0.75F;
constexpr double kClipped = 253;  // grey levels from which on a channel may be cut off
constexpr double kLeastStations = 8;
constexpr int kIterations = 12;
constexpr double kHuber = 3;  // standard deviations
constexpr double kMostStep_px = 3;

/// How much of a pixel lies inside a straight edge, and the derivative by the edge's distance. Exact for a pixel of
/// `wide` and `narrow` times the edge's normal.
struct Coverage {
  double value, slope;
};
Coverage coverage(double inside_px, double wide, double narrow) {
  const double half = (wide + narrow) / 2;
  const double distance = std::abs(inside_px);
  if (distance >= half) return {inside_px > 0 ? 1.0 : 0.0, 0.0};
  if (distance <= (wide - narrow) / 2) return {0.5 + inside_px / wide, 1 / wide};
  const double corner = half - distance;
  const double area = corner * corner / (2 * wide * narrow);
  return {inside_px > 0 ? 1 - area : area, corner / (wide * narrow)};
}

struct Colour {
  std::array<float, 3> linear{};
  std::array<float, 3> variance{};  // of linear light for one grey level
  std::array<float, 3> code{};

  void add(const Colour& other) {
    for (std::size_t i = 0; i < 3; ++i) {
      linear[i] += other.linear[i];
      variance[i] += other.variance[i];
      code[i] += other.code[i];
    }
  }
  void scale(float factor) {
    for (std::size_t i = 0; i < 3; ++i) {
      linear[i] *= factor;
      variance[i] *= factor;
      code[i] *= factor;
    }
  }
};

std::uint8_t label_of(const ColourTable& table, const Colour& c) {
  const std::array<std::uint8_t, 3> rgb{static_cast<std::uint8_t>(c.code[0] + 0.5F),
                                        static_cast<std::uint8_t>(c.code[1] + 0.5F),
                                        static_cast<std::uint8_t>(c.code[2] + 0.5F)};
  return table.label(rgb.data());
}

bool differ(const Colour& a, const Colour& b) {
  float most = 0;
  for (std::size_t i = 0; i < 3; ++i) most = std::max(most, std::abs(a.code[i] - b.code[i]));
  return most > kAlike;
}

/// What is read of one row or column before neighbours are joined.
struct Crossing {
  Station station;
  bool is_row;      // the outline runs along columns here, and is crossed along a row
  int line;         // that row's or column's number
  double at;        // where along it the outline crosses
  double inwards;   // +1 or -1: which way the landmark lies
  double normal;    // of the outline's normal, the part along it: > 0
  double depth_px;  // of the landmark along the normal
  bool is_good;
  bool is_thin;      // too thin for pixels that are wholly inside
  float thin_cover;  // then: how much of its middle pixel it covers
  Colour inside, outside;
};

/// The first pixel from a place along a row or column on, in a direction.
int first_beyond(double from, double direction) {
  return static_cast<int>(direction > 0 ? std::ceil(from) : std::floor(from));
}

class Reader {
 public:
  Reader(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, const Reach& reach)
      : rgb_(rgb), table_(table), label_(label), reach_px_(reach.colours_px), blur_px_(reach.blur_px) {}

  /// Colours beside the outline. False where they do not lie in the picture.
  bool read_colours(Crossing& c, std::vector<double>& scatter) const {
    const double width = c.depth_px / c.normal;
    double inner = reach_px_;
    int samples = kSamples;
    c.is_thin = false;
    if (inner + kSamples > width / 2) {
      samples = 1;
      inner = std::min(inner, width / 2 - 0.5);
      const double inside_px = (first_beyond(c.at + c.inwards * inner, c.inwards) - c.at) * c.inwards * c.normal;
      const double seen = coverage(inside_px, c.station.wide, c.station.narrow).value +
                          coverage(c.depth_px - inside_px, c.station.wide, c.station.narrow).value - 1;
      c.is_thin = seen < 0.999;
      c.thin_cover = static_cast<float>(seen);
    }
    double squares = 0;
    if (!mean(c, c.at - c.inwards * reach_px_, -c.inwards, kSamples, c.outside, squares)) return false;
    if (squares >= 0) scatter.push_back(squares / (kSamples - 1));
    if (!mean(c, c.at + c.inwards * inner, c.inwards, samples, c.inside, squares)) return false;
    if (c.station.part != Station::kArc && samples == kSamples) darken(c, inner);
    return true;
  }

  /// Both colours are what they should be.
  [[nodiscard]] bool is_landmark(const Crossing& c) const {
    if (label_of(table_, c.outside) == label_) return false;
    return c.is_thin || label_of(table_, c.inside) == label_;
  }

  /// The pixels that the outline may cross.
  void read_pixels(const Crossing& c, const Colour& inside, const Colour& outside, double reach_px, Stations& stations,
                   Station& station) const {
    std::array<float, 3> difference{};
    std::array<float, 3> weight{};
    float contrast = 0;
    bool clipped = false;
    for (std::size_t i = 0; i < 3; ++i) {
      difference[i] = inside.linear[i] - outside.linear[i];
      const bool cut = inside.code[i] >= kClipped || outside.code[i] >= kClipped;
      clipped = clipped || cut;
      weight[i] = cut ? 0.F : 2 / (inside.variance[i] + outside.variance[i] + 1e-12F);
      contrast += weight[i] * difference[i] * difference[i];
    }
    station.first = int(stations.pixels.size());
    station.count = 0;
    station.doubt = 0;
    station.is_usable = contrast > kLeastContrast * kLeastContrast;
    if (!station.is_usable) {
      stations.too_bright += clipped ? 1 : 0;
      return;
    }
    const int begin = static_cast<int>(std::ceil(c.at - reach_px));
    const int end = static_cast<int>(std::floor(c.at + reach_px));
    for (int i = begin; i <= end; ++i) {
      const double inside_px = (i - c.at) * c.inwards * c.normal;
      // Of a thin landmark a pixel belongs to the nearer side.
      if (inside_px > station.width_px / 2) continue;
      const std::uint8_t* p = pixel(c, i);
      // Noise is of the code, so a channel tells more where it is dark: weighed by what the pixel is expected to be.
      const auto expected =
          static_cast<float>(coverage(inside_px, station.wide * blur_px_, station.narrow * blur_px_).value);
      float sum = 0;
      float square = 0;
      float information = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const float off = table_.linear(p[k]) - outside.linear[k];
        const float w = weight[k] > 0 ? table_.weight_of(outside.linear[k] + expected * difference[k]) : 0;
        sum += w * difference[k] * off;
        square += w * off * off;
        information += w * difference[k] * difference[k];
      }
      const float share = sum / information;
      stations.pixels.push_back({static_cast<float>(inside_px), share, 1 / information});
      ++station.count;
      // What no mixture of the two colours explains.
      const float misfit = square / information - share * share;
      if (std::abs(inside_px) < kDoubtReach_px && share < kDoubtShare) station.doubt = std::max(station.doubt, misfit);
    }
    station.is_usable = station.count > 0;
    station.doubt =
        std::max(0.F, station.doubt - static_cast<float>(kDoubtVariances * stations.code_variance) / contrast);
  }

  [[nodiscard]] bool in_picture(const Crossing& c, double reach_px) const {
    const int along = c.is_row ? rgb_.cols : rgb_.rows;
    const int lines = c.is_row ? rgb_.rows : rgb_.cols;
    return c.line >= 0 && c.line < lines && c.at - reach_px >= 0 && c.at + reach_px <= along - 1;
  }

 private:
  /// A matt cylinder's light falls (or rises) towards its limb as the sine of the angle from there: between edge and
  /// nearest sample by as much as three quarters of that between nearest and third, whatever the cylinder's size.
  void darken(Crossing& c, double inner) const {
    const int step = c.inwards > 0 ? 1 : -1;
    const int begin = first_beyond(c.at + c.inwards * inner, c.inwards);
    float near = 0;
    float far = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      near += table_.linear(pixel(c, begin)[k]);
      far += table_.linear(pixel(c, begin + 2 * step)[k]);
    }
    const float mean = c.inside.linear[0] + c.inside.linear[1] + c.inside.linear[2];
    const float factor = std::clamp((near + kLimb * (near - far)) / std::max(mean, 1e-6F), 0.5F, 1.5F);
    for (float& x : c.inside.linear) x *= factor;
  }
  [[nodiscard]] const std::uint8_t* pixel(const Crossing& c, int i) const {
    return c.is_row ? rgb_.ptr<std::uint8_t>(c.line) + std::ptrdiff_t(3) * i
                    : rgb_.ptr<std::uint8_t>(i) + std::ptrdiff_t(3) * c.line;
  }

  /// The nearest sample, and those behind it that look alike: a line of the background must not be mixed in.
  bool mean(const Crossing& c, double from, double direction, int samples, Colour& colour, double& squares) const {
    std::array<Colour, kSamples> read;
    const int step = direction > 0 ? 1 : -1;
    const int begin = first_beyond(from, direction);
    const int along = c.is_row ? rgb_.cols : rgb_.rows;
    const int last = begin + step * (samples - 1);
    if (std::min(begin, last) < 0 || std::max(begin, last) >= along) return false;
    colour = {};
    int taken = 0;
    for (int j = 0; j < samples; ++j) {
      const int i = begin + step * j;
      const std::uint8_t* p = pixel(c, i);
      Colour& one = read[std::size_t(j)];
      for (std::size_t k = 0; k < 3; ++k) {
        one.linear[k] = table_.linear(p[k]);
        one.variance[k] = table_.variance(p[k]);
        one.code[k] = p[k];
      }
      if (j > 0 && differ(one, read[0])) break;
      colour.add(one);
      ++taken;
    }
    colour.scale(1.F / float(taken));
    squares = -1;
    if (taken == kSamples) {
      squares = 0;
      for (int j = 0; j < taken; ++j) {
        for (std::size_t k = 0; k < 3; ++k) {
          const double off = read[std::size_t(j)].code[k] - colour.code[k];
          squares += off * off / 3;
        }
      }
    }
    return true;
  }

  const cv::Mat& rgb_;
  const ColourTable& table_;
  std::uint8_t label_;
  double reach_px_;
  double blur_px_;
};

Station::Part part_of(int segment) {
  if (segment < Outline::kSideSegments) return Station::kLeft;
  return segment < Outline::kSideSegments + Outline::kArcSegments ? Station::kArc : Station::kRight;
}

/// Where one segment of the outline crosses rows (or columns, whichever it crosses more squarely).
void cross(const Outline& outline, int segment, const Eigen::Vector2d& middle, int stride,
           std::vector<Crossing>& crossings) {
  const Eigen::Vector2d across = outline.across();
  const Outline::Vertex& a = outline.vertices[std::size_t(segment)];
  const Outline::Vertex& b = outline.vertices[std::size_t(segment) + 1];
  const Eigen::Vector2d along = b.pixel_px - a.pixel_px;
  const double length = along.norm();
  if (!(length > 0)) return;
  Eigen::Vector2d chord_normal(along.y() / length, -along.x() / length);
  if (chord_normal.dot(a.pixel_px + along / 2 - middle) < 0) chord_normal = -chord_normal;  // outwards
  const bool is_row = std::abs(chord_normal.x()) >= std::abs(chord_normal.y());
  const int line_axis = is_row ? 1 : 0;
  const int cross_axis = 1 - line_axis;
  const double from = a.pixel_px[line_axis];
  const double to = b.pixel_px[line_axis];
  if (from == to) return;
  // Half-open, so that a line at a vertex is crossed once.
  const int first = static_cast<int>(std::ceil(std::min(from, to)));
  const int last = static_cast<int>(std::ceil(std::max(from, to))) - 1;
  const auto add = [&](int line) {
    if (line % stride != 0) return;
    const double u = (line - from) / (to - from);
    // A pixel's share of a curved edge is that of a straight one which lies inwards by curvature / 24, the mean of the
    // parabola over a pixel. The bulge is curvature length^2 / 8.
    const Eigen::Vector2d bulge = (4 * u * (1 - u) - 1 / (3 * length * length)) * a.bulge_px;
    Crossing c{};
    c.station.part = part_of(segment);
    c.is_row = is_row;
    c.line = line;
    c.inwards = chord_normal[cross_axis] > 0 ? -1 : 1;
    // The bulge moves the outline along the chord's normal; along the line that is farther.
    c.at = a.pixel_px[cross_axis] + u * along[cross_axis] -
           c.inwards * bulge.dot(chord_normal) / std::abs(chord_normal[cross_axis]);
    // The parabola's own normal there: the chord's would be some degrees off.
    const Eigen::Vector2d tangent = along + 4 * (1 - 2 * u) * a.bulge_px;
    Eigen::Vector2d normal = Eigen::Vector2d(tangent.y(), -tangent.x()).normalized();
    if (normal.dot(chord_normal) < 0) normal = -normal;
    c.normal = std::abs(normal[cross_axis]);
    c.station.wide = static_cast<float>(c.normal);
    c.station.narrow = static_cast<float>(std::abs(normal[line_axis]));
    c.station.by_range_pxpm = static_cast<float>(normal.dot(a.by_range_pxpm + u * (b.by_range_pxpm - a.by_range_pxpm)));
    c.station.by_bearing_pxprad =
        static_cast<float>(normal.dot(a.by_bearing_pxprad + u * (b.by_bearing_pxprad - a.by_bearing_pxprad)));
    c.station.width_px = static_cast<float>(a.width_px + u * (b.width_px - a.width_px));
    const double chord_px = a.chord_px + u * (b.chord_px - a.chord_px);
    c.depth_px = chord_px / std::max(std::abs(normal.dot(across)), 1e-3);
    crossings.push_back(c);
  };
  if (from < to) {
    for (int line = first; line <= last; ++line) add(line);
  } else {
    for (int line = last; line >= first; --line) add(line);
  }
}

}  // namespace

void Stations::clear() {
  stations.clear();
  pixels.clear();
  too_bright = 0;
  code_variance = 0;
}

void read_stations(const cv::Mat& rgb, const ColourTable& table, std::uint8_t label, const Outline& outline,
                   const Reach& reach, int stride, Stations& stations) {
  stations.clear();
  const double reach_px = reach.colours_px;
  const Reader reader(rgb, table, label, reach);
  const Eigen::Vector2d middle =
      (outline.vertices.front().pixel_px + outline.vertices.back().pixel_px + outline.near().pixel_px) / 3;
  std::vector<Crossing> crossings;
  crossings.reserve(1024 / std::size_t(stride));
  for (int i = 0; i + 1 < Outline::kVertices; ++i) cross(outline, i, middle, stride, crossings);
  std::vector<double> scatter;
  scatter.reserve(crossings.size());
  for (Crossing& c : crossings) {
    c.is_good = reader.in_picture(c, reach_px) && reader.read_colours(c, scatter) && reader.is_landmark(c);
  }
  if (!scatter.empty()) {
    // Texture only adds, so the quieter fifth tells the noise: that quantile of chi-squared of six degrees is 0.51 of
    // six.
    const auto fifth = scatter.begin() + std::ptrdiff_t(scatter.size() / 5);
    std::nth_element(scatter.begin(), fifth, scatter.end());
    stations.code_variance = *fifth / 0.51;
  }

  // Of a landmark too thin to show its own colour, that colour is taken from where it covers most.
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    Crossing& c = crossings[i];
    Station station = c.station;
    station.is_usable = false;
    station.first = int(stations.pixels.size());
    station.count = 0;
    if (c.is_good) {
      Colour inside{};
      Colour outside{};
      int count = 0;
      const std::size_t begin = i > kNeighbours ? i - kNeighbours : 0;
      for (std::size_t j = begin; j <= std::min(i + kNeighbours, crossings.size() - 1); ++j) {
        const Crossing& n = crossings[j];
        if (!n.is_good || n.station.part != c.station.part || n.is_row != c.is_row || n.is_thin != c.is_thin) continue;
        inside.add(n.inside);
        outside.add(n.outside);
        ++count;
      }
      inside.scale(1.F / float(count));
      outside.scale(1.F / float(count));
      if (c.is_thin) {
        if (c.thin_cover < 0.3F) {
          stations.stations.push_back(station);
          continue;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          inside.linear[k] = outside.linear[k] + (inside.linear[k] - outside.linear[k]) / c.thin_cover;
        }
      }
      const double support_px = reach_px;
      reader.read_pixels(c, inside, outside, support_px, stations, station);
    }
    stations.stations.push_back(station);
  }
}

std::optional<OutlineFit> fit_outline(const Stations& read, const Cylinder& cylinder, const Outline& outline,
                                      const PixelNoise& noise, const FitLimits& limits) {
  std::array<int, 3> all{};
  std::array<int, 3> usable{};
  for (const Station& s : read.stations) {
    ++all[s.part];
    if (s.is_usable) ++usable[s.part];
  }
  if (usable[0] + usable[1] + usable[2] < kLeastStations) return std::nullopt;
  const auto share = [&](Station::Part part) { return all[part] > 0 ? double(usable[part]) / all[part] : 0.0; };

  // Unknowns in pixels at the near point: of range, of bearing; and the blur.
  const double range_px = outline.near().by_range_pxpm.norm();
  const double bearing_px = outline.near().by_bearing_pxprad.norm();
  Eigen::Vector3d unknown(0, 0, limits.least_blur_px);
  OutlineFit fit;
  Eigen::Matrix3d normal;

  struct Model {
    double value, by_out, by_opposite, by_blur;
  };
  const auto model = [&](const Station& s, const EdgePixel& p, double out_px, double opposite_px) -> Model {
    const double width = unknown.z();
    const double inside = p.inside_px + out_px;
    const Coverage c = coverage(inside, s.wide * width, s.narrow * width);
    Model m{c.value, c.slope, 0, -c.slope * inside / width};
    if (s.width_px < 8 * width) {  // the opposite side may cross this pixel too
      const double far_inside = s.width_px - p.inside_px + opposite_px;
      const Coverage far = coverage(far_inside, s.wide * width, s.narrow * width);
      m.value += far.value - 1;
      m.by_opposite = far.slope;
      m.by_blur -= far.slope * far_inside / width;
    }
    return m;
  };
  const auto variance_of = [&](const Station& s, const EdgePixel& p, double c) {
    const double inner = std::clamp(c, 0.0, 1.0);
    return s.doubt + noise.code_variance * p.variance + noise.sampling * std::max(inner * (1 - inner), 0.02);
  };

  for (int iteration = 0; iteration < kIterations; ++iteration) {
    // The lower half of the normal equations, and their right side.
    double n00 = 0, n10 = 0, n11 = 0, n20 = 0, n21 = 0, n22 = 0, r0 = 0, r1 = 0, r2 = 0;
    for (const Station& s : read.stations) {
      if (!s.is_usable) continue;
      const double range_part = s.by_range_pxpm / range_px;
      const double bearing_part = s.by_bearing_pxprad / bearing_px;
      const double out_px = range_part * unknown.x() + bearing_part * unknown.y();
      const double opposite_px = range_part * unknown.x() - bearing_part * unknown.y();
      for (int i = s.first; i < s.first + s.count; ++i) {
        const EdgePixel& p = read.pixels[std::size_t(i)];
        if (s.width_px >= 8 * unknown.z() && std::abs(p.inside_px + out_px) >= (s.wide + s.narrow) / 2 * unknown.z())
          continue;
        const Model m = model(s, p, out_px, opposite_px);
        const double variance = variance_of(s, p, m.value);
        const double residual = p.coverage - m.value;
        double weight = 1 / variance;
        const double squared = residual * residual * weight;
        if (squared > kHuber * kHuber) weight *= kHuber / std::sqrt(squared);
        const double by_range = range_part * (m.by_out + m.by_opposite);
        const double by_bearing = bearing_part * (m.by_out - m.by_opposite);
        n00 += weight * by_range * by_range;
        n10 += weight * by_bearing * by_range;
        n11 += weight * by_bearing * by_bearing;
        n20 += weight * m.by_blur * by_range;
        n21 += weight * m.by_blur * by_bearing;
        n22 += weight * m.by_blur * m.by_blur;
        r0 += weight * residual * by_range;
        r1 += weight * residual * by_bearing;
        r2 += weight * residual * m.by_blur;
      }
    }
    normal << n00, n10, n20, n10, n11, n21, n20, n21, n22;
    const Eigen::Vector3d right(r0, r1, r2);
    // The blur is known to a tenth of a pixel beforehand only if the data say so; without this it would run away where
    // few pixels lie on the edge.
    constexpr double kBlurInformation = 1 / (0.5 * 0.5);
    normal(2, 2) += kBlurInformation;
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    if (!step.allFinite()) return std::nullopt;
    const double length = step.head<2>().norm();
    const double share_of_step = length > kMostStep_px / 2 ? kMostStep_px / 2 / length : 1;
    unknown += share_of_step * step;
    unknown.z() = std::clamp(unknown.z(), limits.least_blur_px, limits.most_blur_px);
    if (unknown.head<2>().norm() > 4 * kMostStep_px) return std::nullopt;
    if (length < limits.converged_px) break;
  }

  // What the pixels say of the model at the answer.
  std::array<double, 3> side_score{};
  std::array<double, 3> side_information{};
  double previous = 0;
  double before = 0;
  int arc_stations = 0;
  for (const Station& s : read.stations) {
    if (!s.is_usable) {
      previous = before = 0;
      continue;
    }
    const double range_part = s.by_range_pxpm / range_px;
    const double bearing_part = s.by_bearing_pxprad / bearing_px;
    const double out_px = range_part * unknown.x() + bearing_part * unknown.y();
    const double opposite_px = range_part * unknown.x() - bearing_part * unknown.y();
    double score = 0;
    double information = 0;
    for (int i = s.first; i < s.first + s.count; ++i) {
      const EdgePixel& p = read.pixels[std::size_t(i)];
      const Model m = model(s, p, out_px, opposite_px);
      if (m.by_out == 0) continue;
      const double inner = std::clamp(m.value, 0.0, 1.0);
      const double residual = p.coverage - m.value;
      const double sigma = std::sqrt(variance_of(s, p, m.value));
      const double bounded = std::clamp(residual / sigma, -kHuber, kHuber);
      score += m.by_out * bounded / sigma;
      information += m.by_out * m.by_out / (sigma * sigma);
      fit.residual += residual * residual;
      fit.grey += p.variance;
      fit.spread += inner * (1 - inner);
    }
    Scores& scores = s.part == Station::kArc ? fit.arc_scores : fit.side_scores;
    scores.found += score * score + 2 * score * previous;
    if (s.part != Station::kArc) scores.found += 2 * score * before;
    scores.expected += information;
    if (s.part == Station::kArc) ++arc_stations;
    before = previous;
    previous = score;
    fit.length_px += 1 / s.wide;
    side_score[s.part] += score;
    side_information[s.part] += information;
  }
  if (!(fit.arc_scores.expected + fit.side_scores.expected > 0)) return std::nullopt;
  // The fit has made the sum of the arc's scores zero, and with it a part of their products.
  fit.arc_scores.found /= std::max(0.2, 1 - 3.0 / std::max(arc_stations, 1));
  // Blur taken out: it moves no edge, but where a landmark is thin it passes for width.
  const Eigen::Matrix2d pixels =
      normal.topLeftCorner<2, 2>() - normal.topRightCorner<2, 1>() * normal.bottomLeftCorner<1, 2>() / normal(2, 2);
  const Eigen::Vector2d scale(range_px, bearing_px);
  fit.information = scale.asDiagonal() * pixels * scale.asDiagonal();
  fit.cylinder = cylinder;
  fit.step = {unknown.x() / range_px, unknown.y() / bearing_px};
  fit.cylinder.range_m += fit.step.x();
  fit.cylinder.bearing_rad += fit.step.y();
  fit.code_variance = read.code_variance;
  fit.outline = outline;
  fit.blur = unknown.z();
  fit.left_support = share(Station::kLeft);
  fit.arc_support = share(Station::kArc);
  fit.right_support = share(Station::kRight);
  if (side_information[Station::kLeft] > 0 && side_information[Station::kRight] > 0) {
    fit.narrowness_px = -side_score[Station::kLeft] / side_information[Station::kLeft] -
                        side_score[Station::kRight] / side_information[Station::kRight];
    fit.sigma_narrowness_px = std::sqrt(1 / side_information[Station::kLeft] + 1 / side_information[Station::kRight]);
  }
  return fit;
}

}  // namespace twocone::vision
