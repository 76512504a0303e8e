// A smooth displacement field over the sensor or a part of it: uniform cubic B-splines, 8 columns and 6 rows of
// coefficients for x and for y.
//
// Knots are w/5 and h/3 apart, so that the sensor is five by three polynomial pieces, each of the 4 x 4 coefficients
// around it; with a cell above zero they are that far apart, and the five by three pieces lie around the centre.
// Outside these pieces the further coefficients are zero: the field fades out over three spacings.
#include "effect.h"
#include "bspline.h"

namespace misclosure {

constexpr Parameter GridNode(const char* name) { return Estimated(name, "px", Scope::kGlobal, 0.0, 0.2); }

struct ImageGrid {
  static constexpr const char* id = "image-grid";
  static constexpr Stage stage = Stage::kImage;
  static constexpr Kind kind = Kind::kEmpirical;
  static constexpr const char* summary =
      "A smooth displacement field over the sensor, the same in all images; names no cause.";
  static constexpr const char* formula =
      "(x, y) += sum_ij g_ij B_i(5x/w) B_j(3y/h), uniform cubic B-splines; cell > 0: spacing cell around the centre";
  static constexpr const char* confused_with = "everything that is constant in the image.";
  static constexpr const char* source = "tensor-product B-splines; de Boor, A Practical Guide to Splines (2001)";
  static constexpr Name cells[] = {{"sensor", 0.0}};
  static constexpr Parameter parameters[] = {
      GridNode("gx_0_0"),           GridNode("gx_0_1"),           GridNode("gx_0_2"),
      GridNode("gx_0_3"),           GridNode("gx_0_4"),           GridNode("gx_0_5"),
      GridNode("gx_1_0"),           GridNode("gx_1_1"),           GridNode("gx_1_2"),
      GridNode("gx_1_3"),           GridNode("gx_1_4"),           GridNode("gx_1_5"),
      GridNode("gx_2_0"),           GridNode("gx_2_1"),           GridNode("gx_2_2"),
      GridNode("gx_2_3"),           GridNode("gx_2_4"),           GridNode("gx_2_5"),
      GridNode("gx_3_0"),           GridNode("gx_3_1"),           GridNode("gx_3_2"),
      GridNode("gx_3_3"),           GridNode("gx_3_4"),           GridNode("gx_3_5"),
      GridNode("gx_4_0"),           GridNode("gx_4_1"),           GridNode("gx_4_2"),
      GridNode("gx_4_3"),           GridNode("gx_4_4"),           GridNode("gx_4_5"),
      GridNode("gx_5_0"),           GridNode("gx_5_1"),           GridNode("gx_5_2"),
      GridNode("gx_5_3"),           GridNode("gx_5_4"),           GridNode("gx_5_5"),
      GridNode("gx_6_0"),           GridNode("gx_6_1"),           GridNode("gx_6_2"),
      GridNode("gx_6_3"),           GridNode("gx_6_4"),           GridNode("gx_6_5"),
      GridNode("gx_7_0"),           GridNode("gx_7_1"),           GridNode("gx_7_2"),
      GridNode("gx_7_3"),           GridNode("gx_7_4"),           GridNode("gx_7_5"),
      GridNode("gy_0_0"),           GridNode("gy_0_1"),           GridNode("gy_0_2"),
      GridNode("gy_0_3"),           GridNode("gy_0_4"),           GridNode("gy_0_5"),
      GridNode("gy_1_0"),           GridNode("gy_1_1"),           GridNode("gy_1_2"),
      GridNode("gy_1_3"),           GridNode("gy_1_4"),           GridNode("gy_1_5"),
      GridNode("gy_2_0"),           GridNode("gy_2_1"),           GridNode("gy_2_2"),
      GridNode("gy_2_3"),           GridNode("gy_2_4"),           GridNode("gy_2_5"),
      GridNode("gy_3_0"),           GridNode("gy_3_1"),           GridNode("gy_3_2"),
      GridNode("gy_3_3"),           GridNode("gy_3_4"),           GridNode("gy_3_5"),
      GridNode("gy_4_0"),           GridNode("gy_4_1"),           GridNode("gy_4_2"),
      GridNode("gy_4_3"),           GridNode("gy_4_4"),           GridNode("gy_4_5"),
      GridNode("gy_5_0"),           GridNode("gy_5_1"),           GridNode("gy_5_2"),
      GridNode("gy_5_3"),           GridNode("gy_5_4"),           GridNode("gy_5_5"),
      GridNode("gy_6_0"),           GridNode("gy_6_1"),           GridNode("gy_6_2"),
      GridNode("gy_6_3"),           GridNode("gy_6_4"),           GridNode("gy_6_5"),
      GridNode("gy_7_0"),           GridNode("gy_7_1"),           GridNode("gy_7_2"),
      GridNode("gy_7_3"),           GridNode("gy_7_4"),           GridNode("gy_7_5"),
      Given("centre_x", "px", 0.0), Given("centre_y", "px", 0.0), Given("cell", "px", 0.0, cells),
  };
  static constexpr std::array<Need, 0> needs = {};
  static constexpr std::array reads = {0, 1};  // x, y

  template <class T>
  static bool Apply(const Context& context, const T* in, const T* theta, T* out) {
    constexpr int kColumns = 8, kRows = 6, kNodes = kColumns * kRows, kPiecesX = kColumns - 3, kPiecesY = kRows - 3;
    const T& cell = theta[2 * kNodes + 2];
    T s, t;
    if (cell == 0.0) {
      s = in[0] * (kPiecesX / context.width_px);
      t = in[1] * (kPiecesY / context.height_px);
    } else if (cell > 0.0) {
      s = (in[0] - theta[2 * kNodes]) / cell + 0.5 * kPiecesX;
      t = (in[1] - theta[2 * kNodes + 1]) / cell + 0.5 * kPiecesY;
    } else {
      return false;
    }
    out[0] = in[0];
    out[1] = in[1];
    // Three rows of zero coefficients on each side: position k there is coefficient k - 3, and all that lies farther
    // out is zero too.
    const T from_left = s + 3.0, from_top = t + 3.0;
    if (!(from_left >= 0.0 && from_left < kColumns + 3.0 && from_top >= 0.0 && from_top < kRows + 3.0)) {
      return s == s && t == t;
    }
    T column[4], row[4];
    const int first_column = CubicBSpline(from_left, kColumns + 3, column) - 3;
    const int first_row = CubicBSpline(from_top, kRows + 3, row) - 3;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const int node_column = first_column + i, node_row = first_row + j;
        if (node_column < 0 || node_column >= kColumns || node_row < 0 || node_row >= kRows) continue;
        const T weight = column[i] * row[j];
        const T* node = theta + node_column * kRows + node_row;
        out[0] += weight * node[0];
        out[1] += weight * node[kNodes];
      }
    }
    return true;
  }
};
MISCLOSURE_EFFECT(ImageGrid)

}  // namespace misclosure
