#pragma once
/// Bytes of a file that may be compressed; for the .cpp files here.
#include <zlib.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>

namespace wireplan::preprocess {

/// The bytes of a file one after another, inflated where it is compressed: by gzip (RFC 1952,
/// members behind one another) where it begins so, or as said. zlib's gzread does not tell a file
/// whose last bytes are missing from a whole one.
class ByteStream {
 public:
  explicit ByteStream(const std::filesystem::path& path);
  /// From `start` on as it is, or `packed` as one stream of zlib's or gzip's.
  ByteStream(const std::filesystem::path& path, std::streamoff start, bool packed);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  bool packed() const { return packed_; }
  /// False where fewer bytes are left, or they are damaged.
  bool read(void* bytes, std::size_t count);
  /// The same without keeping them.
  bool skip(std::size_t count);
  /// Whether what was compressed ends as it should; what lies behind is not looked at.
  bool ends_whole();

 private:
  bool inflate_more();

  std::ifstream file_;
  bool packed_ = false, one_member_ = false, at_end_ = false;
  z_stream inflater_{};
  std::array<unsigned char, std::size_t{1} << 16U> buffer_{};
};

}  // namespace wireplan::preprocess
