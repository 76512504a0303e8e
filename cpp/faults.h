// How the program ends where no error can be returned: memory that is refused to code without a way out, and libraries
// that crash or end it.

#ifndef MISCLOSURE_FAULTS_H_
#define MISCLOSURE_FAULTS_H_

#include "rust/cxx.h"

namespace misclosure::bridge {

// From now on a lack of memory that would abort or crash the program ends it with a message and code 1. So does a
// library that calls exit(), quick_exit() or _exit() before `work_is_done`: its code would be taken for the program's
// own. Nothing in the process can stop a library that makes the system call itself.
void watch_faults();

// An allocator of another language was refused memory: what ends the program next has this reason.
void memory_was_refused();

// Ends the program with the message about memory where memory is short.
void end_if_memory_is_short();

// Libraries of the user's that are loaded from now on: a crash names them.
void suspect(rust::Str libraries);

// The program ends by itself.
void work_is_done();

}  // namespace misclosure::bridge

#endif  // MISCLOSURE_FAULTS_H_
