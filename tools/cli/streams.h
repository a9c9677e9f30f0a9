// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hextools {

/// From now on standard error is this module's alone: what libraries write there is lost (ITK, VTK, HDF5 and NIfTI name
/// errors that become exceptions anyway).
void silence_libraries();

/// Whether somebody reads the messages as they come.
bool messages_go_to_terminal();

/// Where messages go, for a program that is run: its standard error.
int file_of_messages();

/// Writes to standard error, all at once. Where that cannot be written to, nothing happens.
/// @param text  control characters of it are shown, not obeyed
void say(const std::string& text);

/// Puts a line onto a terminal in place of the last such line; it goes when something is said. Empty: none.
void write_over(const std::string& line);

/// Since something was said, or the run began [s].
double seconds_of_silence();

/// Writes what people read to standard output; likewise.
/// @throws Error{output}
void print(const std::string& text);

/// Writes what programs read to standard output: on a terminal as print(), else as it is.
/// @throws Error{output}
void print_data(const std::string& text);

/// What libraries left in buffers of standard output is written. @throws Error{output}
void flush_standard_output();

}  // namespace hextools
