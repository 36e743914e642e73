#pragma once
/// Work in a process of its own: for a library that ends its process when a file is not what it
/// expects.
#include <cstddef>
#include <functional>
#include <string>

namespace wireplan::preprocess {

using Send = std::function<void(const void* bytes, std::size_t count)>;
using Receive = std::function<void(void* bytes, std::size_t count)>;
/// Says which file the work is at, for the error if it ends there.
using At = std::function<void(const std::string& place)>;

/// Runs `work` in a child of this process, and `take` here, which receives what the child sends.
/// What the child prints is dropped, but see LastWords. Throws `Error`
///   - where the work throws one: the same;
///   - where the child ends before the work is done, or neither sends anything nor names another
///     place for `patience` seconds: one that names the last place, followed by `ended`.
/// The child starts as a copy of this process that has the calling thread alone, so `work` must not
/// start threads or wait for any. To be called while no other thread works: a lock that one holds
/// at that moment stays locked in the child, which then waits in vain until its patience ends.
void run_apart(const std::function<void(const Send&, const At&)>& work,
               const std::function<void(const Receive&)>& take, const std::string& ended,
               unsigned patience = 300);

/// Within such work: what a library prints to the standard error output from here on, which is how
/// a decoder tells why it refuses. Not for what reads a header: its values may tell who the patient
/// is.
class LastWords {
 public:
  LastWords();
  /// The last line, quoted and in brackets to be added to a message: ` ("tile is too long")`. Empty
  /// where nothing was printed, and outside of such work.
  std::string text() const;

 private:
  long begin_;  // in the child's output
};

}  // namespace wireplan::preprocess
