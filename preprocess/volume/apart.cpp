#include "preprocess/volume/apart.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <sstream>

#include "preprocess/base.h"

namespace wireplan::preprocess {
namespace {

constexpr int kDone = 0, kRefused = 1, kGaveUp = 2;  // how the child ends by itself

/// Thrown and caught here: the child sends no more.
struct Silence {};

/// An end of a pipe, closed at the end of its scope.
class PipeEnd {
 public:
  explicit PipeEnd(int file) : file_(file) {}
  ~PipeEnd() { close(); }
  PipeEnd(const PipeEnd&) = delete;
  PipeEnd& operator=(const PipeEnd&) = delete;

  void close() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }
  bool send(const void* bytes, std::size_t count) const {
    const char* next = static_cast<const char*>(bytes);
    while (count > 0) {
      const ssize_t sent = ::write(file_, next, count);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0) return false;
      next += sent;
      count -= static_cast<std::size_t>(sent);
    }
    return true;
  }
  /// Returns how many came before the other end was closed, at most `count`.
  std::size_t receive(void* bytes, std::size_t count) const {
    std::size_t received = 0;
    while (received < count) {
      const ssize_t more = ::read(file_, static_cast<char*>(bytes) + received, count - received);
      if (more < 0 && errno == EINTR) continue;
      if (more <= 0) break;
      received += static_cast<std::size_t>(more);
    }
    return received;
  }

 private:
  int file_;
};

struct Pipe {
  PipeEnd out, in;
};

[[noreturn]] void throw_refused(const std::string& what) {
  throw DiskError("the system gives no other " + what + " (" + std::strerror(errno) +
                  "); end other programs");
}

Pipe open_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw_refused("pipe");
  return {PipeEnd(ends[0]), PipeEnd(ends[1])};
}

/// A text in memory that parent and child share.
class SharedText {
 public:
  SharedText() {
    void* page = ::mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (page == MAP_FAILED) throw_refused("memory");
    text_ = static_cast<char*>(page);
  }
  ~SharedText() { ::munmap(text_, kSize); }
  SharedText(const SharedText&) = delete;
  SharedText& operator=(const SharedText&) = delete;

  void set(const std::string& text) { text_[text.copy(text_, kSize - 1)] = '\0'; }
  std::string get() const { return {text_, ::strnlen(text_, kSize)}; }

 private:
  static constexpr std::size_t kSize = 8192;  // twice the longest path
  char* text_ = nullptr;
};

bool is_apart = false;  // in the child: its standard error output is a file in memory

/// No words of the library's where a user sees them, no files of its memory, no handlers of the
/// process it was.
void be_quiet() {
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC),
            memory = ::memfd_create("printed", MFD_CLOEXEC);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(memory >= 0 ? memory : nowhere, STDERR_FILENO);
  is_apart = memory >= 0;
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGALRM}) {
    ::signal(signal, SIG_DFL);
  }
}

/// The child: ends without the clean-up of the process it was.
[[noreturn]] void work_as_child(const std::function<void(const Send&, const At&)>& work,
                                const PipeEnd& data, const PipeEnd& words, SharedText& place,
                                unsigned patience) {
  be_quiet();
  ::alarm(patience);  // ends the process, unless it is set anew
  try {
    work(
        [&](const void* bytes, std::size_t count) {
          if (!data.send(bytes, count)) ::_exit(kGaveUp);
          ::alarm(patience);
        },
        [&](const std::string& now) {
          place.set(now);
          ::alarm(patience);
        });
  } catch (const Error& error) {
    const std::string text = error.what();
    ::_exit(words.send(text.data(), text.size()) ? kRefused : kGaveUp);
  } catch (...) {
    ::_exit(kGaveUp);
  }
  ::_exit(kDone);
}

}  // namespace

void run_apart(const std::function<void(const Send&, const At&)>& work,
               const std::function<void(const Receive&)>& take, const std::string& ended,
               unsigned patience) {
  SharedText place;
  Pipe data = open_pipe(), words = open_pipe();
  const pid_t child = ::fork();
  if (child < 0) throw_refused("process");
  if (child == 0) {
    data.out.close();
    words.out.close();
    work_as_child(work, data.in, words.in, place, patience);
  }
  data.in.close();
  words.in.close();

  // What the child sends, until it sends no more or nothing more is wanted; it ends then.
  bool all_came = true;
  std::exception_ptr problem;
  try {
    take([&](void* bytes, std::size_t count) {
      if (data.out.receive(bytes, count) < count) throw Silence();
    });
  } catch (const Silence&) {
    all_came = false;
  } catch (...) {
    problem = std::current_exception();
  }
  data.out.close();

  // How it ended.
  std::string text(1U << 16U, '\0');
  text.resize(words.out.receive(text.data(), text.size()));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (problem) std::rethrow_exception(problem);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : kGaveUp;
  if (code == kRefused) throw Error(text);
  if (code != kDone) throw Error(place.get() + ": " + ended);
  expects(all_came);
}

LastWords::LastWords() : begin_(0) {
  if (!is_apart) return;
  std::fflush(stderr);
  begin_ = ::lseek(STDERR_FILENO, 0, SEEK_END);
}

std::string LastWords::text() const {
  if (!is_apart) return {};
  std::fflush(stderr);
  std::array<char, 1024> end{};
  const long size = ::lseek(STDERR_FILENO, 0, SEEK_END),
             from = std::max(begin_, size - static_cast<long>(end.size()));
  const ssize_t count = ::pread(STDERR_FILENO, end.data(), end.size(), from);
  std::istringstream printed(
      std::string(end.data(), count > 0 ? static_cast<std::size_t>(count) : 0));
  std::string last;
  for (std::string line; std::getline(printed, line);) {
    std::erase_if(line, [](unsigned char c) { return c < ' ' || c > '~'; });
    if (line.find_first_not_of(' ') != std::string::npos) last = line;
  }
  return last.empty() ? last : " (\"" + last + "\")";
}

}  // namespace wireplan::preprocess
