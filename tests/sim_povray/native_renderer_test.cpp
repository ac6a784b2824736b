// SPDX-License-Identifier: Apache-2.0
// When the native renderer renders, and when POV-Ray does instead.
#include "drivers/sim_povray/render/native/native_renderer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "drivers/sim_povray/render/native/tile_kernels.h"
#include "drivers/sim_povray/render/povray/pool_renderer.h"
#include "tests/sim_povray/renderer_support.h"
#include "tests/sim_povray/test_support.h"
#include "tests/support/fails_with.h"

namespace twocone::sim_povray {
namespace {

using testing::HasSubstr;
using testing_support::FailsWith;

constexpr int kWidth_px = 64, kHeight_px = 48;

class NativeRendererTest : public testing::Test {
 protected:
  /// Writes the small scene, with more text after it.
  std::filesystem::path scene(const std::string& more) {
    auto path = folder_.path() / "scene.pov";
    std::ofstream(path) << read_file(scene_of_tests("tiny.pov")) << more;
    return path;
  }
  [[nodiscard]] std::filesystem::path cache() const { return folder_.path() / "cache"; }

  /// Renders the first images of both cameras as a run does: both views are expected before either is prepared.
  std::vector<ImageResult> images(const std::filesystem::path& path, bool with_povray = true, int antialias = 1,
                                  const std::filesystem::path& kept = {}) {
    std::optional<Reference> reference;
    if (with_povray) {
      const Povray povray(value(find_povray("povray")), path, kRenderLimit);
      reference.emplace(Reference{povray, std::make_unique<ProcessRenderer>(povray, 4)});
    }
    NativeRenderer renderer({path, SceneAccess(path, {}), kept, [this](const std::string& line) { notices_ += line; },
                             [this](RendererKind kind, bool is_checked) {
                               chosen_ += std::string(to_string(kind)) + (is_checked ? "" : " unchecked");
                             }},
                            std::move(reference));
    const std::vector<View> views{{path, "lower", kWidth_px, kHeight_px, antialias},
                                  {path, "upper", kWidth_px, kHeight_px, antialias}};
    auto first = renderer.expect_view();
    auto second = renderer.expect_view();
    std::vector<std::future<ImageResult>> ordered_images;
    for (const View& view : views) ordered_images.push_back(ordered(renderer, view.job(0)));
    for (const View& view : views) renderer.prepare(view.job(0).view_template, view.job(0).pose);
    first.reset();
    second.reset();
    std::vector<ImageResult> result;
    for (auto& image : ordered_images) result.push_back(image.get());
    described_ = renderer.describe();
    return result;
  }
  /// Returns POV-Ray's images of the same views.
  std::vector<ImageResult> povrays(const std::filesystem::path& path, int antialias = 1) {
    ProcessRenderer renderer(Povray(value(find_povray("povray")), path, kRenderLimit), 4);
    return twocone::sim_povray::images(
        renderer,
        {{path, "lower", kWidth_px, kHeight_px, antialias}, {path, "upper", kWidth_px, kHeight_px, antialias}}, 1);
  }

  TemporaryFolder folder_;
  std::string notices_, chosen_, described_;
};

/// Returns the number of pixels that differ by more than one level.
std::size_t different(const Image& a, const Image& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.bytes.size(); i += 3) {
    bool differs = false;
    for (std::size_t k = i; k < i + 3; ++k) differs = differs || std::abs(int(a.bytes[k]) - int(b.bytes[k])) > 1;
    count += differs ? 1 : 0;
  }
  return count;
}

TEST_F(NativeRendererTest, AgreesPlainAndSmoothed) {
  const auto path = scene("");
  for (const int antialias : {1, 3}) {
    const auto got = images(path, true, antialias);
    const auto expected = povrays(path, antialias);
    for (std::size_t view : {0U, 1U}) {
      EXPECT_LE(different(*value(got[view]), *value(expected[view])), 3U) << "view " << view << ", " << antialias;
    }
  }
  EXPECT_EQ(chosen_, "nativenative");
  EXPECT_EQ(notices_, "");
  EXPECT_EQ(described_, "native, compared with POV-Ray");
}

// The loops are compiled once for each instruction set; an image of one processor must be that of every other.
TEST_F(NativeRendererTest, ImagesDoNotDependOnTheInstructionSet) {
  const auto path = scene("");
  for (const int antialias : {1, 3}) {
    const auto widest = images(path, false, antialias);
    std::string names;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::GetChosenTarget().Update(target);
      names += instruction_set() + ' ';
      const auto got = images(path, false, antialias);
      for (std::size_t view : {0U, 1U}) {
        EXPECT_EQ(value(got[view])->bytes, value(widest[view])->bytes) << instruction_set() << ", view " << view;
      }
    }
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    RecordProperty("instruction_sets", names);
  }
}

