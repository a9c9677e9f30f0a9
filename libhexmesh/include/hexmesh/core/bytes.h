// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace hexmesh {

/// Memory that a vector has taken for its elements.
template <class T, class Allocator>
std::size_t bytes_of(const std::vector<T, Allocator>& v) {
  return v.capacity() * sizeof(T);
}

}  // namespace hexmesh
