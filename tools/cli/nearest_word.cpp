// SPDX-License-Identifier: Apache-2.0
#include "cli/nearest_word.h"

#include <algorithm>

namespace hextools {

int edit_distance(const std::string& a, const std::string& b) {
  const std::size_t columns = b.size() + 1;
  std::vector<int> d((a.size() + 1) * columns);  // of the first i characters of a and the first j of b
  const auto at = [&](std::size_t i, std::size_t j) -> int& { return d[i * columns + j]; };
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        at(i, j) = static_cast<int>(i + j);
        continue;
      }
      const bool is_same = a[i - 1] == b[j - 1];
      at(i, j) = std::min({at(i - 1, j) + 1, at(i, j - 1) + 1, at(i - 1, j - 1) + !is_same});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        at(i, j) = std::min(at(i, j), at(i - 2, j - 2) + 1);
    }
  return d.back();
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& known) {
  std::string nearest;
  int least = static_cast<int>(word.size()) / 3 + 1;
  for (const std::string& k : known)
    if (const int distance = edit_distance(word, k); distance < least) {
      least = distance;
      nearest = k;
    }
  return nearest;
}

}  // namespace hextools
