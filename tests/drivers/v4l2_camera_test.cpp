// SPDX-License-Identifier: Apache-2.0
// Tests of the choice of the device, its format, rate and controls.
#include <cerrno>
#include <stdexcept>

#include "tests/drivers/v4l2_fixture.h"
#include "tests/support/fails_with.h"

namespace twocone::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;
using testing_support::FailsWith;
using v4l2::V4l2Settings;

class V4l2CameraTest : public V4l2Test {
 protected:
  /// Opens and configures a camera; returns the applied settings.
  Result<CameraSettings> configure(const V4l2Settings& settings, const CameraSettings& wanted = {64, 48, 20}) {
    camera_.reset();
    if (auto opened = open(settings); !opened) return opened.error();
    return camera_->configure(wanted);
  }
  Result<CameraSettings> with_format(const std::string& format, const CameraSettings& wanted = {64, 48, 20}) {
    return configure({"/dev/video0", format, {}}, wanted);
  }
  Result<CameraSettings> with_controls(std::vector<std::pair<std::string, double>> controls) {
    return configure({"/dev/video0", "", std::move(controls)});
  }
};

TEST_F(V4l2CameraTest, SettingsAreCheckedByName) {
  EXPECT_THROW(v4l2::check(V4l2Settings{"", "", {}}), std::invalid_argument);
  EXPECT_THROW(v4l2::check(V4l2Settings{"/dev/video0", "H264", {}}), std::invalid_argument);
  EXPECT_THROW(v4l2::check(V4l2Settings{"/dev/video0", "", {{"", 1}}}), std::invalid_argument);
  for (const char* format : {"YUYV", "UYVY", "NV12", "GREY", "RGB3", "BGR3", "MJPG", ""}) {
    EXPECT_NO_THROW(v4l2::check(V4l2Settings{"/dev/video0", format, {{"gain", 1}}})) << format;
  }
}

TEST_F(V4l2CameraTest, IsOneDeviceUnderAllItsNames) {
  device_.card = "Left eye";
  kernel_->add_link("/dev/v4l/by-id/usb-Left-index0", "/dev/video0");
  for (const char* name : {"/dev/video0", "/dev/v4l/by-id/usb-Left-index0", "Left eye"}) {
    EXPECT_EQ(v4l2::node_of(name, kernel_), "/dev/video0") << name;
  }
  EXPECT_EQ(v4l2::node_of("/dev/video9", kernel_), "/dev/video9");
  EXPECT_EQ(v4l2::node_of("Right eye", kernel_), "Right eye");
}

// Catches a camera whose name controls the terminal in which it is listed.
TEST_F(V4l2CameraTest, ANameWithEscapeSequencesIsCleaned) {
  device_.card = "Eye \x1b[2J\x1b]0;x\x07";
  const auto cameras = v4l2::list_cameras(kernel_);
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras.front().what, "Eye ?[2J?]0;x? (/dev/video0, scripted:/dev/video0)");
  EXPECT_TRUE(open({"Eye ?[2J?]0;x?", "", {}})) << "the listed name must find it";
}

TEST_F(V4l2CameraTest, IsFoundByPathByLinkAndByCard) {
  device_.card = "Left eye";
  ScriptedDevice& other = kernel_->add({.path = "/dev/video10", .card = "Right eye"});
  kernel_->add_link("/dev/v4l/by-id/usb-Right-index0", "/dev/video10");
  kernel_->add_link("/dev/v4l/by-path/pci-1-index0", "/dev/video10");
  for (const auto& [name, card, path] :
       {std::tuple{"/dev/video0", "Left eye", "/dev/video0"}, std::tuple{"Left eye", "Left eye", "/dev/video0"},
        std::tuple{"/dev/v4l/by-id/usb-Right-index0", "Right eye", "/dev/v4l/by-id/usb-Right-index0"},
        std::tuple{"Right eye", "Right eye", "/dev/v4l/by-id/usb-Right-index0"}}) {
    ASSERT_TRUE(configure({name, "", {}})) << name;
    EXPECT_EQ(camera_->facts().device, std::string(card) + " (" + path + ")");
  }
  camera_.reset();
  other.card = "Left eye";
  EXPECT_THAT(
      open({"Left eye", "", {}}),
      FailsWith(ErrorCode::kRefused, AllOf(HasSubstr("/dev/video0"), HasSubstr("/dev/v4l/by-id/usb-Right-index0"))));
  EXPECT_THAT(open({"Third eye", "", {}}), FailsWith(ErrorCode::kNotFound, HasSubstr("'Left eye'")));
}

