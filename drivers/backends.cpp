// SPDX-License-Identifier: Apache-2.0
#include "drivers/backends.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/libcamera_camera/libcamera_camera.h"
#include "drivers/memory/memory_camera.h"
#include "drivers/memory/memory_diffdrive.h"
#include "drivers/serial_diffdrive/serial_port.h"
#include "drivers/sim_povray/simulation.h"
#include "drivers/v4l2_camera/v4l2_camera.h"

namespace twocone::drivers {
namespace {

constexpr const char* kDrivePart = "drive";

// A world in this program advances without delay, because its images arrive later. A served world waits for the slowest
// of its robots, whose program may be working on an image.
constexpr std::chrono::milliseconds kFrameTimeout{5'000};
constexpr std::chrono::milliseconds kServedFrameTimeout{60'000};

/// Objects that the parts of one robot share. They are made before the parts.
struct Shared {
  std::shared_ptr<ManualClock> clock = std::make_shared<ManualClock>();  ///< memory
  std::unique_ptr<sim_povray::Simulation> simulation;                    ///< sim_povray
};

using CameraOpener = Result<std::unique_ptr<Camera>> (*)(Shared&, const char* view, const CameraPart&);
using DriveOpener = Result<std::unique_ptr<DiffDrive>> (*)(Shared&, const DrivePart&);

Result<std::unique_ptr<Camera>> open_memory_camera(Shared& shared, const char*, const CameraPart&) {
  return std::unique_ptr<Camera>(
      std::make_unique<memory::MemoryCamera>(shared.clock, memory::WhenNotDue::kAdvance, memory::test_pattern));
}

Result<std::unique_ptr<DiffDrive>> open_memory_drive(Shared& shared, const DrivePart& part) {
  return std::unique_ptr<DiffDrive>(std::make_unique<memory::MemoryDiffDrive>(shared.clock, part.limits));
}

Result<std::unique_ptr<Camera>> open_sim_camera(Shared& shared, const char* view, const CameraPart& part) {
  return shared.simulation->open_camera({view, part.antialias, part.effects});
}

Result<std::unique_ptr<DiffDrive>> open_sim_drive(Shared& shared, const DrivePart&) {
  return shared.simulation->open_drive();
}

v4l2::V4l2Settings to_v4l2(const CameraDevice& device) {
  v4l2::V4l2Settings settings{device.name, device.format, {}};
  for (const auto& [name, value] : device.controls) settings.controls.emplace_back(name, std::llround(value));
  return settings;
}

libcamera_camera::LibcameraSettings to_libcamera(const CameraDevice& device) {
  return {device.name, device.format, device.controls};
}

Result<std::unique_ptr<Camera>> open_v4l2_camera(Shared&, const char*, const CameraPart& part) {
  auto camera = v4l2::V4l2Camera::open(to_v4l2(part.device));
  if (!camera) return camera.error();
  return std::unique_ptr<Camera>(*std::move(camera));
}

Result<std::unique_ptr<Camera>> open_libcamera_camera(Shared&, const char*, const CameraPart& part) {
  return libcamera_camera::open_camera(to_libcamera(part.device));
}

Result<std::unique_ptr<DiffDrive>> open_serial_drive(Shared&, const DrivePart& part) {
  auto drive = serial::SerialDiffDrive::open(*part.serial, part.limits);
  if (!drive) return drive.error();
  return std::unique_ptr<DiffDrive>(*std::move(drive));
}

/// What `checked` complains about; empty: nothing.
template <typename Check>
std::string complaint_of(Check checked) {
  try {
    checked();
    return {};
  } catch (const std::invalid_argument& complaint) {
    return complaint.what();
  }
}

// ---- checks and lists of each driver

std::string complaint_about_v4l2(const CameraDevice& device) {
  return complaint_of([&] { v4l2::check(to_v4l2(device)); });
}
std::string complaint_about_libcamera(const CameraDevice& device) {
  return complaint_of([&] { libcamera_camera::check(to_libcamera(device)); });
}

void list_v4l2(Devices& devices) {
  for (v4l2::CameraInfo& camera : v4l2::list_cameras()) {
    devices.found.push_back({std::string(kV4l2Camera), camera.stable_path.empty() ? camera.path : camera.stable_path,
                             fmt::format("{} ({}, {})", camera.card, camera.path, camera.bus),
                             std::move(camera.modes)});
  }
}
void list_libcamera(Devices& devices) {
  auto cameras = libcamera_camera::list_cameras();
  if (!cameras) {
    devices.not_looked_for.push_back(fmt::format("{}: {}", kLibcameraCamera, cameras.error().message));
    return;
  }
  for (libcamera_camera::CameraInfo& camera : *cameras) {
    devices.found.push_back({std::string(kLibcameraCamera), camera.id, camera.model, std::move(camera.formats)});
  }
}
void list_serial_ports(Devices& devices) {
  for (const serial::PortInfo& port : serial::list_ports()) {
    devices.found.push_back({std::string(kSerialDiffDrive),
                             port.stable_path.empty() ? port.path : port.stable_path,
                             port.description.empty() ? port.path : fmt::format("{} ({})", port.description, port.path),
                             {}});
  }
}

std::vector<std::string> v4l2_nodes(std::vector<std::string> names) {
  for (std::string& name : names) name = v4l2::node_of(name);
  return names;
}

/// For each name the id of the one camera of that model, else the name itself. Lists the cameras once.
std::vector<std::string> libcamera_ids(std::vector<std::string> names) {
  const auto cameras = libcamera_camera::list_cameras();
  if (!cameras) return names;
  for (std::string& name : names) {
    const auto is_it = [&](const libcamera_camera::CameraInfo& camera) { return camera.model == name; };
    if (std::count_if(cameras->begin(), cameras->end(), is_it) != 1) continue;
    name = std::find_if(cameras->begin(), cameras->end(), is_it)->id;
  }
  return names;
}

/// All that the program knows of one driver. Only this table names every driver.
struct Row {
  Backend backend;
  CameraOpener open_camera = nullptr;
  DriveOpener open_drive = nullptr;
  std::string (*complain)(const CameraDevice&) =
      nullptr;                       ///< what is wrong with a camera's device keys; empty: nothing
  void (*list)(Devices&) = nullptr;  ///< adds this machine's devices
  /// One id for each name; two names of one camera have equal ids.
  std::vector<std::string> (*device_ids)(std::vector<std::string> names) = nullptr;
};

using Keys = Backend::Keys;
const std::array kRows{
    Row{{kMemory, true, true, ""}, open_memory_camera, open_memory_drive},
    Row{{kSimPovray, true, true, ""}, open_sim_camera, open_sim_drive},
    Row{{kV4l2Camera, true, false, v4l2::why_not(), Keys::kCameraWithIntegers},
        open_v4l2_camera,
        nullptr,
        complaint_about_v4l2,
        list_v4l2,
        v4l2_nodes},
    Row{{kLibcameraCamera, true, false, libcamera_camera::why_not(), Keys::kCamera},
        open_libcamera_camera,
        nullptr,
        complaint_about_libcamera,
        list_libcamera,
        libcamera_ids},
    Row{{kSerialDiffDrive, false, true, serial::why_not(), Keys::kSerialDrive},
        nullptr,
        open_serial_drive,
        nullptr,
        list_serial_ports},
};

const auto kBackends = [] {
  std::array<Backend, kRows.size()> all{};
  std::transform(kRows.begin(), kRows.end(), all.begin(), [](const Row& row) { return row.backend; });
  return all;
}();

/// Null: there is no such driver.
const Row* find_row(std::string_view driver) {
  const auto row = std::find_if(kRows.begin(), kRows.end(), [&](const Row& r) { return r.backend.name == driver; });
  return row == kRows.end() ? nullptr : &*row;
}

/// A part, by its name in messages, and the driver that it requests.
struct Wanted {
  std::string part;
  bool is_camera;
  std::string driver;

  [[nodiscard]] bool suits(const Backend& backend) const { return is_camera ? backend.for_cameras : backend.for_drive; }
};

std::string other_part(const OtherCamera& camera) { return "cameras." + camera.name; }

/// The parts in this order: lower, upper, drive, then the other cameras.
std::vector<Wanted> parts_of(const RobotSettings& settings) {
  std::vector<Wanted> parts{{"cameras.lower", true, settings.lower.driver},
                            {"cameras.upper", true, settings.upper.driver},
                            {kDrivePart, false, settings.drive.driver}};
  for (const OtherCamera& camera : settings.others) parts.push_back({other_part(camera), true, camera.part.driver});
  return parts;
}

/// The drivers for this kind of part that are in this build, or those that are not: "memory, sim_povray".
std::string drivers_for(const Wanted& wanted, bool available = true) {
  std::vector<std::string_view> names;
  for (const Backend& backend : kBackends) {
    if (backend.available() == available && wanted.suits(backend)) names.push_back(backend.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

Result<const Row*> find_row(const Wanted& wanted) {
  const Row* const row = find_row(wanted.driver);
  if (row == nullptr) {
    const std::string lacking = drivers_for(wanted, false);
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: there is no driver '{}'; drivers for it are: {}{}", wanted.part, wanted.driver,
                             drivers_for(wanted), lacking.empty() ? "" : " (not in this build: " + lacking + ")")};
  }
  if (!wanted.suits(row->backend)) {
    return Error{ErrorCode::kRefused,
                 fmt::format("{}: driver '{}' is for {}; drivers for it are: {}", wanted.part, wanted.driver,
                             wanted.is_camera ? "a drive" : "cameras", drivers_for(wanted))};
  }
  if (!row->backend.available()) {
    return Error{ErrorCode::kUnavailable,
                 fmt::format("{}: driver '{}' is not in this build: {}; drivers that are: {}", wanted.part,
                             wanted.driver, row->backend.why_not, drivers_for(wanted))};
  }
  return row;
}

bool is_simulated(const Wanted& wanted) { return wanted.driver == kSimPovray; }

/// The row of every part, after the check that all can be combined.
Result<std::vector<const Row*>> find_rows(const RobotSettings& settings) {
  const auto parts = parts_of(settings);
  std::vector<const Row*> rows;
  for (const Wanted& part : parts) {
    const auto row = find_row(part);
    if (!row) return row.error();
    rows.push_back(*row);
  }
  const auto simulated = std::count_if(parts.begin(), parts.end(), is_simulated);
  if (simulated != 0 && simulated != std::ssize(parts)) {
    std::vector<std::string> named;
    named.reserve(parts.size());
    for (const Wanted& part : parts) named.push_back(fmt::format("{}: {}", part.part, part.driver));
    return Error{ErrorCode::kRefused, fmt::format("{}: sim_povray moves all parts of a robot or none: a simulated "
                                                  "camera cannot see a real drive move",
                                                  fmt::join(named, ", "))};
  }
  return rows;
}

/// Adds what `checked` complains about to `bad`.
template <typename Check>
void collect(std::string& bad, const std::string& part, Check checked) {
  if (const std::string complaint = complaint_of(checked); !complaint.empty()) {
    bad += fmt::format("\n  {}: {}", part, complaint);
  }
}

/// Checks a part by the rules of its driver.
void check_part(std::string& bad, const std::string& part, const CameraPart& camera) {
  collect(bad, part, [&] { twocone::check(camera.settings); });
  collect(bad, part, [&] { sim_povray::check(sim_povray::ViewSettings{part, camera.antialias, camera.effects}); });
  const Row* const row = find_row(camera.driver);
  const std::string complaint = row != nullptr && row->complain != nullptr ? row->complain(camera.device) : "";
  if (!complaint.empty()) bad += fmt::format("\n  {}: {}", part, complaint);
}

void check_part(std::string& bad, const DrivePart& drive) {
  collect(bad, kDrivePart, [&] { twocone::check(drive.limits); });
  const Row* const row = find_row(drive.driver);
  if (row == nullptr || row->backend.keys != Keys::kSerialDrive) return;
  if (drive.serial) {
    collect(bad, kDrivePart, [&] { serial::check(*drive.serial); });
  } else {
    bad += fmt::format("\n  {}: serial is missing, {} needs it", kDrivePart, drive.driver);
  }
}

Error not_alone(const std::string& part) {
  return {ErrorCode::kRefused, fmt::format("{}: a part of a simulated robot cannot be opened alone", part)};
}

}  // namespace

Devices list_devices() {
  Devices devices;
  for (const Row& row : kRows) {
    if (row.list == nullptr) continue;
    if (row.backend.available()) {
      row.list(devices);
    } else {
      devices.not_looked_for.push_back(fmt::format("{}: {}", row.backend.name, row.backend.why_not));
    }
  }
  return devices;
}

Result<std::unique_ptr<Camera>> open_camera(const std::string& part, const CameraPart& camera) {
  std::string bad;
  check_part(bad, part, camera);
  if (!bad.empty()) throw std::invalid_argument("CameraPart:" + bad);
  const auto row = find_row({part, true, camera.driver});
  if (!row) return row.error();
  if (camera.driver == kSimPovray) return not_alone(part);
  Shared shared;
  auto opened = (*row)->open_camera(shared, part.c_str(), camera);
  if (!opened) return with_name(part, opened.error());
  return opened;
}

Result<std::unique_ptr<DiffDrive>> open_drive(const DrivePart& drive) {
  std::string bad;
  check_part(bad, drive);
  if (!bad.empty()) throw std::invalid_argument("DrivePart:" + bad);
  const auto row = find_row({kDrivePart, false, drive.driver});
  if (!row) return row.error();
  if (drive.driver == kSimPovray) return not_alone(kDrivePart);
  Shared shared;
  auto opened = (*row)->open_drive(shared, drive);
  if (!opened) return with_name(kDrivePart, opened.error());
  return opened;
}

Status check_cameras_differ(const RobotSettings& settings) {
  struct Entry {
    std::string part;
    const CameraPart* camera;
    std::string device;  ///< the unique name that the driver uses for it
  };
  std::vector<Entry> entries{{"cameras.lower", &settings.lower, {}}, {"cameras.upper", &settings.upper, {}}};
  for (const OtherCamera& other : settings.others) entries.push_back({other_part(other), &other.part, {}});
  for (const Row& row : kRows) {
    if (row.device_ids == nullptr) continue;
    std::vector<Entry*> of_driver;
    std::vector<std::string> names;
    for (Entry& entry : entries) {
      if (entry.camera->driver != row.backend.name) continue;
      of_driver.push_back(&entry);
      names.push_back(entry.camera->device.name);
    }
    if (names.empty()) continue;
    const std::vector<std::string> ids = row.device_ids(std::move(names));
    for (std::size_t i = 0; i < ids.size(); ++i) of_driver[i]->device = ids[i];
  }
  for (auto a = entries.begin(); a != entries.end(); ++a) {
    for (auto b = a + 1; b != entries.end(); ++b) {
      if (a->device.empty() || a->camera->driver != b->camera->driver || a->device != b->device) continue;
      return Error{ErrorCode::kRefused,
                   fmt::format("{} ('{}') and {} ('{}') are one camera, {}; give each its own device:, as twocone "
                               "devices lists them",
                               a->part, a->camera->device.name, b->part, b->camera->device.name, a->device)};
    }
  }
  return {};
}

std::span<const Backend> backends() { return kBackends; }

const Backend* find_backend(std::string_view name) {
  const Row* const row = find_row(name);
  return row == nullptr ? nullptr : &row->backend;
}

void check(const RobotSettings& settings) {
  std::string bad;
  check_part(bad, "cameras.lower", settings.lower);
  check_part(bad, "cameras.upper", settings.upper);
  for (const OtherCamera& camera : settings.others) {
    check_part(bad, other_part(camera), camera.part);
    if (camera.part.settings.rate_hz != settings.lower.settings.rate_hz) {
      bad += fmt::format("\n  {}: rate_hz is {} Hz, must be that of the pair, {} Hz", other_part(camera),
                         camera.part.settings.rate_hz, settings.lower.settings.rate_hz);
    }
  }
  if (settings.lower.settings.rate_hz != settings.upper.settings.rate_hz) {
    bad += fmt::format("\n  cameras: rate_hz is {} Hz for lower and {} Hz for upper, must be one rate for the pair",
                       settings.lower.settings.rate_hz, settings.upper.settings.rate_hz);
  }
  check_part(bad, settings.drive);
  if (settings.max_skew.count() < 0) {
    bad += fmt::format("\n  cameras: max_skew is {} ns, must be >= 0", settings.max_skew.count());
  }
  const auto parts = parts_of(settings);
  if (std::any_of(parts.begin(), parts.end(), is_simulated)) {
    if (!settings.world) {
      bad += "\n  world: is missing, sim_povray needs one";
    } else {
      collect(bad, "world", [&] { sim_povray::check(settings.world->session); });
      if (settings.world->attach.empty()) collect(bad, "world", [&] { sim_povray::check(settings.world->place); });
    }
  }
  if (!bad.empty()) throw std::invalid_argument("RobotSettings:" + bad);
}

Result<Robot> open_robot(const RobotSettings& settings) {
  check(settings);
  const auto rows = find_rows(settings);
  if (!rows) return rows.error();
  if (auto differ = check_cameras_differ(settings); !differ) return differ.error();

  Shared shared;
  std::unique_ptr<GroundTruth> truth;
  RobotPace pace;
  if (settings.drive.driver == kSimPovray) {
    SimulatedWorld world = *settings.world;
    world.session.drive = settings.drive.limits;
    auto simulation = world.attach.empty() ? sim_povray::Simulation::open(world.place, world.session)
                                           : sim_povray::Simulation::attach(world.attach, world.session);
    if (!simulation) return simulation.error();
    shared.simulation = *std::move(simulation);
    truth = shared.simulation->open_truth();
    pace = {.waits_for_program = true,
            .frame_timeout = world.attach.empty() ? kFrameTimeout : kServedFrameTimeout,
            .notice = "POV-Ray takes some seconds for the first"};
  }
  auto lower = (*rows)[0]->open_camera(shared, "lower", settings.lower);
  if (!lower) return with_name("cameras.lower", lower.error());
  auto upper = (*rows)[1]->open_camera(shared, "upper", settings.upper);
  if (!upper) return with_name("cameras.upper", upper.error());
  auto drive = (*rows)[2]->open_drive(shared, settings.drive);
  if (!drive) return with_name(kDrivePart, drive.error());
  std::vector<NamedCamera> others;
  for (std::size_t i = 0; i < settings.others.size(); ++i) {
    const OtherCamera& wanted = settings.others[i];
    auto camera = (*rows)[3 + i]->open_camera(shared, wanted.name.c_str(), wanted.part);
    if (!camera) return with_name(other_part(wanted), camera.error());
    others.push_back({wanted.name, *std::move(camera), wanted.part.settings});
  }
  return Robot(StereoRig(*std::move(lower), *std::move(upper), settings.max_skew), *std::move(drive), std::move(truth),
               std::move(others), std::move(pace));
}

}  // namespace twocone::drivers
