// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/render/native/noise.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/sim_povray/render/native/shuffled_integers.h"

namespace twocone::sim_povray {
namespace {

// The entry of the permutation that belongs to the lattice planes through the origin: measured.
constexpr std::int64_t kEntryOfOrigin = 1808;
// A lattice point has one of this many sets of coefficients.
constexpr std::size_t kSets = 256;
// A set is a window of the table: four numbers for each of up to three components.
constexpr std::size_t kNumbersPerComponent = 4;
constexpr std::size_t kCoefficients = kSets + 3 * kNumbersPerComponent - 1;

// From -1 to 1. Solved for from the noise and the vector noise that POV-Ray prints in 17 digits around one lattice
// point of each set: all of them agree with these six digits to 1e-14.
constexpr std::array<double, kCoefficients> kNumbers{
    -1,         0.604974,  -0.937102,   0.414115,   0.576226,   -0.0161593, 0.432334,  0.103685,  0.590539,   0.0286412,
    0.46981,    -0.84622,  -0.0734112,  -0.304097,  -0.40206,   -0.210132,  -0.919127, 0.652033,  -0.83151,   -0.183948,
    -0.671107,  0.852476,  0.043595,    -0.404532,  0.75494,    -0.335653,  0.618433,  0.605707,  0.708583,   -0.477195,
    0.899474,   0.490623,  0.221729,    -0.400381,  -0.853727,  -0.932586,  0.659113,  0.961303,  0.325948,   -0.750851,
    0.842466,   0.734401,  -0.649866,   0.394491,   -0.466056,  -0.434073,  0.109026,  0.0847028, -0.738857,  0.241505,
    0.16228,    -0.71426,  -0.883665,   -0.150408,  -0.90396,   -0.686549,  -0.785214, 0.488548,  0.0246433,  0.142473,
    -0.602136,  0.375845,  -0.00779736, 0.498955,   -0.268147,  0.856382,   -0.386007, -0.596094, -0.867735,  -0.570977,
    -0.914366,  0.28896,   0.672206,    -0.233783,  0.94815,    0.895262,   0.343252,  -0.173388, -0.767971,  -0.314748,
    0.824308,   -0.342092, 0.721431,    -0.24004,   -0.63653,   0.553277,   0.376272,  0.158984,  -0.452659,  0.396323,
    -0.420676,  -0.454154, 0.122179,    0.295857,   0.0664225,  -0.202075,  -0.724788, 0.453513,  0.224567,   -0.908812,
    0.176349,   -0.320516, -0.697139,   0.742702,   -0.900786,  0.471489,   -0.133532, 0.119127,  -0.889769,  -0.23183,
    -0.669673,  -0.046891, -0.803433,   -0.966735,  0.475578,   -0.652644,  0.0112459, -0.730007, 0.128283,   0.145647,
    -0.619318,  0.272023,  0.392966,    0.646418,   -0.0207675, -0.315908,  0.480797,  0.535668,  -0.250172,  -0.83093,
    -0.653773,  -0.443809, 0.119982,    -0.897642,  0.89453,    0.165789,   0.633875,  -0.886839, 0.930877,   -0.537194,
    0.587732,   0.722011,  -0.209461,   -0.0424659, -0.814267,  -0.919432,  0.280262,  -0.66302,  -0.558099,  -0.537469,
    -0.598779,  0.929656,  -0.170794,   -0.537163,  0.312581,   0.959442,   0.722652,  0.499931,  0.175616,   -0.534874,
    -0.685115,  0.444999,  0.17171,     0.108202,   -0.768704,  -0.463828,  0.254231,  0.546014,  0.869474,   0.875212,
    -0.944427,  0.130724,  -0.110185,   0.312184,   -0.33138,   -0.629206,  0.0606546, 0.722866,  -0.0979477, 0.821561,
    0.0931258,  -0.972808, 0.0318151,   -0.867033,  -0.387228,  0.280995,   -0.218189, -0.539178, -0.427359,  -0.602075,
    0.311971,   0.277974,  0.773159,    0.592493,   -0.0331884, -0.630854,  -0.269947, 0.339132,  0.581079,   0.209461,
    -0.317433,  -0.284993, 0.181323,    0.341634,   0.804959,   -0.229572,  -0.758907, -0.336721, 0.605463,   -0.991272,
    -0.0188754, -0.300191, 0.368307,    -0.176135,  -0.3832,    -0.749569,  0.62356,   -0.573938, 0.278309,   -0.971313,
    0.839994,   -0.830686, 0.439078,    0.66128,    0.694514,   0.0565042,  0.54342,   -0.438804, -0.0228428, -0.687068,
    0.857267,   0.301991,  -0.494255,   -0.941039,  0.775509,   0.410575,   -0.362081, -0.671534, -0.348379,  0.932433,
    0.886442,   0.868681,  -0.225666,   -0.062211,  -0.0976425, -0.641444,  -0.848112, 0.724697,  0.473503,   0.998749,
    0.174701,   0.559625,  -0.029099,   -0.337392,  -0.958129,  -0.659785,  0.236042,  -0.246937, 0.659449,   -0.027512,
    0.821897,   -0.226215, 0.0181735,   0.500481,   -0.420127,  -0.427878,  0.566186};

/// Where a coordinate lies between two planes of the lattice.
struct LatticePlace {
  explicit LatticePlace(double at) {
    auto plane = static_cast<std::int64_t>(at);
    if (at < static_cast<double>(plane)) --plane;
    offset[0] = at - static_cast<double>(plane);
    offset[1] = offset[0] - 1;
    weight[1] = offset[0] * offset[0] * (3 - 2 * offset[0]);
    weight[0] = 1 - weight[1];
    index[0] = static_cast<std::uint32_t>(plane + kEntryOfOrigin) % kShuffledCount;
    index[1] = (index[0] + 1) % kShuffledCount;
  }

