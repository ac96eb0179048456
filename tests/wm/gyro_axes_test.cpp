#include "modules/wm/fault_detection/gyro_axes.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::wm {
namespace {

/// Rotations of a vehicle on rough ground, from scan to scan.
class Ride {
 public:
  explicit Ride(unsigned seed) : random_(seed) {}

  Vec3 turn() {
    const auto draw = [this] { return normal_(random_); };
    rate_ = 0.5 * rate_ + Vec3{0.01 * draw(), 0.01 * draw(), 0.02 * draw()};
    return rate_;
  }
  Vec3 noise(double sigma_rad) {
    return sigma_rad * Vec3{normal_(random_), normal_(random_), normal_(random_)};
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  Vec3 rate_ = Vec3::Zero();
};

/// @return scans out of 100 after which the axes are wrong
int scans_wrong(const Mat3& axes, double noise_rad, unsigned seed) {
  Ride ride(seed);
  GyroAxes fit;
  int wrong = 0;
  for (int scan = 0; scan < 120; ++scan) {
    const Vec3 turn = ride.turn();
    fit.add(axes * turn, turn + ride.noise(noise_rad));
    if (scan >= 20) wrong += fit.wrong() ? 1 : 0;
  }
  return wrong;
}

Mat3 exchanged(int i, int j) {
  Mat3 axes = Mat3::Identity();
  axes.col(i).swap(axes.col(j));
  return axes;
}

TEST(GyroAxes, ExchangedAndInvertedAxesAreFound) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    EXPECT_EQ(scans_wrong(exchanged(0, 1), 0.002, seed), 100) << seed;
    EXPECT_EQ(scans_wrong(exchanged(1, 2), 0.002, seed), 100) << seed;
    EXPECT_EQ(scans_wrong(Vec3(-1.0, 1.0, 1.0).asDiagonal(), 0.002, seed), 100) << seed;
    EXPECT_EQ(scans_wrong(Vec3(1.0, 1.0, -1.0).asDiagonal(), 0.002, seed), 100) << seed;
  }
}

TEST(GyroAxes, NoiseBiasAndScaleAreNoWrongAxes) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    for (const double noise_rad : {0.0, 0.002, 0.02, 0.2}) {
      EXPECT_EQ(scans_wrong(Mat3::Identity(), noise_rad, seed), 0) << noise_rad << ' ' << seed;
      EXPECT_EQ(scans_wrong(1.3 * Mat3::Identity(), noise_rad, seed), 0) << noise_rad;
      EXPECT_EQ(scans_wrong(Mat3::Zero(), noise_rad, seed), 0) << "silent " << noise_rad;
    }
  }
}

TEST(GyroAxes, StampsThatAreLateAreNoWrongAxes) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Ride ride(seed);
    GyroAxes fit;
    Vec3 before = Vec3::Zero();
    for (int scan = 0; scan < 120; ++scan) {
      const Vec3 turn = ride.turn();
      fit.add(before, turn);
      before = turn;
      EXPECT_FALSE(fit.wrong()) << seed << ' ' << scan;
    }
  }
}

/// On even ground a simulation without noise rolls and pitches by its rounding errors.
TEST(GyroAxes, RoundingErrorsAreNoWrongAxes) {
  GyroAxes fit;
  for (int scan = 0; scan < 100; ++scan) {
    const double rounding = 1e-17 * (scan % 7 - 3);
    fit.add(Vec3(-rounding, rounding, 0.02), Vec3(rounding, -rounding, 0.02));
    EXPECT_FALSE(fit.wrong()) << scan;
  }
}

/// At rest the LADAR measures its noise alone.
TEST(GyroAxes, AtRestNothingIsWrong) {
  Ride ride(1);
  GyroAxes fit;
  for (int scan = 0; scan < 200; ++scan) {
    fit.add(ride.noise(1e-4), ride.noise(0.002));
    EXPECT_FALSE(fit.wrong()) << scan;
  }
}

/// @return share of the scans after which the gyro is unconfirmed
double share_unconfirmed(const Mat3& axes, double of_ladar, double noise_rad) {
  int count = 0;
  int unconfirmed = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Ride ride(seed);
    GyroAxes fit;
    for (int scan = 0; scan < 120; ++scan) {
      const Vec3 turn = ride.turn();
      fit.add(axes * turn, of_ladar * turn + ride.noise(noise_rad));
      if (scan < 20) continue;
      ++count;
      unconfirmed += fit.unconfirmed() ? 1 : 0;
    }
  }
  return static_cast<double>(unconfirmed) / count;
}

TEST(GyroAxes, ALadarThatMeasuresConfirmsARightGyro) {
  EXPECT_EQ(share_unconfirmed(Mat3::Identity(), 1.0, 0.001), 0.0);
  EXPECT_LT(share_unconfirmed(Mat3::Identity(), 1.0, 0.005), 0.01) << "half of the rotation";
}

TEST(GyroAxes, NoiseConfirmsNoGyro) {
  EXPECT_GT(share_unconfirmed(Mat3::Identity(), 0.0, 0.03), 0.8);
  EXPECT_GT(share_unconfirmed(Vec3(-1.0, 1.0, 1.0).asDiagonal(), 1.0, 0.03), 0.8);
}

TEST(GyroAxes, AGyroThatHardlyTurnsNeedsNoConfirmation) {
  EXPECT_EQ(share_unconfirmed(0.1 * Mat3::Identity(), 0.1, 0.03), 0.0);
}

}  // namespace
}  // namespace rcs::wm
