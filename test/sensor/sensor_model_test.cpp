#include "ttsdf_localization/sensor/sensor_model.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace ttsdf {
namespace {

TEST(SensorModel, EveryNameHasAModelThatTrustsNearReadingsMost) {
  for (const std::string& name : sensorNames()) {
    const SensorModel model = sensorModel(name);
    double before = 1.0;
    for (double range = 0.0; range < 30.0; range += 0.5) {
      const double weight = model.weight(range, 0.01);
      EXPECT_GT(weight, 0.0) << name;
      EXPECT_LE(weight, before) << name << " at " << range;
      before = weight;
    }
  }
}

TEST(SensorModel, WeightsAreSharesOfTheVariance) {
  const SensorModel kinect = sensorModel("kinect");
  EXPECT_NEAR(kinect.sigma(3.0), 0.0005 + 9.0 * 0.001425, 1e-12);
  // Where the sensor is as wrong as the rest, a reading counts half.
  EXPECT_NEAR(kinect.weight(3.0, kinect.sigma(3.0)), 0.5, 1e-12);
  EXPECT_EQ(sensorModel("exact").weight(20.0, 0.0), 1.0);
  // A lidar's far readings are worth what its near ones are: 1 / 676 at 20 m was a Kinect's.
  const SensorModel lidar = sensorModel("lidar");
  EXPECT_GT(lidar.weight(20.0, 0.01), 0.5 * lidar.weight(1.0, 0.01));
}

TEST(SensorModel, RefusesANameItDoesNotKnow) { EXPECT_THROW(sensorModel("sonar"), std::invalid_argument); }

}  // namespace
}  // namespace ttsdf
