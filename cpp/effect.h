// The contract of an effect, in C and in C++. This is the one header that an extension needs.
//
// An effect is written once, as a formula that works for any number type:
//
//   #include "effect.h"
//   namespace misclosure {
//   struct FocalTime {
//     static constexpr const char* id = "focal-time";
//     static constexpr Stage stage = Stage::kInterior;
//     ...                                                          // see cpp/effects/focal-time.h
//     template <class T>
//     static bool Apply(const Context& context, const T* in, const T* theta, T* out);
//   };
//   MISCLOSURE_EFFECT(FocalTime)
//   }
//
// Derivatives follow from it by automatic differentiation, by every input of the stage. An effect that depends on a few
// of them costs less when it says which:
//
//     static constexpr std::array reads = {0, 1, 5, 6};             // of an image effect: x, y, dcx, dcy
//
// An input that is not listed passes through: the output of the same index is this input plus a function of the listed
// ones, and no other output depends on it.
//
// A header in cpp/effects/ is built in. The same file, unchanged, is a
// plug-in when compiled with `misclosure effects build focal-time.h -o focal-time.so`, which is
//
//   c++ -std=c++17 -O3 -fPIC -shared -fvisibility=hidden -DMISCLOSURE_PLUGIN -I cpp -I /usr/include/eigen3 -x c++ focal-time.h -o focal-time.so
//
// and exports one symbol, `misclosure_plugin`. `misclosure effects new` writes a header to begin with.
//
// The loader checks that of a plug-in which it can (description, null law at random places) and refuses it otherwise;
// `misclosure effects check` checks every law.
//
// Two laws: at the nominal values of its parameters an effect is exactly the identity, and it has no state, throws
// nothing and may be called from several threads at once.
//
// A frame effect is called for two kinds of coordinates: of control and check points, after the control stage, and of
// antennas, after the position stage. `surveyed_kind` of the context says which of the two is at hand; at all other
// stages it is NaN. Control points belong to no image: control and frame effects have global parameters alone and read
// nothing of one. What a map does may reach one kind alone; cpp/surveyed.h has the given parameter `in` for that
// choice.
//
// An effect that names a cause may state three things more: plausible ranges, which a diagnosis weighs, and words and
// a picture, which a report shows. Without a range any size counts as possible; without words there are figures alone.
//
//   static constexpr Parameter parameters[] = {
//       Within(Estimated("kappa", "1/m", Scope::kGlobal, 0.0, 1.3e-8), 0.0, 5e-8, "four times the standard air"),
//   };
//   static constexpr Words words = {"What it is, in two sentences.", "What to do about it.",
//                                   "the flight, column or setting that would tell it from what looks like it"};
//   static constexpr Picture picture = Picture::kScale;             // without it that of the stage
//   static constexpr By by = By::kTemperature;                      // of kScale, kShift and kGnss; without it the time

#ifndef MISCLOSURE_EFFECT_H_
#define MISCLOSURE_EFFECT_H_

#include <stdint.h>

// ------------------------------------------------------------------------------------------------------------- C ABI

// Raised by one whenever a struct below changes. A program of version 3 also loads what was compiled with version 2,
// which had neither ranges nor words nor pictures: version 3 adds their fields at the end of the structs, and
// changes nothing else.
#define MISCLOSURE_ABI_VERSION 3u

