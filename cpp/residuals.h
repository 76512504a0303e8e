// Cost functions. Jets stay within one stage of the chain each; stages are composed by small matrix products, from the
// residual back to the unknowns, which costs a fraction of one wide Jet.

#ifndef MISCLOSURE_RESIDUALS_H_
#define MISCLOSURE_RESIDUALS_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "chain.h"
#include "stages.h"
#include "surveyed.h"

namespace misclosure {

template <int M, int N>
using ConstMap = Eigen::Map<const RowMajor<M, N>>;
template <int M, int N>
Eigen::Map<RowMajor<M, N>> Into(double* values) {
  return Eigen::Map<RowMajor<M, N>>(values);
}

// A camera's parameter block: scaled, and without dcx, dcy where they are tied to the principal point.
struct CameraBlock {
  const double* scale;  // 12
  bool tied;

  int size() const { return tied ? 10 : 12; }
  // Interior parameter of entry k.
  int parameter(int k) const { return tied && k >= kDcx ? k + 2 : k; }
  // Entry of an interior parameter.
  int entry(int parameter) const {
    return tied && parameter >= kDcx ? parameter - 2 : parameter;  // dcx, dcy -> ppx, ppy; the others move up
  }
  void Unpack(const double* block, double interior[12]) const {
    for (int k = 0; k < size(); ++k) interior[parameter(k)] = block[k] * scale[parameter(k)];
    if (tied) {
      interior[kDcx] = interior[kPpx];
      interior[kDcy] = interior[kPpy];
    }
  }
  // Derivatives by the interior orientation -> by the block.
  void Pack(RowMajor<2, 12> by_interior, double* jacobian) const {
    if (tied) by_interior.middleCols<2>(kPpx) += by_interior.middleCols<2>(kDcx);
    by_interior.array().rowwise() *= ConstMap<1, 12>(scale).array();
    if (tied) {
      Into<2, 10>(jacobian) << by_interior.leftCols<kDcx>(), by_interior.rightCols<kCoefficients>();
    } else {
      Into<2, 12>(jacobian) = by_interior;
    }
  }
};

// Derivatives by a pose's parameter block: quaternion, centre.
template <int M>
void PackPose(const RowMajor<M, 4>& by_q, const RowMajor<M, 3>& by_c, double* jacobian) {
  Into<M, 7>(jacobian) << by_q, by_c;
}

// What the measurements of an image have in common.
struct ImageChain {
  Chain chain;
  CameraBlock camera;
};

// An image measurement. Parameter blocks: camera, pose, point, then those of the effects. Of these there are millions:
// each is small.
class ImageCost final : public ceres::CostFunction {
 public:
  // `image` and `xy` (2) must outlive this.
  ImageCost(const ImageChain& image, const double* xy, double weight) : image_(image), xy_(xy), weight_(weight) {
    set_num_residuals(2);
    std::vector<int32_t>& sizes = *mutable_parameter_block_sizes();
    const std::vector<int>& of_effects = image.chain.block_sizes;
    sizes.reserve(3 + of_effects.size());
    sizes = {image.camera.size(), 7, 3};
    sizes.insert(sizes.end(), of_effects.begin(), of_effects.end());
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    return Compute(x, residuals, jacobians, nullptr);
  }

  // The same; says why it failed.
  bool Compute(double const* const* x, double* residuals, double** jacobians, std::string* reason) const {
    misclosure_context context;
    if (!image_.chain.values.empty() || image_.chain.derivatives > 0) context = image_.chain.context;
    // Of the end of the chain by the place that effects are told.
    RowMajor<2, 2> by_place = RowMajor<2, 2>::Zero();
    const bool derive = jacobians != nullptr;
    if (image_.chain.ReadsPlace() && !FindPlace(x, derive, context, by_place, reason)) return false;
    ChainRun run(image_.chain, x + 3, 2, derive);
    Predicted at;
    if (!Predict(run, context, x, derive, at, reason)) return false;
    residuals[0] = weight_ * (xy_[0] - at.xy[0]);
    residuals[1] = weight_ * (xy_[1] - at.xy[1]);
    // The place follows what the end follows: p = h(p, u), so dp/du = (I - dh/dp)^-1 dh/du.
    if (derive) Derive(run, at, -weight_ * (RowMajor<2, 2>::Identity() - by_place).inverse(), jacobians);
    return true;
  }

