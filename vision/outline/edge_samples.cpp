// SPDX-License-Identifier: Apache-2.0
#include "vision/outline/outline_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace twocone::vision {
namespace {

// Least contrast in grey levels: below it, an edge carries less information than noise. Tuned by hand on synthetic
// images; no test fixes it.
constexpr double kLeastContrast = 8;
// A pixel shows a band alone from this distance of its edge on, in widths of an edge: half a pixel's diagonal.
constexpr double kClear = 0.7;
// Least difference of the light on both sides of a band's side, as a share of the larger one.
constexpr float kLeastDifference = 0.5F;
constexpr double kDeep_px = 1e6;  // the band's own ends limit what is read across an edge between bands
// A colour is the mean over this number of further rows or columns to either side. Tuned by hand on synthetic images;
// no test fixes it.
constexpr std::size_t kNeighbours = 1;
// A greater difference, in grey levels, is another surface rather than noise. Tuned by hand on synthetic images; no
// test fixes it.
constexpr int kAlike = 12;
// Pixels on the background's side of an edge (up to kDoubtReach_px from it, coverage below kDoubtShare) show whether
// the background is the one assumed. Noise alone causes a misfit with two degrees of freedom, of which the largest of
// some pixels is taken; kDoubtVariances of it are allowed, which a chi-squared of two degrees exceeds with probability
// exp(-12) = 6e-6. Tuned by hand on synthetic images; no test fixes the three values.
constexpr double kDoubtReach_px = 1.2;
constexpr float kDoubtShare = 0.6F;
constexpr double kDoubtVariances = 24;
// Number of pixels for the fall of light towards a landmark's limb, and the factor of darken(), where its source is
// given. outline_ranging_test.cpp, BrightnessAndShadingOfTheScenesDoNotMoveTheEdges, exercises them but does not fix
// them.
constexpr int kLimbSamples = 3;
constexpr float kLimb = 0.75F;
// A channel may be clipped from this grey level on. Tuned by hand on synthetic images; outline_ranging_test.cpp,
// SaturatedLandmarksAreFlaggedOrLeftOut, exercises it but does not fix it.
constexpr int kClipped = 253;
// A pixel counts as wholly the landmark's from this coverage on. Tuned by hand on synthetic images; no test fixes it.
constexpr float kWhole = 0.999F;
// An edge sample is used only if the pixels of the landmark's colour have at least this coverage. Tuned by hand on
// synthetic images; outline_ranging_test.cpp, ThinLandmarksAreFoundByTheirCoverage, exercises it but does not fix it.
constexpr float kLeastCover = 0.3F;

/// Returns the first pixel at or beyond a position along a row or column, in a direction.
int first_beyond(double from, double direction) {
  return static_cast<int>(direction > 0 ? std::ceil(from) : std::floor(from));
}

/// Returns the lower-fifth quantile of a variance with this many degrees of freedom, over its mean (Wilson and
/// Hilferty).
double lower_fifth_of_variances(int degrees) {
  constexpr double kLowerFifth = -0.8416;  // that quantile of the normal distribution
  const double spread = 2 / (9.0 * degrees);
  const double root = 1 - spread + kLowerFifth * std::sqrt(spread);
  return root * root * root;
}

/// The colour to one side of the outline in one row or column: the mean of some pixels.
struct Colour {
  std::array<float, 3> linear{};
  std::array<std::uint8_t, 3> code{};
  int pixels = 0;
};

/// The data of one row or column, before neighbours are averaged.
struct Crossing {
  EdgeSample edge_sample;
  bool is_row;  // the outline runs along columns here, and is crossed along a row
  int line;     // that row's or column's number
  double at;    // position along it at which the outline crosses
  Eigen::Vector2d place_px;
  Eigen::Vector2d outwards;       // the outline's normal
  double inwards;                 // +1 or -1: the direction of the landmark
  double normal;                  // component of the outline's normal along it: > 0
  double depth_px;                // depth of the landmark along the normal
  const Outline::Strand* strand;  // of a banded landmark
  bool is_good;
  bool is_left_out;  // shows no band alone, or is beside a band that is as light as the background
  float cover;       // coverage of the pixels of `inside`: below 1 where the landmark is too thin for whole ones
  Colour inside, outside;
};

/// Running sums over crossings: the mean over any interval follows from a difference.
struct Sums {
  std::array<double, 3> inside{}, outside{};  // linear light
  double inside_weight = 0, inside_cover = 0;
  double crossings = 0, outside_variance = 0;

