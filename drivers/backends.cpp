// SPDX-License-Identifier: Apache-2.0
#include "drivers/backends.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/memory/memory_camera.h"
#include "drivers/memory/memory_diffdrive.h"

namespace twocone::drivers {
namespace {

/// What the parts of one robot share, made once before them.
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

struct Row {
  Backend told;
  CameraOpener open_camera = nullptr;
  DriveOpener open_drive = nullptr;
};

constexpr std::string_view kSimPovray = "sim_povray";

constexpr std::array kRows{
    Row{{"memory", true, true, ""}, open_memory_camera, open_memory_drive},
    Row{{kSimPovray, true, true, ""}, open_sim_camera, open_sim_drive},
    Row{{"v4l2_camera", true, false, "twocone " TWOCONE_VERSION " has no V4L2 driver yet"}},
    Row{{"libcamera_camera", true, false, "twocone " TWOCONE_VERSION " has no libcamera driver yet"}},
    Row{{"serial_diffdrive", false, true, "twocone " TWOCONE_VERSION " has no driver for motor controllers yet"}},
};

constexpr auto kBackends = [] {
  std::array<Backend, kRows.size()> told{};
  std::transform(kRows.begin(), kRows.end(), told.begin(), [](const Row& row) { return row.told; });
  return told;
}();

/// A part as the messages call it, and what it asks for.
struct Wanted {
  std::string part;
  bool is_camera;
  std::string driver;