 private:
  // What the chain made of a point, stage by stage, with derivatives where they are asked for.
  struct Predicted {
    double xy[2];
    RowMajor<3, 4> r_q;
    RowMajor<4, 3> q_r;
    RowMajor<3, 4> v_q;
    RowMajor<3, 3> v_p;
    RowMajor<2, 12> xy_interior;
    RowMajor<2, 3> xy_v;
  };

  // Into the camera and onto the sensor, at the place of the context.
  bool Predict(ChainRun& run, const misclosure_context& context, double const* const* x, bool derive, Predicted& at,
               std::string* reason) const {
    const auto& exposure = image_.chain.stage(Stage::kExposure);
    const auto& ray = image_.chain.stage(Stage::kRay);
    const auto& interior_effects = image_.chain.stage(Stage::kInterior);
    const auto outside = [&] {
      if (reason != nullptr) *reason = std::string("outside the domain of effect ") + run.LastEffect();
      return false;
    };

    // Exposure: (r, C) and the quaternion again.
    double in[15], interior[16] = {}, image_r[3], r[3], q[4], c[3], p[3];
    std::copy_n(x[1], 4, q);
    std::copy_n(x[1] + 4, 3, c);
    std::copy_n(x[2], 3, p);
    if (!exposure.empty() || !ray.empty() || !interior_effects.empty()) {
      RotationVector(q, derive, image_r, &at.r_q);
      std::copy_n(image_r, 3, r);
    }
    if (!exposure.empty()) {
      double out[6];
      for (const Link& link : exposure) {
        std::copy_n(r, 3, in);
        std::copy_n(c, 3, in + 3);
        if (!run.Forward(link, context, in, out)) return outside();
        std::copy_n(out, 3, r);
        std::copy_n(out + 3, 3, c);
      }
      Quaternion(r, derive, q, &at.q_r);
    }
    for (const Link& link : ray) {
      std::copy_n(r, 3, in);
      std::copy_n(c, 3, in + 3);
      std::copy_n(p, 3, in + 6);
      if (!run.Forward(link, context, in, p)) return outside();
    }
    image_.camera.Unpack(x[0], interior);
    if (!run.ForwardInterior(image_r, interior)) return outside();

    const double arm[3] = {p[0] - c[0], p[1] - c[1], p[2] - c[2]};
    double v[3];
    bool front;
    if (derive) {
      Rotated(q, arm, v, &at.v_q, &at.v_p);
      front = Projected(interior, v, at.xy, &at.xy_interior, &at.xy_v);
    } else {
      RotateByQuaternion(q, arm, v);
      front = Project(interior, v, at.xy);
    }
    if (!front) {
      if (reason != nullptr) *reason = "it lies behind the camera (Z = " + std::to_string(v[2]) + " m)";
      return false;
    }
    for (const Link& link : image_.chain.stage(Stage::kImage)) {
      std::copy_n(at.xy, 2, in);
      std::copy_n(interior, 12, in + 2);
      if (!run.Forward(link, context, in, at.xy)) return outside();
    }
    return true;
  }

  // Finds the fixed point of the chain: the place that, put into the context, is where the chain ends. With `derive` it
  // also returns the derivative of the end by the place. The search starts at the measurement. The place must not keep
  // the measurement's noise: that noise would look like the effect.
  bool FindPlace(double const* const* x, bool derive, misclosure_context& context, RowMajor<2, 2>& by_place,
                 std::string* reason) const {
    // Each gains the change of the effect from pixel to pixel, a hundredth or less for anything that a sensor does.
    constexpr int kMoves = 60;
    constexpr double kSamePx = 1e-9;
    ChainRun run(image_.chain, x + 3, 2, false);
    Predicted at;
    const auto end = [&](double column, double row) {
      context.column_px = column;
      context.row_px = row;
      return Predict(run, context, x, false, at, reason);
    };
    double place[2] = {xy_[0], xy_[1]};
    for (int move = 0; move < kMoves; ++move) {
      if (!end(place[0], place[1])) return false;
      const double moved = std::max(image_.chain.reads_place[0] ? std::abs(at.xy[0] - place[0]) : 0.0,
                                    image_.chain.reads_place[1] ? std::abs(at.xy[1] - place[1]) : 0.0);
      std::copy_n(at.xy, 2, place);
      if (moved > kSamePx) continue;
      for (int axis = 0; derive && axis < 2; ++axis) {
        if (!image_.chain.reads_place[axis]) continue;
        // Five points: what an effect does bends over hundreds of pixels.
        constexpr double kStepPx = 2.0, kOffsets[] = {-2, -1, 1, 2}, kWeights[] = {1, -8, 8, -1};
        for (int k = 0; k < 4; ++k) {
          const double shift = kOffsets[k] * kStepPx;
          if (!end(place[0] + (axis == 0 ? shift : 0.0), place[1] + (axis == 1 ? shift : 0.0))) return false;
          for (int i = 0; i < 2; ++i) by_place(i, axis) += kWeights[k] * at.xy[i] / (12.0 * kStepPx);
        }
      }
      context.column_px = place[0];
      context.row_px = place[1];
      return true;
    }
    if (reason != nullptr) *reason = "no row, or more than one, is exposed where it would see the point";
    return false;
  }

