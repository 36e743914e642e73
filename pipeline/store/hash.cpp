#include "pipeline/store/hash.h"

#include <openssl/evp.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <vector>

#include "preprocess/base.h"
#include "preprocess/text.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    expects(context_ && EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) == 1);
  }

  void add(std::string_view bytes) {
    expects(EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
  }

  std::string hex() {
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int length = 0;
    expects(EVP_DigestFinal_ex(context_.get(), digest.data(), &length) == 1);
    std::string text;
    for (unsigned int k = 0; k < length; ++k) {
      text += "0123456789abcdef"[digest[k] >> 4U];
      text += "0123456789abcdef"[digest[k] & 15U];
    }
    return text;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

// Names of the files relative to the folder, in an order that no file system decides.
std::vector<std::string> names_below(const fs::path& folder) try {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      names.push_back(entry.path().lexically_relative(folder).generic_string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
} catch (const fs::filesystem_error& error) {
  throw Error(folder.string() + ": cannot be read (" + error.code().message() +
              "), expected a readable folder; check the path and its permissions");
}

/// The name of the file with the voxels that the header of a MetaImage or NRRD tells, in all the
/// spellings that their readers take (preprocess/volume); empty where it tells none.
std::string told_data_file(const fs::path& header, bool meta) {
  constexpr std::size_t kMost = 100000;  // lines
  std::ifstream stream(header, std::ios::binary);
  std::string line;
  for (std::size_t k = 0; k < kMost && std::getline(stream, line); ++k) {
    if (line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // as some editors begin a text
    line = trimmed(line);
    if (!meta && line.empty()) return {};  // the header's end
    const std::size_t mark = line.find(meta ? "=" : ": ");
    if (mark == std::string::npos || (!meta && line.find(":=") < mark)) continue;
    const std::string key = lower_case(trimmed(line.substr(0, mark)));
    const bool names = meta ? key == "elementdatafile" : key == "data file" || key == "datafile";
    if (names) return trimmed(line.substr(mark + (meta ? 1 : 2)));
  }
  return {};
}

/// The file with the voxels that the header of a MetaImage or NRRD names; empty where they lie in
/// it, or in several files.
fs::path data_of_header(const fs::path& header) {
  const std::string ending = lower_case(header.extension().string());
  const bool meta = ending == ".mhd" || ending == ".mha";
  if (!meta && ending != ".nhdr" && ending != ".nrrd") return {};
  std::string name = told_data_file(header, meta);
  if (name.empty()) return {};
  std::error_code unknown;
  const auto is_there = [&] { return fs::is_regular_file(header.parent_path() / name, unknown); };
  if (!is_there()) std::replace(name.begin(), name.end(), '\\', '/');  // as Windows has it
  return is_there() ? header.parent_path() / name : fs::path();
}

std::string hash_folder(const fs::path& folder) {
  const std::vector<std::string> names = names_below(folder);
  Sha256 sum;
  for (const std::string& name : names) {
    const fs::path file = folder / name;
    // A zero byte cannot stand in a name: it parts the name from what follows.
    sum.add(std::string_view(name.c_str(), name.size() + 1));
    sum.add(std::to_string(fs::file_size(file)) + " " + hash_file(file) + "\n");
  }
  return sum.hex();
}

}  // namespace

std::string hash_text(std::string_view text) {
  Sha256 sum;
  sum.add(text);
  return sum.hex();
}

std::string hash_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || fs::is_directory(file)) {
    throw Error(file.string() + ": cannot be read (" + std::strerror(errno) +
                "), expected a readable file; check the path and its permissions");
  }
  Sha256 sum;
  std::array<char, std::size_t{1} << 16U> buffer{};
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) ||
         stream.gcount() > 0) {
    sum.add(std::string_view(buffer.data(), static_cast<std::size_t>(stream.gcount())));
  }
  if (stream.bad()) {
    throw Error(file.string() + ": reading stopped half way, expected a readable file; check the " +
                "disk it lies on");
  }
  return sum.hex();
}

std::string hash_input(const fs::path& path) {
  if (fs::is_directory(path)) return hash_folder(path);
  const fs::path data = data_of_header(path);
  return data.empty() ? hash_file(path) : hash_text(hash_file(path) + hash_file(data));
}

std::string input_stamp(const fs::path& path) {
  std::vector<std::string> names = {""};
  if (fs::is_directory(path)) names = names_below(path);
  std::string stamp;
  const fs::path data = fs::is_directory(path) ? fs::path() : data_of_header(path);
  if (!data.empty()) stamp = input_stamp(data);
  for (const std::string& name : names) {
    const fs::path file = name.empty() ? path : path / name;
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) continue;  // gone: the others' stamps do not match
    stamp += name + " " + std::to_string(status.st_size) + " " + std::to_string(status.st_ino);
    for (const timespec& time : {status.st_mtim, status.st_ctim}) {
      stamp += ' ' + std::to_string(time.tv_sec) + '.' + std::to_string(time.tv_nsec);
    }
    stamp += "\n";
  }
  return stamp;
}

}  // namespace wireplan::pipeline
