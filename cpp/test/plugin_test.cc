// The same header as a plug-in and built in: the same description and the same numbers.
#include <dlfcn.h>

#include "effect_test.h"
#include "solve.h"

using namespace misclosure;
using namespace misclosure::test;

int main(int count, char** arguments) {
  if (count != 2) return 2;
  void* library = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
  Expect(library != nullptr, "the plug-in loads");
  if (library == nullptr) return Finish();
  const auto entry = reinterpret_cast<const misclosure_effect* (*)()>(dlsym(library, "misclosure_plugin"));
  Expect(entry != nullptr, "it exports misclosure_plugin");
  if (entry == nullptr) return Finish();
  const misclosure_effect& plugin = *entry();
  CheckLaws(plugin);
  bool found = false;
  for (std::size_t k = 0; const misclosure_effect* own = misclosure_builtin(k); ++k) {
    if (std::string(own->id) != plugin.id) continue;
    found = true;
    Expect(own->eval != plugin.eval, "another copy of the code");
    std::mt19937_64 random(11);
    for (int sample = 0; sample < kSamples; ++sample) {
      const Place place = Draw(*own, random);
      const Result a = Evaluate(*own, place, true);
      const Result b = Evaluate(plugin, place, true);
      Expect(a.ok == b.ok && a.out == b.out, "the same values");
    }
  }
  Expect(found, "built in as well");
  return Finish();
}
