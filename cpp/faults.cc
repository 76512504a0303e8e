#include "faults.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace misclosure::bridge {
namespace {

// As the program's exit code for a failure without a code of its own.
constexpr int kFailure = 1;

std::atomic<bool> is_done{false};
// A handler may not allocate: what it says stands ready.
char suspects[4096] = "";

// For handlers: write(2) is allowed there, whatever the program was doing.
void Say(const char* text) {
  const ssize_t ignored = write(STDERR_FILENO, text, std::strlen(text));
  static_cast<void>(ignored);
}

[[noreturn]] void EndBySuspects(const char* what) {
  Say("error: ");
  Say(what);
  Say("; these plug-ins were loaded and are the likely cause: ");
  Say(suspects);
  Say("\n");
  _exit(kFailure);
}

// An allocation that fails sets errno, also that of a thread's stack, and what ends the program for it does nothing that would set it anew.
void EndByMemory() {
  if (errno != ENOMEM) return;
  Say("error: there is too little memory for this; allow the program more, or use fewer threads (--threads) or a smaller block\n");
  _exit(kFailure);
}

void OnAbort(int) {
  EndByMemory();
  if (suspects[0] != '\0') EndBySuspects("the program was aborted");
  signal(SIGABRT, SIG_DFL);
  raise(SIGABRT);
}

void OnCrash(int number) {
  switch (number) {
    case SIGSEGV: EndBySuspects("the program crashed: a memory access that is not allowed (SIGSEGV)");
    case SIGBUS: EndBySuspects("the program crashed: a memory access that is not possible (SIGBUS)");
    case SIGILL: EndBySuspects("the program crashed: an instruction that the processor does not have (SIGILL)");
    default: EndBySuspects("the program crashed: arithmetic that has no result (SIGFPE)");
  }
}

void OnExit() {
  if (is_done) return;
  EndByMemory();
  if (suspects[0] != '\0') EndBySuspects("a library ended the program before its work was done");
  Say("error: a library ended the program before its work was done; the message above, where there is one, is its reason\n");
  _exit(kFailure);
}

void Handle(int number, void (*handler)(int)) {
  struct sigaction action = {};
  action.sa_handler = handler;
  // On the other stack, where there is one: a recursion without end leaves no room on its own.
  action.sa_flags = SA_ONSTACK;
  sigaction(number, &action, nullptr);
}

}  // namespace

void watch_faults() {
  Handle(SIGABRT, OnAbort);
  std::atexit(OnExit);
}

void suspect(rust::Str libraries) {
  const std::size_t length = std::min(libraries.size(), sizeof(suspects) - 1);
  std::memcpy(suspects, libraries.data(), length);
  suspects[length] = '\0';
  for (const int number : {SIGSEGV, SIGBUS, SIGILL, SIGFPE}) Handle(number, OnCrash);
}

void work_is_done() { is_done = true; }

}  // namespace misclosure::bridge
