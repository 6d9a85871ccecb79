// The Python module `ttsdf`: numpy in and out, options by keyword, errors as ValueError with the library's
// own words.

#include <pybind11/pybind11.h>

#include <exception>
#include <stdexcept>

#include "bindings.h"

namespace py = pybind11;

PYBIND11_MODULE(ttsdf, m) {
  m.doc() =
      "Signed distance maps compressed with the tensor-train decomposition: build, query, localize in them.";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const py::builtin_exception&) {
      throw;
    } catch (const py::error_already_set&) {
      throw;
    } catch (const std::runtime_error& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    } catch (const std::invalid_argument& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    }
  });

  auto map = ttsdf::python::bindMap(m);
  ttsdf::python::bindRegistration(m, map);
  ttsdf::python::bindReaders(m);
  ttsdf::python::bindBuilds(m);
}
