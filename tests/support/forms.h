// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string_view>

namespace testing_support {

/// Whether the whole of each long test is asked for (HEXTOOLS_TESTS=full), which tests of the label `slow` do, or a
/// short form of it.
inline bool is_full() {
  const char* form = std::getenv("HEXTOOLS_TESTS");
  return form && std::string_view(form) == "full";
}

/// `whole` of the full form, `part` of the short one.
template <class T>
T whole_or(T whole, T part) {
  return is_full() ? whole : part;
}

}  // namespace testing_support