TEST_F(V4l2CameraTest, TheListIsInTheOrderOfNumbersAndOmitsOtherDevices) {
  device_.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_H264};
  kernel_->add({.path = "/dev/video10"});
  kernel_->add({.path = "/dev/video2"});
  kernel_->add({.path = "/dev/video3", .can = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING});
  kernel_->add({.path = "/dev/video4", .open_error = EACCES});
  kernel_->add({.path = "/dev/vbi0"});
  const auto cameras = v4l2::list_cameras(kernel_);
  ASSERT_EQ(cameras.size(), 3U);
  EXPECT_EQ(cameras[0].name, "/dev/video0");
  EXPECT_EQ(cameras[1].name, "/dev/video2");
  EXPECT_EQ(cameras[2].name, "/dev/video10");
  EXPECT_EQ(cameras[0].what, "Scripted (/dev/video0, scripted:/dev/video0)");
  EXPECT_THAT(cameras[0].details, ElementsAre("YUYV 640x480 at 30, 15 Hz", "H264 (not known to this driver)"));
}

TEST_F(V4l2CameraTest, AFailedOpenReportsTheReason) {
  struct Case {
    int error;
    ErrorCode code;
    const char* part;
  };
  for (const Case& c :
       {Case{ENOENT, ErrorCode::kNotFound, "/dev/video0"}, Case{ENODEV, ErrorCode::kNotFound, ""},
        Case{ENXIO, ErrorCode::kNotFound, ""}, Case{EACCES, ErrorCode::kRefused, "group video"},
        Case{EBUSY, ErrorCode::kRefused, "another program"}, Case{ENOMEM, ErrorCode::kUnavailable, ""}}) {
    device_.open_error = c.error;
    EXPECT_THAT(open(), FailsWith(c.code, HasSubstr(c.part)));
  }
  device_.open_error = 0;
  EXPECT_EQ(error_of(open({"/dev/video7", "", {}})).code, ErrorCode::kNotFound);
}

TEST_F(V4l2CameraTest, ADeviceThatDoesNotCaptureIsRefused) {
  for (const std::uint32_t can :
       {V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING, V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE,
        V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING}) {
    device_.can = can;
    EXPECT_THAT(open(), FailsWith(ErrorCode::kRefused, HasSubstr("is no camera")));
  }
  device_.errors[VIDIOC_QUERYCAP] = {ENOTTY};
  EXPECT_THAT(error_of(open()).message, HasSubstr("is no video device"));
  device_.errors[VIDIOC_QUERYCAP] = {ENODEV};
  EXPECT_EQ(error_of(open()).code, ErrorCode::kNotFound);
}

TEST_F(V4l2CameraTest, EveryFormatArrivesUnchanged) {
  struct Case {
    std::uint32_t code;
    const char* name;
    PixelFormat layout;
    std::size_t bytes;
  };
  constexpr std::size_t kPixels = std::size_t(64) * 48;
  for (const Case& c : {Case{V4L2_PIX_FMT_YUYV, "YUYV", PixelFormat::kYuyv, 2 * kPixels},
                        Case{V4L2_PIX_FMT_UYVY, "UYVY", PixelFormat::kUyvy, 2 * kPixels},
                        Case{V4L2_PIX_FMT_NV12, "NV12", PixelFormat::kNv12, kPixels * 3 / 2},
                        Case{V4L2_PIX_FMT_GREY, "GREY", PixelFormat::kGrey8, kPixels},
                        Case{V4L2_PIX_FMT_RGB24, "RGB3", PixelFormat::kRgb8, 3 * kPixels},
                        Case{V4L2_PIX_FMT_BGR24, "BGR3", PixelFormat::kBgr8, 3 * kPixels},
                        Case{V4L2_PIX_FMT_MJPEG, "MJPG", PixelFormat::kMjpeg, 1234},
                        Case{V4L2_PIX_FMT_JPEG, "MJPG", PixelFormat::kMjpeg, 1234}}) {
    for (const bool has_planes : {false, true}) {
      for (const std::uint32_t padding : {0U, 12U}) {
        SCOPED_TRACE(testing::Message() << c.name << (has_planes ? ", in planes, " : ", ") << padding << " padded");
        camera_.reset();
        device_.formats = {V4L2_PIX_FMT_H264, c.code};
        device_.can = (has_planes ? V4L2_CAP_VIDEO_CAPTURE_MPLANE : V4L2_CAP_VIDEO_CAPTURE) | V4L2_CAP_STREAMING;
        device_.row_padding = c.layout == PixelFormat::kMjpeg ? 0 : padding;
        ASSERT_TRUE(open({"/dev/video0", c.name, {}}));
        start();
        EXPECT_EQ(camera_->facts().format, c.name);
        ASSERT_TRUE(kernel_->expose(device_, {.captured = std::chrono::steady_clock::now().time_since_epoch(),
                                              .value = 0x5A,
                                              .bytes = c.layout == PixelFormat::kMjpeg ? 1234U : 0U}));
        const auto frame = camera_->grab(kPlenty);
        ASSERT_TRUE(frame) << frame.error().message;
        const Image& image = **frame->image(kPlenty);
        EXPECT_EQ(image.format, c.layout);
        EXPECT_EQ(image.width_px, 64);
        EXPECT_EQ(image.height_px, 48);
        ASSERT_EQ(image.bytes.size(), c.bytes);
        EXPECT_EQ(std::count(image.bytes.begin(), image.bytes.end(), 0x5A), std::ptrdiff_t(c.bytes));
        EXPECT_EQ(image.bytes.is_lent(), device_.row_padding == 0) << "a padded image is packed, and so copied";
      }
    }
  }
}

