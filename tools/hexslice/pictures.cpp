// SPDX-License-Identifier: Apache-2.0
#include "pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "cli/progress.h"
#include "hexmesh/core/error.h"

namespace hextools {

Pictures::Pictures(const std::string& folder, const std::vector<std::string>& names, RunFiles& files,
                   const CommonOptions& common)
    : folder_(folder), files_(files), common_(common) {
  files.make_folder(folder);
  for (const std::string& name : names)
    pictures_.emplace_back(name, &files.output(path(name), Content::binary, ".png"));
}

void Pictures::write(const std::string& name, const hexmesh::Canvas& picture) const {
  const auto found = std::find_if(pictures_.begin(), pictures_.end(), [&](const auto& p) { return p.first == name; });
  picture.write_png(found->second->path());
  const std::ptrdiff_t done = found - pictures_.begin() + 1;
  at_work(fmt::format("drawing {} pictures into '{}'", pictures_.size(), folder_),
          static_cast<double>(done) / static_cast<double>(pictures_.size()));
}

void Pictures::commit(const Console& console) {
  files_.commit();
  if (common_.force) remove_older();
  console.note(fmt::format("wrote {} pictures into {}", pictures_.size(), folder_));
}

void Pictures::remove_older() const {
  if (pictures_.empty()) return;
  const std::string& last = pictures_.back().first;
  const std::size_t digits = last.find_last_of('_') + 1;
  if (digits == 0) return;
  const std::size_t width = last.find('.') - digits;
  std::error_code failed;
  for (int n = std::stoi(last.substr(digits)) + 1;; ++n) {
    const std::string file = path(fmt::format("{}{:0{}}.png", last.substr(0, digits), n, width));
    if (files_.is_input(file) || !std::filesystem::remove(file, failed)) return;
  }
}

std::string Pictures::path(const std::string& name) const { return (std::filesystem::path(folder_) / name).string(); }

}  // namespace hextools
