// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace testing_support {

/// What quadratic elements of CalculiX tend to as they get smaller, of tests/data/limits.json [mm]; a name or component
/// that is not there fails the test.
double limit_of(const std::string& name, const std::string& component);

}  // namespace testing_support
