// SPDX-License-Identifier: Apache-2.0
#include "python/native/robot.h"

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/native/errors.h"

namespace py = pybind11;

namespace twocone::python {
namespace {

Failure of_another_process() {
  return {FailureCode::kInvalidState, "another process opened it, of which this one is a fork: open it here"};
}
Failure closed() { return {FailureCode::kInvalidState, "the robot is closed: open it again"}; }

// Robots that are open when the interpreter ends. They are closed then, so that their wheels stop.
std::mutex open_mutex;
std::set<PyRobot*> open_robots;  // guarded by open_mutex

void close_all() {
  while (true) {
    PyRobot* robot = nullptr;
    {
      const std::lock_guard lock(open_mutex);
      if (open_robots.empty()) return;
      robot = *open_robots.begin();
      open_robots.erase(open_robots.begin());
    }
    robot->close();
  }
}

/// Returns a timeout in milliseconds. @throws pybind11::value_error
std::chrono::milliseconds milliseconds_of(double timeout_s) {
  constexpr double kLongest_s = 1e6;
  if (!(timeout_s >= 0)) throw py::value_error(fmt::format("timeout_s is {}, must be a number >= 0", timeout_s));
  return std::chrono::milliseconds(std::llround(1e3 * std::min(timeout_s, kLongest_s)));
}

}  // namespace

template <typename T>
T& OfThisProcess<T>::get() {
  if (::getpid() != process_) throw FailureError(of_another_process());
  return *value_;
}

template class OfThisProcess<CapturedFrame>;
template class OfThisProcess<ConnectedRobot>;

// ---- frame

py::array PyFrame::image(const std::shared_ptr<PyFrame>& self, Side side) {
  const CapturedFrame& frame = self->frame();
  const ImageView view = value_or_raise([&] {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(self->mutex_);
    return side == Side::kLower ? frame.lower() : frame.upper();
  }());
  py::array array(py::dtype::of<std::uint8_t>(), {view.height_px, view.width_px, 3}, view.rgb.data(), py::cast(self));
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

// ---- robot

template <typename F>
auto PyRobot::use(F f) {
  if (::getpid() != process_) throw FailureError(of_another_process());
  return value_or_raise([&] {
    const py::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    using Answer = decltype(f(robot_->get()));
    return robot_ && !*is_closing_ ? f(robot_->get()) : Answer(closed());
  }());
}

PyRobot::PyRobot(const std::filesystem::path& robot_file, std::uint64_t seed) : description_(robot_file) {
  OpenOptions options;
  options.seed = seed;
  options.is_cancelled = [is_closing = is_closing_] { return *is_closing || is_interrupted(); };
  robot_.emplace(value_or_raise([&] {
    const py::gil_scoped_release unlocked;
    return open_robot(robot_file, options);
  }()));
  const std::lock_guard lock(open_mutex);
  open_robots.insert(this);
}

PyRobot::~PyRobot() { close(); }

std::shared_ptr<PyFrame> PyRobot::next_frame(double timeout_s) {
  const auto timeout = milliseconds_of(timeout_s);
  return std::make_shared<PyFrame>(use([timeout](ConnectedRobot& robot) { return robot.next_frame(timeout); }));
}

Velocity PyRobot::set_velocity(double forward_mps, double turn_radps) {
  if (!std::isfinite(forward_mps) || !std::isfinite(turn_radps)) {
    throw py::value_error(
        fmt::format("forward_mps is {} and turn_radps is {}, must be finite", forward_mps, turn_radps));
  }
  return use([&](ConnectedRobot& robot) { return robot.set_velocity({forward_mps, turn_radps}); });
}

std::optional<Pose> PyRobot::true_pose() {
  return use([](ConnectedRobot& robot) { return Expected<std::optional<Pose>>(robot.true_pose()); });
}

std::string PyRobot::contact() {
  return use([](ConnectedRobot& robot) { return Expected<std::string>(robot.contact()); });
}

void PyRobot::close() noexcept {
  *is_closing_ = true;
  {
    const std::lock_guard lock(open_mutex);
    open_robots.erase(this);
  }
  if (::getpid() != process_) return;
  const auto end = [this] {
    const std::lock_guard lock(mutex_);
    robot_.reset();
  };
  // A call that waits with the mutex takes the interpreter's lock to look for signals.
  if (PyGILState_Check() == 0) return end();
  const py::gil_scoped_release unlocked;
  end();
}

// ---- module

void add_robot(py::module_& module) {
  py::class_<Pose>(module, "Pose", "A pose in the world: x and y in metres, the heading counter-clockwise from x.")
      .def(py::init([](double x_m, double y_m, double heading_rad) {
             return Pose{x_m, y_m, heading_rad};
           }),
           py::arg("x_m") = 0, py::arg("y_m") = 0, py::arg("heading_rad") = 0)
      .def_readonly("x_m", &Pose::x_m)
      .def_readonly("y_m", &Pose::y_m)
      .def_readonly("heading_rad", &Pose::heading_rad, "(-pi, pi]")
      .def("__repr__", [](const Pose& p) {
        return fmt::format("Pose(x_m={:.6g}, y_m={:.6g}, heading_rad={:.6g})", p.x_m, p.y_m, p.heading_rad);
      });

  using Landmark = RobotDescription::Landmark;
  py::class_<Landmark>(module, "Landmark", "A landmark of the map, in the world's frame.")
      .def_readonly("name", &Landmark::name)
      .def_readonly("x_m", &Landmark::x_m, "of its axis")
      .def_readonly("y_m", &Landmark::y_m)
      .def_readonly("radius_m", &Landmark::radius_m)
      .def_readonly("top_m", &Landmark::top_m)
      .def("__repr__",
           [](const Landmark& l) { return fmt::format("Landmark({}, x_m={:.6g}, y_m={:.6g})", l.name, l.x_m, l.y_m); });
  py::class_<RobotDescription>(module, "RobotDescription", "The content of a robot file and its map, read and checked.")
      .def(py::init<const std::filesystem::path&>(), py::arg("robot_file"))
      .def_property_readonly("landmarks", &RobotDescription::landmarks)
      .def_property_readonly("waypoints", &RobotDescription::waypoints, "the robot file's waypoints; headings are 0")
      .def_property_readonly("start", &RobotDescription::start);

  py::class_<Velocity>(module, "Velocity", "Speeds of the body.")
      .def(py::init([](double forward_mps, double turn_radps) {
             return Velocity{forward_mps, turn_radps};
           }),
           py::arg("forward_mps") = 0.0, py::arg("turn_radps") = 0.0)
      .def_readonly("forward_mps", &Velocity::forward_mps)
      .def_readonly("turn_radps", &Velocity::turn_radps, "counter-clockwise")
      .def("__repr__", [](const Velocity& v) {
        return fmt::format("Velocity(forward_mps={:.6g}, turn_radps={:.6g})", v.forward_mps, v.turn_radps);
      });

  py::class_<PyFrame, std::shared_ptr<PyFrame>>(module, "CapturedFrame",
                                                "Both images of one moment, and the wheels' angles by then.")
      .def_property_readonly(
          "number", [](PyFrame& f) { return f.frame().number(); }, "counts frames, from 0")
      .def_property_readonly(
          "t_s", [](PyFrame& f) { return f.frame().t_s(); }, "time of the lower image since that of the first frame")
      .def(
          "lower", [](const std::shared_ptr<PyFrame>& f) { return PyFrame::image(f, PyFrame::Side::kLower); },
          "Waits for the pixels, and returns them as a read-only array of (rows, columns, 3) without a copy.")
      .def(
          "upper", [](const std::shared_ptr<PyFrame>& f) { return PyFrame::image(f, PyFrame::Side::kUpper); },
          "Likewise for the upper camera.");

  py::class_<PyRobot, std::shared_ptr<PyRobot>>(module, "ConnectedRobot", "An opened robot: see open_robot().")
      .def_property_readonly("description", &PyRobot::description, py::return_value_policy::copy)
      .def("next_frame", &PyRobot::next_frame, py::arg("timeout_s") = 1.0,
           "Waits for the next pair of images. A simulated world advances by one frame period.")
      .def("set_velocity", &PyRobot::set_velocity, py::arg("forward_mps") = 0.0, py::arg("turn_radps") = 0.0,
           "Commands the wheels, and returns the applied velocity. They stop unless the call is repeated within the "
           "robot file's command_timeout_s.")
      .def("true_pose", &PyRobot::true_pose, "Returns the true pose at the newest frame; None on hardware.")
      .def_property_readonly("contact", &PyRobot::contact, "what the body touches; empty: nothing, and on hardware")
      .def("close", &PyRobot::close, "Stops the wheels, then the cameras. May be called again.")
      .def_property_readonly("closed", &PyRobot::is_closed)
      .def("__enter__", [](const std::shared_ptr<PyRobot>& robot) { return robot; })
      .def("__exit__", [](PyRobot& robot, const py::args& /*of the exception*/) { robot.close(); });

  module.def(
      "open_robot",
      [](const std::filesystem::path& file, std::uint64_t seed) { return std::make_shared<PyRobot>(file, seed); },
      py::arg("robot_file"), py::kw_only(), py::arg("seed") = 1,
      "Opens the robot that a robot file describes, simulated or real, and starts its cameras.");
  py::module_::import("atexit").attr("register")(py::cpp_function(&close_all));
}

}  // namespace twocone::python
