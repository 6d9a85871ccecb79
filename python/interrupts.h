#pragma once
// Ctrl-C while the library works: Python's signals are looked at between its steps.

#include <pybind11/pybind11.h>

#include <chrono>
#include <exception>
#include <string>
#include <type_traits>

namespace ttsdf::python {

namespace py = pybind11;

class Interrupts {
 public:
  /// True to go on. Called without the GIL, which is taken ten times a second at the most.
  bool goOn() {
    const auto now = std::chrono::steady_clock::now();
    if (raised_ || now < next_) return !raised_;
    next_ = now + std::chrono::milliseconds(100);
    const py::gil_scoped_acquire held;
    raise();
    return !raised_;
  }
  /// With the GIL: throws what a signal's handler raised.
  void rethrow() {
    if (raised_) std::rethrow_exception(raised_);
  }

 private:
  void raise() {
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    } catch (...) {
      raised_ = std::current_exception();
    }
  }
  std::exception_ptr raised_;
  std::chrono::steady_clock::time_point next_;
};

/// work(interrupts) without the GIL. Work that `goOn` told to stop ends in what the signal's handler raised
/// (KeyboardInterrupt), whatever it returns or throws itself.
template <class Work>
auto interruptible(Work&& work) -> std::invoke_result_t<Work, Interrupts&> {
  Interrupts interrupts;
  try {
    auto result = [&] {
      const py::gil_scoped_release released;
      return work(interrupts);
    }();
    interrupts.rethrow();
    return result;
  } catch (const py::error_already_set&) {
    throw;
  } catch (...) {
    interrupts.rethrow();
    throw;
  }
}

/// The library's callbacks of progress.
inline auto progressOf(Interrupts& interrupts) {
  return [&interrupts](auto&&...) { return interrupts.goOn(); };
}

}  // namespace ttsdf::python
