#include "tests/fuzz/in_place.h"

#include <dlfcn.h>
#include <ucontext.h>
#include <unistd.h>

#include <array>
#include <csetjmp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "preprocess/base.h"
#include "preprocess/volume/apart.h"

namespace wireplan::fuzz {
namespace {

sigjmp_buf before_work;
bool is_working = false;
std::array<struct sigaction, NSIG> former{};

/// Whether an instruction is one of a library's and not of this program's, which the sanitizers
/// watch.
bool is_of_library(void* instruction) {
  Dl_info its{}, ours{};
  return ::dladdr(instruction, &its) != 0 &&
         ::dladdr(reinterpret_cast<void*>(&run_in_place), &ours) != 0 &&
         its.dli_fbase != ours.dli_fbase;
}

/// A library's fault ends the process that the program starts, as an assertion does.
void on_fault(int signal, siginfo_t* /*what*/, void* context) {
  const auto& state = static_cast<const ucontext_t*>(context)->uc_mcontext;
#ifdef __x86_64__
  void* instruction = reinterpret_cast<void*>(state.gregs[REG_RIP]);
#else
  void* instruction = reinterpret_cast<void*>(state.pc);
#endif
  if (is_working && is_of_library(instruction)) siglongjmp(before_work, 1);
  ::sigaction(signal, &former[static_cast<std::size_t>(signal)], nullptr);  // then it comes again
}

void watch_faults() {
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE}) {
    struct sigaction action {};
    action.sa_sigaction = on_fault;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    expects(::sigaction(signal, &action, &former[static_cast<std::size_t>(signal)]) == 0);
  }
}

/// Whether the linker did as the build tells it to.
bool is_exchanged() {
  bool here = false;
  preprocess::run_apart([&](const preprocess::Send&, const preprocess::At&) { here = true; },
                        [](const preprocess::Receive&) {}, "");
  return here;
}

}  // namespace

void run_in_place(const std::function<void()>& work) {
  static const int kFirstFree = ::dup(STDERR_FILENO);
  static const bool kIsReady = [] {
    expects(is_exchanged());
    watch_faults();
    return true;
  }();
  expects(kIsReady);
  if (sigsetjmp(before_work, 1) == 0) {
    is_working = true;
    work();
  } else {
    ::close_range(static_cast<unsigned>(kFirstFree) + 1, ~0U, 0);  // what was open at the assertion
  }
  is_working = false;
}

/// run_apart in this process: what the work sends is kept, then taken.
void run_here(const std::function<void(const preprocess::Send&, const preprocess::At&)>& work,
              const std::function<void(const preprocess::Receive&)>& take, const std::string& ended,
              unsigned patience) __asm__(WIREPLAN_OTHER_RUN_APART);
void run_here(const std::function<void(const preprocess::Send&, const preprocess::At&)>& work,
              const std::function<void(const preprocess::Receive&)>& take, const std::string& ended,
              unsigned /*patience*/) {
  std::string sent, place;
  try {
    work([&](const void* bytes,
             std::size_t count) { sent.append(static_cast<const char*>(bytes), count); },
         [&](const std::string& now) { place = now; });
  } catch (const Error&) {
    throw;
  } catch (const std::exception&) {
    throw Error(place + ": " + ended);
  }
  std::size_t taken = 0;
  take([&](void* bytes, std::size_t count) {
    if (count > sent.size() - taken) std::abort();  // less than the work promised
    std::memcpy(bytes, sent.data() + taken, count);
    taken += count;
  });
}

}  // namespace wireplan::fuzz

/// In the place of the C library's, for all libraries of this program.
extern "C" void __assert_fail(const char* claim, const char* file, unsigned line,
                              const char* /*function*/) noexcept {
  if (wireplan::fuzz::is_working) siglongjmp(wireplan::fuzz::before_work, 1);
  std::fprintf(stderr, "%s:%u: %s\n", file, line, claim);
  std::abort();
}
