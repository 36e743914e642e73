#pragma once
/// The command line: run, check, status, wires, simulate, phantom, bench (design section 3).
/// Answers go to standard output, the log to standard error.

namespace wireplan::pipeline {

/// Exit codes of the program.
inline constexpr int kDone = 0, kNoPlan = 1, kBadInput = 2, kOurFault = 3, kInterrupted = 130;

/// Does what the arguments ask. Returns kDone or kNoPlan, or kBadInput where the arguments make no
/// sense. Throws `Error` for a bad world and `Interrupted` where the user stopped it.
int run_command(int argc, const char* const* argv);

}  // namespace wireplan::pipeline
