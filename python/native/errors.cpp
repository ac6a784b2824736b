// SPDX-License-Identifier: Apache-2.0
#include "python/native/errors.h"

#include <exception>

#include "apps/config/yaml/text_file.h"
#include "apps/runlog/storage/disk.h"
#include "base/errors.h"
#include "twocone/twocone.h"

namespace py = pybind11;

namespace twocone::python {
namespace {

/// Raises an exception of errors.py.
void raise(const char* type, const char* message) {
  PyErr_SetString(py::module_::import("twocone.errors").attr(type).ptr(), message);
}

void raise(const FailureError& error) {
  const py::object errors = py::module_::import("twocone.errors");
  const py::object type = errors.attr(error.code == FailureCode::kTimeout ? "DeviceTimeout" : "DeviceError");
  const py::object exception = type(error.what(), py::cast(error.code));
  PyErr_SetObject(type.ptr(), exception.ptr());
}

}  // namespace

bool is_interrupted() {
  const py::gil_scoped_acquire lock;
  return PyErr_Occurred() != nullptr || PyErr_CheckSignals() != 0;
}

void add_errors(py::module_& module) {
  py::enum_<FailureCode>(module, "FailureCode", "Kinds of failure, one for each way in which a caller can react.")
      .value("NOT_FOUND", FailureCode::kNotFound, "no such device, file or driver: check the name")
      .value("UNAVAILABLE", FailureCode::kUnavailable, "known, but not here: install it or plug it in")
      .value("INVALID_STATE", FailureCode::kInvalidState, "the call is not allowed now")
      .value("TIMEOUT", FailureCode::kTimeout, "nothing arrived before the deadline: it is safe to try again")
      .value("DISCONNECTED", FailureCode::kDisconnected, "the device or its program is gone: open the robot again")
      .value("BAD_DATA", FailureCode::kBadData, "bytes arrived, but they are not an image or reply")
      .value("CANCELLED", FailureCode::kCancelled, "the robot was closed, or a signal arrived")
      .value("REFUSED", FailureCode::kRefused, "the device rejects the request, and the message says why");
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const FailureError& error) {
      raise(error);
    } catch (const config::FileError& error) {
      raise("FileError", error.what());
    } catch (const runlog::DiskError& error) {
      raise("FileError", error.what());
    } catch (const base::FormattedError& error) {
      raise("Error", error.what());
    }
  });
}

}  // namespace twocone::python