  void add(const Crossing& c) {
    // The weight is the information on the landmark's colour: pixels that it covers by half carry half as much.
    const double weight = c.inside.pixels * double(c.cover);
    inside_weight += weight;
    inside_cover += weight * c.cover;
    // Each row's background has the same weight: where a seam leaves a row few pixels, its neighbours may show another
    // background.
    crossings += 1;
    outside_variance += 1.0 / c.outside.pixels;
    for (std::size_t k = 0; k < 3; ++k) {
      inside[k] += weight * c.inside.linear[k];
      outside[k] += c.outside.linear[k];
    }
  }
};

/// Linear light on both sides of a place on the outline.
struct Sides {
  std::array<float, 3> inside, outside;
  float inside_noise, outside_noise;  ///< their variances over that of a pixel
};
Sides between(const Sums& begin, const Sums& end) {
  Sides sides{};
  const double weight = end.inside_weight - begin.inside_weight;
  // Pixels of a thin landmark are mixtures, which hold this share of the landmark's own colour.
  const double cover = (end.inside_cover - begin.inside_cover) / weight;
  const double crossings = end.crossings - begin.crossings;
  for (std::size_t k = 0; k < 3; ++k) {
    const double seen = (end.inside[k] - begin.inside[k]) / weight;
    const double outside = (end.outside[k] - begin.outside[k]) / crossings;
    sides.inside[k] = static_cast<float>(outside + (seen - outside) / cover);
    sides.outside[k] = static_cast<float>(outside);
  }
  sides.inside_noise = static_cast<float>(1 / (weight * cover));
  sides.outside_noise = static_cast<float>((end.outside_variance - begin.outside_variance) / (crossings * crossings));
  return sides;
}

/// Returns whether the colours on both sides are nearly as light as each other. The light of a band changes towards its
/// side by a tenth and more, and such a change is then no small share of the contrast.
bool is_faint(const Crossing& c) {
  float inside = 0;
  float outside = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    inside += c.inside.linear[k];
    outside += c.outside.linear[k];
  }
  return std::abs(inside - outside) < kLeastDifference * std::max(inside, outside);
}

/// The image of an upright landmark.
struct Wedge {
  Eigen::Vector2d tip_px;
  Eigen::Vector2d axis;  ///< unit vector
  double slope;          ///< half its width over the distance from the tip
  double sag;            ///< how much nearer to the tip a circle round it is at its sides, as a share of the distance
};
Wedge wedge_of(const Outline& outline) {
  const Eigen::Vector2d near_px = outline.near.pixel_px - outline.tip_px;
  const double half_px = outline.vertices[Outline::kSideSegments].chord_px / 2;
  const Eigen::Vector2d side_px = outline.vertices[Outline::kSideSegments].pixel_px - outline.tip_px;
  const Eigen::Vector2d axis = near_px.normalized();
  return {outline.tip_px, axis, half_px / side_px.dot(axis), 1 - side_px.dot(axis) / near_px.norm()};
}

class Reader {
 public:
  Reader(const cv::Mat& rgb, const ColourTable& table, const Surface& surface, const Wedge& wedge,
         const SampleReach& reach)
      : rgb_(rgb), table_(table), surface_(surface), wedge_(wedge), reach_(reach) {}

