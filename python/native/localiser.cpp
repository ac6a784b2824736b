// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include "python/native/errors.h"
#include "python/native/robot.h"
#include "twocone/localisation.h"

namespace py = pybind11;

namespace twocone::python {
namespace {

/// Returns an array of 3 x 3, or None.
py::object to_array(const std::optional<PoseCovariance>& covariance) {
  if (!covariance) return py::none();
  return py::array_t<double>({3, 3}, covariance->data());
}

/// The pixels of an image of one's own, and what keeps them in memory.
struct OwnPixels {
  py::array kept;
  ImageView view;

  /// @throws pybind11::value_error naming what the array is and what it must be
  OwnPixels(const py::array& image, const char* name) {
    if (!image.dtype().is(py::dtype::of<std::uint8_t>()) || image.ndim() != 3 || image.shape(2) != 3) {
      throw py::value_error(fmt::format("{} is an array of {} and shape {}, must be uint8 and (rows, columns, 3)", name,
                                        std::string(py::str(image.dtype())),
                                        std::string(py::str(image.attr("shape")))));
    }
    kept = py::array::ensure(image, py::array::c_style);
    const auto* const data = static_cast<const std::uint8_t*>(kept.data());
    view = {int(kept.shape(1)), int(kept.shape(0)), {data, std::size_t(kept.size())}};
  }
};

/// A localiser that several threads may use.
class PyLocaliser {
 public:
  explicit PyLocaliser(const RobotDescription& description) : localiser_(description) {}

  FrameReport update(PyFrame& frame) {
    CapturedFrame& captured = frame.frame();
    return value_or_raise([&] {
      const py::gil_scoped_release unlocked;
      const std::lock_guard lock(mutex_);
      return localiser_.update(captured);
    }());
  }

  FrameReport update_images(const py::array& lower, const py::array& upper, double t_s,
                            const std::optional<std::pair<double, double>>& wheels_rad) {
    const OwnPixels low(lower, "lower"), up(upper, "upper");
    OwnFrame frame{low.view, up.view, t_s, {}};
    if (wheels_rad) frame.wheels = {wheels_rad->first, wheels_rad->second};
    return value_or_raise([&] {
      const py::gil_scoped_release unlocked;
      const std::lock_guard lock(mutex_);
      return localiser_.update(frame);
    }());
  }

