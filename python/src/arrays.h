// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <array>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hextools::python {

namespace py = pybind11;

using hexmesh::Index3;
using hexmesh::Vec3;

/// Keeps an owner alive as long as arrays look into it.
template <class Owner>
py::capsule keep_alive(std::shared_ptr<const Owner> owner) {
  using Held = std::shared_ptr<const Owner>;
  return {new Held(std::move(owner)), [](void* held) { delete static_cast<Held*>(held); }};
}

/// Values that an owner has, as a read-only array without a copy.
template <class Value>
py::array view(const Value* values, std::vector<py::ssize_t> shape, const py::capsule& owner) {
  py::array out(py::dtype::of<Value>(), std::move(shape), values, owner);
  py::detail::array_proxy(out.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return out;
}

template <class Value>
py::array view(const std::vector<Value>& values, const py::capsule& owner) {
  return view(values.data(), {std::ssize(values)}, owner);
}

/// Shape (n, 3).
inline py::array view(const std::vector<Vec3>& points, const py::capsule& owner) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  return view(points.empty() ? nullptr : points.front().data(), {std::ssize(points), 3}, owner);
}

/// Shape (n, Width).
template <class Value, std::size_t Width>
py::array view(const std::vector<std::array<Value, Width>>& rows, const py::capsule& owner) {
  static_assert(sizeof(rows.front()) == Width * sizeof(Value));
  return view(rows.empty() ? nullptr : rows.front().data(), {std::ssize(rows), static_cast<py::ssize_t>(Width)}, owner);
}

/// An array of its own.
template <class Values>
py::array copy_of(Values values) {
  auto owner = std::make_shared<const Values>(std::move(values));
  py::array out = view(*owner, keep_alive<Values>(owner));
  py::detail::array_proxy(out.ptr())->flags |= py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return out;
}

/// Values of voxels, i fastest in memory, as a read-only array [i, j, k] without a copy.
template <class Value>
py::array view_of_voxels(const std::vector<Value>& values, const Index3& n, const py::capsule& owner) {
  const py::ssize_t size = sizeof(Value);
  py::array out(py::dtype::of<Value>(), std::vector<py::ssize_t>{n[0], n[1], n[2]},
                std::vector<py::ssize_t>{size, size * n[0], size * n[0] * n[1]}, values.data(), owner);
  py::detail::array_proxy(out.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return out;
}

/// Arrays as the package hands them over: it has checked type, shape and order.
using Labels = py::array_t<std::uint16_t, py::array::f_style>;  ///< [i, j, k]
using GreyValues = py::array_t<float, py::array::f_style>;      ///< [i, j, k]
using Rows = py::array_t<double, py::array::c_style>;           ///< (n, 3)
using Numbers = std::array<double, 3>;
using Axes = std::array<Numbers, 3>;  ///< rows
/// TOML, what messages call it, and whether they name its lines.
using Text = std::tuple<std::string, std::string, bool>;

template <class Value>
std::vector<Value> to_vector(const py::array_t<Value, py::array::f_style>& array) {
  return {array.data(), array.data() + array.size()};
}

inline Index3 extent_of(const py::array& array) {
  Index3 out{};
  for (py::ssize_t d = 0; d < 3; ++d) out[static_cast<std::size_t>(d)] = static_cast<std::int32_t>(array.shape(d));
  return out;
}

inline std::vector<Vec3> to_points(const Rows& rows) {
  std::vector<Vec3> out(static_cast<std::size_t>(rows.shape(0)));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = Vec3::Map(rows.data() + 3 * n);
  return out;
}

}  // namespace hextools::python
