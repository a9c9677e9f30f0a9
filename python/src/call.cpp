// SPDX-License-Identifier: Apache-2.0
#include "call.h"

#include <fmt/format.h>
#include <omp.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <regex>

#include "cli/machine.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/interruption.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/file/temporary_file.h"

namespace hextools::python {
namespace {

std::atomic<int> threads_asked = 0;

/// Asks Python for signals now and then: taking the interpreter costs, and other threads may have it.
class SignalCheck {
public:
  void operator()() {
    constexpr std::chrono::milliseconds between_looks(50);
    const Clock::time_point now = Clock::now();
    if (now - last_ < between_looks) return;
    const py::gil_scoped_acquire held;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    last_ = Clock::now();
  }

private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

/// A message without the options of the tools that it names in brackets.
std::string for_python(std::string message) {
  static const std::regex options(" \\(--[^)]*\\)");
  message = std::regex_replace(hexmesh::with_known_names(std::move(message)), options, "");
  constexpr std::string_view or_stream = " or -";
  if (message.ends_with(or_stream)) message.resize(message.size() - or_stream.size());
  return message;
}

const char* class_of(hexmesh::ErrorKind kind) {
  switch (kind) {
    case hexmesh::ErrorKind::usage:
      return "UsageError";
    case hexmesh::ErrorKind::input:
      return "InputError";
    case hexmesh::ErrorKind::geometry:
      return "GeometryError";
    case hexmesh::ErrorKind::output:
      return "OutputError";
  }
  return "Error";
}

void raise(const char* name, const std::string& message) {
  const py::object type = py::module_::import("hextools.errors").attr(name);
  const py::object text = py::reinterpret_steal<py::object>(
      PyUnicode_DecodeUTF8(message.data(), static_cast<py::ssize_t>(message.size()), "replace"));
  PyErr_SetObject(type.ptr(), text.ptr());
}

}  // namespace

void set_threads(int count) { threads_asked = count; }

int threads() { return threads_asked > 0 ? threads_asked.load() : default_threads(); }

struct WithoutInterpreter::Parts {
  int threads_before = omp_get_max_threads();
  py::gil_scoped_release released;
  hexmesh::Interruptible interruptible{SignalCheck()};
};

WithoutInterpreter::WithoutInterpreter() : parts_(std::make_unique<Parts>()) { omp_set_num_threads(threads()); }

WithoutInterpreter::~WithoutInterpreter() { omp_set_num_threads(parts_->threads_before); }

FileLock::~FileLock() {
  const py::error_scope raised;  // keeps what may be on its way
  try {
    lock_.attr("__exit__")(py::none(), py::none(), py::none());
  } catch (py::error_already_set& e) {
    e.discard_as_unraisable("hextools");
  }
}

void warn(const std::string& text) {
  const py::object type = py::module_::import("hextools.errors").attr("Warning");
  if (PyErr_WarnEx(type.ptr(), for_python(text).c_str(), 1) != 0) throw py::error_already_set();
}

py::bytes bytes_of_file(const std::filesystem::path& path) {
  std::string bytes(std::filesystem::file_size(path), '\0');
  std::ifstream(path, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

void forbid_new(const py::object& type, const std::string& made_by) {
  type.attr("_made_by") = made_by;
  auto* raw = reinterpret_cast<PyTypeObject*>(type.ptr());
  raw->tp_new = [](PyTypeObject* asked, PyObject*, PyObject*) -> PyObject* {
    PyObject* from = PyObject_GetAttrString(reinterpret_cast<PyObject*>(asked), "_made_by");
    if (from) PyErr_Format(PyExc_TypeError, "%s is not made by itself, expected %U", asked->tp_name, from);
    Py_XDECREF(from);
    return nullptr;
  };
  PyType_Modified(raw);
}

void register_errors() {
  py::register_exception_translator([](std::exception_ptr error) {
    try {
      std::rethrow_exception(std::move(error));
    } catch (const hexmesh::Error& e) {
      raise(class_of(e.kind()), for_python(e.what()));
    } catch (const std::filesystem::filesystem_error& e) {
      raise("InputError",
            fmt::format("'{}' cannot be read: {}, expected a file or folder", e.path1().string(), e.code().message()));
    } catch (const std::exception& e) {
      if (!hexmesh::is_out_of_memory(e)) throw;
      PyErr_SetString(PyExc_MemoryError, hexmesh::out_of_memory_message().c_str());
    }
  });
}

py::object from_json(const std::string& text) { return py::module_::import("json").attr("loads")(text); }

}  // namespace hextools::python
