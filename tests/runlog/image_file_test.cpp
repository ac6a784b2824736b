// SPDX-License-Identifier: Apache-2.0
// PNG files of this program and of OpenCV, each read by the other.
#include "apps/runlog/storage/image_file.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "apps/config/yaml/text_file.h"
#include "tests/support/fails_with.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing::HasSubstr;
using testing_support::FailsWith;
using testing_support::TemporaryFolder;

class ImageFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }

  const TemporaryFolder folder_;
};

Image colours(int width_px, int height_px) {
  Image image{width_px, height_px, PixelFormat::kRgb8, {}};
  for (int i = 0; i < 3 * width_px * height_px; ++i) image.bytes.push_back(std::uint8_t(5 * i + i * i / 7));
  return image;
}

TEST_F(ImageFile, ComesBackAsItWas) {
  Image image = colours(5, 3);
  write_image(file("a.png"), image);
  const auto again = read_image(file("a.png"));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(*again, image);
  image.format = PixelFormat::kBgr8;  // as a camera may deliver it; the stored image must show the same colours
  write_image(file("bgr.png"), image);
  EXPECT_EQ(*read_image(file("bgr.png")), *to_rgb8(image));
  const Image grey{2, 1, PixelFormat::kGrey8, {7, 200}};
  write_image(file("grey.png"), grey);
  EXPECT_EQ(*read_image(file("grey.png")), *to_rgb8(grey));
}

// Catches exchanged channels and a file that only this program can read.
TEST_F(ImageFile, OpenCvReadsIt) {
  const Image image = colours(63, 41);
  write_image(file("a.png"), image);
  cv::Mat rgb;
  cv::cvtColor(cv::imread(file("a.png").string(), cv::IMREAD_UNCHANGED), rgb, cv::COLOR_BGR2RGB);
  ASSERT_EQ(rgb.type(), CV_8UC3);
  EXPECT_TRUE(std::equal(image.bytes.begin(), image.bytes.end(), rgb.datastart, rgb.dataend));
  write_image(file("grey.png"), {3, 1, PixelFormat::kGrey8, {7, 200, 0}});
  EXPECT_EQ(cv::imread(file("grey.png").string(), cv::IMREAD_UNCHANGED).type(), CV_8UC1);
}

// Imported images are of any kind.
TEST_F(ImageFile, ReadsEveryKindAsOpenCvDoes) {
  cv::Mat wide(20, 30, CV_16UC3);
  cv::randu(wide, 0, 65536);
  cv::Mat bytes, grey, transparent, black_and_white;
  wide.convertTo(bytes, CV_8U, 1 / 256.0);
  cv::cvtColor(bytes, grey, cv::COLOR_BGR2GRAY);
  cv::cvtColor(bytes, transparent, cv::COLOR_BGR2BGRA);
  transparent.forEach<cv::Vec4b>([](cv::Vec4b& pixel, const int* place) { pixel[3] = std::uint8_t(8 * place[1]); });
  cv::threshold(grey, black_and_white, 128, 255, cv::THRESH_BINARY);
  cv::Mat deep_grey;
  cv::extractChannel(wide, deep_grey, 1);
  int number = 0;
  for (const cv::Mat& image : {bytes, grey, transparent, wide, deep_grey, black_and_white}) {
    const auto name = file(std::to_string(number) + ".png").string();
    const std::vector<int> options{cv::IMWRITE_PNG_BILEVEL, number == 5 ? 1 : 0};
    ASSERT_TRUE(cv::imwrite(name, image, options));
    cv::Mat wanted;
    cv::cvtColor(cv::imread(name, cv::IMREAD_COLOR), wanted, cv::COLOR_BGR2RGB);
    const auto rgb = read_rgb(name);
    ASSERT_TRUE(rgb) << rgb.error().message;
    ASSERT_EQ(rgb->size(), wanted.size());
    EXPECT_EQ(cv::norm(*rgb, wanted, cv::NORM_INF), 0) << "kind " << number;
    ++number;
  }
}

TEST_F(ImageFile, RefusesWhatIsNoImage) {
  EXPECT_THAT(read_image(file("b.png")), FailsWith(ErrorCode::kNotFound, HasSubstr("b.png")));
  EXPECT_THAT(read_image(folder_.write("c.png", "no image at all")),
              FailsWith(ErrorCode::kBadData, HasSubstr("c.png is not an image that can be read")));
  EXPECT_THAT(read_image(folder_.path()), FailsWith(ErrorCode::kBadData, HasSubstr(folder_.path().string())));
}

// A program that was killed leaves such a file, and a bad disk one with another byte.
TEST_F(ImageFile, RefusesAFileTruncatedOrChangedAnywhere) {
  write_image(file("a.png"), colours(23, 17));
  const std::string whole = config::read_text(file("a.png"));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    ASSERT_THAT(read_image(folder_.write("cut.png", whole.substr(0, size))),
                FailsWith(ErrorCode::kBadData, HasSubstr("it is cut off")))
        << size << " bytes of " << whole.size();
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string changed = whole;
    changed[at] = char(changed[at] ^ 0x10);
    ASSERT_THAT(read_image(folder_.write("changed.png", changed)), FailsWith(ErrorCode::kBadData)) << "byte " << at;
  }
}

// Its pixels would need 3 TB of memory.
TEST_F(ImageFile, RefusesAnImageOfEndlessSize) {
  write_image(file("a.png"), {1'000'000, 1, PixelFormat::kGrey8, std::vector<std::uint8_t>(1'000'000)});
  EXPECT_THAT(read_image(file("a.png")), FailsWith(ErrorCode::kBadData, HasSubstr("a.png is not an image")));
}

}  // namespace
}  // namespace twocone::runlog