TEST_F(NativeRendererTest, AnUnknownConstructIsNamedAndRenderedByPovray) {
  const auto path = scene("light_source { <1, 50, 1> rgb 0.2 area_light x, y, 2, 2 }\n");
  const auto got = images(path);
  const auto expected = povrays(path);
  for (std::size_t view : {0U, 1U}) EXPECT_EQ(value(got[view])->bytes, value(expected[view])->bytes);
  EXPECT_THAT(notices_, HasSubstr("POV-Ray renders, because " + path.string() + ":31: 'area_light'"));
  EXPECT_EQ(chosen_, "povray");
}

// Each scene uses only what the native renderer knows, but POV-Ray shows it otherwise.
TEST_F(NativeRendererTest, AKnownConstructThatIsRenderedOtherwiseIsFound) {
  for (const std::string_view otherwise : {
           // POV-Ray shows only what is within the bounds.
           "union { box { <-60, 0, 50> <60, 60, 55> } box { <-60, 0, -55> <60, 60, -50> } pigment { rgb <1, 1, 0> }\n"
           "  bounded_by { sphere { <0, 30, 52>, 20 } } }\n",
           // POV-Ray sees nothing that is farther away than 1e7.
           "sphere { 0, 3e7 pigment { rgb <1, 1, 0> } }\n",
           // The reflections of the pixels' centres run along the edges of the box, so rounding decides which face each
           // of them meets.
           "box { <-20, -1, -20> <20, 30, 20> pigment { rgb <1, 1, 0> } }\n",
       }) {
    notices_ = chosen_ = "";
    const auto path = scene(std::string(otherwise));
    const auto got = images(path);
    const auto expected = povrays(path);
    for (std::size_t view : {0U, 1U}) {
      EXPECT_EQ(value(got[view])->bytes, value(expected[view])->bytes) << otherwise;
    }
    EXPECT_EQ(chosen_, "povray") << otherwise;
    EXPECT_THAT(notices_, HasSubstr("the native renderer's first image differs")) << otherwise;
  }
}

TEST_F(NativeRendererTest, WithoutPovrayAnUnknownConstructIsAnError) {
  const auto path = scene("sphere { 0, 1 pigment { rgbt 1 } }\n");
  for (const ImageResult& image : images(path, false))
    EXPECT_THAT(image, FailsWith(ErrorCode::kRefused, HasSubstr(":31: ")));
}

TEST_F(NativeRendererTest, WithoutPovrayNothingIsChecked) {
  for (const ImageResult& image : images(scene(""), false)) EXPECT_TRUE(image);
  EXPECT_EQ(chosen_, "native unchecked");
  EXPECT_EQ(described_, "native, unchecked");
}

TEST_F(NativeRendererTest, WhatAgreedIsRemembered) {
  const auto path = scene("");
  (void)images(path, true, 1, cache());
  const auto files = [this] {
    const std::filesystem::directory_iterator all(cache() / "agreed");
    return std::distance(begin(all), end(all));
  };
  EXPECT_EQ(files(), 2);
  (void)images(path, true, 1, cache());
  EXPECT_EQ(files(), 2);
  (void)images(scene("sphere { 100, 1 }\n"), true, 1, cache());
  EXPECT_EQ(files(), 4) << "another scene is another question";
}

TEST_F(NativeRendererTest, ACacheThatCannotBeWrittenChangesNothing) {
  std::ofstream(cache()) << "a file, no folder";
  for (const ImageResult& image : images(scene(""), true, 1, cache())) EXPECT_TRUE(image);
  EXPECT_EQ(chosen_, "native");
}

// One view alone would be rendered natively.
TEST_F(NativeRendererTest, OneViewThatDiffersDecidesForAll) {
  // A sphere between the upper camera and its mirror, which POV-Ray does not show.
  const auto path = scene(
      "union { sphere { <0.3, 12.5, 0>, 0.2 } sphere { <0, 60, 0>, 1 } pigment { rgb <1, 0, 1> }\n"
      "  bounded_by { sphere { <0, 60, 0>, 2 } } }\n");
  const auto got = images(path);
  const auto expected = povrays(path);
  for (std::size_t view : {0U, 1U}) EXPECT_EQ(value(got[view])->bytes, value(expected[view])->bytes);
  EXPECT_EQ(chosen_, "povray");
}

TEST(ParsePoses, RefusesOtherText) {
  EXPECT_FALSE(parse_poses(""));
  EXPECT_FALSE(parse_poses("#declare X = transform { matrix <1,0,0, 0,1,0, 0,0,1, 2,3"));
  EXPECT_FALSE(parse_poses("matrix <0,0,0, 0,0,0, 0,0,0, 0,0,0>"));
  const auto poses = parse_poses("a matrix <1,0,0, 0,1,0, 0,0,1, 2,3,4> b matrix <1,0,0,0,1,0,0,0,1,5,6,7>");
  ASSERT_TRUE(poses);
  ASSERT_EQ(poses->movers.size(), 1U);
  EXPECT_EQ(poses->movers[0].point({}), (Vec3{2, 3, 4}));
  EXPECT_EQ(poses->view.point({}), (Vec3{5, 6, 7}));
}

}  // namespace
}  // namespace twocone::sim_povray