  /// Reads the colours beside the outline. Returns false where they are not in the image.
  bool read_colours(Crossing& c, std::vector<double>& scatter) const {
    const double width = c.depth_px / c.normal;
    const double clear_px = width - 2 * reach_.colours_px;
    double inner = reach_.colours_px;
    int samples = 1;
    c.cover = 1;
    if (clear_px >= 1) {
      samples = std::min(reach_.samples, static_cast<int>(clear_px));
    } else {
      inner = std::min(inner, width / 2 - 0.5);
      const double inside_px = (first_beyond(c.at + c.inwards * inner, c.inwards) - c.at) * c.inwards * c.normal;
      const double wide = c.edge_sample.wide * reach_.measured_blur_px;
      const double narrow = c.edge_sample.narrow * reach_.measured_blur_px;
      const auto seen = static_cast<float>(coverage(inside_px, wide, narrow).value +
                                           coverage(c.depth_px - inside_px, wide, narrow).value - 1);
      if (seen < kWhole) c.cover = std::max(seen, 0.F);
    }
    int squares = 0;
    if (!read(c, c.at - c.inwards * reach_.colours_px, -c.inwards, reach_.samples, nullptr, c.outside, squares)) {
      return false;
    }
    if (c.outside.pixels == reach_.samples) scatter.push_back(variance(c.outside.pixels, squares));
    const Outline::Band* band = c.strand != nullptr ? &c.strand->inside : nullptr;
    if (!read(c, c.at + c.inwards * inner, c.inwards, samples, band, c.inside, squares)) return false;
    if (c.edge_sample.part != Outline::kArc && inner + kLimbSamples <= width / 2 &&
        (band == nullptr || c.inside.pixels >= kLimbSamples)) {
      darken(c, inner);
    }
    return true;
  }

  /// Returns whether there is a pixel of one band alone on the inner side of a band's side, or on either side of the
  /// edge between two bands, whose colours are then read.
  [[nodiscard]] bool reads_bands(Crossing& c) const {
    const Outline::Strand& strand = *c.strand;
    if (strand.outside) {
      c.cover = 1;
      return read_band(strand.inside, c, -c.outwards, c.inside) && read_band(*strand.outside, c, c.outwards, c.outside);
    }
    return is_on(strand.inside, pixel_at(c, first_beyond(c.at + c.inwards * reach_.colours_px, c.inwards)));
  }

  /// Returns whether the colour inside is the landmark's and the colour outside is not. The edge of a band is between
  /// two of the landmark's, and beside a side of bands anything may be.
  [[nodiscard]] bool is_landmark(const Crossing& c) const {
    if (surface_.label == 0) {
      if (c.cover >= 1 && is_light(c.inside) != c.strand->inside.is_light) return false;
      return !c.strand->outside || is_light(c.outside) == c.strand->outside->is_light;
    }
    if (table_.label(c.outside.code.data()) == surface_.label) return false;
    return c.cover < 1 || table_.label(c.inside.code.data()) == surface_.label;
  }

