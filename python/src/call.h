// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <filesystem>
#include <memory>
#include <string>

namespace hextools::python {

namespace py = pybind11;

/// How many threads calls use from now on, in any thread of Python; 0: as many as there are.
void set_threads(int count);
int threads();

/// While it lives this thread works without the interpreter, with threads(), and Ctrl-C in the main thread ends what it
/// does (see hexmesh::Interruptible).
class WithoutInterpreter {
public:
  WithoutInterpreter();
  ~WithoutInterpreter();
  WithoutInterpreter(const WithoutInterpreter&) = delete;
  WithoutInterpreter& operator=(const WithoutInterpreter&) = delete;

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Held with the interpreter by what reads or writes files: h5py may have the same copy of HDF5, with a lock of its
/// own.
class FileLock {
public:
  FileLock() : lock_(py::module_::import("hextools._files").attr("file_lock")()) { lock_.attr("__enter__")(); }
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

private:
  py::object lock_;
};

/// A path for what takes "-" for a stream, which here is a file like others.
inline std::string file_name(const std::filesystem::path& path) { return path == "-" ? "./-" : path.string(); }

/// Warns as hextools.Warning, of the line of Python that called.
void warn(const std::string& text);

/// What a file holds.
py::bytes bytes_of_file(const std::filesystem::path& path);

/// Objects of a class come from C++ alone: __new__ would leave one empty.
/// @param made_by  in messages
void forbid_new(const py::object& type, const std::string& made_by);

/// Makes exceptions of hextools.errors from those of the libraries.
void register_errors();

/// JSON as Python has it.
py::object from_json(const std::string& text);

}  // namespace hextools::python
