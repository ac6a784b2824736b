// SPDX-License-Identifier: Apache-2.0
#include "drivers/backends.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/libcamera_camera/libcamera_camera.h"
#include "drivers/memory/memory.h"
#include "drivers/serial_diffdrive/transport.h"
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

using OpenedCamera = Result<std::unique_ptr<Camera>>;
using OpenedDrive = Result<std::unique_ptr<DiffDrive>>;

OpenedCamera open_memory_camera(Shared& shared, const char* /*view*/, const CameraPart& /*part*/) {
  return {std::make_unique<memory::MemoryCamera>(shared.clock)};
}

OpenedDrive open_memory_drive(Shared& shared, const DrivePart& part) {
  return {std::make_unique<memory::MemoryDiffDrive>(shared.clock, part.limits)};
}

std::vector<std::string> v4l2_nodes(std::vector<std::string> names) {
  for (std::string& name : names) name = v4l2::node_of(name);
  return names;
}

/// Returns for each name the id of the one camera of that model, else the name itself. Lists the cameras once.
std::vector<std::string> libcamera_ids(std::vector<std::string> names) {
  const auto cameras = libcamera_camera::list_cameras();
  if (!cameras) return names;
  for (std::string& name : names) {
    if (std::ranges::count(*cameras, name, &DeviceInfo::what) != 1) continue;
    name = std::ranges::find(*cameras, name, &DeviceInfo::what)->name;
  }
  return names;
}

/// Everything that the program needs to know about one driver. Only this table names every driver.
struct Row {
  Backend backend;
  OpenedCamera (*open_camera)(Shared&, const char* view, const CameraPart&) = nullptr;
  OpenedDrive (*open_drive)(Shared&, const DrivePart&) = nullptr;
  void (*check_camera)(const CameraDevice&) = nullptr;  ///< throws std::invalid_argument
  Result<std::vector<DeviceInfo>> (*list)() = nullptr;  ///< this machine's devices
  /// Returns one id for each name; two names of one camera have equal ids.
  std::vector<std::string> (*device_ids)(std::vector<std::string> names) = nullptr;
};

using Keys = Backend::Keys;
const std::array kRows{
    Row{.backend = {kMemory, true, true, ""}, .open_camera = open_memory_camera, .open_drive = open_memory_drive},
    Row{.backend = {kSimPovray, true, true, ""},
        .open_camera = [](Shared& shared, const char* view, const CameraPart& part) -> OpenedCamera {
          return shared.simulation->open_camera({view, part.antialias, part.effects});
        },
        .open_drive = [](Shared& shared, const DrivePart&) -> OpenedDrive { return shared.simulation->open_drive(); }},
    Row{.backend = {"v4l2_camera", true, false, v4l2::why_not(), Keys::kCameraWithIntegers},
        .open_camera = [](Shared&, const char*, const CameraPart& part) { return v4l2::open_camera(part.device); },
        .check_camera = v4l2::check,
        .list = []() -> Result<std::vector<DeviceInfo>> { return v4l2::list_cameras(); },
        .device_ids = v4l2_nodes},
    Row{.backend = {"libcamera_camera", true, false, libcamera_camera::why_not(), Keys::kCamera},
        .open_camera = [](Shared&, const char*,
                          const CameraPart& part) { return libcamera_camera::open_camera(part.device); },
        .check_camera = libcamera_camera::check,
        .list = libcamera_camera::list_cameras,
        .device_ids = libcamera_ids},
    Row{.backend = {kSerialDiffDrive, false, true, serial::why_not(), Keys::kSerialDrive},
        .open_drive = [](Shared&, const DrivePart& part) { return serial::open_drive(*part.serial, part.limits); },
        .list = []() -> Result<std::vector<DeviceInfo>> { return serial::list_ports(); }},
};

/// Returns the driver's row; null: there is no such driver.
const Row* find_row(std::string_view driver) {
  const auto row = std::ranges::find(kRows, driver, [](const Row& each) { return each.backend.name; });
  return row == kRows.end() ? nullptr : &*row;
}

/// A part, by its name in messages, and the driver that it requests.
struct Wanted {
  std::string part;
  std::string driver;
  const CameraPart* camera = nullptr;  ///< null: the part is the drive

