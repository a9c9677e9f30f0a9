// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>

namespace hexmesh {

/// SHA-256 (FIPS 180-4) of bytes that come one after the other.
class Sha256 {
public:
  Sha256();
  ~Sha256();
  void add(const void* bytes, std::size_t count);

  /// 64 hexadecimal digits; nothing is added afterwards.
  std::string digits();

private:
  struct Context;
  std::unique_ptr<Context> context_;
};

}  // namespace hexmesh
