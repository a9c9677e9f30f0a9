// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <exception>
#include <string>

namespace hexmesh {

/// From here on what is foreseen to take more than `bytes` beside what the process already has is refused. What was
/// foreseen wrongly gets std::bad_alloc at a wall that stands farther off, as the operating system counts addresses,
/// used or not: a quarter and 64 MB, and what threads' stacks may take. Limits that the process has stay.
/// Called once, where only one thread runs.
/// @param wall  for a limit that is not the user's [bytes]; 0: by `bytes`; infinite: none
/// @param name  what sets the limit, in messages
void limit_memory(double bytes, double wall = 0, const std::string& name = "--max-memory");

/// Takes memory in large pages from here on, out of one range of addresses, and keeps what is freed: touching small
/// pages for the first time costs a fifth of a short run, and half of it on some virtual machines. Does nothing where
/// the system does not offer them, or counts what is only asked for. Called after limit_memory(); and again after
/// malloc_trim(), which gives that range back.
void use_large_pages();

/// What it may still ask for now [bytes]; infinite where nothing was limited.
double memory_left();

/// To be called before much is asked for.
/// @throws Error{input} "WHAT takes about ... MB, expected at most ... MB, what is left of ... MB (NAME)"
void expect_memory(std::size_t bytes, const std::string& what);

/// What set the limit, as limit_memory() was told.
const std::string& name_of_memory_limit();

/// What a run says that met its limit where nothing foresaw it.
const std::string& out_of_memory_message();

/// Whether there was no memory, or no thread: of threads, libraries say it in ways of their own.
bool is_out_of_memory(const std::exception& e);

}  // namespace hexmesh
