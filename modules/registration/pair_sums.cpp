#include "modules/registration/pair_sums.h"

namespace rcs::registration {

void PairSums::flush() {
  const Lane& wr = in_[6];
  const Lane& w = in_[7];
  const Lane& wv = in_[8];
  const std::array<Lane, 6> J = {in_[3],
                                 in_[4],
                                 in_[5],
                                 in_[1] * in_[5] - in_[2] * in_[4],
                                 in_[2] * in_[3] - in_[0] * in_[5],
                                 in_[0] * in_[4] - in_[1] * in_[3]};
  std::size_t k = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const Lane wJ = w * J[i];
    const Lane wvJ = wv * J[i];
    for (std::size_t j = 0; j <= i; ++j, ++k) {
      lanes_[kH + k] += wJ * J[j];
      lanes_[kHv + k] += wvJ * J[j];
    }
    lanes_[kB + i] += wr * J[i];
  }
  k = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Lane wvp = wv * in_[i];
    lanes_[kP + i] += wvp;
    for (std::size_t j = i; j < 3; ++j, ++k) lanes_[kPp + k] += wvp * in_[j];
  }
  lanes_[kV] += wv;
  lanes_[kW] += w;
  filled_ = 0;
  if (++flushes_ == kFlushes) fold();
}

void PairSums::fold() {
  for (std::size_t k = 0; k < kSums; ++k) {
    sums_[k] += double{lanes_[k].sum()};
    lanes_[k].setZero();
  }
  flushes_ = 0;
}

NormalEquations PairSums::finish() {
  if (filled_ > 0) {
    for (int lane = filled_; lane < kLanes; ++lane) {
      for (Lane& in : in_) in[lane] = 0.0F;
    }
    flush();
  }
  fold();
  NormalEquations out;
  std::size_t k = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j, ++k) {
      out.H(i, j) = sums_[kH + k];
      out.noise(i, j) = -sums_[kHv + k];
    }
    out.b[i] = sums_[kB + static_cast<std::size_t>(i)];
  }
  // dJ = (dn, p x dn) with cov(dn) = v (I - n n').
  const Vec3 p(sums_[kP], sums_[kP + 1], sums_[kP + 2]);
  Mat3 pp;
  pp << sums_[kPp], sums_[kPp + 1], sums_[kPp + 2],    //
      sums_[kPp + 1], sums_[kPp + 3], sums_[kPp + 4],  //
      sums_[kPp + 2], sums_[kPp + 4], sums_[kPp + 5];
  out.noise.topLeftCorner<3, 3>().diagonal().array() += sums_[kV];
  out.noise.bottomLeftCorner<3, 3>() += hat(p);
  out.noise.bottomRightCorner<3, 3>() += pp.trace() * Mat3::Identity() - pp;
  out.weight = sums_[kW];
  out.close();
  return out;
}

}  // namespace rcs::registration
