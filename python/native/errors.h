// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include <pybind11/pybind11.h>

#include "twocone/types.h"

/// Failures as exceptions of Python (twocone/errors.py).
namespace twocone::python {

/// A failure on its way to Python, where it becomes twocone.DeviceError.
struct FailureError : std::runtime_error {
  explicit FailureError(const Failure& failure) : std::runtime_error(failure.message), code(failure.code) {}
  FailureCode code;
};

/// Returns the value. Requires the interpreter's lock.
/// @throws FailureError; the exception that a signal's handler has raised, as KeyboardInterrupt
template <typename T>
T value_or_raise(Expected<T> result) {
  if (PyErr_Occurred() != nullptr) throw pybind11::error_already_set();
  if (!result) throw FailureError(result.error());
  return std::move(*result);
}

/// Runs the handlers of signals that have arrived, if this is the interpreter's main thread. Returns whether one of
/// them has raised an exception, which stays set. Takes the interpreter's lock.
bool is_interrupted();

/// Makes exceptions of C++ those of errors.py.
void add_errors(pybind11::module_& module);

}  // namespace twocone::python
