// The contract between hosts of different age: a message's fingerprint covers its fields' names and
// types. When this test fails a message was changed: processes and logs of before will not
// understand it. If that is meant, put the new fingerprint here and say so in CHANGELOG.md; a field
// with a new meaning needs a new name, a redesign a new type.
#include <gtest/gtest.h>

#include <cstdio>
#include <map>
#include <string>

#include "common/message_check.h"
#include "tests/common/all_messages.h"

namespace foresight {
namespace {

const std::map<std::string, std::string> kExpected = {
    {"alignment_t", "62cc5fb823177e30"},
    {"arm_encoders_t", "d428159564797f50"},
    {"arm_torques_t", "0df34fd845fcce31"},
    {"base_pose_t", "049176c0c4ffa107"},
    {"camera_info_t", "2a74cb5d4c5350fc"},
    {"camera_pose_t", "75db4e3b4c4ae00f"},
    {"carving_delta_t", "425f304091522772"},
    {"controller_state_t", "0cd045aac58f7f53"},
    {"delta_header_t", "9bba78c3f1832d74"},
    {"device_state_t", "647322a6867f8c87"},
    {"display_stats_t", "a5c0aa210926cea3"},
    {"health_t", "c0e934a34f4ec6f4"},
    {"image_t", "c6c282f2d13a9843"},
    {"joint_command_t", "08942ba32dd2d57a"},
    {"joint_state_t", "ac4909dcc7cf5ebc"},
    {"link_flow_t", "c60e539cb1aa9980"},
    {"link_stats_t", "33d8521290e98cbe"},
    {"map_delta_t", "edc69107850598e5"},
    {"mesh_t", "cdec24e5b743f88d"},
    {"pendant_t", "51dbce493cb0bef2"},
    {"port_health_t", "81439b9c989d0cc2"},
    {"pose_hint_t", "d932d3383ae2b29a"},
    {"sim_clock_t", "4d0d41c1f105b12f"},
    {"slam_command_t", "688400df367087a8"},
    {"snapshot_request_t", "6dcd978c7ee419ca"},
    {"truth_t", "fff99387374f0ff2"},
    {"view_t", "b8ea51425948f7c1"},
};

TEST(Fingerprints, OfEveryMessageAreThoseOfTheContract) {
  for_each_message(AllMessages{}, [&]<class Message>() {
    char text[17];
    std::snprintf(text, sizeof text, "%016llx",
                  static_cast<unsigned long long>(Message::getHash()));
    const std::string name = Message::getTypeName();
    EXPECT_TRUE(kExpected.contains(name)) << name << " is new";
    EXPECT_EQ(kExpected.contains(name) ? kExpected.at(name) : "", text) << name << " has changed";
  });
}

TEST(Fingerprints, CoverEveryMessage) {
  EXPECT_EQ(AllMessages::kSize, all_schemas().size()) << "all_messages.h misses a message";
  EXPECT_EQ(kExpected.size(), all_schemas().size());
}

}  // namespace
}  // namespace foresight
