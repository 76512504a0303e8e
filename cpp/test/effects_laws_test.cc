// Every built-in effect keeps the laws.
// Builds alone: c++ -std=c++17 -O1 -I cpp -I /usr/include/eigen3 THIS -lglog
#include "effects/decentring-high.h"
#include "effects/earth-curvature.h"
#include "effects/flat-port.h"
#include "effects/focal-flight.h"
#include "effects/focal-image.h"
#include "effects/focal-spline.h"
#include "effects/focal-temperature.h"
#include "effects/focal-time.h"
#include "effects/forward-motion.h"
#include "effects/gnss-delay.h"
#include "effects/gnss-drift.h"
#include "effects/gnss-lever-arm.h"
#include "effects/gnss-shift.h"
#include "effects/gravity-sag.h"
#include "effects/image-fourier.h"
#include "effects/image-grid.h"
#include "effects/local-flaw.h"
#include "effects/map-scale.h"
#include "effects/pp-flight.h"
#include "effects/pp-image.h"
#include "effects/pp-time.h"
#include "effects/radial-high.h"
#include "effects/refraction.h"
#include "effects/rolling-shutter.h"
#include "effects/unflatness.h"
#include "test/laws.h"

using namespace misclosure;

int main() {
  test::CheckLaws<DecentringHigh>();
  test::CheckLaws<EarthCurvature>();
  test::CheckLaws<FlatPort>();
  test::CheckLaws<FocalFlight>();
  test::CheckLaws<FocalImage>();
  test::CheckLaws<FocalSpline>();
  test::CheckLaws<FocalTemperature>();
  test::CheckLaws<FocalTime>();
  test::CheckLaws<ForwardMotion>();
  test::CheckLaws<GnssDelay>();
  test::CheckLaws<GnssDrift>();
  test::CheckLaws<GnssLeverArm>();
  test::CheckLaws<GnssShift>();
  test::CheckLaws<GravitySag>();
  test::CheckLaws<ImageFourier>();
  test::CheckLaws<ImageGrid>();
  test::CheckLaws<LocalFlaw>();
  test::CheckLaws<MapScale>();
  test::CheckLaws<PpFlight>();
  test::CheckLaws<PpImage>();
  test::CheckLaws<PpTime>();
  test::CheckLaws<RadialHigh>();
  test::CheckLaws<Refraction>();
  test::CheckLaws<RollingShutter>();
  test::CheckLaws<Unflatness>();
  std::printf("%s\n", test::failures == 0 ? "all effects keep the laws" : "FAILED");
  return test::failures == 0 ? 0 : 1;
}