TEST_F(V4l2CameraTest, AMissingFormatIsRefusedNamingTheAvailableOnes) {
  device_.formats = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_H264};
  EXPECT_THAT(with_format("MJPG"),
              FailsWith(ErrorCode::kRefused, AllOf(HasSubstr("no format MJPG"), HasSubstr("YUYV, H264"))));
  device_.formats = {V4L2_PIX_FMT_H264};
  EXPECT_THAT(error_of(with_format("")).message, HasSubstr("no format that this driver knows"));
  // The kernel's driver offers a format that it then refuses.
  device_.formats = {V4L2_PIX_FMT_YUYV};
  device_.errors[VIDIOC_S_FMT] = {EINVAL};
  EXPECT_EQ(error_of(with_format("YUYV")).code, ErrorCode::kRefused);
}

TEST_F(V4l2CameraTest, ImagesInSeveralPlanesAreRefused) {
  device_.can = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  device_.formats = {V4L2_PIX_FMT_NV12};
  device_.planes = 2;
  EXPECT_THAT(error_of(with_format("NV12")).message, HasSubstr("NV12 in 2 planes"));
}

TEST_F(V4l2CameraTest, TheReportedSizeIsTheOneThatTheDeviceApplied) {
  device_.adjust = [](std::uint32_t, std::uint32_t& width, std::uint32_t& height) {
    width = 320;
    height = 180;
  };
  const auto applied = with_format("", {320, 240, 20});
  ASSERT_TRUE(applied);
  EXPECT_EQ(*applied, (CameraSettings{320, 180, 20}));
  EXPECT_EQ(camera_->facts().settings, *applied);
  start({320, 240, 20});
  kernel_->expose(device_);
  EXPECT_EQ((*camera_->grab(kPlenty)->image(kPlenty))->bytes.size(), 2U * 320 * 180);
}

TEST_F(V4l2CameraTest, SidesThatAFormatCannotHaveAreRefused) {
  EXPECT_THAT(error_of(with_format("YUYV", {61, 47, 20})).message, HasSubstr("61 x 47 pixels, which YUYV cannot have"));
}

TEST_F(V4l2CameraTest, TheChosenFormatHasSizeAndRate) {
  device_.formats = {V4L2_PIX_FMT_GREY, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_YUYV};
  device_.fastest_hz = [](std::uint32_t format) { return format == V4L2_PIX_FMT_MJPEG ? 60.0 : 5.0; };
  ASSERT_TRUE(with_format("", {640, 480, 25}));
  EXPECT_EQ(camera_->facts().format, "MJPG");
  ASSERT_TRUE(with_format("", {640, 480, 5}));
  EXPECT_EQ(camera_->facts().format, "YUYV") << "the first that is fast enough";

  // No format has both. The one with the size is chosen, because the rig's calibration holds for one size.
  device_.fastest_hz = [](std::uint32_t format) { return format == V4L2_PIX_FMT_YUYV ? 60.0 : 5.0; };
  device_.adjust = [](std::uint32_t format, std::uint32_t& width, std::uint32_t&) {
    if (format != V4L2_PIX_FMT_GREY) width = 320;
  };
  const auto applied = with_format("", {640, 480, 25});
  ASSERT_TRUE(applied);
  EXPECT_EQ(*applied, (CameraSettings{640, 480, 5}));
  EXPECT_EQ(camera_->facts().format, "GREY");
  EXPECT_EQ(kernel_->format(device_).pixelformat, V4L2_PIX_FMT_GREY)
      << "the reported format must be set, not the last one that was tried";
}

