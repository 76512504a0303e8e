// Which surveyed coordinates a frame effect acts on: its given parameter `in`.
//
// A survey can give the control points in a map and the antennas in Cartesian coordinates, or the other way round; what
// a map does to coordinates must then reach one kind of them alone.

#ifndef MISCLOSURE_SURVEYED_H_
#define MISCLOSURE_SURVEYED_H_

#include "effect.h"

namespace misclosure {

// The kinds of surveyed coordinates, as `surveyed_kind` of the context counts them.
constexpr double kControlKind = 0.0, kAntennaKind = 1.0;

// The choices of `in`.
constexpr double kInBoth = 0.0, kInControl = 1.0, kInGnss = 2.0;
inline constexpr Name kSurveyedIn[] = {{"both", kInBoth}, {"control", kInControl}, {"gnss", kInGnss}};

// Whether an effect acts on the coordinate at hand. Returns false where that cannot be said: `in` is none of the
// choices, or it is one kind and the coordinate's is not known.
template <class T>
bool ActsOn(const Context& context, const T& in, bool* acts) {
  const double kind = context.surveyed_kind;
  *acts = in == kInBoth || (in == kInControl && kind == kControlKind) || (in == kInGnss && kind == kAntennaKind);
  const bool choice = in == kInBoth || in == kInControl || in == kInGnss;
  return choice && (in == kInBoth || kind == kControlKind || kind == kAntennaKind);
}

}  // namespace misclosure

#endif  // MISCLOSURE_SURVEYED_H_
