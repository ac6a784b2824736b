// SPDX-License-Identifier: Apache-2.0
#include "apps/recording/recording.h"

#include <atomic>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "apps/config/map_file.h"
#include "apps/config/robot_file.h"
#include "apps/import/import_run.h"
#include "apps/mcap/mcap.h"
#include "apps/recording/foxglove.pb.h"
#include "apps/runlog/run_data.h"
#include "apps/runs/run.h"
#include "apps/telemetry/telemetry.h"
#include "drivers/sim_povray/place.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace twocone::recording {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsSupersetOf;

const std::string kLab = TWOCONE_SOURCE_DIR "/robots/lab_sim.yaml";
constexpr int kFrames = 4;

std::string content_of(const fs::path& file) {
  std::ifstream from(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(from), {}};
}

/// The messages of a file by their topics, and the names of the schemas.
struct Content {
  std::map<std::string, std::vector<std::string>> messages;
  std::map<std::string, std::string> schema_of;  ///< by topic
  std::map<std::string, std::vector<std::uint64_t>> times_ns;
  std::map<std::string, mcap::Schema> schemas;

  explicit Content(const fs::path& file) {
    mcap::Reader reader(file);
    while (const auto message = reader.next()) {
      const mcap::Channel& channel = reader.channels().at(message->channel);
      messages[channel.topic].emplace_back(reinterpret_cast<const char*>(message->data.data()), message->data.size());
      times_ns[channel.topic].push_back(message->log_time_ns);
      const mcap::Schema& schema = reader.schemas().at(channel.schema.value());
      schema_of[channel.topic] = schema.name;
      schemas.emplace(schema.name, schema);
    }
    EXPECT_TRUE(reader.is_complete());
  }
  template <typename Message>
  [[nodiscard]] Message parsed(const std::string& topic, std::size_t i) const {
    Message message;
    EXPECT_TRUE(message.ParseFromString(messages.at(topic).at(i)));
    return message;
  }
};

class Recording : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    driven_ = std::make_unique<testing_support::TemporaryFolder>();
    const config::Robot robot = config::read_robot(kLab);
    runs::RunOptions options;
    options.frames = kFrames;
    options.behaviour = "wander";
    options.renderer = sim_povray::RendererKind::kNative;
    options.out = driven_->path() / "run";
    const std::atomic<bool> stop{false};
    const auto nothing = [](double) {};
    ASSERT_TRUE(runs::run(robot, config::read_map(robot.map), options, nothing, stop).has_value());
  }
  static void TearDownTestSuite() { driven_.reset(); }

  Recording() {
    fs::copy(driven_->path() / "run", folder_.path() / "run", fs::copy_options::recursive);
    run_ = runlog::read_run(folder_.path() / "run");
  }
  [[nodiscard]] ExportCounts exported() const {
    return export_run(run_.folder, file_, [](double) {});
  }

  static std::unique_ptr<testing_support::TemporaryFolder> driven_;
  const testing_support::TemporaryFolder folder_;
  const fs::path file_ = folder_.path() / "run.mcap";
  runlog::RunData run_;
};
std::unique_ptr<testing_support::TemporaryFolder> Recording::driven_;

