#pragma once
/// For libraries that end their process: GDCM is built with its assertions on, which damaged files
/// break. The program reads DICOM in a process of its own for each folder then. The fuzzer does it
/// in its own, where it sees what is covered: the linker puts another `run_apart` in the place of
/// the program's, and an assertion or a fault of a library leads back here. What the library
/// held is lost then, so the fuzzer's limit of memory has to be wider.
#include <functional>

namespace wireplan::fuzz {

/// Does the work, until its end, or that of a library. Any other end is a finding.
void run_in_place(const std::function<void()>& work);

}  // namespace wireplan::fuzz
