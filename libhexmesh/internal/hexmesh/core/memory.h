// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

namespace hexmesh {

/// From here on what is foreseen to take more than `expected` bytes beside what the process already has is refused, and
/// what asks for more than `wall`, as the operating system counts it, gets std::bad_alloc. Called once, where only one
/// thread runs.
void limit_memory(double expected, double wall);

/// What it may still ask for now [bytes]; infinite where nothing was limited.
double memory_left();

/// To be called before much is asked for.
/// @throws Error{input} "WHAT takes about ... MB, expected at most ... MB, what is left of ... MB (--max-memory)" if it
/// is not left
void expect_memory(double bytes, const std::string& what);

/// What a run says that met its limit where nothing foresaw it.
std::string out_of_memory_message();

}  // namespace hexmesh
