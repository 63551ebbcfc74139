// Linked into every program and compiled for any x86-64: says in one line that the processor is too
// old, before the first instruction of x86-64-v3 would end the program without a word.
#ifdef SACCADE_NEEDS_X86_64_V3  // else any processor of its kind will do

#include <unistd.h>

#include <cstdlib>

namespace {

// Before all other initialisers of the program, which are compiled for x86-64-v3 already.
__attribute__((constructor(101))) void CheckProcessor() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
      __builtin_cpu_supports("bmi2")) {
    return;
  }
  static const char message[] =
      "saccade: this processor lacks AVX2, FMA or BMI2 (x86-64-v3, 2013 and later); build with "
      "-DSACCADE_ARCH=x86-64 for it\n";
  const ssize_t written = write(STDERR_FILENO, message, sizeof message - 1);
  _exit(written > 0 ? 1 : 2);
}

}  // namespace

#endif