  // Back: derivative of the residuals by what each stage was given, from that by the image point.
  void Derive(ChainRun& run, const Predicted& at, RowMajor<2, 2> by_xy, double** jacobians) const {
    const auto& exposure = image_.chain.stage(Stage::kExposure);
    const auto& ray = image_.chain.stage(Stage::kRay);
    const auto& interior_effects = image_.chain.stage(Stage::kInterior);
    const auto& image = image_.chain.stage(Stage::kImage);
    RowMajor<2, 12> by_interior = RowMajor<2, 12>::Zero();
    RowMajor<2, 3> by_r = RowMajor<2, 3>::Zero();
    RowMajor<2, 3> by_image_r = RowMajor<2, 3>::Zero();
    for (auto link = image.rbegin(); link != image.rend(); ++link) {
      const ConstMap<2, 14> d_in(run.DIn(*link));
      run.Backward(*link, by_xy.data());
      by_interior += by_xy * d_in.rightCols<12>();
      by_xy = (by_xy * d_in.leftCols<2>()).eval();
    }
    by_interior += by_xy * at.xy_interior;
    const RowMajor<2, 3> by_v = by_xy * at.xy_v;
    for (auto link = interior_effects.rbegin(); link != interior_effects.rend(); ++link) {
      const ConstMap<12, 15> d_in(run.DIn(*link));
      run.Backward(*link, by_interior.data());
      by_image_r += by_interior * d_in.rightCols<3>();
      by_interior = (by_interior * d_in.leftCols<12>()).eval();
    }
    RowMajor<2, 4> by_q = by_v * at.v_q;
    RowMajor<2, 3> by_p = by_v * at.v_p;
    RowMajor<2, 3> by_c = -by_p;
    for (auto link = ray.rbegin(); link != ray.rend(); ++link) {
      const ConstMap<3, 9> d_in(run.DIn(*link));
      run.Backward(*link, by_p.data());
      by_r += by_p * d_in.leftCols<3>();
      by_c += by_p * d_in.middleCols<3>(3);
      by_p = (by_p * d_in.rightCols<3>()).eval();
    }
    if (!exposure.empty()) {
      RowMajor<2, 6> by_rc;
      by_rc << by_r + by_q * at.q_r, by_c;
      for (auto link = exposure.rbegin(); link != exposure.rend(); ++link) {
        run.Backward(*link, by_rc.data());
        by_rc = (by_rc * ConstMap<6, 6>(run.DIn(*link))).eval();
      }
      by_q = (by_rc.leftCols<3>() + by_image_r) * at.r_q;
      by_c = by_rc.rightCols<3>();
    } else if (!ray.empty() || !interior_effects.empty()) {
      by_q += (by_r + by_image_r) * at.r_q;
    }

    if (jacobians[0] != nullptr) image_.camera.Pack(by_interior, jacobians[0]);
    if (jacobians[1] != nullptr) PackPose<2>(by_q, by_c, jacobians[1]);
    if (jacobians[2] != nullptr) Into<2, 3>(jacobians[2]) = by_p;
    run.Scatter(jacobians + 3);
  }

