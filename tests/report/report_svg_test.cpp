// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/svg.h"
#include "apps/runlog/storage/image_file.h"

#include <gtest/gtest.h>

namespace twocone::report {
namespace {

TEST(Escape, MakesEveryMeaningfulCharacterAnEntity) {
  EXPECT_EQ(escape("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  EXPECT_EQ(escape("&amp;"), "&amp;amp;") << "text that looks like an entity is text";
}

TEST(Escape, KeepsUtf8AndReplacesInvalidBytes) {
  EXPECT_EQ(escape("gr\u00fcn \u2192 \U0001F916"), "gr\u00fcn \u2192 \U0001F916");
  EXPECT_EQ(escape("a\xFF"
                   "b"),
            "a\uFFFD"
            "b");
  EXPECT_EQ(escape("a\xC3"), "a\uFFFD") << "cut off within a character";
  EXPECT_EQ(escape("\xC0\xAF"), "\uFFFD\uFFFD") << "an overlong '/'";
  EXPECT_EQ(escape("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD") << "half of a surrogate pair";
  EXPECT_EQ(escape("\xEF\xBF\xBF"), "\uFFFD") << "not a character in XML";
}

TEST(Escape, LeavesOutControlCharactersThatXmlForbids) {
  EXPECT_EQ(escape(std::string("a\0b\x01"
                               "c\td\ne",
                               9)),
            "abc\td\ne");
}

TEST(JpegUri, HoldsTheBytesOfTheJpeg) {
  const Image image{5, 3, PixelFormat::kGrey8, std::vector<std::uint8_t>(15, 90)};
  const auto jpeg = to_mjpeg(image, 80);
  ASSERT_TRUE(jpeg);
  const std::string uri = runlog::jpeg_uri(image, 80);
  constexpr std::string_view kHead = "data:image/jpeg;base64,";
  ASSERT_TRUE(uri.starts_with(kHead));
  EXPECT_EQ(uri.substr(kHead.size(), 4), "/9j/") << "FF D8 FF";
  EXPECT_EQ(uri.size() - kHead.size(), (jpeg->bytes.size() + 2) / 3 * 4);
}

TEST(OwnColour, IsThatOfTheLandmarkInSrgb) { EXPECT_EQ(own_colour({0.2140, 2, -1}), "#7fff00"); }

}  // namespace
}  // namespace twocone::report
