// SPDX-License-Identifier: Apache-2.0
#include "pictures.h"

#include <fmt/format.h>

#include <filesystem>

#include "hexmesh/core/error.h"

namespace hextools {
namespace {

void make_folder(const std::string& name) {
  std::error_code failed;
  std::filesystem::create_directories(name, failed);
  if (!std::filesystem::is_directory(name))
    throw hexmesh::Error(hexmesh::ErrorKind::output,
                         fmt::format("cannot make the folder '{}', expected a writable place", name));
}

}  // namespace

Pictures::Pictures(const PlaneOptions& o, const CommonOptions& common, std::vector<std::string> names)
    : o_(o), common_(common), names_(std::move(names)) {
  make_folder(o.output);
  for (const std::string& name : names_) open_output(path(name), ".png", common_, {});
  if (common.force) remove_older();
}

void Pictures::write(const std::string& name, const hexmesh::Canvas& picture) const {
  const auto file = open_output(path(name), ".png", common_, {o_.input, o_.scan});
  picture.write_png(file->path());
  file->commit();
}

void Pictures::remove_older() const {
  if (names_.empty()) return;
  const std::string& last = names_.back();
  const std::size_t digits = last.find_last_of('_') + 1;
  if (digits == 0) return;
  const std::size_t width = last.find('.') - digits;
  for (int n = std::stoi(last.substr(digits)) + 1;; ++n)
    if (!std::filesystem::remove(path(fmt::format("{}{:0{}}.png", last.substr(0, digits), n, width)))) return;
}

std::string Pictures::path(const std::string& name) const { return (std::filesystem::path(o_.output) / name).string(); }

}  // namespace hextools
