// The measurement chain of one image: which effects act at which stage, and where their parameters come from.
//
//   (r, C) --exposure--> (r', C');  P --ray--> P';  v = R' (P' - C')
//   (interior, r) --interior--> interior';  (x, y) = Fraser(interior', v) --image--> (x', y')
//   antenna: (r, C) --position--> A --frame--> A';  surveyed: P --control--> S --frame--> S'
//
// Column and row of the context are those of (x', y'), which the chain itself decides: see ImageCost::FindPlace. Ray
// effects get what the exposure stage made of the pose. Interior effects get the image's own r, not the row's r': an
// image has one interior orientation.

#ifndef MISCLOSURE_CHAIN_H_
#define MISCLOSURE_CHAIN_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "guarded.h"

namespace misclosure {

// One effect of a chain; offsets into the chain's values and into the scratch of an evaluation.
struct Link {
  const misclosure_effect* effect;
  int values;   // its parameters, in Chain::values
  int d_in;     // outputs x inputs
  int d_theta;  // outputs x parameters
};

// A parameter of an effect that is unknown: entry of a parameter block, and its place among the chain's values.
struct ChainUnknown {
  int block;
  int entry;
  int value;
  double scale;  // raw = scale x block value
};

struct Chain {
  misclosure_context context = {};
  std::vector<Link> stages[static_cast<int>(Stage::kFrame) + 1];
  std::vector<double> values;  // raw; those of unknowns are replaced by the blocks'
  std::vector<ChainUnknown> unknowns;
  std::vector<double*> blocks;
  std::vector<int> block_sizes;
  int derivatives = 0;  // doubles that the links' derivatives take
  bool reads_place[2] = {false, false};  // whether any effect reads column, row of the context
  std::uint64_t id = 0;  // of this chain and no other in the program's life

  const std::vector<Link>& stage(Stage stage) const { return stages[static_cast<int>(stage)]; }

  bool ReadsPlace() const { return reads_place[0] || reads_place[1]; }

  void Add(const misclosure_effect* effect) {
    const Stage stage = static_cast<Stage>(effect->stage);
    const int p = static_cast<int>(effect->parameter_count);
    Link link{effect, static_cast<int>(values.size()), derivatives, derivatives + Outputs(stage) * Inputs(stage)};
    derivatives = link.d_theta + Outputs(stage) * p;
    stages[effect->stage].push_back(link);
    values.resize(values.size() + p);
  }
};

// One evaluation of a chain: parameter values, derivatives of each link, and the residuals' derivatives by the values.
class ChainRun {
 public:
  // `blocks` are the parameter blocks of the effects.
  ChainRun(const Chain& chain, const double* const* blocks, int residuals, bool derive)
      : chain_(chain), derive_(derive), residuals_(residuals) {
    const std::size_t count = chain.values.size();
    Buffer().resize(count * (1 + residuals) + chain.derivatives);
    values_ = Buffer().data();
    columns_ = values_ + count;
    derivatives_ = columns_ + count * residuals;
    for (std::size_t k = 0; k < count; ++k) values_[k] = chain.values[k];
    for (const ChainUnknown& unknown : chain.unknowns) {
      values_[unknown.value] = blocks[unknown.block][unknown.entry] * unknown.scale;
    }
  }

  // out = effect(in); remembers the effect for the reason of a failure. `in` and `out` must not overlap.
  bool Forward(const Link& link, const misclosure_context& context, const double* in, double* out) {
    last_ = link.effect;
    double* d_in = derive_ ? derivatives_ + link.d_in : nullptr;
    double* d_theta = derive_ && link.effect->parameter_count > 0 ? derivatives_ + link.d_theta : nullptr;
    return misclosure_guarded_eval(link.effect, &context, in, values_ + link.values, out, d_in, d_theta) ==
           MISCLOSURE_DONE;
  }

