// SPDX-License-Identifier: Apache-2.0
#pragma once

/// Tables of scenes that several tests solve.
namespace testing_support {

/// A body that an end holds, near x = 0, under its weight along -z.
inline constexpr const char* held_by_an_end = R"(
[[fix]]
halfspace = { point_mm = [0.6, 0, 0], normal = [-1, 0, 0] }
[gravity]
m_s2 = [0, 0, -9.81]
)";

}  // namespace testing_support
