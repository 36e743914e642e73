#pragma once
/// How long something takes.
#include <chrono>

namespace wireplan::pipeline {

/// By the clock on the wall [s].
inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace wireplan::pipeline