  // The interior orientation after the interior effects, in place. It is one for all measurements of an image, so the
  // last one that this thread made of it, with its derivatives, serves as long as nothing that it depends on has
  // changed.
  bool ForwardInterior(const double* r, double* interior) {
    const std::vector<Link>& links = chain_.stage(Stage::kInterior);
    if (links.empty()) return true;
    thread_local std::vector<Interior> made(kInteriors);
    Interior& last = made[chain_.id % kInteriors];
    if (last.chain == chain_.id && (last.derived || !derive_) && std::equal(last.in, last.in + 12, interior) &&
        std::equal(last.in + 12, last.in + 15, r) && SameValues(links, last)) {
      std::copy_n(last.out, 12, interior);
      const double* derivatives = last.derivatives.data();
      for (const Link& link : links) {
        if (derive_) std::copy_n(derivatives, InteriorDerivatives(link), derivatives_ + link.d_in);
        derivatives += InteriorDerivatives(link);
      }
      return true;
    }
    last.chain = 0;
    std::copy_n(interior, 12, last.in);
    std::copy_n(r, 3, last.in + 12);
    double in[15];
    std::copy_n(r, 3, in + 12);
    for (const Link& link : links) {
      std::copy_n(interior, 12, in);
      if (!Forward(link, chain_.context, in, interior)) return false;
    }
    last.values.clear();
    last.derivatives.clear();
    for (const Link& link : links) {
      const double *values = values_ + link.values, *derivatives = derivatives_ + link.d_in;
      last.values.insert(last.values.end(), values, values + link.effect->parameter_count);
      if (derive_)
        last.derivatives.insert(last.derivatives.end(), derivatives, derivatives + InteriorDerivatives(link));
    }
    std::copy_n(interior, 12, last.out);
    last.derived = derive_;
    last.chain = chain_.id;
    return true;
  }

  const char* LastEffect() const { return last_->id; }

  const double* DIn(const Link& link) const { return derivatives_ + link.d_in; }

  // Columns of the link's parameters: a (residuals x outputs, row-major) times d_theta.
  void Backward(const Link& link, const double* a) {
    const int m = Outputs(static_cast<Stage>(link.effect->stage));
    const int p = static_cast<int>(link.effect->parameter_count);
    const double* d_theta = derivatives_ + link.d_theta;
    for (int k = 0; k < p; ++k) {
      for (int row = 0; row < residuals_; ++row) {
        double sum = 0.0;
        for (int i = 0; i < m; ++i) sum += a[row * m + i] * d_theta[i * p + k];
        columns_[(link.values + k) * residuals_ + row] = sum;
      }
    }
  }

  // Writes the columns into the Jacobians of the effects' blocks.
  void Scatter(double** jacobians) const {
    for (const ChainUnknown& unknown : chain_.unknowns) {
      double* jacobian = jacobians[unknown.block];
      if (jacobian == nullptr) continue;
      const int size = chain_.block_sizes[unknown.block];
      for (int row = 0; row < residuals_; ++row) {
        jacobian[row * size + unknown.entry] = columns_[unknown.value * residuals_ + row] * unknown.scale;
      }
    }
  }

 private:
  // What ForwardInterior made of a chain last.
  struct Interior {
    std::uint64_t chain = 0;  // none
    double in[15], out[12];
    std::vector<double> values, derivatives;
    bool derived = false;
  };
  // Chains that share a place take it from each other: more places than most blocks have images.
  static constexpr std::uint64_t kInteriors = 4096;

  // By input and parameters, one behind the other.
  static int InteriorDerivatives(const Link& link) {
    return 12 * (15 + static_cast<int>(link.effect->parameter_count));
  }

  bool SameValues(const std::vector<Link>& links, const Interior& last) const {
    const double* other = last.values.data();
    for (const Link& link : links) {
      if (!std::equal(other, other + link.effect->parameter_count, values_ + link.values)) return false;
      other += link.effect->parameter_count;
    }
    return true;
  }

  static std::vector<double>& Buffer() {
    thread_local std::vector<double> buffer;
    return buffer;
  }

  const Chain& chain_;
  bool derive_;
  int residuals_;
  const misclosure_effect* last_ = nullptr;
  double* values_;
  double* columns_;
  double* derivatives_;
};

}  // namespace misclosure

#endif  // MISCLOSURE_CHAIN_H_
