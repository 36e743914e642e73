#include "preprocess/volume/byte_stream.h"

#include <algorithm>

#include "preprocess/base.h"

namespace wireplan::preprocess {
namespace {

constexpr int kGzipOrZlib = 32 + MAX_WBITS;  // as it begins

}  // namespace

ByteStream::ByteStream(const std::filesystem::path& path) : file_(path, std::ios::binary) {
  packed_ = file_.get() == 0x1F && file_.get() == 0x8B;
  file_.clear();
  file_.seekg(0);
  expects(inflateInit2(&inflater_, kGzipOrZlib) == Z_OK);
}

ByteStream::ByteStream(const std::filesystem::path& path, std::streamoff start, bool packed)
    : file_(path, std::ios::binary), packed_(packed), one_member_(true) {
  file_.seekg(start);
  expects(inflateInit2(&inflater_, kGzipOrZlib) == Z_OK);
}

ByteStream::~ByteStream() { inflateEnd(&inflater_); }

bool ByteStream::read(void* bytes, std::size_t count) {
  if (!packed_) {
    file_.read(static_cast<char*>(bytes), static_cast<std::streamsize>(count));
    return static_cast<std::size_t>(file_.gcount()) == count;
  }
  constexpr std::size_t kAtOnce = std::size_t{1} << 30U;  // zlib counts with 32 bits
  inflater_.next_out = static_cast<unsigned char*>(bytes);
  for (std::size_t more = 0; count > 0; count -= more) {
    more = std::min(count, kAtOnce);
    inflater_.avail_out = static_cast<unsigned>(more);
    while (inflater_.avail_out > 0) {
      if (!inflate_more()) return false;
    }
  }
  return true;
}

bool ByteStream::skip(std::size_t count) {
  std::array<unsigned char, std::size_t{1} << 14U> some{};
  for (std::size_t more = 0; count > 0; count -= more) {
    more = std::min(count, some.size());
    if (!read(some.data(), more)) return false;
  }
  return true;
}

bool ByteStream::ends_whole() {
  std::array<unsigned char, 4096> rest{};
  while (packed_ && !at_end_) {
    inflater_.next_out = rest.data();
    inflater_.avail_out = static_cast<unsigned>(rest.size());
    if (!inflate_more()) return false;
  }
  return true;
}

bool ByteStream::inflate_more() {
  if (at_end_ && one_member_) return false;
  if (inflater_.avail_in == 0) {
    file_.read(reinterpret_cast<char*>(buffer_.data()),
               static_cast<std::streamsize>(buffer_.size()));
    inflater_.next_in = buffer_.data();
    inflater_.avail_in = static_cast<unsigned>(file_.gcount());
    if (inflater_.avail_in == 0) return false;
  }
  if (at_end_ && inflateReset(&inflater_) != Z_OK) return false;  // the next member
  const int result = inflate(&inflater_, Z_NO_FLUSH);
  at_end_ = result == Z_STREAM_END;
  return result == Z_OK || at_end_;
}

}  // namespace wireplan::preprocess
