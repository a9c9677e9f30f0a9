// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace hextools {

/// Characters to put in, leave out, change, or swap with the next to get from one word to the other.
int edit_distance(const std::string& a, const std::string& b);

/// The word that was probably meant: the one with the least edit_distance(), at most a third of the length; empty:
/// none.
std::string nearest_word(const std::string& word, const std::vector<std::string>& known);

}  // namespace hextools
