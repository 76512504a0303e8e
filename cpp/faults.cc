#include "faults.h"

#include <dlfcn.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/syscall.h>
#endif

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <system_error>

namespace misclosure::bridge {
namespace {

// The program's exit code for a failure without a code of its own.
constexpr int kFailure = 1;
// Address space that a healthy program can always get; a thread's stack needs as much.
constexpr std::size_t kProbe = std::size_t{8} << 20;
// 0 until the faults are watched. A child between fork() and exec() has another number and ends as it likes.
std::atomic<pid_t> watched_process{0};
std::atomic<bool> is_done{false};
// Set by the first thread that ends the process early: it alone speaks.
std::atomic_flag is_ending = ATOMIC_FLAG_INIT;
std::atomic<bool> was_refused{false};
// Handlers may not allocate: the names stand ready.
char suspects[4096] = "";
struct sigaction earlier_action[NSIG];
std::terminate_handler earlier_terminate = nullptr;

// write(2) is allowed in a handler.
void Say(const char* text) {
  const ssize_t ignored = write(STDERR_FILENO, text, std::strlen(text));
  static_cast<void>(ignored);
}

// Ends the process without destructors and handlers. Not _exit(), which is below.
[[noreturn]] void End(int code) {
#ifdef __linux__
  for (;;) syscall(SYS_exit_group, code);
#else
  std::_Exit(code);
#endif
}

[[noreturn]] void EndBySuspects(const char* what) {
  Say("error: ");
  Say(what);
  Say("; these plug-ins were loaded and are the likely cause: ");
  Say(suspects);
  Say("\n");
  End(kFailure);
}

[[noreturn]] void EndByMemory() {
  Say("error: there is too little memory for this; allow the program more, or use fewer threads (--threads) or a "
      "smaller block\n");
  End(kFailure);
}

// Asks the system, not malloc: a handler may.
bool ProbeFails() {
  void* const probe = mmap(nullptr, kProbe, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (probe == MAP_FAILED) return true;
  munmap(probe, kProbe);
  return false;
}

// Three signs, none of which is always there: a large allocation fails while a small probe succeeds, a message that was
// printed since sets errno anew, and a thread's stack or the growth of the main one is refused to no allocator.
bool IsMemoryShort() { return errno == ENOMEM || was_refused || ProbeFails(); }

void OnAbort(int number) {
  if (IsMemoryShort()) EndByMemory();
  if (suspects[0] != '\0') EndBySuspects("the program was aborted");
  sigaction(number, &earlier_action[number], nullptr);
  raise(number);
}

// A library that does not check what malloc gave, or a stack that cannot grow, crashes for lack of memory too.
void OnCrash(int number) {
  if (IsMemoryShort()) EndByMemory();
  if (suspects[0] != '\0') {
    switch (number) {
      case SIGSEGV: EndBySuspects("the program crashed: a memory access that is not allowed (SIGSEGV)");
      case SIGBUS: EndBySuspects("the program crashed: a memory access that is not possible (SIGBUS)");
      case SIGILL: EndBySuspects("the program crashed: an instruction that the processor does not have (SIGILL)");
      default: EndBySuspects("the program crashed: arithmetic that has no result (SIGFPE)");
    }
  }
  // The instruction is tried again, for the earlier handler: Rust's names a stack overflow.
  sigaction(number, &earlier_action[number], nullptr);
}

void OnExit() {
  if (is_done) return;
  // A second thread waits until the first has spoken and ended the process for both.
  while (is_ending.test_and_set()) pause();
  if (errno == ENOMEM || was_refused) EndByMemory();
  if (suspects[0] != '\0') EndBySuspects("a library ended the program before its work was done");
  Say("error: a library ended the program before its work was done; the message above, where there is one, is its "
      "reason\n");
  End(kFailure);
}

// An exception that leaves a thread of Ceres, or an exception in the middle of another.
[[noreturn]] void OnTerminate() {
  try {
    if (const std::exception_ptr exception = std::current_exception()) std::rethrow_exception(exception);
  } catch (const std::bad_alloc&) {
    EndByMemory();
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) EndByMemory();
  } catch (...) {
  }
  if (earlier_terminate != nullptr) earlier_terminate();
  std::abort();
}

// For `operator new`.
void OnRefusal() {
  was_refused = true;
  throw std::bad_alloc();
}

void Handle(int number, void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  // On the other stack, where there is one: a recursion without end leaves no room on its own.
  action.sa_flags = SA_ONSTACK;
  sigaction(number, &action, &earlier_action[number]);
}

}  // namespace

void watch_faults() {
  watched_process = getpid();
  Handle(SIGABRT, OnAbort);
  for (const int number : {SIGSEGV, SIGBUS, SIGILL, SIGFPE}) Handle(number, OnCrash);
  earlier_terminate = std::set_terminate(OnTerminate);
  std::set_new_handler(OnRefusal);
  std::atexit(OnExit);
  std::at_quick_exit(OnExit);
}

void suspect(rust::Str libraries) {
  const std::size_t length = std::min(libraries.size(), sizeof(suspects) - 1);
  std::memcpy(suspects, libraries.data(), length);
  suspects[length] = '\0';
}

void memory_was_refused() { was_refused = true; }

void end_if_memory_is_short() {
  if (watched_process == getpid() && IsMemoryShort()) EndByMemory();
}

void work_is_done() { is_done = true; }

}  // namespace misclosure::bridge

#ifdef __linux__
// These functions take the place of the C library's, for the libraries that the program loads as well. _exit() and
// _Exit() run no handler of atexit(). exit() and quick_exit() do, but each handler runs once: of two threads that call
// exit() together, the second finds none and would end the program with its own code.
extern "C" void _exit(int code) {
  using namespace misclosure::bridge;
  if (watched_process == getpid()) OnExit();
  End(code);
}

extern "C" void _Exit(int code) noexcept { _exit(code); }

namespace misclosure::bridge {
namespace {

// Calls the C library's function of this name.
[[noreturn]] void EndByLibrary(const char* name, int code) {
  if (watched_process == getpid()) OnExit();
  if (void* const function = dlsym(RTLD_NEXT, name)) reinterpret_cast<void (*)(int)>(function)(code);
  End(code);
}

}  // namespace
}  // namespace misclosure::bridge

extern "C" void exit(int code) noexcept { misclosure::bridge::EndByLibrary("exit", code); }

extern "C" void quick_exit(int code) noexcept { misclosure::bridge::EndByLibrary("quick_exit", code); }
#endif
