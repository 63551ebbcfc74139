#include "server/tracker/status_monitor.hpp"

#include <gtest/gtest.h>

namespace saccade::status_monitor_test {
namespace {

StatusMonitor Tracking() {
  StatusMonitor monitor{TrackerOptions()};
  for (int k = 0; k < 10; ++k) monitor.Record(50, 48, true);
  return monitor;
}

TEST(StatusMonitor, InitialisesUntilDepthsAreSettled) {
  StatusMonitor monitor{TrackerOptions()};
  monitor.Record(50, 48, false);
  EXPECT_EQ(monitor.status(), TrackingStatus::kInitialising);
  monitor.Record(50, 48, true);
  EXPECT_EQ(monitor.status(), TrackingStatus::kTracking);
  EXPECT_EQ(monitor.quality(), TrackingQuality::kGood);
}

TEST(StatusMonitor, FewerThanFiveMatchesIsCoasting) {
  StatusMonitor monitor = Tracking();
  monitor.Record(50, 4, true);
  EXPECT_EQ(monitor.status(), TrackingStatus::kCoasting);
  for (int k = 0; k < 3; ++k) monitor.Record(50, 40, true);
  EXPECT_EQ(monitor.status(), TrackingStatus::kTracking);
}

TEST(StatusMonitor, WhatAFewMatchesAgreeOnIsBelievedWhenMoreDo) {
  StatusMonitor monitor = Tracking();
  monitor.Record(20, 5, true);  // after a gap: five of twenty agreed, 40 cm off
  EXPECT_EQ(monitor.status(), TrackingStatus::kCoasting);
  monitor.Record(50, 30, true);
  EXPECT_EQ(monitor.status(), TrackingStatus::kCoasting);
  monitor.Record(50, 30, true);
  EXPECT_EQ(monitor.status(), TrackingStatus::kTracking);
}

TEST(StatusMonitor, LastingDoubtIsLost) {
  StatusMonitor monitor = Tracking();
  int frames = 0;
  while (monitor.status() != TrackingStatus::kLost && frames < 100) {
    monitor.Record(50, 14, true);
    EXPECT_NE(monitor.status(), TrackingStatus::kTracking);
    ++frames;
  }
  EXPECT_EQ(frames, 15);
}

TEST(StatusMonitor, BlindFramesEndInLostAndStayThere) {
  StatusMonitor monitor = Tracking();
  int frames = 0;
  while (monitor.status() != TrackingStatus::kLost && frames < 100) {
    monitor.Record(0, 0, true);
    ++frames;
  }
  EXPECT_EQ(frames, TrackerOptions().lost_after_blind);
  monitor.Record(50, 50, true);
  EXPECT_EQ(monitor.status(), TrackingStatus::kLost);
}

TEST(StatusMonitor, RelocalisationIsConfirmedByTheNextFramesOrRefused) {
  StatusMonitor good = Tracking(), bad = Tracking();
  for (StatusMonitor* monitor : {&good, &bad}) {
    while (monitor->status() != TrackingStatus::kLost) monitor->Record(50, 0, true);
    monitor->BeginRelocalisation();
    EXPECT_EQ(monitor->status(), TrackingStatus::kRelocalising);
  }
  for (int k = 0; k < 3; ++k) good.Record(40, 35, true);
  EXPECT_EQ(good.status(), TrackingStatus::kTracking);
  for (int k = 0; k < 2; ++k) bad.Record(40, 8, true);
  EXPECT_EQ(bad.status(), TrackingStatus::kLost);
  EXPECT_TRUE(bad.refused());
}

}  // namespace
}  // namespace saccade::status_monitor_test