  [[nodiscard]] bool suits(const Backend& backend) const { return is_camera ? backend.for_cameras : backend.for_drive; }
};

std::string other_part(const OtherCamera& camera) { return "cameras." + camera.name; }

/// lower, upper, drive, then the other cameras.
std::vector<Wanted> parts_of(const RobotSettings& settings) {
  std::vector<Wanted> parts{{"cameras.lower", true, settings.lower.driver},
                            {"cameras.upper", true, settings.upper.driver},
                            {"drive", false, settings.drive.driver}};
  for (const OtherCamera& camera : settings.others) parts.push_back({other_part(camera), true, camera.part.driver});
  return parts;
}

/// The drivers that could do it: "memory, sim_povray".
std::string drivers_for(const Wanted& wanted) {
  std::vector<std::string_view> names;
  for (const Backend& backend : kBackends) {
    if (backend.available() && wanted.suits(backend)) names.push_back(backend.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

Result<const Row*> find_row(const Wanted& wanted) {
  const auto row = std::find_if(kRows.begin(), kRows.end(), [&](const Row& r) { return r.told.name == wanted.driver; });
  if (row == kRows.end()) {
    std::vector<std::string_view> others;
    for (const Backend& backend : kBackends) {
      if (!backend.available() && wanted.suits(backend)) others.push_back(backend.name);
    }
    return Error{ErrorCode::kNotFound,
                 fmt::format("{}: there is no driver '{}'; drivers for it are: {} (and, not in this build: {})",
                             wanted.part, wanted.driver, drivers_for(wanted), fmt::join(others, ", "))};
  }
  if (!wanted.suits(row->told)) {
    return Error{ErrorCode::kRefused,
                 fmt::format("{}: driver '{}' is for {}; drivers for it are: {}", wanted.part, wanted.driver,
                             wanted.is_camera ? "a drive" : "cameras", drivers_for(wanted))};
  }
  if (!row->told.available()) {
    return Error{ErrorCode::kUnavailable,
                 fmt::format("{}: driver '{}' is not in this build: {}; drivers that are: {}", wanted.part,
                             wanted.driver, row->told.why_not, drivers_for(wanted))};
  }
  return &*row;
}

bool is_simulated(const Wanted& wanted) { return wanted.driver == kSimPovray; }

/// Every part's row, once all are known to go together.
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
    std::vector<std::string> told;
    for (const Wanted& part : parts) told.push_back(fmt::format("{}: {}", part.part, part.driver));
    return Error{ErrorCode::kRefused, fmt::format("{}: sim_povray moves all parts of a robot or none: a simulated "
                                                  "camera cannot see a real drive move",
                                                  fmt::join(told, ", "))};
  }
  return rows;
}

Error in_part(const std::string& part, const Error& error) {
  return {error.code, fmt::format("{}: {}", part, error.message)};
}

/// Calls `checked` and adds what it complains about to `bad`.
template <typename Check>
void collect(std::string& bad, const std::string& part, Check checked) {
  try {
    checked();
  } catch (const std::invalid_argument& complaint) {
    bad += fmt::format("\n  {}: {}", part, complaint.what());
  }
}

}  // namespace

std::span<const Backend> backends() { return kBackends; }

void check(const RobotSettings& settings) {
  std::string bad;
  const auto check_camera = [&bad](const std::string& part, const CameraPart& camera) {
    collect(bad, part, [&] { twocone::check(camera.settings); });
    collect(bad, part, [&] { sim_povray::check(sim_povray::ViewSettings{part, camera.antialias, camera.effects}); });
  };
  check_camera("cameras.lower", settings.lower);
  check_camera("cameras.upper", settings.upper);
  for (const OtherCamera& camera : settings.others) {
    check_camera(other_part(camera), camera.part);
    if (camera.part.settings.rate_hz != settings.lower.settings.rate_hz) {
      bad += fmt::format("\n  {}: rate_hz is {} Hz, must be that of the pair, {} Hz", other_part(camera),
                         camera.part.settings.rate_hz, settings.lower.settings.rate_hz);
    }
  }
  if (settings.lower.settings.rate_hz != settings.upper.settings.rate_hz) {
    bad += fmt::format("\n  cameras: rate_hz is {} Hz for lower and {} Hz for upper, must be one rate for the pair",
                       settings.lower.settings.rate_hz, settings.upper.settings.rate_hz);
  }
  collect(bad, "drive", [&] { twocone::check(settings.drive.limits); });
  if (settings.max_skew.count() < 0) {
    bad += fmt::format("\n  cameras: max_skew is {} ns, must be >= 0", settings.max_skew.count());
  }
  const auto parts = parts_of(settings);
  if (std::any_of(parts.begin(), parts.end(), is_simulated)) {
    if (!settings.world) {
      bad += "\n  world: is missing, sim_povray needs one";
    } else {
      collect(bad, "world", [&] { sim_povray::check(settings.world->seat); });
      if (settings.world->attach.empty()) collect(bad, "world", [&] { sim_povray::check(settings.world->place); });
    }
  }
  if (!bad.empty()) throw std::invalid_argument("RobotSettings:" + bad);
}

Result<Robot> open_robot(const RobotSettings& settings) {
  check(settings);
  const auto rows = find_rows(settings);
  if (!rows) return rows.error();

  Shared shared;
  std::unique_ptr<GroundTruth> truth;
  if (settings.drive.driver == kSimPovray) {
    SimulatedWorld world = *settings.world;
    world.seat.drive = settings.drive.limits;
    auto simulation = world.attach.empty() ? sim_povray::Simulation::open(world.place, world.seat)
                                           : sim_povray::Simulation::attach(world.attach, world.seat);
    if (!simulation) return simulation.error();
    shared.simulation = *std::move(simulation);
    truth = shared.simulation->open_truth();
  }
  auto lower = (*rows)[0]->open_camera(shared, "lower", settings.lower);
  if (!lower) return in_part("cameras.lower", lower.error());
  auto upper = (*rows)[1]->open_camera(shared, "upper", settings.upper);
  if (!upper) return in_part("cameras.upper", upper.error());
  auto drive = (*rows)[2]->open_drive(shared, settings.drive);
  if (!drive) return in_part("drive", drive.error());
  std::vector<NamedCamera> others;
  for (std::size_t i = 0; i < settings.others.size(); ++i) {
    const OtherCamera& wanted = settings.others[i];
    auto camera = (*rows)[3 + i]->open_camera(shared, wanted.name.c_str(), wanted.part);
    if (!camera) return in_part(other_part(wanted), camera.error());
    others.push_back({wanted.name, *std::move(camera), wanted.part.settings});
  }
  return Robot(StereoRig(*std::move(lower), *std::move(upper), settings.max_skew), *std::move(drive), std::move(truth),
               std::move(others));
}

}  // namespace twocone::drivers
