#pragma once
/// Work in a process of its own, for a library that ends the process it runs in where a file is not
/// what it expects.
#include <cstddef>
#include <functional>
#include <string>

namespace wireplan::preprocess {

using Send = std::function<void(const void* bytes, std::size_t count)>;
using Receive = std::function<void(void* bytes, std::size_t count)>;
/// Says which file the work is at, for the error if it ends there.
using At = std::function<void(const std::string& place)>;

/// Runs `work` in a child of this process and `take` here, which receives what the other sends. An
/// Error of the work is thrown here; where the child ends in the midst of it, or neither sends nor
/// comes to another place for `patience` seconds, an Error of the place where it was and `ended`.
/// What it prints is dropped. The child begins as a copy of this process with this thread alone, so
/// the work starts no threads and waits for none.
void run_apart(const std::function<void(const Send&, const At&)>& work,
               const std::function<void(const Receive&)>& take, const std::string& ended,
               unsigned patience = 300);

}  // namespace wireplan::preprocess
