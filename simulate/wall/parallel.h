#pragma once
/// Loops on all cores, for what is built once per patient.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <future>
#include <vector>

#include "preprocess/cores.h"

namespace wireplan::simulate {

/// Calls work(k) for each k below `count`, in no promised order. It may write to its own part
/// alone. Threads of its own, not TBB's: the thread sanitizer sees all that they share.
template <class Work>
void for_each_index(std::size_t count, const Work& work) {
  constexpr std::size_t kAtOnce = 16;
  std::atomic<std::size_t> next = 0;
  const auto run = [&] {
    for (std::size_t k = next.fetch_add(kAtOnce); k < count; k = next.fetch_add(kAtOnce)) {
      for (std::size_t j = k; j < std::min(count, k + kAtOnce); ++j) work(j);
    }
  };
  std::vector<std::future<void>> others;
  const auto cores = static_cast<std::size_t>(core_count());
  for (std::size_t t = 1; t < cores && t * kAtOnce < count; ++t) {
    others.push_back(std::async(std::launch::async, run));
  }
  run();
  for (std::future<void>& other : others) other.get();
}

}  // namespace wireplan::simulate