  [[nodiscard]] bool suits(const Backend& backend) const { return camera ? backend.for_cameras : backend.for_drive; }
};

std::string other_part(const OtherCamera& camera) { return "cameras." + camera.name; }

/// Returns the parts in this order: lower, upper, drive, then the other cameras.
std::vector<Wanted> parts_of(const RobotSettings& settings) {
  std::vector<Wanted> parts{{"cameras.lower", settings.lower.driver, &settings.lower},
                            {"cameras.upper", settings.upper.driver, &settings.upper},
                            {kDrivePart, settings.drive.driver}};
  for (const OtherCamera& other : settings.others) parts.push_back({other_part(other), other.part.driver, &other.part});
  return parts;
}

/// Returns the drivers for this kind of part that are in this build, or those that are not: "memory, sim_povray".
std::string drivers_for(const Wanted& wanted, bool available = true) {
  std::vector<std::string_view> names;
  for (const Backend& backend : backends()) {
    if (backend.available() == available && wanted.suits(backend)) names.push_back(backend.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

Result<const Row*> find_row(const Wanted& wanted) {
  const Row* const row = find_row(wanted.driver);
  if (row == nullptr) {
    const std::string lacking = drivers_for(wanted, false);
    return Error(ErrorCode::kNotFound, "{}: there is no driver '{}'; drivers for it are: {}{}", wanted.part,
                 wanted.driver, drivers_for(wanted), lacking.empty() ? "" : " (not in this build: " + lacking + ")");
  }
  if (!wanted.suits(row->backend)) {
    return Error(ErrorCode::kRefused, "{}: driver '{}' is for {}; drivers for it are: {}", wanted.part, wanted.driver,
                 wanted.camera ? "a drive" : "cameras", drivers_for(wanted));
  }
  if (!row->backend.available()) {
    return Error(ErrorCode::kUnavailable, "{}: driver '{}' is not in this build: {}; drivers that are: {}", wanted.part,
                 wanted.driver, row->backend.why_not, drivers_for(wanted));
  }
  return row;
}

bool is_simulated(const Wanted& wanted) { return wanted.driver == kSimPovray; }

/// Checks that every part has a driver, and that the drivers can be combined.
Status check_drivers(const RobotSettings& settings) {
  const auto parts = parts_of(settings);
  for (const Wanted& part : parts) {
    if (const auto row = find_row(part); !row) return row.error();
  }
  const auto simulated = std::ranges::count_if(parts, is_simulated);
  if (simulated != 0 && simulated != std::ssize(parts)) {
    std::vector<std::string> named;
    named.reserve(parts.size());
    for (const Wanted& part : parts) named.push_back(fmt::format("{}: {}", part.part, part.driver));
    return Error(ErrorCode::kRefused,
                 "{}: sim_povray moves all parts of a robot or none: a simulated camera cannot see a real drive move",
                 fmt::join(named, ", "));
  }
  return {};
}

/// Adds the complaints of `checked` to `bad`.
template <typename Check>
void collect(std::string& bad, const std::string& part, Check checked) {
  try {
    checked();
  } catch (const std::invalid_argument& complaint) {
    bad += fmt::format("\n  {}: {}", part, complaint.what());
  }
}

/// Checks a part by the rules of its driver.
void check_part(std::string& bad, const std::string& part, const CameraPart& camera) {
  collect(bad, part, [&] { twocone::check(camera.settings); });
  collect(bad, part, [&] { sim_povray::check(sim_povray::ViewSettings{part, camera.antialias, camera.effects}); });
  const Row* const row = find_row(camera.driver);
  if (row != nullptr && row->check_camera != nullptr) collect(bad, part, [&] { row->check_camera(camera.device); });
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

/// Opens a part outside of a robot, by the call `open` of its row.
template <typename Device, typename Open>
Result<std::unique_ptr<Device>> open_alone(const Wanted& wanted, Open open) {
  const auto row = find_row(wanted);
  if (!row) return row.error();
  if (is_simulated(wanted)) {
    return Error(ErrorCode::kRefused, "{}: a part of a simulated robot cannot be opened alone", wanted.part);
  }
  Shared shared;
  Result<std::unique_ptr<Device>> opened = open(**row, shared);
  if (!opened) return with_name(wanted.part, opened.error());
  return opened;
}

}  // namespace

Devices list_devices() {
  Devices devices;
  for (const Row& row : kRows) {
    if (row.list == nullptr) continue;
    auto found =
        row.backend.available() ? row.list() : Error{ErrorCode::kUnavailable, std::string(row.backend.why_not)};
    if (!found) {
      devices.not_looked_for.push_back(fmt::format("{}: {}", row.backend.name, found.error().message));
      continue;
    }
    for (DeviceInfo& device : *found) {
      device.driver = row.backend.name;
      devices.found.push_back(std::move(device));
    }
  }
  return devices;
}

Result<std::unique_ptr<Camera>> open_camera(const std::string& part, const CameraPart& camera) {
  std::string bad;
  check_part(bad, part, camera);
  if (!bad.empty()) throw std::invalid_argument("CameraPart:" + bad);
  return open_alone<Camera>({part, camera.driver, &camera}, [&](const Row& row, Shared& shared) {
    return row.open_camera(shared, part.c_str(), camera);
  });
}

Result<std::unique_ptr<DiffDrive>> open_drive(const DrivePart& drive) {
  std::string bad;
  check_part(bad, drive);
  if (!bad.empty()) throw std::invalid_argument("DrivePart:" + bad);
  return open_alone<DiffDrive>({kDrivePart, drive.driver},
                               [&](const Row& row, Shared& shared) { return row.open_drive(shared, drive); });
}

Status check_cameras_differ(const RobotSettings& settings) {
  const std::vector<Wanted> all = parts_of(settings);
  for (const Row& row : kRows) {
    if (row.device_ids == nullptr) continue;
    std::vector<std::string> parts;
    std::vector<std::string> names;
    for (const Wanted& wanted : all) {
      if (!wanted.camera || wanted.driver != row.backend.name) continue;
      parts.push_back(wanted.part);
      names.push_back(wanted.camera->device.name);
    }
    if (names.empty()) continue;
    const std::vector<std::string> ids = row.device_ids(names);
    for (std::size_t a = 0; a < ids.size(); ++a) {
      const auto same = std::find(ids.begin() + std::ptrdiff_t(a) + 1, ids.end(), ids[a]);
      if (same == ids.end()) continue;
      const auto b = std::size_t(same - ids.begin());
      return Error(ErrorCode::kRefused,
                   "{} ('{}') and {} ('{}') are one camera, {}; give each its own device:, as twocone "
                   "devices lists them",
                   parts[a], names[a], parts[b], names[b], ids[a]);
    }
  }
  return {};
}

std::vector<Backend> backends() {
  std::vector<Backend> all;
  all.reserve(std::size(kRows));
  for (const Row& row : kRows) all.push_back(row.backend);
  return all;
}

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
  if (std::ranges::any_of(parts, is_simulated)) {
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
  if (auto known = check_drivers(settings); !known) return known.error();
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
  const auto open_view = [&](const std::string& part, const std::string& view, const CameraPart& camera) {
    OpenedCamera opened = find_row(camera.driver)->open_camera(shared, view.c_str(), camera);
    return opened ? std::move(opened) : with_name(part, opened.error());
  };
  auto lower = open_view("cameras.lower", "lower", settings.lower);
  if (!lower) return lower.error();
  auto upper = open_view("cameras.upper", "upper", settings.upper);
  if (!upper) return upper.error();
  auto drive = find_row(settings.drive.driver)->open_drive(shared, settings.drive);
  if (!drive) return with_name(kDrivePart, drive.error());
  std::vector<NamedCamera> others;
  for (const OtherCamera& wanted : settings.others) {
    auto camera = open_view(other_part(wanted), wanted.name, wanted.part);
    if (!camera) return camera.error();
    others.push_back({wanted.name, *std::move(camera), wanted.part.settings});
  }
  return Robot(StereoRig(*std::move(lower), *std::move(upper), settings.max_skew), *std::move(drive), std::move(truth),
               std::move(others), std::move(pace));
}

}  // namespace twocone::drivers
