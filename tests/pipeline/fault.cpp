// A library for LD_PRELOAD that makes the disk fail: the calls that write below
// WIREPLAN_FAULT_BELOW are counted, and that number WIREPLAN_FAULT_AT fails with the error
// WIREPLAN_FAULT_ERROR; with WIREPLAN_FAULT_STAYS all after it fail too, as on a disk that is full.
// How many were counted is written to WIREPLAN_FAULT_COUNT at the end. With WIREPLAN_CLOCK_BACK the
// clock of the day runs backwards. A write is: open for writing, write, fwrite, fsync, rename,
// link, mkdir, chmod.
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>

namespace {

std::atomic<long> counted{0};

long number_of(const char* name) {
  const char* text = getenv(name);
  return text == nullptr ? 0 : atol(text);
}

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

bool is_below(const char* path) {
  const char* folder = getenv("WIREPLAN_FAULT_BELOW");
  return folder != nullptr && path != nullptr && strncmp(path, folder, strlen(folder)) == 0;
}

bool is_below(int file) {
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const long length = syscall(SYS_readlink, link, path, sizeof path - 1);
  if (length <= 0) return false;
  path[length] = '\0';
  return is_below(path);
}

// Whether this call, a write, is to fail; sets errno then.
template <typename Place>
bool fails(Place place) {
  const int kept = errno;
  if (!is_below(place)) {
    errno = kept;
    return false;
  }
  const long now = ++counted, at = number_of("WIREPLAN_FAULT_AT");
  const bool stays = getenv("WIREPLAN_FAULT_STAYS") != nullptr;
  errno = kept;
  if (at == 0 || (stays ? now < at : now != at)) return false;
  errno = static_cast<int>(number_of("WIREPLAN_FAULT_ERROR"));
  return true;
}

struct WriteCountAtEnd {
  ~WriteCountAtEnd() {
    const char* path = getenv("WIREPLAN_FAULT_COUNT");
    if (path == nullptr) return;
    const long file = syscall(SYS_openat, AT_FDCWD, path, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    char text[32];
    const int length = snprintf(text, sizeof text, "%ld\n", counted.load());
    syscall(SYS_write, file, text, length);
    syscall(SYS_close, file);
  }
} write_count_at_end;

constexpr bool writes(int flags) { return (flags & O_ACCMODE) != O_RDONLY; }

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  if (writes(flags) && fails(path)) return -1;
  return next<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  if (writes(flags) && fails(path)) return -1;
  return next<int (*)(const char*, int, ...)>("open64")(path, flags, mode);
}

FILE* fopen(const char* path, const char* mode) {
  if (mode[0] != 'r' && fails(path)) return nullptr;
  return next<FILE* (*)(const char*, const char*)>("fopen")(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  if (mode[0] != 'r' && fails(path)) return nullptr;
  return next<FILE* (*)(const char*, const char*)>("fopen64")(path, mode);
}

ssize_t write(int file, const void* bytes, size_t count) {
  if (fails(file)) return -1;
  return next<ssize_t (*)(int, const void*, size_t)>("write")(file, bytes, count);
}

ssize_t writev(int file, const iovec* parts, int count) {
  if (fails(file)) return -1;
  return next<ssize_t (*)(int, const iovec*, int)>("writev")(file, parts, count);
}

size_t fwrite(const void* bytes, size_t size, size_t count, FILE* stream) {
  if (fails(fileno(stream))) return 0;
  return next<size_t (*)(const void*, size_t, size_t, FILE*)>("fwrite")(bytes, size, count, stream);
}

int fsync(int file) {
  if (fails(file)) return -1;
  return next<int (*)(int)>("fsync")(file);
}

int rename(const char* from, const char* to) {
  if (fails(to)) return -1;
  return next<int (*)(const char*, const char*)>("rename")(from, to);
}

int link(const char* from, const char* to) {
  if (fails(to)) return -1;
  return next<int (*)(const char*, const char*)>("link")(from, to);
}

int mkdir(const char* path, mode_t mode) {
  if (fails(path)) return -1;
  return next<int (*)(const char*, mode_t)>("mkdir")(path, mode);
}

int chmod(const char* path, mode_t mode) {
  if (fails(path)) return -1;
  return next<int (*)(const char*, mode_t)>("chmod")(path, mode);
}

int fchmodat(int folder, const char* path, mode_t mode, int flags) {
  if (fails(path)) return -1;
  return next<int (*)(int, const char*, mode_t, int)>("fchmodat")(folder, path, mode, flags);
}

int clock_gettime(clockid_t clock, timespec* time) {
  const long result = syscall(SYS_clock_gettime, clock, time);
  if (result == 0 && clock == CLOCK_REALTIME && getenv("WIREPLAN_CLOCK_BACK") != nullptr) {
    static std::atomic<long> calls{0};
    time->tv_sec -= 3600 * ++calls;
  }
  return static_cast<int>(result);
}

}  // extern "C"
