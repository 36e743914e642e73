#pragma once
/// What an error says.
#include <functional>
#include <string>

#include "preprocess/base.h"

namespace wireplan {

/// The message of the `Error` that the action throws, "no error" where it throws none.
inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

inline bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace wireplan
