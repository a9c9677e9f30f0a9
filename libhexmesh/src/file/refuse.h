// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>

#include "hexmesh/core/error.h"

namespace hexmesh {

/// More bytes than one byte of a file can inflate to; deflate gains at most 1032 : 1.
inline constexpr std::uintmax_t best_deflation = 1100;

/// "'PATH' has ..., expected ...".
/// @throws Error{input} always
template <class... Args>
[[noreturn]] void refuse(const std::filesystem::path& path, fmt::format_string<Args...> text, Args&&... args) {
  throw Error(ErrorKind::input, fmt::format("'{}' {}", path.string(), fmt::format(text, std::forward<Args>(args)...)));
}

}  // namespace hexmesh
