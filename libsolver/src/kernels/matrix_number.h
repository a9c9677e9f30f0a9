// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace hexsolver {

/// In place of the number of a matrix that cells share: a cell has no matrix, or one of its own.
inline constexpr std::int32_t no_matrix = -1, own_matrix = -2;

}  // namespace hexsolver
