// SPDX-License-Identifier: Apache-2.0
// The files of run --truth, read back by the rules of their formats.
#include "apps/runlog/tables/truth_files.h"

#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "apps/config/yaml/text_file.h"
#include "tests/support/temporary_folder.h"

namespace twocone::runlog {
namespace {

using testing_support::TemporaryFolder;

/// An array of NumPy's format 1.0 with float32 in rows.
struct Npy {
  std::string header;
  std::vector<float> values;
};

Npy read_npy(const std::filesystem::path& file) {
  const std::string bytes = config::read_text(file);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const std::size_t length = std::uint8_t(bytes.at(8)) + 256U * std::uint8_t(bytes.at(9));
  EXPECT_EQ((10 + length) % 64, 0U) << "the format aligns the values";
  Npy result{bytes.substr(10, length), {}};
  EXPECT_EQ(result.header.back(), '\n');
  result.values.resize((bytes.size() - 10 - length) / sizeof(float));
  std::memcpy(result.values.data(), bytes.data() + 10 + length, result.values.size() * sizeof(float));
  return result;
}

// Catches swapped bytes or axes, 8-bit object numbers, and a header that NumPy does not read.
TEST(TruthFiles, ComeBackAsTheyWere) {
  const TemporaryFolder folder;
  sim_povray::PixelTruth truth{.width_px = 3, .height_px = 2};
  truth.object = {0, 1, 300, 65535, 2, 0};
  truth.distance_m = {0, 1.25F, 0.1F, 7, 3.5F, 0};
  truth.normal = {{0, 0, 0}, {0, 0, 1}, {0.6F, -0.8F, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  EXPECT_FALSE(has_truth(folder.path(), "upper", 7));
  write_truth(folder.path(), "upper", 7, truth);
  EXPECT_TRUE(has_truth(folder.path(), "upper", 7));

  const auto file = [&](const char* ending) {
    return folder.path() / "truth" / (std::string("upper_000007_") + ending);
  };
  const cv::Mat objects = cv::imread(file("object.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(objects.type(), CV_16UC1);
  ASSERT_EQ(objects.size(), cv::Size(3, 2));
  EXPECT_EQ(std::vector<std::uint16_t>(objects.begin<std::uint16_t>(), objects.end<std::uint16_t>()), truth.object);
  const Npy distance = read_npy(file("distance.npy"));
  EXPECT_EQ(distance.header.substr(0, distance.header.find('}') + 1),
            "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }");
  EXPECT_EQ(distance.values, truth.distance_m);
  const Npy normal = read_npy(file("normal.npy"));
  EXPECT_NE(normal.header.find("'shape': (2, 3, 3), }"), std::string::npos) << normal.header;
  ASSERT_EQ(normal.values.size(), 18U);
  for (std::size_t i = 0; i < 18; ++i) EXPECT_EQ(normal.values[i], truth.normal[i / 3][i % 3]) << i;

  std::filesystem::remove(file("distance.npy"));
  EXPECT_FALSE(has_truth(folder.path(), "upper", 7)) << "a resumed run would lack it";
}

// Catches a landmark's name on what stands around or beside it, and text that breaks a row.
TEST(TruthFiles, ObjectsOfLandmarksHaveTheirNames) {
  const TemporaryFolder folder;
  const std::vector<Landmark> landmarks{{"a, b", {}, 2, -1, 0.15, 0.9}, {"red", {}, -2, 1, 0.15, 0.9}};
  using sim_povray::TrueBox;
  write_true_objects(folder.path(),
                     {{1, "plane", "", "x.pov", 5, {}},
                      {2, "cylinder", "post", "x.pov", 6, TrueBox{{1.85, -1.15, 0}, {2.15, -0.85, 0.9}}},
                      {3, "cylinder", "", "x.pov", 7, TrueBox{{-2.2, 0.8, 0}, {-1.8, 1.2, 0.02}}},
                      {5, "torus", "", "x.pov", 8, TrueBox{{-2.15, 0.85, 0.7}, {-1.85, 1.15, 0.9005}}}},
                     landmarks);
  EXPECT_EQ(config::read_text(folder.path() / "truth" / "objects.csv"),
            "number,kind,name,landmark,file,line\n1,plane,,,x.pov,5\n2,cylinder,post,\"a, b\",x.pov,6\n"
            "3,cylinder,,,x.pov,7\n5,torus,,red,x.pov,8\n");
}

}  // namespace
}  // namespace twocone::runlog