  /// Reads the pixels that the outline may cross.
  void read_pixels(const Crossing& c, const Sides& sides, EdgeSamples& edge_samples, EdgeSample& edge_sample) const {
    std::array<float, 3> difference{};
    std::array<float, 3> weight{};
    float contrast = 0;
    bool clipped = false;
    for (std::size_t i = 0; i < 3; ++i) {
      difference[i] = sides.inside[i] - sides.outside[i];
      const bool cut = c.inside.code[i] >= kClipped || c.outside.code[i] >= kClipped;
      clipped = clipped || cut;
      weight[i] = cut ? 0.F : 2 / (1 / table_.weight_of(sides.inside[i]) + 1 / table_.weight_of(sides.outside[i]));
      contrast += weight[i] * difference[i] * difference[i];
    }
    edge_sample.is_usable = contrast > kLeastContrast * kLeastContrast;
    if (!edge_sample.is_usable) {
      edge_samples.too_bright += clipped ? 1 : 0;
      return;
    }
    const int begin = static_cast<int>(std::ceil(c.at - reach_.colours_px));
    const int end = static_cast<int>(std::floor(c.at + reach_.colours_px));
    for (int i = begin; i <= end; ++i) {
      const double inside_px = (i - c.at) * c.inwards * c.normal;
      // A pixel of a thin landmark belongs to the nearer side.
      if (inside_px > edge_sample.width_px / 2) continue;
      const std::uint8_t* p = pixel(c, i);
      // Noise is in the code, so a channel carries more information where it is dark: weight by the expected pixel.
      const auto expected = static_cast<float>(
          coverage(inside_px, edge_sample.wide * reach_.blur_px, edge_sample.narrow * reach_.blur_px).value);
      float sum = 0;
      float square = 0;
      float information = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const float off = table_.linear(p[k]) - sides.outside[k];
        const float w = weight[k] > 0 ? table_.weight_of(sides.outside[k] + expected * difference[k]) : 0;
        sum += w * difference[k] * off;
        square += w * off * off;
        information += w * difference[k] * difference[k];
      }
      const float share = sum / information;
      const bool is_inside = surface_.label == 0 ? share > 0.5F : table_.label(p) == surface_.label;
      edge_samples.pixels.push_back({static_cast<float>(inside_px), share, 1 / information, is_inside});
      ++edge_sample.count;
      // The part of the colour that no mixture of the two colours explains.
      const float misfit = square / information - share * share;
      if (std::abs(inside_px) < kDoubtReach_px && share < kDoubtShare)
        edge_sample.doubt = std::max(edge_sample.doubt, misfit);
    }
    edge_sample.is_usable = edge_sample.count > 0;
    edge_sample.inside_noise = sides.inside_noise;
    edge_sample.outside_noise = sides.outside_noise;
    edge_sample.doubt =
        std::max(0.F, edge_sample.doubt - static_cast<float>(kDoubtVariances * edge_samples.code_variance) / contrast);
  }

  [[nodiscard]] bool in_image(const Crossing& c) const {
    const int along = length(c);
    const int lines = c.is_row ? rgb_.rows : rgb_.cols;
    return c.line >= 0 && c.line < lines && c.at - reach_.colours_px >= 0 && c.at + reach_.colours_px <= along - 1;
  }

 private:
  [[nodiscard]] bool is_light(const Colour& colour) const {
    return (colour.linear[0] + colour.linear[1] + colour.linear[2]) / 3 > surface_.limit_of_light;
  }
  /// Corrects the colour inside for shading. The light of a matt cylinder falls (or rises) towards its limb as the sine
  /// of the angle from the limb. Between edge and nearest sample it changes by three quarters of the change between the
  /// nearest and the third sample, whatever the cylinder's size.
  void darken(Crossing& c, double inner) const {
    const int step = c.inwards > 0 ? 1 : -1;
    const int nearest = first_beyond(c.at + c.inwards * inner, c.inwards);
    const int third = nearest + (kLimbSamples - 1) * step;
    if (third < 0 || third >= length(c)) return;
    float near = 0;
    float far = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      near += table_.linear(pixel(c, nearest)[k]);
      far += table_.linear(pixel(c, third)[k]);
    }
    const float mean = c.inside.linear[0] + c.inside.linear[1] + c.inside.linear[2];
    const float factor = std::clamp((near + kLimb * (near - far)) / std::max(mean, 1e-6F), 0.5F, 1.5F);
    for (float& x : c.inside.linear) x *= factor;
  }
  [[nodiscard]] int length(const Crossing& c) const { return c.is_row ? rgb_.cols : rgb_.rows; }
  [[nodiscard]] const std::uint8_t* pixel(const Crossing& c, int i) const {
    return c.is_row ? rgb_.ptr<std::uint8_t>(c.line) + std::ptrdiff_t(3) * i
                    : rgb_.ptr<std::uint8_t>(i) + std::ptrdiff_t(3) * c.line;
  }

  [[nodiscard]] static cv::Point pixel_at(const Crossing& c, int i) {
    return c.is_row ? cv::Point(i, c.line) : cv::Point(c.line, i);
  }
  /// Returns the nearest pixels of a band alone from the edge between two on, across that edge: light changes round the
  /// landmark, and across the edge it does not.
  [[nodiscard]] std::vector<cv::Point> pixels_on(const Outline::Band& band, const Crossing& c,
                                                 const Eigen::Vector2d& direction) const {
    constexpr double kStep_px = 0.5;
    std::vector<cv::Point> pixels;
    const double most_px = reach_.colours_px + reach_.samples + 1;
    for (double way_px = reach_.colours_px; way_px < most_px && int(pixels.size()) < reach_.samples;
         way_px += kStep_px) {
      const Eigen::Vector2d p = c.place_px + way_px * direction;
      const cv::Point pixel(static_cast<int>(std::lround(p.x())), static_cast<int>(std::lround(p.y())));
      if (!pixels.empty() && pixel == pixels.back()) continue;
      if (cv::Rect({0, 0}, rgb_.size()).contains(pixel) && is_on(band, pixel)) pixels.push_back(pixel);
    }
    return pixels;
  }
  [[nodiscard]] bool read_band(const Outline::Band& band, const Crossing& c, const Eigen::Vector2d& direction,
                               Colour& colour) const {
    const std::vector<cv::Point> pixels = pixels_on(band, c, direction);
    if (pixels.empty()) return false;
    std::array<int, 3> sum{};
    for (const cv::Point& at : pixels) {
      const auto* p = rgb_.ptr<std::uint8_t>(at.y) + std::ptrdiff_t(3) * at.x;
      for (std::size_t k = 0; k < 3; ++k) {
        colour.linear[k] += table_.linear(p[k]) / float(pixels.size());
        sum[k] += p[k];
      }
    }
    colour.pixels = static_cast<int>(pixels.size());
    for (std::size_t k = 0; k < 3; ++k) colour.code[k] = static_cast<std::uint8_t>(sum[k] / colour.pixels);
    return true;
  }
  /// Returns whether a pixel shows a band alone: no other band, and nothing beside the landmark. The landmark is a
  /// wedge that points at the tip.
  [[nodiscard]] bool is_on(const Outline::Band& band, const cv::Point& pixel) const {
    const Eigen::Vector2d from_tip = Eigen::Vector2d(pixel.x, pixel.y) - wedge_.tip_px;
    const double along_px = from_tip.dot(wedge_.axis);
    const double across_px = std::abs(from_tip.x() * wedge_.axis.y() - from_tip.y() * wedge_.axis.x());
    const double clear_px = kClear * reach_.blur_px;
    const double half_px = along_px * wedge_.slope;
    if (across_px > half_px - clear_px) return false;
    // A circle round the landmark is seen nearer to the tip at its sides than at its near point.
    const double aside = across_px / half_px;
    const double as_near_px = along_px / (1 - wedge_.sag * (1 - std::sqrt(1 - aside * aside)));
    return as_near_px >= band.from_px + clear_px && as_near_px <= band.to_px - clear_px;
  }
  /// Reads the nearest pixel and those behind it that look alike, because a line of the background must not be mixed
  /// in. Returns false where there is no pixel.
  /// @param band null: anything
  /// @param squares sum of squares of the codes about their mean, times the number of pixels
  bool read(const Crossing& c, double from, double direction, int samples, const Outline::Band* band, Colour& colour,
            int& squares) const {
    const int step = direction > 0 ? 1 : -1;
    const int begin = first_beyond(from, direction);
    if (begin < 0 || begin >= length(c)) return false;
    samples = std::min(samples, step > 0 ? length(c) - begin : begin + 1);
    const std::ptrdiff_t stride = step * (c.is_row ? std::ptrdiff_t(3) : std::ptrdiff_t(rgb_.step));
    const std::uint8_t* const nearest = pixel(c, begin);
    const std::uint8_t* p = nearest;
    std::array<float, 3> light{};
    std::array<int, 3> sum{};
    std::array<int, 3> square{};
    int taken = 0;
    for (; taken < samples; ++taken, p += stride) {
      const auto differs = [&](std::size_t k) { return std::abs(p[k] - nearest[k]) > kAlike; };
      if (differs(0) || differs(1) || differs(2)) break;
      if (band != nullptr && !is_on(*band, pixel_at(c, begin + taken * step))) break;
      for (std::size_t k = 0; k < 3; ++k) {
        light[k] += table_.linear(p[k]);
        sum[k] += p[k];
        square[k] += p[k] * p[k];
      }
    }
    if (taken == 0) return false;
    squares = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      colour.linear[k] = light[k] / float(taken);
      colour.code[k] = static_cast<std::uint8_t>((sum[k] + taken / 2) / taken);
      squares += taken * square[k] - sum[k] * sum[k];
    }
    colour.pixels = taken;
    return true;
  }
  /// Returns the variance of one channel's code.
  static double variance(int pixels, int squares) { return double(squares) / pixels / (3.0 * (pixels - 1)); }

  const cv::Mat& rgb_;
  const ColourTable& table_;
  Surface surface_;
  Wedge wedge_;
  SampleReach reach_;
};

