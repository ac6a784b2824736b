// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "apps/compare/source_tests.h"
#include "base/quantile.h"

namespace twocone::compare {
namespace {

struct MeanSigma {
  double mean = 0, sigma = 0;
};

/// Returns the mean of a series. Its sigma is from the scatter of the means of kStretches parts, because neighbours are
/// correlated.
MeanSigma mean_of(const std::vector<double>& series) {
  constexpr std::size_t kStretches = 8;
  MeanSigma result;
  for (const double value : series) result.mean += value / double(series.size());
  if (series.size() < 2 * kStretches) {
    for (const double value : series) result.sigma += (value - result.mean) * (value - result.mean);
    result.sigma = std::sqrt(result.sigma / double(std::max<std::size_t>(1, series.size() - 1)));
    return result;
  }
  for (std::size_t k = 0; k < kStretches; ++k) {
    const std::size_t from = k * series.size() / kStretches, to = (k + 1) * series.size() / kStretches;
    double mean = 0;
    for (std::size_t i = from; i < to; ++i) mean += series[i] / double(to - from);
    result.sigma += (mean - result.mean) * (mean - result.mean);
  }
  result.sigma = std::sqrt(result.sigma / double(kStretches * (kStretches - 1)));
  return result;
}

void add_gain(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kExposureAndColour, view);
  constexpr std::size_t kLeastPairs = 3;
  if (images.transfers.size() < kLeastPairs) {
    source.reason = fmt::format("{} pairs of images show nearly the same view, but {} are needed",
                                images.transfers.size(), kLeastPairs);
    return;
  }
  const auto series = [&](const auto& of) {
    std::vector<double> values;
    for (const vision::Transfer& t : images.transfers) values.push_back(of(t));
    return mean_of(values);
  };
  constexpr std::array<const char*, 3> kNames{"gain.red", "gain.green", "gain.blue"};
  for (std::size_t c = 0; c < kNames.size(); ++c) {
    const MeanSigma log_gain = series([c](const vision::Transfer& t) { return t.log_gain[c]; });
    const double gain = std::exp(log_gain.mean);
    source.components.push_back({kNames[c], "1", 1, gain, gain * std::hypot(log_gain.sigma, kModel.log_gain)});
  }
  const MeanSigma vignetting = series([](const vision::Transfer& t) { return t.vignetting; });
  source.components.push_back({"vignetting", "1", 0, vignetting.mean, std::hypot(vignetting.sigma, kModel.vignetting)});
  judge(source);
}

void add_noise(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kNoise, view);
  const auto a = vision::fit_noise(images.simulated_noise);
  const auto b = vision::fit_noise(images.real_noise);
  // An uncertainty of some grey levels comes from a few tiles that are not uniform.
  constexpr double kMostSigma_grey = 1;
  const auto is_determined = [](const auto& noise) { return noise && noise->sigma_noise_grey <= kMostSigma_grey; };
  if (!is_determined(a) || !is_determined(b)) {
    source.reason = fmt::format("the {} images have too few uniform areas", is_determined(b) ? "simulated" : "real");
    return;
  }
  source.components.push_back(
      {"noise", "grey", a->noise_grey, b->noise_grey, std::hypot(a->sigma_noise_grey, b->sigma_noise_grey)});
  judge(source);
}

void add_blur(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  Source& source = add_source(sources, Cause::kSharpness, view);
  if (images.simulated_blur_px.empty() || images.real_blur_px.empty()) {
    source.reason =
        fmt::format("the {} images have no sharp edges", images.real_blur_px.empty() ? "real" : "simulated");
    return;
  }
  const auto sigma = [](const std::vector<double>& values) { return mean_of(values).sigma; };
  source.components.push_back(
      {"blur", "px", base::quantile(images.simulated_blur_px, 0.5), base::quantile(images.real_blur_px, 0.5),
       std::hypot(sigma(images.simulated_blur_px), sigma(images.real_blur_px), kModel.blur_px)});
  judge(source);
}

}  // namespace

void add_image_sources(const ViewImages& images, vision::Side view, std::vector<Source>& sources) {
  add_gain(images, view, sources);
  add_noise(images, view, sources);
  add_blur(images, view, sources);
}

}  // namespace twocone::compare