  std::array<std::size_t, 2> index;
  std::array<double, 2> offset;
  std::array<double, 2> weight;
};

/// Calls `add` for each corner of p's cell with the corner's coefficients, p relative to the corner, and the weight.
template <typename Add>
void for_each_corner(const Vec3& p, const Add& add) {
  const LatticePlace x(p.x), y(p.y), z(p.z);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      const std::size_t row = kShuffled[kShuffled[x.index[i]] ^ y.index[j]];
      const double row_weight = x.weight[i] * y.weight[j];
      for (std::size_t k = 0; k < 2; ++k) {
        const double* numbers = &kNumbers[kShuffled[row ^ z.index[k]] % kSets];
        add(numbers, Vec3{x.offset[i], y.offset[j], z.offset[k]}, row_weight * z.weight[k]);
      }
    }
  }
}

/// The linear function that a corner contributes to one component.
double at_corner(const double* numbers, const Vec3& offset) {
  return 0.5 * numbers[0] + (numbers[1] * offset.x + numbers[2] * offset.y + numbers[3] * offset.z);
}

}  // namespace

double noise(const Vec3& p) {
  // Noise generator 2 maps the sum, which may leave the range from 0 to 1, by these numbers.
  constexpr double kShift = 0.5 + 0.55242;
  constexpr double kScale = 0.48985582;
  double sum = 0;
  for_each_corner(p, [&sum](const double* numbers, const Vec3& offset, double weight) {
    sum += weight * at_corner(numbers, offset);
  });
  return std::clamp((sum + kShift) * kScale, 0.0, 1.0);
}

Vec3 vector_noise(const Vec3& p) {
  Vec3 sum;
  for_each_corner(p, [&sum](const double* numbers, const Vec3& offset, double weight) {
    sum.x += weight * at_corner(numbers, offset);
    sum.y += weight * at_corner(numbers + kNumbersPerComponent, offset);
    sum.z += weight * at_corner(numbers + 2 * kNumbersPerComponent, offset);
  });
  return sum;
}

Vec3 turbulence(const Vec3& p, const Turbulence& turbulence) {
  constexpr int kMostOctaves = 10;  // POV-Ray takes no more, without a word
  // POV-Ray keeps these two numbers in single precision.
  const double lambda = static_cast<float>(turbulence.lambda);
  const double omega = static_cast<float>(turbulence.omega);
  Vec3 sum = vector_noise(p);
  double frequency = 1;
  double amplitude = 1;
  for (int octave = 1; octave < std::min(turbulence.octaves, kMostOctaves); ++octave) {
    frequency *= lambda;
    amplitude *= omega;
    sum += vector_noise(p * frequency) * amplitude;
  }
  return sum;
}

}  // namespace twocone::sim_povray
