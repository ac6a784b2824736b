// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <utility>

#include <pybind11/pybind11.h>

#include "hal/result.h"
#include "python/native/errors.h"

/// Long work of the program for Python: it can be interrupted, and Python's functions can watch it.
namespace twocone::python {

/// Calls f(stop) on a thread of its own without the interpreter's lock, and waits for its value. Where a signal's
/// handler raises an exception, as Ctrl-C does, or a function of Python that f calls, `stop` is set, and the exception
/// is thrown when f has ended.
template <typename F>
auto interruptibly(F f) {
  constexpr std::chrono::milliseconds kBetweenLooks{50};
  std::atomic<bool> stop{false};
  auto working = std::async(std::launch::async, [&] { return f(stop); });
  {
    const pybind11::gil_scoped_release unlocked;
    while (working.wait_for(kBetweenLooks) != std::future_status::ready) {
      if (!stop && is_interrupted()) stop = true;
    }
  }
  if (PyErr_Occurred() != nullptr) throw pybind11::error_already_set();
  return working.get();
}

/// Returns the value of a result. @throws FailureError
template <typename T>
T value_or_raise(Result<T> result) {
  if (!result) throw FailureError({FailureCode(int(result.error().code)), result.error().message});
  return std::move(*result);
}

void add_runs(pybind11::module_& module);
void add_tools(pybind11::module_& module);

}  // namespace twocone::python