TEST_F(V4l2CameraTest, TheRateIsReadBackIfTheDeviceReportsIt) {
  for (const double rate_hz : {25.0, 29.97, 7.5, 1.0}) {
    EXPECT_EQ(with_format("", {64, 48, rate_hz})->rate_hz, rate_hz);
    EXPECT_TRUE(camera_->facts().has_rate);
  }
  device_.fastest_hz = [](std::uint32_t) { return 7.5; };
  EXPECT_EQ(with_format("", {64, 48, 30})->rate_hz, 7.5);

  device_.sets_rate = false;
  device_.own_rate_hz = 12.5;
  EXPECT_EQ(with_format("", {64, 48, 30})->rate_hz, 12.5) << "a device that has only one rate";
  EXPECT_TRUE(camera_->facts().has_rate);

  device_.reports_rate = false;
  device_.cable_rate_hz = 59.94;
  EXPECT_EQ(with_format("", {64, 48, 30})->rate_hz, 59.94) << "the rate of the video signal";
  EXPECT_TRUE(camera_->facts().has_rate);

  device_.cable_rate_hz = 0;
  EXPECT_EQ(with_format("", {64, 48, 30})->rate_hz, 30);
  EXPECT_FALSE(camera_->facts().has_rate);
}

TEST_F(V4l2CameraTest, RatesBeyondTheKernelsNumbersDoNotOverflow) {
  for (const double rate_hz : {1e-9, 1e9, 1e300}) {
    const auto applied = with_format("", {64, 48, rate_hz});
    ASSERT_TRUE(applied) << rate_hz;
    EXPECT_GT(applied->rate_hz, 0) << rate_hz;
  }
}

TEST_F(V4l2CameraTest, ControlsAreSetByNameInOrderAndReadBack) {
  device_.controls = {
      {.title = "User Controls", .type = V4L2_CTRL_TYPE_CTRL_CLASS, .flags = V4L2_CTRL_FLAG_READ_ONLY},
      {.title = "Exposure Time, Absolute", .minimum = 3, .maximum = 2047, .step = 8},
      {.title = "White Balance, Automatic", .type = V4L2_CTRL_TYPE_BOOLEAN, .maximum = 1, .value = 1},
      {.title = "Auto Exposure",
       .type = V4L2_CTRL_TYPE_MENU,
       .maximum = 3,
       .value = 3,
       .menu = {{1, "Manual Mode"}, {3, "Aperture Priority Mode"}}},
      {.title = "Link Frequency", .type = V4L2_CTRL_TYPE_INTEGER_MENU, .maximum = 1, .menu = {{0, "400"}, {1, "800"}}},
      {.title = "Focus, Now",
       .type = V4L2_CTRL_TYPE_BUTTON,
       .maximum = 0,
       .flags = V4L2_CTRL_FLAG_WRITE_ONLY | V4L2_CTRL_FLAG_EXECUTE_ON_WRITE},
      {.title = "Pixel Rate", .type = V4L2_CTRL_TYPE_INTEGER64, .minimum = -5, .maximum = 1LL << 40},
      {.title = "Flags", .type = V4L2_CTRL_TYPE_BITMASK, .maximum = 0x80402010}};
  const auto applied = with_controls({{"auto_exposure", 1},
                                      {"exposure_time_absolute", 157},
                                      {"white_balance_automatic", 0},
                                      {"link_frequency", 1},
                                      {"focus_now", 1},
                                      {"pixel_rate", 1LL << 36},
                                      {"flags", 0x80000010}});
  ASSERT_TRUE(applied) << applied.error().message;
  EXPECT_THAT(camera_->facts().controls,
              ElementsAre(Pair("auto_exposure", 1), Pair("exposure_time_absolute", 152),
                          Pair("white_balance_automatic", 0), Pair("link_frequency", 1), Pair("focus_now", 1),
                          Pair("pixel_rate", double(1LL << 36)), Pair("flags", double(0x80000010))));
  EXPECT_EQ(device_.controls[1].value, 152);
  EXPECT_EQ(device_.controls[5].value, 1) << "pressed";
  EXPECT_EQ(device_.controls[6].value, 1LL << 36);
}

