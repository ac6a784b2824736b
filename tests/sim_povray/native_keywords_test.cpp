// SPDX-License-Identifier: Apache-2.0
// The native tracer compared with POV-Ray, one small scene for each keyword of the scene language that evaluator.h
// supports. Scenes with many keywords would not show which of them is wrong.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "drivers/sim_povray/render/native/native_view.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "tests/sim_povray/native_keyword_scenes.h"
#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"

namespace twocone::sim_povray {
namespace {

constexpr int kWidth_px = 64;
constexpr int kHeight_px = 48;
constexpr int kPixels = kWidth_px * kHeight_px;
/// The two programs add up in another order, so that a value near the middle of two bytes may go either way.
constexpr int kMostLevels = 1;
/// 0.2 % of the pixels: those whose ray passes an edge so closely that rounding decides what it meets. Measured: none
/// in any scene whose keyword both understand alike; the property most_different_px holds the worst of a group.
constexpr int kMostDifferent_px = kPixels / 500;
/// A keyword that changes fewer pixels of its group's plain scene is not tested by its scene.
constexpr int kLeastEffect_px = kPixels / 100;
/// POV-Ray sleeps for 0.6 s of the 0.64 s that such an image takes, so there may be more processes than cores.
constexpr int kProcesses = 12;

const IncludeReader kNoFiles = [](const std::string&) { return std::nullopt; };

std::string text_of(const KeywordGroup& group, const char* part) {
  return fmt::format("{}\n{}\n{}", group.before, part, group.after);
}

Result<Image> traced_image(const std::string& scene) {
  const RenderJob job = plain_image("", scene, kWidth_px, kHeight_px, 1);
  const auto view = NativeView::make(*job.view_template, "scene.pov", kNoFiles);
  if (!view) return view.error();
  Image image{kWidth_px, kHeight_px, PixelFormat::kRgb8, Bytes(std::vector<std::uint8_t>(std::size_t(kPixels) * 3))};
  const NativeView::Moment moment = (*view)->at({});
  for (int band = 0; band < (*view)->bands(); ++band) (*view)->render(moment, band, image);
  return image;
}

struct Difference {
  int pixels = 0;        ///< those that differ by more than kMostLevels
  int worst_levels = 0;  ///< in one channel
  int worst_at = 0;      ///< the number of that pixel
};

Difference difference(const Image& a, const Image& b) {
  Difference result;
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    int levels = 0;
    for (int channel = 0; channel < 3; ++channel) {
      const auto at = std::size_t(3 * pixel + channel);
      levels = std::max(levels, std::abs(int(a.bytes[at]) - int(b.bytes[at])));
    }
    if (levels > kMostLevels) ++result.pixels;
    if (levels > result.worst_levels) result.worst_levels = levels, result.worst_at = pixel;
  }
  return result;
}

class NativeKeywords : public testing::TestWithParam<const KeywordGroup*> {};

TEST_P(NativeKeywords, LookAsPovrayRendersThem) {
  const KeywordGroup& group = *GetParam();
  ProcessRenderer povray(Povray(value(find_povray("povray")), "scene.pov", kRenderLimit), kProcesses);
  std::vector<std::future<ImageResult>> references;
  for (const KeywordCase& c : group.cases) {
    references.push_back(ordered(povray, plain_image(c.keyword, text_of(group, c.scene), kWidth_px, kHeight_px, 1)));
  }
  const auto plain = traced_image(text_of(group, group.plain));
  ASSERT_TRUE(plain) << plain.error().message;
  int worst_px = 0;
  for (std::size_t i = 0; i < group.cases.size(); ++i) {
    const KeywordCase& c = group.cases[i];
    SCOPED_TRACE(fmt::format("'{}' of the {}: {}", c.keyword, group.name, c.scene));
    const auto reference = references[i].get();
    const auto image = traced_image(text_of(group, c.scene));
    EXPECT_TRUE(reference) << reference.error().message;
    if (!image && c.effect == Effect::kVisibleOrRefused) {
      EXPECT_EQ(image.error().code, ErrorCode::kRefused);
      continue;
    }
    EXPECT_TRUE(image) << image.error().message;
    if (!reference || !image) continue;
    const Difference found = difference(*image, **reference);
    worst_px = std::max(worst_px, found.pixels);
    EXPECT_LE(found.pixels, kMostDifferent_px)
        << "pixels differ by more than " << kMostLevels << "/255; the worst by " << found.worst_levels
        << "/255 in column " << found.worst_at % kWidth_px << ", row " << found.worst_at / kWidth_px;
    if (c.effect != Effect::kNone) {
      EXPECT_GE(difference(*image, *plain).pixels, kLeastEffect_px) << "the scene does not show what the keyword does";
    }
  }
  RecordProperty("most_different_px", worst_px);
}

INSTANTIATE_TEST_SUITE_P(Groups, NativeKeywords,
                         testing::Values(&kShapes, &kCombinations, &kTransforms, &kPatterns, &kPigmentParts, &kFinishes,
                                         &kLights, &kSkies, &kCameras, &kSettings, &kLanguage),
                         [](const auto& test) { return test.param->name; });

}  // namespace
}  // namespace twocone::sim_povray
