// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <array>
#include <string>
#include <vector>

namespace hextools {

/// Begins a program, found on the PATH where its name has no slash.
/// @param words   its name and arguments
/// @param files   that become its standard input, output and error; -1: /dev/null
/// @param process  becomes its number
/// @returns 0, or the errno of why not
int begin_program(std::vector<std::string> words, const std::array<int, 3>& files, pid_t& process);

/// Waits for its end. @returns its exit code, 128 and the number of a signal that ended it; -1 where there is no such
/// process
int wait_for_program(pid_t process);

}  // namespace hextools