Outline::Part part_of(int segment) {
  if (segment < Outline::kSideSegments) return Outline::kLeft;
  return segment < Outline::kSideSegments + Outline::kArcSegments ? Outline::kArc : Outline::kRight;
}

/// A segment of an outline or of a strand, and what is known of it.
struct Segment {
  const Outline::Vertex &a, &b;
  Outline::Part part;
  Eigen::Vector2d inside_px;  ///< a place on the inner side
  const Outline::Strand* strand = nullptr;
};

/// Finds where one segment crosses rows (or columns, whichever are nearer to its normal).
/// @param across Outline::across()
void cross(const Segment& segment, const Eigen::Vector2d& across, int stride, std::vector<Crossing>& crossings) {
  const Outline::Vertex& a = segment.a;
  const Outline::Vertex& b = segment.b;
  const Eigen::Vector2d along = b.pixel_px - a.pixel_px;
  const double length = along.norm();
  if (!(length > 0)) return;
  Eigen::Vector2d chord_normal(along.y() / length, -along.x() / length);
  if (chord_normal.dot(a.pixel_px + along / 2 - segment.inside_px) < 0) chord_normal = -chord_normal;  // outwards
  const bool is_row = std::abs(chord_normal.x()) >= std::abs(chord_normal.y());
  const int line_axis = is_row ? 1 : 0;
  const int cross_axis = 1 - line_axis;
  const double from = a.pixel_px[line_axis];
  const double to = b.pixel_px[line_axis];
  if (from == to) return;
  // The interval is half-open, so a line at a vertex is crossed once.
  const int first = static_cast<int>(std::ceil(std::min(from, to)));
  const int last = static_cast<int>(std::ceil(std::max(from, to))) - 1;
  const auto add = [&](int line) {
    if (line % stride != 0) return;
    const double u = (line - from) / (to - from);
    // A pixel's coverage by a curved edge is that of a straight edge that lies inwards by curvature / 24, the mean of
    // the parabola over a pixel. The bulge is curvature length^2 / 8.
    const Eigen::Vector2d bulge = (4 * u * (1 - u) - 1 / (3 * length * length)) * a.bulge_px;
    Crossing c{};
    c.edge_sample.part = segment.part;
    c.strand = segment.strand;
    c.edge_sample.bend_px = static_cast<float>(a.bulge_px.dot(chord_normal) / (3 * length * length));
    c.is_row = is_row;
    c.line = line;
    c.inwards = chord_normal[cross_axis] > 0 ? -1 : 1;
    // The bulge moves the outline along the chord's normal; its distance along the row or column is longer.
    c.at = a.pixel_px[cross_axis] + u * along[cross_axis] -
           c.inwards * bulge.dot(chord_normal) / std::abs(chord_normal[cross_axis]);
    c.edge_sample.row = static_cast<float>(is_row ? line : c.at);
    // Use the parabola's own normal there: the chord's normal differs by some degrees.
    const Eigen::Vector2d tangent = along + 4 * (1 - 2 * u) * a.bulge_px;
    Eigen::Vector2d normal = Eigen::Vector2d(tangent.y(), -tangent.x()).normalized();
    if (normal.dot(chord_normal) < 0) normal = -normal;
    c.normal = std::abs(normal[cross_axis]);
    c.outwards = normal;
    c.place_px = is_row ? Eigen::Vector2d(c.at, line) : Eigen::Vector2d(line, c.at);
    c.edge_sample.wide = static_cast<float>(c.normal);
    c.edge_sample.narrow = static_cast<float>(std::abs(normal[line_axis]));
    c.edge_sample.by_range_pxpm =
        static_cast<float>(normal.dot(a.by_range_pxpm + u * (b.by_range_pxpm - a.by_range_pxpm)));
    c.edge_sample.by_bearing_pxprad =
        static_cast<float>(normal.dot(a.by_bearing_pxprad + u * (b.by_bearing_pxprad - a.by_bearing_pxprad)));
    c.edge_sample.by_width_px = static_cast<float>(normal.dot(a.by_width_px + u * (b.by_width_px - a.by_width_px)));
    c.edge_sample.by_height_pxpm =
        static_cast<float>(normal.dot(a.by_height_pxpm + u * (b.by_height_pxpm - a.by_height_pxpm)));
    c.edge_sample.by_lean_px = static_cast<float>(normal.dot(a.by_lean_px + u * (b.by_lean_px - a.by_lean_px)));
    c.edge_sample.width_px = static_cast<float>(a.width_px + u * (b.width_px - a.width_px));
    const double chord_px = a.chord_px + u * (b.chord_px - a.chord_px);
    c.depth_px = chord_px / std::max(std::abs(normal.dot(across)), 1e-3);
    if (c.strand != nullptr && c.strand->outside) c.depth_px = kDeep_px;
    crossings.push_back(c);
  };
  if (from < to) {
    for (int line = first; line <= last; ++line) add(line);
  } else {
    for (int line = last; line >= first; --line) add(line);
  }
}

}  // namespace

