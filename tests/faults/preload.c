/* Faults of storage and steps of clocks, for a process that is started with this in LD_PRELOAD.

   M2PEM_FAULTS names a file of 4096 bytes, which is mapped, so that a change takes effect at once.
   Each line is one fault: "CALL ERRNO NAME": a call (write, sync, read, open) on a file whose path
   contains NAME fails with ERRNO, or hangs as long as the fault is there if that is -1;
   "clock ID SECONDS": this clock is ahead by so much. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SIZE 4096
#define NEXT(name) \
  static long (*next)(); \
  if (!next) next = (long (*)())dlsym(RTLD_NEXT, name)

static const char *rules;
static pid_t owner;

/* A forked process gets a file of its own, and its environment a little after it began. */
static const char *current(void) {
  if (rules && owner == getpid()) return rules;
  owner = getpid();
  rules = NULL;
  const char *path = getenv("M2PEM_FAULTS");
  if (path) {
    long (*real_open)() = (long (*)())dlsym(RTLD_NEXT, "open64");
    int file = real_open(path, O_RDONLY | O_CLOEXEC);
    if (file >= 0) {
      void *found = mmap(NULL, SIZE, PROT_READ, MAP_SHARED, file, 0);
      if (found != MAP_FAILED) rules = found;
      close(file);
    }
  }
  return rules;
}

static int found(const char *call, const char *path) {
  const char *line = current();
  if (!line) return 0;
  for (const char *end; *line && (end = strchr(line, '\n')); line = end + 1) {
    char what[16], part[128];
    int number;
    if (sscanf(line, "%15s %d %127s", what, &number, part) == 3 && !strcmp(what, call) &&
        strstr(path, part))
      return number;
  }
  return 0;
}

static int fault_of(const char *call, const char *path) {
  int number;
  while ((number = found(call, path)) < 0) usleep(1000);
  return number;
}

static int fault(const char *call, int file) {
  const char *line = current();
  if (!line || !*line) return 0;
  char link[64], path[1024];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  ssize_t length = readlink(link, path, sizeof path - 1);
  if (length < 0) return 0;
  path[length] = 0;
  return fault_of(call, path);
}

#define FAIL(call, file) \
  do { \
    int number = fault(call, file); \
    if (number) { \
      errno = number; \
      return -1; \
    } \
  } while (0)

#define WRITE_AT(name) \
  ssize_t name(int file, const void *content, size_t size, off_t place) { \
    NEXT(#name); \
    FAIL("write", file); \
    return next(file, content, size, place); \
  }
WRITE_AT(pwrite)
WRITE_AT(pwrite64)

#define READ_AT(name) \
  ssize_t name(int file, void *content, size_t size, off_t place) { \
    NEXT(#name); \
    FAIL("read", file); \
    return next(file, content, size, place); \
  }
READ_AT(pread)
READ_AT(pread64)

ssize_t write(int file, const void *content, size_t size) {
  NEXT("write");
  FAIL("write", file);
  return next(file, content, size);
}

ssize_t read(int file, void *content, size_t size) {
  NEXT("read");
  FAIL("read", file);
  return next(file, content, size);
}

#define RESIZE(name) \
  int name(int file, off_t size) { \
    NEXT(#name); \
    FAIL("write", file); \
    return next(file, size); \
  }
RESIZE(ftruncate)
RESIZE(ftruncate64)

#define SYNC(name) \
  int name(int file) { \
    NEXT(#name); \
    FAIL("sync", file); \
    return next(file); \
  }
SYNC(fsync)
SYNC(fdatasync)

/* "open" is of opening for writing: what a file system that is mounted read-only refuses. */
#define OPEN(name) \
  int name(const char *path, int flags, ...) { \
    va_list more; \
    va_start(more, flags); \
    int mode = va_arg(more, int); \
    va_end(more); \
    NEXT(#name); \
    int number = flags & (O_WRONLY | O_RDWR | O_CREAT) ? fault_of("open", path) : 0; \
    if (number) { \
      errno = number; \
      return -1; \
    } \
    return next(path, flags, mode); \
  }
OPEN(open)
OPEN(open64)

static long ahead(clockid_t id) {
  const char *line = current();
  if (!line) return 0;
  for (const char *end; *line && (end = strchr(line, '\n')); line = end + 1) {
    int which;
    long seconds;
    if (sscanf(line, "clock %d %ld", &which, &seconds) == 2 && which == (int)id) return seconds;
  }
  return 0;
}

int clock_gettime(clockid_t id, struct timespec *now) {
  NEXT("clock_gettime");
  int status = next(id, now);
  if (!status) now->tv_sec += ahead(id);
  return status;
}

time_t time(time_t *now) {
  struct timespec found;
  clock_gettime(CLOCK_REALTIME, &found);
  if (now) *now = found.tv_sec;
  return found.tv_sec;
}

int gettimeofday(struct timeval *now, void *zone) {
  NEXT("gettimeofday");
  int status = next(now, zone);
  if (!status) now->tv_sec += ahead(CLOCK_REALTIME);
  return status;
}