#ifdef __cplusplus
extern "C" {
#endif

// Observed constants, never unknowns. NaN: not known.
typedef struct misclosure_context {
  uint32_t image, flight, camera;                    // positions in their lists
  uint32_t image_count, flight_count, camera_count;  // of the block
  double width_px, height_px;                        // sensor
  double column_px, row_px;                          // predicted image point at the end of the chain; NaN where
                                                     // the stage has none, or no effect reads it
  double time_s;                                     // exposure
  double tau;                                        // (t - mean t) / (max t - min t) over the block's images
  double tau_order;                                  // the same from the place in the table
  double flight_time_s, flight_span_s;               // since the flight's first image; length of the flight
  double temperature_c, mean_temperature_c;          // degrees Celsius; mean over the images that have one
  const double* temperature_history;                 // time_s, temperature_c, time_s, ... by time
  uint64_t temperature_history_length;               // number of pairs
  double velocity[3];                                // m/s, world axes
  double angular_velocity[3];                        // rad/s, camera axes
  double exposure_s, focus_m;                        // exposure time; focus distance
  double block_centre[3];                            // mean of the projection centres' start values, m
  double survey_mean[3];                             // mean of the control points in the datum; without any, of the
                                                     // observed antennas, m
  double surveyed_kind;                              // of a frame effect: 0 control or check point, 1 antenna; else NaN
} misclosure_context;

// A name for a value of a given parameter: `against=order` is 1.
typedef struct misclosure_name {
  const char* name;  // a word
  double value;      // what it stands for
} misclosure_name;

// A parameter. C++ makes one with Estimated, Searched, Given, Random or VelocityError, and gives it a plausible range
// with Within or UpTo. The plausible range is what the parameter can be if the cause that the effect names is at work,
// in the parameter's unit; of a random parameter it is that of the standard deviation. It comes from physics or a data
// sheet, never from the block.
//
//                     |<---------- plausible ---------->|
//     ---- other -----+----------------+----------------+----- other ---->  theta
//        causes      min            nominal            max    causes
//                                      |<-- s = (max - min) / 2
//
// A diagnosis uses it three times. (1) The size has the prior N(nominal, s^2): the objective is J = v'Pv + ((theta -
// nominal) / s)^2 + prices, so that an effect pays for an implausible size. (2) A size that the block does not
// determine to within max - min is not tested. (3) An estimate beyond the range by three of its standard deviations
// is reported as a shape that looks like the effect, and has another cause. An adjustment without diagnosis uses no
// range. Expected: min < max, both finite, nominal and typical size within, and a source. Zeros and a null source:
// no range is stated.
typedef struct misclosure_parameter {
  const char* name;               // without spaces and []=,:
  const char* unit;               // "1" for none
  uint32_t scope;                 // misclosure::Scope
  uint32_t role;                  // misclosure::Role
  double nominal;                 // the identity; for searched and given ones the default
  double typical;                 // a size met in practice, not zero
  uint32_t domain;                // misclosure::Domain, of a searched parameter
  uint32_t name_count;            // of a given parameter
  double domain_min, domain_max;  // of a searched parameter, where its domain has limits
  const misclosure_name* names;   // of a given parameter
  const char* deviation;          // of a random parameter: name of its standard deviation
  double plausible_min, plausible_max;  // what it can be; of an estimated or random parameter
  const char* plausible_source;   // where the range comes from; null: no range is stated
} misclosure_parameter;

// What an effect answers. Where it is called (guarded.h) an exception is caught and numbers are looked at, which gives
// the last two.
#define MISCLOSURE_OUTSIDE 0     // it cannot be evaluated there
#define MISCLOSURE_DONE 1
#define MISCLOSURE_NOT_FINITE 2  // a value or derivative is NaN or infinite
#define MISCLOSURE_THREW 3

// Writes out (m), and where not null d_in (m x n) and d_theta (m x p), row-major and whole, and returns
// MISCLOSURE_DONE, or else why it did not. Columns of d_theta of given parameters are zero.
typedef int (*misclosure_eval)(void* self, const misclosure_context* context, const double* in, const double* theta,
                               double* out, double* d_in, double* d_theta);

// The table of an effect. C++ makes it with MISCLOSURE_EFFECT. The three words are all stated or all null; texts are
// UTF-8, of 16384 bytes at most.
typedef struct misclosure_effect {
  uint32_t abi_version;  // MISCLOSURE_ABI_VERSION
  uint32_t effect_size, parameter_size, name_size, context_size;  // sizeof of the structs here
  uint32_t stage;        // misclosure::Stage
  uint32_t kind;         // misclosure::Kind
  uint32_t parameter_count, need_count;  // 256 parameters at most
  const char* id;             // lower case words with hyphens
  const char* summary;        // what happens, in a sentence
  const char* formula;        // for people
  const char* confused_with;  // effects that look like it, and what tells them apart
  const char* source;         // literature
  const misclosure_parameter* parameters;  // in the order of theta
  const uint32_t* needs;  // misclosure::Need
  void* self;             // handed to eval
  misclosure_eval eval;   // the formula
  uint32_t picture, picture_by;  // misclosure::Picture and misclosure::By: where a report shows it
  const char* what;       // what it is, in two sentences, for somebody who never heard the term
  const char* remedy;     // what to do about it, a sentence
  const char* tell;       // what would tell it from its like: a flight, column or setting, without a full stop
} misclosure_effect;

#ifdef __cplusplus
}  // extern "C"

