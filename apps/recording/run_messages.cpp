// SPDX-License-Identifier: Apache-2.0
#include "apps/recording/run_messages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>
#include <Eigen/Eigenvalues>

#include "apps/config/to_layers.h"
#include "apps/config/yaml/text_file.h"
#include "apps/recording/foxglove.pb.h"
#include "apps/runlog/summary/summary.h"
#include "apps/telemetry/telemetry.h"

namespace twocone::recording {
namespace {

void set(google::protobuf::Timestamp& stamp, double t_s) {
  const std::uint64_t ns = to_ns(t_s);
  stamp.set_seconds(std::int64_t(ns / 1'000'000'000));
  stamp.set_nanos(std::int32_t(ns % 1'000'000'000));
}

template <typename Vector>
void set(Vector& to, double x, double y, double z) {
  to.set_x(x);
  to.set_y(y);
  to.set_z(z);
}

/// Sets a turn about the upright axis.
void set_turn(foxglove::Quaternion& to, double angle_rad) {
  set(to, 0, 0, std::sin(angle_rad / 2));
  to.set_w(std::cos(angle_rad / 2));
}

void set(foxglove::Pose& to, double x_m, double y_m, double z_m, double heading_rad) {
  set(*to.mutable_position(), x_m, y_m, z_m);
  set_turn(*to.mutable_orientation(), heading_rad);
}

/// Returns the schema of a message of foxglove.proto: its name, and all definitions that it needs.
template <typename Message>
mcap::Schema schema_of() {
  const google::protobuf::FileDescriptor* const file = Message::descriptor()->file();
  google::protobuf::FileDescriptorSet files;
  for (int i = 0; i < file->dependency_count(); ++i) file->dependency(i)->CopyTo(files.add_file());
  file->CopyTo(files.add_file());
  return {Message::descriptor()->full_name(), "protobuf", files.SerializeAsString()};
}

/// The schema of a type, once.
template <typename Message>
const mcap::Schema& schema_for() {
  static const mcap::Schema schema = schema_of<Message>();
  return schema;
}
const mcap::Schema& schema_of_telemetry() {
  static const mcap::Schema schema{telemetry::kSchema, "jsonschema", R"({"type": "object"})"};
  return schema;
}

/// A variance of x and y with their covariance.
struct PlaneCovariance {
  double xx_m2, xy_m2, yy_m2;
};

/// Adds the 95 % ellipse around a place, on the floor.
void add_ellipse(foxglove::SceneEntity& entity, double x_m, double y_m, const PlaneCovariance& covariance) {
  const Eigen::Matrix2d matrix{{covariance.xx_m2, covariance.xy_m2}, {covariance.xy_m2, covariance.yy_m2}};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(matrix);
  const Eigen::Vector2d radii_m = (runlog::k95Ellipse * axes.eigenvalues().cwiseMax(0)).cwiseSqrt();
  foxglove::LinePrimitive& line = *entity.add_lines();
  line.set_type(foxglove::LinePrimitive::LINE_LOOP);
  line.set_thickness(2);
  line.set_scale_invariant(true);
  set(*line.mutable_pose(), 0, 0, 0, 0);
  line.mutable_color()->set_a(1);
  constexpr int kPoints = 36;
  for (int i = 0; i < kPoints; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / kPoints;
    const Eigen::Vector2d p =
        axes.eigenvectors() * radii_m.cwiseProduct(Eigen::Vector2d(std::cos(angle_rad), std::sin(angle_rad)));
    set(*line.add_points(), x_m + p.x(), y_m + p.y(), 0.0);
  }
}

/// A landmark as a cylinder, with its covariance.
struct Cylinder {
  std::string name;
  double x_m, y_m, radius_m, top_m;
  Eigen::Vector3d rgb;
  PlaneCovariance covariance;
};

void add_landmark(foxglove::SceneUpdate& update, double t_s, const Cylinder& landmark) {
  foxglove::SceneEntity& entity = *update.add_entities();
  set(*entity.mutable_timestamp(), t_s);
  entity.set_frame_id("world");
  entity.set_id(landmark.name);
  const auto add_text = [&entity](const char* key, double value) {
    foxglove::KeyValuePair& pair = *entity.add_metadata();
    pair.set_key(key);
    pair.set_value(fmt::format("{}", value));
  };
  add_text("var_x_m2", landmark.covariance.xx_m2);
  add_text("cov_xy_m2", landmark.covariance.xy_m2);
  add_text("var_y_m2", landmark.covariance.yy_m2);
  foxglove::CylinderPrimitive& cylinder = *entity.add_cylinders();
  set(*cylinder.mutable_pose(), landmark.x_m, landmark.y_m, landmark.top_m / 2, 0);
  set(*cylinder.mutable_size(), 2 * landmark.radius_m, 2 * landmark.radius_m, landmark.top_m);
  cylinder.set_bottom_scale(1);
  cylinder.set_top_scale(1);
  foxglove::Color& color = *cylinder.mutable_color();
  color.set_r(landmark.rgb.x());
  color.set_g(landmark.rgb.y());
  color.set_b(landmark.rgb.z());
  color.set_a(1);
  add_ellipse(entity, landmark.x_m, landmark.y_m, landmark.covariance);
}

std::optional<vision::Rig> rig_of(const config::Robot& robot) {
  try {
    return config::to_rig(robot);
  } catch (const config::FileError&) {
    return std::nullopt;  // numbers that make no rig
  }
}

Eigen::Vector3d colour_of(const config::Landmark& landmark) {
  return {landmark.colour[0], landmark.colour[1], landmark.colour[2]};
}

}  // namespace

std::vector<RunTopic> topics_of_runs() {
  std::vector<RunTopic> topics;
  const auto add = [&topics]<typename Message>(const Message& /*type*/, std::initializer_list<const char*> names) {
    for (const char* const name : names) topics.push_back({name, schema_for<Message>(), "protobuf"});
  };
  add(foxglove::CompressedImage(), {"/lower/image", "/upper/image"});
  add(foxglove::CameraCalibration(), {"/lower/camera_info", "/upper/camera_info"});
  add(foxglove::PoseInFrame(), {"/odometry", "/fix", "/track", "/truth"});
  add(foxglove::FrameTransform(), {"/tf"});
  add(foxglove::LaserScan(), {"/scan"});
  add(foxglove::SceneUpdate(), {"/landmarks"});
  add(foxglove::Log(), {"/events"});
  topics.push_back({"/telemetry", schema_of_telemetry(), "json"});
  return topics;
}

std::uint64_t to_ns(double t_s) { return std::uint64_t(std::llround(std::max(0.0, t_s) * 1e9)); }

RunMessages::RunMessages(const config::Robot& robot, const config::Map& map, Emit emit)
    : robot_(robot), map_(map), rig_(rig_of(robot)), emit_(std::move(emit)) {}

template <typename Message>
void RunMessages::add(const std::string& topic, double t_s, const Message& message) const {
  emit_({topic, schema_for<Message>(), "protobuf", t_s, message.SerializeAsString()});
}

void RunMessages::add_line(double t_s, const std::string& line) const {
  emit_({"/telemetry", schema_of_telemetry(), "json", t_s, line});
}

void RunMessages::begin(const std::string& first_line) const {
  add_line(0, first_line);
  foxglove::SceneUpdate landmarks;
  for (const config::Landmark& l : map_.landmarks) {
    const double xx_m2 = l.sigma.x_m * l.sigma.x_m, yy_m2 = l.sigma.y_m * l.sigma.y_m;
    add_landmark(landmarks, 0, {l.name, l.x_m, l.y_m, l.radius_m, l.top_m, colour_of(l), {xx_m2, 0, yy_m2}});
  }
  if (landmarks.entities_size() > 0) add("/landmarks", 0, landmarks);
  if (!rig_) return;
  for (const vision::Side side : {vision::Side::kLower, vision::Side::kUpper}) {
    const vision::MirrorViewSettings& s = vision::of_view(*rig_, side).settings();
    foxglove::FrameTransform lens;
    set(*lens.mutable_timestamp(), 0);
    lens.set_parent_frame_id("body");
    lens.set_child_frame_id(std::string(to_string(side)));
    set(*lens.mutable_translation(), s.axis_offset_m.x(), s.axis_offset_m.y(), s.lens_height_m);
    set_turn(*lens.mutable_rotation(), s.azimuth_rad);
    add("/tf", 0, lens);
  }
}

void RunMessages::event(double t_s, const std::string& text, bool is_warning) const {
  foxglove::Log log;
  set(*log.mutable_timestamp(), t_s);
  log.set_level(is_warning ? foxglove::Log::WARNING : foxglove::Log::INFO);
  log.set_message(text);
  log.set_name("twocone");
  add("/events", t_s, log);
}

void RunMessages::image(vision::Side side, double t_s, const std::string& format, std::string content) const {
  const std::string name(to_string(side));
  foxglove::CompressedImage image;
  set(*image.mutable_timestamp(), t_s);
  image.set_frame_id(name);
  image.set_format(format);
  image.set_data(std::move(content));
  add("/" + name + "/image", t_s, image);
}

void RunMessages::frame(const runlog::FrameRecord& record, bool has_odometry, const std::string& line) const {
  const double t_s = record.frame.t_s;
  if (rig_) {
    add_lens(vision::Side::kLower, t_s);
    add_lens(vision::Side::kUpper, t_s);
  }
  if (has_odometry) add_pose("/odometry", t_s, record.odometry);
  if (record.truth) add_pose("/truth", t_s, *record.truth);
  const bool is_one = record.answer.fixes.size() == 1;  // an ambiguous frame has two
  for (const runlog::FixRow& fix : record.answer.fixes) {
    const bool is_answer = is_one && fix.x_m && fix.heading_rad && !runlog::is_out_of_bounds(fix);
    if (is_answer) add_pose("/fix", t_s, {t_s, *fix.x_m, *fix.y_m, *fix.heading_rad});
    if (fix.verdict != "ok") event(t_s, fmt::format("fix: {}", fix.verdict), true);
  }
  if (record.answer.track) add_track(t_s, *record.answer.track);
  add_scan(t_s, record.scan);
  foxglove::SceneUpdate found;
  for (const runlog::LandmarkRow& l : record.answer.landmarks) {
    add_landmark(found, t_s,
                 {l.landmark,
                  l.x_m,
                  l.y_m,
                  l.radius_m,
                  l.top_m,
                  Eigen::Vector3d::Constant(0.5),
                  {l.var_x_m2, l.cov_xy_m2, l.var_y_m2}});
  }
  if (found.entities_size() > 0) add("/landmarks", t_s, found);
  add_line(t_s, line);
}

void RunMessages::add_lens(vision::Side side, double t_s) const {
  const std::string name(to_string(side));
  const CameraSettings& camera = (side == vision::Side::kLower ? robot_.lower : robot_.upper).settings;
  const vision::MirrorView& view = vision::of_view(*rig_, side);
  const vision::MirrorViewSettings& s = view.settings();
  foxglove::CameraCalibration calibration;
  set(*calibration.mutable_timestamp(), t_s);
  calibration.set_frame_id(name);
  calibration.set_width(std::uint32_t(camera.width_px));
  calibration.set_height(std::uint32_t(camera.height_px));
  const double focal_px = view.focal_length_px();
  Eigen::Vector2d f_px(focal_px, focal_px), c_px = s.centre_px;
  if (s.distortion) {
    f_px = s.distortion->focal_px;
    c_px = s.distortion->principal_px;
    calibration.set_distortion_model(s.distortion->coefficients.size() > 5 ? "rational_polynomial" : "plumb_bob");
    for (const double coefficient : s.distortion->coefficients) calibration.add_d(coefficient);
  }
  for (const double k : {f_px.x(), 0.0, c_px.x(), 0.0, f_px.y(), c_px.y(), 0.0, 0.0, 1.0}) calibration.add_k(k);
  for (const double r : {1., 0., 0., 0., 1., 0., 0., 0., 1.}) calibration.add_r(r);
  for (const double p : {f_px.x(), 0.0, c_px.x(), 0.0, 0.0, f_px.y(), c_px.y(), 0.0, 0.0, 0.0, 1.0, 0.0}) {
    calibration.add_p(p);
  }
  add("/" + name + "/camera_info", t_s, calibration);
}

void RunMessages::add_pose(const std::string& topic, double t_s, const runlog::PoseRow& pose) const {
  foxglove::PoseInFrame message;
  set(*message.mutable_timestamp(), t_s);
  message.set_frame_id("world");
  set(*message.mutable_pose(), pose.x_m, pose.y_m, 0, pose.heading_rad);
  add(topic, t_s, message);
}

void RunMessages::add_track(double t_s, const runlog::TrackRow& track) const {
  const auto pose = runlog::pose_of(track);
  if (!pose) return;
  add_pose("/track", t_s, *pose);
  foxglove::FrameTransform body;
  set(*body.mutable_timestamp(), t_s);
  body.set_parent_frame_id("world");
  body.set_child_frame_id("body");
  set(*body.mutable_translation(), pose->x_m, pose->y_m, 0);
  set_turn(*body.mutable_rotation(), pose->heading_rad);
  add("/tf", t_s, body);
}

void RunMessages::add_scan(double t_s, const std::vector<vision::Beam>& beams) const {
  if (beams.empty()) return;
  foxglove::LaserScan scan;
  set(*scan.mutable_timestamp(), t_s);
  scan.set_frame_id("body");
  set(*scan.mutable_pose(), 0, 0, 0, 0);
  scan.set_start_angle(vision::beam_bearing_rad(0, beams.size()));
  scan.set_end_angle(vision::beam_bearing_rad(beams.size() - 1, beams.size()));
  for (const vision::Beam& beam : beams) {
    const bool is_thing = beam.state == vision::BeamState::kOccupied;
    scan.add_ranges(is_thing ? beam.range_m : std::numeric_limits<double>::quiet_NaN());
  }
  add("/scan", t_s, scan);
}

}  // namespace twocone::recording