TEST_F(Recording, HasWhatTheRunHas) {
  const ExportCounts counts = exported();
  EXPECT_EQ(counts.frames, std::size_t(kFrames));
  EXPECT_EQ(counts.without_images, 0U);
  const Content content(file_);
  const std::map<std::string, std::string> expected{{"/lower/image", "foxglove.CompressedImage"},
                                                    {"/upper/image", "foxglove.CompressedImage"},
                                                    {"/lower/camera_info", "foxglove.CameraCalibration"},
                                                    {"/upper/camera_info", "foxglove.CameraCalibration"},
                                                    {"/odometry", "foxglove.PoseInFrame"},
                                                    {"/fix", "foxglove.PoseInFrame"},
                                                    {"/truth", "foxglove.PoseInFrame"},
                                                    {"/tf", "foxglove.FrameTransform"},
                                                    {"/landmarks", "foxglove.SceneUpdate"},
                                                    {"/telemetry", telemetry::kSchema}};
  for (const auto& [topic, schema] : expected) {
    ASSERT_TRUE(content.schema_of.contains(topic)) << topic;
    EXPECT_EQ(content.schema_of.at(topic), schema);
  }
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto files = runlog::images_of(run_, i);
    const auto image = content.parsed<foxglove::CompressedImage>("/upper/image", i);
    EXPECT_EQ(image.format(), "png");
    EXPECT_EQ(image.data(), content_of(files[1])) << "byte by byte";
    const auto truth = content.parsed<foxglove::PoseInFrame>("/truth", i);
    EXPECT_EQ(truth.pose().position().x(), run_.truth[i].x_m);
    EXPECT_EQ(content.times_ns.at("/truth")[i], std::uint64_t(std::llround(1e9 * run_.frames[i].t_s)));
    const auto line = nlohmann::json::parse(content.messages.at("/telemetry")[i + 1]);
    EXPECT_EQ(line["frame"], run_.frames[i].frame);
  }
  const auto landmarks = content.parsed<foxglove::SceneUpdate>("/landmarks", 0);
  ASSERT_EQ(landmarks.entities_size(), int(run_.map.landmarks.size()));
  EXPECT_EQ(landmarks.entities(0).id(), run_.map.landmarks[0].name);
  EXPECT_EQ(landmarks.entities(0).cylinders(0).pose().position().x(), run_.map.landmarks[0].x_m);
}

TEST_F(Recording, ASchemaHoldsEveryDefinitionThatItNeeds) {
  EXPECT_EQ(exported().frames, std::size_t(kFrames));
  for (const auto& [name, schema] : Content(file_).schemas) {
    if (schema.encoding != "protobuf") continue;
    google::protobuf::FileDescriptorSet files;
    ASSERT_TRUE(files.ParseFromString(schema.data)) << name;
    std::set<std::string> known;
    for (const auto& file : files.file()) {
      for (const std::string& dependency : file.dependency()) EXPECT_TRUE(known.contains(dependency)) << dependency;
      known.insert(file.name());
    }
  }
}

TEST_F(Recording, IsImportedAsTheSameRun) {
  EXPECT_EQ(exported().frames, std::size_t(kFrames));
  importer::Recording recording;
  recording.robot_file = kLab;
  recording.file = file_;
  const fs::path out = folder_.path() / "again";
  import_run(recording, out, [](double) {});
  const runlog::RunData again = runlog::read_run(out);
  ASSERT_EQ(again.frames.size(), run_.frames.size());
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_NEAR(again.frames[i].t_s, run_.frames[i].t_s, 1e-9);
    EXPECT_NEAR(again.odometry[i].x_m, run_.odometry[i].x_m, 1e-6);
    EXPECT_EQ(content_of(runlog::images_of(again, i)[0]), content_of(runlog::images_of(run_, i)[0]));
    EXPECT_EQ(content_of(runlog::images_of(again, i)[1]), content_of(runlog::images_of(run_, i)[1]));
  }
}

TEST_F(Recording, AFrameWithoutAnImageKeepsItsNumbers) {
  fs::remove(runlog::images_of(run_, 3)[0]);
  EXPECT_EQ(exported().without_images, 1U);
  const Content content(file_);
  EXPECT_EQ(content.messages.at("/lower/image").size(), std::size_t(kFrames - 1));
  EXPECT_EQ(content.messages.at("/upper/image").size(), std::size_t(kFrames));
  EXPECT_EQ(content.messages.at("/odometry").size(), std::size_t(kFrames));
}

TEST_F(Recording, AFailureLeavesNoFile) {
  const fs::path nowhere = folder_.path() / "none" / "run.mcap";
  EXPECT_THAT(testing_support::error_of<mcap::McapError>([&] { export_run(run_.folder, nowhere, [](double) {}); }),
              HasSubstr("run.mcap"));
  EXPECT_NE(
      testing_support::error_of<std::exception>([&] { export_run(folder_.path() / "no_run", file_, [](double) {}); }),
      "");
  EXPECT_FALSE(fs::exists(file_));
  EXPECT_FALSE(fs::exists(file_.string() + ".part"));
}

}  // namespace
}  // namespace twocone::recording
