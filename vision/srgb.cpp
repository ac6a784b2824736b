// SPDX-License-Identifier: Apache-2.0
#include "vision/srgb.h"

#include <cmath>

namespace twocone::vision {

double srgb_to_linear(double code) {
  const double coded = code / 255;
  return coded <= 0.04045 ? coded / 12.92 : std::pow((coded + 0.055) / 1.055, 2.4);
}

double linear_to_srgb(double light) {
  return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055);
}

double light_per_grey(double code) {
  const double coded = code / 255;
  return (coded <= 0.04045 ? 1 / 12.92 : 2.4 / 1.055 * std::pow((coded + 0.055) / 1.055, 1.4)) / 255;
}

const std::array<float, 256>& light_of_code() {
  static const std::array<float, 256> kLight = [] {
    std::array<float, 256> light{};
    for (std::size_t code = 0; code < light.size(); ++code) light[code] = float(srgb_to_linear(double(code)));
    return light;
  }();
  return kLight;
}

cv::Mat_<float> linear_grey(const cv::Mat& rgb) {
  const std::array<float, 256>& light = light_of_code();
  cv::Mat_<float> grey(rgb.size());
  for (int row = 0; row < rgb.rows; ++row) {
    const auto* in = rgb.ptr<cv::Vec3b>(row);
    for (float& value : cv::Mat_<float>(grey.row(row))) {
      const cv::Vec3b& code = *in++;
      value = (light[code[0]] + light[code[1]] + light[code[2]]) / 3;
    }
  }
  return grey;
}

}  // namespace twocone::vision