TEST_F(V4l2CameraTest, ImpossibleControlsAreRefusedNamingThePossibleOnes) {
  device_.controls = {
      {.title = "Gain", .minimum = 0, .maximum = 100},
      {.title = "Temperature", .flags = V4L2_CTRL_FLAG_READ_ONLY},
      {.title = "Old", .flags = V4L2_CTRL_FLAG_DISABLED},
      {.title = "Label", .type = V4L2_CTRL_TYPE_STRING, .flags = V4L2_CTRL_FLAG_HAS_PAYLOAD},
      {.title = "Mode", .type = V4L2_CTRL_TYPE_MENU, .maximum = 3, .menu = {{1, "Manual"}, {3, "Automatic"}}},
      {.title = "Hue", .flags = V4L2_CTRL_FLAG_INACTIVE},
      {.title = "Held", .refused = EBUSY},
      {.title = "Far", .refused = EIO},
      {.title = "Gone", .refused = ENODEV}};
  struct Case {
    const char* name;
    std::int64_t value;
    ErrorCode code;
    const char* part;
  };
  for (const Case& c :
       {Case{"gain", 101, ErrorCode::kRefused, "gain is 101, must be 0 to 100"},
        Case{"gain", -1, ErrorCode::kRefused, "gain is -1, must be 0 to 100"},
        Case{"gain", 1LL << 32, ErrorCode::kRefused, "must be 0 to 100"},
        Case{"temperature", 20, ErrorCode::kRefused, "temperature can only be read"},
        Case{"label", 1, ErrorCode::kRefused, "label is not a number"},
        Case{"mode", 2, ErrorCode::kRefused, "mode is 2, must be one of 1 (Manual), 3 (Automatic)"},
        Case{"hue", 1, ErrorCode::kRefused, "hue is inactive"}, Case{"held", 1, ErrorCode::kRefused, "busy"},
        Case{"far", 1, ErrorCode::kRefused, "Input/output"},
        Case{"gone", 1, ErrorCode::kDisconnected, "No such device"},
        Case{"Gain", 1, ErrorCode::kRefused, "it has: gain, mode, hue, held, far, gone"},
        Case{"old", 1, ErrorCode::kRefused, "no control old"}}) {
    EXPECT_THAT(with_controls({{c.name, double(c.value)}}), FailsWith(c.code, HasSubstr(c.part)));
  }
  EXPECT_THAT(error_of(with_controls({{"x", 1}})).message, AllOf(Not(HasSubstr("label")), Not(HasSubstr("old"))));
}

TEST_F(V4l2CameraTest, OldDriversAreQueriedWithTheOldCall) {
  device_.queries_controls_the_old_way = true;
  device_.controls = {{.title = "Gain", .minimum = 10, .maximum = 100},
                      {.title = "Pixel Rate", .type = V4L2_CTRL_TYPE_INTEGER64, .maximum = 1LL << 40}};
  ASSERT_TRUE(with_controls({{"gain", 50}, {"pixel_rate", 1LL << 36}}));
  EXPECT_EQ(device_.controls[1].value, 1LL << 36) << "bounds that the old call cannot report are not applied";
  EXPECT_THAT(error_of(with_controls({{"gain", 5}})).message, HasSubstr("must be 10 to 100"));
}

TEST_F(V4l2CameraTest, AnUnplugWhileItIsConfiguredIsReportedAndTheCameraIsFoundAgain) {
  ASSERT_TRUE(open());
  kernel_->unplug(device_);
  EXPECT_EQ(error_of(camera_->configure({64, 48, 20})).code, ErrorCode::kDisconnected);
  device_.open_error = ENOENT;
  EXPECT_EQ(error_of(camera_->configure({64, 48, 20})).code, ErrorCode::kDisconnected) << "still unplugged";
  device_.open_error = 0;
  EXPECT_TRUE(camera_->configure({64, 48, 20}));

  kernel_->unplug(device_);
  EXPECT_EQ(error_of(camera_->start()).code, ErrorCode::kDisconnected);
  EXPECT_TRUE(camera_->start()) << "it is opened again";
}

TEST_F(V4l2CameraTest, ACameraThatComesBackWithAnotherSizeDoesNotStart) {
  ASSERT_TRUE(configure({"/dev/video0", "", {}}));
  kernel_->unplug(device_);
  EXPECT_EQ(error_of(camera_->start()).code, ErrorCode::kDisconnected);
  device_.adjust = [](std::uint32_t, std::uint32_t& width, std::uint32_t&) { width = 32; };
  EXPECT_THAT(camera_->start(),
              FailsWith(ErrorCode::kRefused, HasSubstr("32 x 48 pixels at 20 Hz instead of 64 x 48 at 20")));
}

}  // namespace
}  // namespace twocone::test
