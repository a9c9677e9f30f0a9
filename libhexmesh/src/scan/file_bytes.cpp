// SPDX-License-Identifier: Apache-2.0
#include "file_bytes.h"

#include <algorithm>
#include <new>

#include "../file/refuse.h"

namespace hexmesh {

namespace fs = std::filesystem;

std::string first_bytes(const fs::path& path, std::size_t count) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path))
    throw Error(ErrorKind::input, fmt::format("cannot read '{}', expected a readable file", path.string()));
  std::string bytes(count, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

Inflater::Inflater(const fs::path& path, std::uintmax_t offset)
    : path_(path), file_(path, std::ios::binary), input_(1 << 18) {
  file_.seekg(static_cast<std::streamoff>(offset));
  constexpr int either_format = 15 + 32;
  if (inflateInit2(&stream_, either_format) != Z_OK) throw std::bad_alloc();
}

Inflater::~Inflater() { inflateEnd(&stream_); }

std::size_t Inflater::read(char* to, std::size_t count) {
  std::size_t done = 0;
  while (done < count) {
    if (stream_.avail_in == 0) refill();
    constexpr Bytef first_of_gzip = 0x1f;
    if (ended_ && (stream_.avail_in == 0 || *stream_.next_in != first_of_gzip)) break;  // what follows is padding
    if (ended_) {  // gzip files may follow one another
      inflateReset(&stream_);
      ended_ = false;
    }
    const auto room = static_cast<uInt>(std::min<std::size_t>(count - done, 1U << 30));
    stream_.next_out = reinterpret_cast<Bytef*>(to + done);
    stream_.avail_out = room;
    const int status = inflate(&stream_, Z_NO_FLUSH);
    done += room - stream_.avail_out;
    total_ += room - stream_.avail_out;
    ended_ = status == Z_STREAM_END;
    if (status != Z_OK && status != Z_STREAM_END)
      refuse(path_, "is cut or damaged: its compressed data ends after {} bytes, expected a whole file", total_);
  }
  return done;
}

void Inflater::refill() {
  file_.read(input_.data(), static_cast<std::streamsize>(input_.size()));
  stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
  stream_.avail_in = static_cast<uInt>(file_.gcount());
}

}  // namespace hexmesh