  const ImageChain& image_;
  const double* xy_;
  double weight_;
};

// An observed position: of a surveyed point (blocks: point, effects) or of an antenna (blocks: pose, effects). `stage`
// is kControl or kPosition; the frame's effects follow it.
class PositionCost final : public ceres::CostFunction {
 public:
  PositionCost(const Chain& chain, Stage stage, const double* position, const double* sigma)
      : chain_(chain), stage_(stage) {
    std::copy_n(position, 3, position_);
    for (int k = 0; k < 3; ++k) weight_[k] = 1.0 / sigma[k];
    set_num_residuals(3);
    mutable_parameter_block_sizes()->push_back(OfPose() ? 7 : 3);
    mutable_parameter_block_sizes()->insert(mutable_parameter_block_sizes()->end(), chain.block_sizes.begin(),
                                            chain.block_sizes.end());
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    return Compute(x, residuals, jacobians, nullptr);
  }

  bool Compute(double const* const* x, double* residuals, double** jacobians, std::string* reason) const {
    const bool derive = jacobians != nullptr;
    const auto& links = chain_.stage(stage_);
    const auto& frame = chain_.stage(Stage::kFrame);
    const int first = OfPose() ? 3 : 0;  // place of the position in the input of an effect before the frame
    ChainRun run(chain_, x + 1, 3, derive);
    const auto outside = [&] {
      if (reason != nullptr) *reason = std::string("outside the domain of effect ") + run.LastEffect();
      return false;
    };
    double in[6], position[3];
    RowMajor<3, 4> r_q;
    if (OfPose() && !links.empty()) RotationVector(x[0], derive, in, &r_q);
    std::copy_n(x[0] + (OfPose() ? 4 : 0), 3, position);
    for (const Link& link : links) {
      std::copy_n(position, 3, in + first);
      if (!run.Forward(link, chain_.context, in, position)) return outside();
    }
    if (!frame.empty()) {
      misclosure_context surveyed = chain_.context;
      surveyed.surveyed_kind = stage_ == Stage::kControl ? kControlKind : kAntennaKind;
      for (const Link& link : frame) {
        std::copy_n(position, 3, in);
        if (!run.Forward(link, surveyed, in, position)) return outside();
      }
    }
    for (int k = 0; k < 3; ++k) residuals[k] = weight_[k] * (position_[k] - position[k]);
    if (!derive) return true;

    RowMajor<3, 3> by_position = RowMajor<3, 3>::Zero();
    for (int k = 0; k < 3; ++k) by_position(k, k) = -weight_[k];
    RowMajor<3, 3> by_r = RowMajor<3, 3>::Zero();
    const auto back = [&](const Link& link) {
      run.Backward(link, by_position.data());
      by_position = (by_position * ConstMap<3, 3>(run.DIn(link))).eval();
    };
    for (auto link = frame.rbegin(); link != frame.rend(); ++link) back(*link);
    for (auto link = links.rbegin(); link != links.rend(); ++link) {
      if (!OfPose()) {
        back(*link);
        continue;
      }
      const ConstMap<3, 6> d_in(run.DIn(*link));
      run.Backward(*link, by_position.data());
      by_r += by_position * d_in.leftCols<3>();
      by_position = (by_position * d_in.rightCols<3>()).eval();
    }
    if (jacobians[0] != nullptr && OfPose()) {
      RowMajor<3, 4> by_q = RowMajor<3, 4>::Zero();
      if (!links.empty()) by_q = by_r * r_q;
      PackPose<3>(by_q, by_position, jacobians[0]);
    } else if (jacobians[0] != nullptr) {
      Into<3, 3>(jacobians[0]) = by_position;
    }
    run.Scatter(jacobians + 1);
    return true;
  }

 private:
  bool OfPose() const { return stage_ == Stage::kPosition; }

  const Chain& chain_;
  Stage stage_;
  double position_[3];
  double weight_[3];
};

// A prior on one entry of a scaled block.
class PriorCost final : public ceres::CostFunction {
 public:
  PriorCost(int block_size, int entry, double scale, double value, double sigma)
      : entry_(entry), scale_(scale), value_(value), sigma_(sigma) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->push_back(block_size);
  }

  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    residuals[0] = (value_ - x[0][entry_] * scale_) / sigma_;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      std::fill_n(jacobians[0], parameter_block_sizes()[0], 0.0);
      jacobians[0][entry_] = -scale_ / sigma_;
    }
    return true;
  }

 private:
  int entry_;
  double scale_, value_, sigma_;
};

}  // namespace misclosure

#endif  // MISCLOSURE_RESIDUALS_H_