void EdgeSamples::clear() {
  edge_samples.clear();
  pixels.clear();
  too_bright = 0;
  code_variance = 0;
}

void read_edge_samples(const cv::Mat& rgb, const ColourTable& table, const Surface& surface, const Outline& outline,
                       const SampleReach& reach, int stride, EdgeSamples& edge_samples) {
  edge_samples.clear();
  const Reader reader(rgb, table, surface, wedge_of(outline), reach);
  const Eigen::Vector2d middle =
      (outline.vertices.front().pixel_px + outline.vertices.back().pixel_px + outline.near.pixel_px) / 3;
  std::vector<Crossing> crossings;
  crossings.reserve(1024 / std::size_t(stride));
  const Eigen::Vector2d across = outline.across();
  if (surface.label != 0) {
    for (int i = 0; i + 1 < Outline::kVertices; ++i) {
      const auto k = std::size_t(i);
      cross({outline.vertices[k], outline.vertices[k + 1], part_of(i), middle}, across, stride, crossings);
    }
  }
  for (const Outline::Strand& strand : outline.strands) {
    const Eigen::Vector2d inside_px = strand.part == Outline::kArc ? outline.tip_px : middle;
    for (std::size_t i = 0; i + 1 < strand.vertices.size(); ++i) {
      cross({strand.vertices[i], strand.vertices[i + 1], strand.part, inside_px, &strand}, across, stride, crossings);
    }
  }
  for (Crossing& c : crossings) c.is_left_out = c.strand != nullptr && !reader.reads_bands(c);
  std::erase_if(crossings, [](const Crossing& c) { return c.is_left_out; });
  std::vector<double> scatter;
  scatter.reserve(crossings.size());
  std::vector<Sums> sums(crossings.size() + 1);
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    Crossing& c = crossings[i];
    const bool is_read = c.strand != nullptr && c.strand->outside;
    c.is_good = reader.in_image(c) && (is_read || reader.read_colours(c, scatter)) && reader.is_landmark(c);
    c.is_left_out = c.is_good && c.strand != nullptr && !c.strand->outside && is_faint(c);
    if (c.is_left_out) c.is_good = false;
    sums[i + 1] = sums[i];
    if (c.is_good) sums[i + 1].add(c);
  }
  if (!scatter.empty()) {
    // Texture only adds to the variance, so its lower fifth gives the noise.
    const auto fifth = scatter.begin() + std::ptrdiff_t(scatter.size() / 5);
    std::nth_element(scatter.begin(), fifth, scatter.end());
    edge_samples.code_variance = *fifth / lower_fifth_of_variances(3 * (reach.samples - 1));
  }

  // A side or the arc crosses rows, or columns, in runs: neighbours are taken from the same run only.
  std::size_t run_begin = 0;
  std::size_t run_end = 0;
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const Crossing& c = crossings[i];
    if (c.is_left_out) continue;
    if (i >= run_end) {
      run_begin = run_end = i;
      while (run_end < crossings.size() && crossings[run_end].edge_sample.part == c.edge_sample.part &&
             crossings[run_end].is_row == c.is_row && crossings[run_end].strand == c.strand) {
        ++run_end;
      }
    }
    EdgeSample edge_sample = c.edge_sample;
    edge_sample.is_usable = false;
    edge_sample.first = int(edge_samples.pixels.size());
    if (c.is_good && c.cover >= kLeastCover) {
      const std::size_t begin = i > run_begin + kNeighbours ? i - kNeighbours : run_begin;
      const std::size_t end = std::min(i + kNeighbours + 1, run_end);
      reader.read_pixels(c, between(sums[begin], sums[end]), edge_samples, edge_sample);
    }
    edge_samples.edge_samples.push_back(edge_sample);
  }
}

}  // namespace twocone::vision