// --------------------------------------------------------------------------------------------------------------- C++

#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <type_traits>

#include "ceres/jet.h"
#include "rotation.h"  // for Apply functions

namespace misclosure {

using Context = misclosure_context;
using Name = misclosure_name;
using Parameter = misclosure_parameter;

// Where in the measurement chain an effect acts. r: rotation vector of R (world to camera); C: projection centre; P:
// object point; interior: f, ppx, ppy, dcx, dcy, k1, k2, k3, p1, p2, b1, b2.
enum class Stage : uint32_t {
  kExposure = 0,  // r 3, C 3 -> r 3, C 3
  kRay = 1,       // r 3, C 3, P 3 -> P 3
  kInterior = 2,  // interior 12, r 3 -> interior 12
  kImage = 3,     // x, y, interior 12 -> x, y
  kPosition = 4,  // r 3, C 3 -> antenna 3
  kControl = 5,   // P 3 -> surveyed 3
  kFrame = 6,     // surveyed 3 -> surveyed 3, of points and of antennas
};

constexpr int Inputs(Stage stage) {
  constexpr int inputs[] = {6, 9, 15, 14, 6, 3, 3};
  return inputs[static_cast<uint32_t>(stage)];
}

constexpr int Outputs(Stage stage) {
  constexpr int outputs[] = {6, 3, 12, 2, 3, 3, 3};
  return outputs[static_cast<uint32_t>(stage)];
}

// Output k of the identity is input IdentityOffset + k.
constexpr int IdentityOffset(Stage stage) {
  return stage == Stage::kRay ? 6 : stage == Stage::kPosition ? 3 : 0;
}

// What an effect is for.
enum class Kind : uint32_t {
  kPhysical = 0,   // names a cause
  kEmpirical = 1,  // only takes a shape away: may serve a fit, explains nothing
};

// How many values a parameter has in a block. Where there are several cameras, a global one of the interior or image
// stage has one per camera.
enum class Scope : uint32_t {
  kGlobal = 0,          // one
  kCamera = 1,          // one per camera
  kFlight = 2,          // one per flight
  kFlightButFirst = 3,  // one per flight, that of the first held at the nominal value
  kImage = 4,           // one per image
};

// How a parameter gets its value. Priors: a random parameter has one of mean zero, whose standard deviation is
// estimated; an estimated one has none, unless `--add ID:prior=K` gives it K times its typical size.
enum class Role : uint32_t {
  kEstimated = 0,  // from the measurements; at its nominal value nothing happens
  kSearched = 1,   // too, but the effect is nonlinear in it: a test scans its domain first
  kGiven = 2,      // by the user, else its default
  kRandom = 3,     // a value per image, normal with mean zero
  kVelocityError = 4,  // error of an image's derived velocity in one coordinate, observed as zero with its sigma
};

// Search domain of a parameter.
enum class Domain : uint32_t {
  kNone = 0,            // not searched
  kSensorX = 1,         // the sensor's width, px
  kSensorY = 2,         // the sensor's height, px
  kSensorFraction = 3,  // two fractions of half the sensor's diagonal, px
  kRange = 4,           // two values in the parameter's unit
};

// What a block must have to test an effect. What is not known is NaN: a formula that uses it without saying so here
// gives no values.
enum class Need : uint32_t {
  kTime = 0,         // time_s of every image
  kTemperature = 1,  // temperature_c of every image
  kFlights = 2,      // two flights or more
  kVelocity = 3,     // velocities, or times to derive them from
  kGnss = 4,         // GNSS positions in the datum: every effect of the position stage
  kControl = 5,      // control points in the datum: every effect of the control stage
  kVertical = 6,     // either of the two: every effect of the frame stage
};

// In which picture an effect is seen: residuals without it and with it, everything else as in the final model. One
// that the stage can move: kSurveyed of the control and frame stage, kGnss of the position and frame stage, the
// others of the stages that end in an image.
enum class Picture : uint32_t {
  kOfStage = 0,   // kRow (exposure), kSensor (ray, interior, image), kGnss by heading (position), else kSurveyed
  kSensor = 1,    // displacement by place on the sensor
  kRow = 2,       // displacement along the motion, against the image row
  kRadius = 3,    // radial displacement, against the distance from the principal point
  kScale = 4,     // scale of each image, against what By says
  kShift = 5,     // shift of each image, against what By says
  kGnss = 6,      // GNSS residuals along the track, across and up, against what By says
  kSurveyed = 7,  // residuals of surveyed coordinates, outward and up, against the distance from their centre
};

// What a picture of images is drawn against.
enum class By : uint32_t {
  kTime = 0,         // time of exposure, s
  kTemperature = 1,  // temperature of the camera, degrees Celsius
  kHeading = 2,      // heading of the track, degrees
  kOrder = 3,        // place in the block's table
};

// An effect in words, for somebody who flies drones and never heard the term.
struct Words {
  const char* what;    // what it is, in two sentences
  const char* remedy;  // what to do about it, a sentence
  const char* tell;    // the flight, column or setting that would tell it from its like, without a full stop
};

// Parameters by role; `nominal` is the value of the identity. Within and UpTo give one its plausible range, with the
// source of the range: UpTo on both sides of zero.
constexpr Parameter Estimated(const char* name, const char* unit, Scope scope, double nominal, double typical) {
  return {name, unit, static_cast<uint32_t>(scope), static_cast<uint32_t>(Role::kEstimated), nominal, typical, 0, 0,
          0.0, 0.0, nullptr, nullptr, 0.0, 0.0, nullptr};
}

constexpr Parameter Searched(const char* name, const char* unit, Scope scope, double start, double typical,
                             Domain domain, double domain_min = 0.0, double domain_max = 0.0) {
  return {name, unit, static_cast<uint32_t>(scope), static_cast<uint32_t>(Role::kSearched), start, typical,
          static_cast<uint32_t>(domain), 0, domain_min, domain_max, nullptr, nullptr, 0.0, 0.0, nullptr};
}

constexpr Parameter Given(const char* name, const char* unit, double value) {
  return {name, unit, 0, static_cast<uint32_t>(Role::kGiven), value, 1.0, 0, 0, 0.0, 0.0, nullptr, nullptr,
          0.0, 0.0, nullptr};
}

template <std::size_t N>
constexpr Parameter Given(const char* name, const char* unit, double value, const Name (&names)[N]) {
  return {name, unit, 0, static_cast<uint32_t>(Role::kGiven), value, 1.0, 0, static_cast<uint32_t>(N), 0.0, 0.0, names,
          nullptr, 0.0, 0.0, nullptr};
}

constexpr Parameter Random(const char* name, const char* unit, double typical, const char* deviation) {
  return {name, unit, static_cast<uint32_t>(Scope::kImage), static_cast<uint32_t>(Role::kRandom), 0.0, typical, 0, 0,
          0.0, 0.0, nullptr, deviation, 0.0, 0.0, nullptr};
}

constexpr Parameter VelocityError(const char* name, double typical) {
  const auto scope = static_cast<uint32_t>(Scope::kImage);
  const auto role = static_cast<uint32_t>(Role::kVelocityError);
  return {name, "m/s", scope, role, 0.0, typical, 0, 0, 0.0, 0.0, nullptr, nullptr, 0.0, 0.0, nullptr};
}

constexpr Parameter Within(Parameter parameter, double min, double max, const char* source) {
  parameter.plausible_min = min;
  parameter.plausible_max = max;
  parameter.plausible_source = source;
  return parameter;
}

constexpr Parameter UpTo(Parameter parameter, double size, const char* source) {
  return Within(parameter, -size, size, source);
}

// ------------------------------------------------------------------------------------- from Apply to the C ABI

namespace internal {

template <std::size_t N>
constexpr std::array<uint32_t, N> Numbers(const std::array<Need, N>& needs) {
  std::array<uint32_t, N> numbers{};
  for (std::size_t k = 0; k < N; ++k) numbers[k] = static_cast<uint32_t>(needs[k]);
  return numbers;
}

constexpr bool IsGiven(const Parameter& parameter) { return parameter.role == static_cast<uint32_t>(Role::kGiven); }

template <class E>
constexpr int DifferentiableCount() {
  int count = 0;
  for (std::size_t k = 0; k < std::size(E::parameters); ++k) count += IsGiven(E::parameters[k]) ? 0 : 1;
  return count;
}

// The inputs that an effect depends on: `reads`, or all of its stage.
template <class E, class = void>
struct ReadsOf {
  static constexpr std::array<int, Inputs(E::stage)> All() {
    std::array<int, Inputs(E::stage)> all{};
    for (int k = 0; k < Inputs(E::stage); ++k) all[k] = k;
    return all;
  }
  static constexpr auto value = All();
};

template <class E>
struct ReadsOf<E, std::void_t<decltype(E::reads)>> {
  static constexpr auto value = E::reads;
};

template <class E>
constexpr bool Reads(int input) {
  for (const int k : ReadsOf<E>::value) {
    if (k == input) return true;
  }
  return false;
}

template <class E>
constexpr bool ReadsInputsOfItsStage() {
  for (const int k : ReadsOf<E>::value) {
    if (k < 0 || k >= Inputs(E::stage)) return false;
  }
  return true;
}

// The optional members of an effect, and what stands in their place.
template <class E, class = void>
struct WordsOf {
  static constexpr Words value = {nullptr, nullptr, nullptr};
};

template <class E>
struct WordsOf<E, std::void_t<decltype(E::words)>> {
  static constexpr Words value = E::words;
};

template <class E, class = void>
struct PictureOf {
  static constexpr Picture value = Picture::kOfStage;
};

template <class E>
struct PictureOf<E, std::void_t<decltype(E::picture)>> {
  static constexpr Picture value = E::picture;
};

template <class E, class = void>
struct ByOf {
  static constexpr By value = By::kTime;
};

template <class E>
struct ByOf<E, std::void_t<decltype(E::by)>> {
  static constexpr By value = E::by;
};

// Apply on doubles, or on Jets over the inputs that it reads and the parameters that are not given.
template <class E>
int Eval(void*, const misclosure_context* context, const double* in, const double* theta, double* out, double* d_in,
         double* d_theta) {
  constexpr int n = Inputs(E::stage);
  constexpr int m = Outputs(E::stage);
  constexpr int p = static_cast<int>(std::size(E::parameters));
  static_assert(ReadsInputsOfItsStage<E>(), "`reads` lists places among the inputs of the stage");
  if (d_in == nullptr && d_theta == nullptr) {
    return E::Apply(*context, in, theta, out) ? MISCLOSURE_DONE : MISCLOSURE_OUTSIDE;
  }
  constexpr auto& reads = ReadsOf<E>::value;
  constexpr int r = static_cast<int>(reads.size());
  constexpr int width = r + DifferentiableCount<E>();
  // An even number, so that Eigen aligns the derivatives: of an odd one they straddle the pairs in which a compiler
  // stores them, and each load waits for two stores.
  using Jet = ceres::Jet<double, width == 0 ? 2 : (width + 1) / 2 * 2>;
  Jet jet_in[n], jet_theta[p > 0 ? p : 1], jet_out[m];
  for (int k = 0; k < n; ++k) jet_in[k] = Jet(in[k]);
  for (int k = 0; k < r; ++k) jet_in[reads[k]].v[k] = 1.0;
  int column[p > 0 ? p : 1];
  int next = r;
  for (int k = 0; k < p; ++k) {
    column[k] = IsGiven(E::parameters[k]) ? -1 : next++;
    jet_theta[k] = column[k] < 0 ? Jet(theta[k]) : Jet(theta[k], column[k]);
  }
  if (!E::Apply(*context, jet_in, jet_theta, jet_out)) return MISCLOSURE_OUTSIDE;
  for (int i = 0; i < m; ++i) {
    out[i] = jet_out[i].a;
    if (d_in != nullptr) {
      for (int k = 0; k < n; ++k) d_in[i * n + k] = k == IdentityOffset(E::stage) + i && !Reads<E>(k) ? 1.0 : 0.0;
      for (int k = 0; k < r; ++k) d_in[i * n + reads[k]] = jet_out[i].v[k];
    }
    if (d_theta != nullptr) {
      for (int k = 0; k < p; ++k) d_theta[i * p + k] = column[k] < 0 ? 0.0 : jet_out[i].v[column[k]];
    }
  }
  return MISCLOSURE_DONE;
}

// Whoever loads a plug-in may be no C++: an exception ends here. What is built in is called through guarded.h.
template <class E>
int Call(void* self, const misclosure_context* context, const double* in, const double* theta, double* out,
         double* d_in, double* d_theta) {
#if defined(MISCLOSURE_PLUGIN) && defined(__cpp_exceptions)
  try {
    return Eval<E>(self, context, in, theta, out, d_in, d_theta);
  } catch (...) {
    return MISCLOSURE_THREW;
  }
#else
  return Eval<E>(self, context, in, theta, out, d_in, d_theta);
#endif
}

template <class E>
struct Table {
  static constexpr auto needs = Numbers(E::needs);
  static constexpr misclosure_effect value = {
      MISCLOSURE_ABI_VERSION,
      sizeof(misclosure_effect),
      sizeof(misclosure_parameter),
      sizeof(misclosure_name),
      sizeof(misclosure_context),
      static_cast<uint32_t>(E::stage),
      static_cast<uint32_t>(E::kind),
      static_cast<uint32_t>(std::size(E::parameters)),
      static_cast<uint32_t>(needs.size()),
      E::id,
      E::summary,
      E::formula,
      E::confused_with,
      E::source,
      std::data(E::parameters),
      needs.data(),
      nullptr,
      &Call<E>,
      static_cast<uint32_t>(PictureOf<E>::value),
      static_cast<uint32_t>(ByOf<E>::value),
      WordsOf<E>::value.what,
      WordsOf<E>::value.remedy,
      WordsOf<E>::value.tell,
  };
};

}  // namespace internal

// What a header that is included for its formula alone (a test) gets.
template <class E>
constexpr const misclosure_effect& EffectOf() {
  return internal::Table<E>::value;
}

}  // namespace misclosure

// Makes a type an effect: the exported symbol of a plug-in, or the entry that the generated registry of built-in
// effects calls.
#if defined(MISCLOSURE_PLUGIN)
#define MISCLOSURE_EFFECT(Type)                                                                                       \
  extern "C" __attribute__((visibility("default"))) const misclosure_effect* misclosure_plugin(void) {               \
    return &::misclosure::EffectOf<Type>();                                                                           \
  }
#elif defined(MISCLOSURE_BUILTIN)
#define MISCLOSURE_EFFECT(Type)                                                                                       \
  extern "C" const misclosure_effect* MISCLOSURE_BUILTIN(void) { return &::misclosure::EffectOf<Type>(); }
#else
#define MISCLOSURE_EFFECT(Type) static_assert(sizeof(::misclosure::EffectOf<Type>()) != 0, "an effect");
#endif

#endif  // __cplusplus
#endif  // MISCLOSURE_EFFECT_H_
