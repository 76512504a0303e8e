// How the program ends where no error can be returned: memory that is refused to code without a way out, and libraries that crash or end it.

#ifndef MISCLOSURE_FAULTS_H_
#define MISCLOSURE_FAULTS_H_

#include "rust/cxx.h"

namespace misclosure::bridge {

// From now on a lack of memory that aborts the program ends it with a message and code 1, and so does a library that calls exit()
// before `work_is_done`: its code would be taken for the program's own.
void watch_faults();

// Libraries of the user's that are loaded from now on: a crash names them.
void suspect(rust::Str libraries);

// The program ends by itself.
void work_is_done();

}  // namespace misclosure::bridge

#endif  // MISCLOSURE_FAULTS_H_