 private:
  std::mutex mutex_;
  Localiser localiser_;
};

PoseAnswer locate_all(const std::vector<LandmarkObservation>& observations) {
  const py::gil_scoped_release unlocked;
  return locate(observations);
}

}  // namespace

void add_localiser(py::module_& module) {
  py::enum_<FixVerdict>(module, "FixVerdict", "The reason why a position is given or withheld (docs/verdicts.md).")
      .value("OK", FixVerdict::kOk)
      .value("GAP", FixVerdict::kGap, "given by method paper, although two of its circles did not meet")
      .value("AMBIGUOUS", FixVerdict::kAmbiguous, "two positions explain the measurements equally well; none is given")
      .value("TOO_FEW", FixVerdict::kTooFew, "fewer measurements than a position requires; none is given")
      .value("WEAK", FixVerdict::kWeak, "given, but one direction is not determined: see the covariance")
      .value("CONTRADICTORY", FixVerdict::kContradictory, "the measurements contradict each other; none is given")
      .value("OUT_OF_BOUNDS", FixVerdict::kOutOfBounds, "a position outside the map's bounds; none is given");
  py::enum_<RangeVerdict>(module, "RangeVerdict", "The reason why a range is given or withheld (docs/verdicts.md).")
      .value("OK", RangeVerdict::kOk)
      .value("NOT_SEEN", RangeVerdict::kNotSeen)
      .value("TRUNCATED", RangeVerdict::kTruncated)
      .value("NO_MATCH", RangeVerdict::kNoMatch)
      .value("BEYOND_LIMIT", RangeVerdict::kBeyondLimit)
      .value("SAME_COLOUR", RangeVerdict::kSameColour)
      .value("ONE_VIEW", RangeVerdict::kOneView)
      .value("OCCLUDED", RangeVerdict::kOccluded)
      .value("SATURATED", RangeVerdict::kSaturated)
      .value("TWO_CANDIDATES", RangeVerdict::kTwoCandidates)
      .value("INCONSISTENT", RangeVerdict::kInconsistent)
      .value("IMPOSSIBLE", RangeVerdict::kImpossible);

  py::class_<RangeAnswer>(module, "RangeAnswer", "The measurement of one landmark; None where there is no answer.")
      .def_readonly("landmark", &RangeAnswer::landmark)
      .def_readonly("verdict", &RangeAnswer::verdict)
      .def_readonly("range_m", &RangeAnswer::range_m, "horizontal, to the landmark's axis")
      .def_readonly("sigma_range_m", &RangeAnswer::sigma_range_m)
      .def_readonly("bearing_rad", &RangeAnswer::bearing_rad, "in the body frame, (-pi, pi]")
      .def_readonly("sigma_bearing_rad", &RangeAnswer::sigma_bearing_rad)
      .def("__repr__", [](const RangeAnswer& r) {
        return fmt::format("RangeAnswer({}, {}{})", r.landmark, to_string(r.verdict),
                           r.range_m ? fmt::format(", {:.4g} m", *r.range_m) : "");
      });
  py::class_<PoseAnswer>(module, "PoseAnswer", "A pose from one frame; None where there is no answer.")
      .def_readonly("verdict", &PoseAnswer::verdict)
      .def_readonly("pose", &PoseAnswer::pose)
      .def_property_readonly(
          "covariance", [](const PoseAnswer& a) { return to_array(a.covariance); },
          "of (x m, y m, heading rad): an array of 3 x 3");
  py::class_<FrameReport>(module, "FrameReport", "The answer of a Localiser to one frame.")
      .def_readonly("ranges", &FrameReport::ranges, "one per landmark, in the map's order")
      .def_readonly("fix", &FrameReport::fix, "from this frame alone")
      .def_readonly("track", &FrameReport::track, "from fixes and wheels; None before the first fix")
      .def_property_readonly(
          "covariance", [](const FrameReport& r) { return to_array(r.covariance); }, "of the track: 3 x 3")
      .def_readonly("odometry", &FrameReport::odometry, "from the wheels alone, since the robot file's start");

  py::class_<PyLocaliser>(module, "Localiser", "Ranges, fix and track, as the robot file's estimator specifies.")
      .def(py::init<const RobotDescription&>(), py::arg("description"))
      .def("update", &PyLocaliser::update, py::arg("frame"),
           "Waits for the frame's images and answers it. Frames must be in order.")
      .def("update_images", &PyLocaliser::update_images, py::arg("lower"), py::arg("upper"), py::kw_only(),
           py::arg("t_s"), py::arg("wheels_rad") = py::none(),
           "Answers images of one's own: uint8 arrays of (rows, columns, 3) at t_s seconds, with the total angles "
           "that the left and the right wheel have turned. Without these, the track is the frame's own fix.");

  py::class_<LandmarkObservation>(module, "LandmarkObservation", "The measurement of one landmark at a known place.")
      .def(py::init([](double x_m, double y_m, std::optional<double> range_m, std::optional<double> bearing_rad,
                       double sigma_range_m, double sigma_bearing_rad) {
             return LandmarkObservation{x_m, y_m, range_m, bearing_rad, sigma_range_m, sigma_bearing_rad};
           }),
           py::arg("x_m"), py::arg("y_m"), py::kw_only(), py::arg("range_m") = py::none(),
           py::arg("bearing_rad") = py::none(), py::arg("sigma_range_m") = 0.0, py::arg("sigma_bearing_rad") = 0.0)
      .def_readonly("x_m", &LandmarkObservation::x_m)
      .def_readonly("y_m", &LandmarkObservation::y_m)
      .def_readonly("range_m", &LandmarkObservation::range_m)
      .def_readonly("bearing_rad", &LandmarkObservation::bearing_rad)
      .def_readonly("sigma_range_m", &LandmarkObservation::sigma_range_m)
      .def_readonly("sigma_bearing_rad", &LandmarkObservation::sigma_bearing_rad);
  module.def("locate", &locate_all, py::arg("observations"),
             "Returns the most likely pose for measurements of landmarks at known places, with its covariance.");
}

}  // namespace twocone::python
