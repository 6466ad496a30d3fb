// SLAM_COMMAND, SLAM_ANSWER and what becomes of files.
#include <filesystem>
#include <fstream>

#include "tests/slam/slam_process_fixture.h"

namespace foresight {
namespace {

class SlamOrderTest : public SlamProcessTest {
 protected:
  slam_command_t make_order(int command, const std::string& map_name) {
    slam_command_t m{};
    m.utime = world_.now().us;
    m.command = static_cast<int8_t>(command);
    m.map_name = map_name;
    return m;
  }
  void order(int command, const std::string& map_name) {
    send("SLAM_COMMAND", make_order(command, map_name));
    wait(seconds(1.5));  // the worker may be busy, and writes
  }
  void save(const std::string& name) { order(slam_command_t::COMMAND_SAVE_MAP, name); }
  void load(const std::string& name) { order(slam_command_t::COMMAND_LOAD_MAP, name); }
  void reset() { order(slam_command_t::COMMAND_RESET_MAP, ""); }
  void expect_done() {
    ASSERT_FALSE(answers_.empty());
    EXPECT_EQ(answers_.back().outcome, +slam_answer_t::OUTCOME_DONE) << answers_.back().text;
  }
  void expect_refused(const std::string& because) {
    ASSERT_FALSE(answers_.empty());
    EXPECT_EQ(answers_.back().outcome, +slam_answer_t::OUTCOME_REFUSED);
    EXPECT_NE(answers_.back().text.find(because), std::string::npos) << answers_.back().text;
  }
  int count_answers(int outcome) const {
    return static_cast<int>(std::count_if(answers_.begin(), answers_.end(),
                                          [=](const auto& a) { return a.outcome == outcome; }));
  }
  std::string root() const { return params_.map_root; }
};

TEST_F(SlamOrderTest, SavesLoadsAndForgetsTheMap) {
  start_map();
  const int64_t epoch = pose_.epoch;
  save("map");
  expect_done();
  EXPECT_TRUE(std::filesystem::exists(root() + "/map/points3D.txt"));
  // A reset right after a save: what was there at the save is what is saved.
  send("SLAM_COMMAND", make_order(slam_command_t::COMMAND_SAVE_MAP, "map"));
  reset();
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
  load("map");
  expect_done();
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  EXPECT_NE(pose_.epoch, epoch);
}

TEST_F(SlamOrderTest, NamesWhatItCannotLoadOrSaveAndTracksOn) {
  start_map();
  const int64_t epoch = pose_.epoch;
  load("nothing");
  expect_refused("nothing/foresight.txt");
  sweep(0.6, 0.7, 35);
  expect_tracking_in(epoch);
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_NE(health_.reason.find("nothing/foresight.txt"), std::string::npos) << health_.reason;
  order(77, "map");
  expect_refused("no order");
  sweep(0.8, 0.9, 6);
  expect_tracking_in(epoch);
}

TEST_F(SlamOrderTest, SaysThatTheDiskCannotBeWritten) {
  std::ofstream(root()) << "a file where the folder should be";
  start_map();
  save("map");
  expect_refused(root());
  sweep(0.6, 0.7, 35);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  EXPECT_NE(health_.reason.find(root()), std::string::npos) << health_.reason;
}

TEST_F(SlamOrderTest, ASaveDeletesNothingThatItDidNotWrite) {
  start_map();
  save("map");
  const std::vector<std::string> foreign = {"letter.txt", "images/holiday.png", "images/999999.png",
                                            "notes/idea.txt"};
  for (const std::string& name : foreign) {
    const std::filesystem::path file = root() + "/map/" + name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << "dear";
    save("map");
    expect_refused("was not written by this program");
    EXPECT_TRUE(std::filesystem::exists(file)) << name;
    EXPECT_TRUE(std::filesystem::exists(root() + "/map/points3D.txt"));
    std::filesystem::remove_all(name.starts_with("notes") ? file.parent_path() : file);
  }
  // A folder that is no map, though it has a file of that name.
  std::filesystem::create_directories(root() + "/letters");
  std::ofstream(root() + "/letters/foresight.txt") << "about foresight";
  std::ofstream(root() + "/letters/images.txt") << "about images";
  save("letters");
  expect_refused("was not written by this program");
  EXPECT_TRUE(std::filesystem::exists(root() + "/letters/images.txt"));
  save("map");
  expect_done();
}

TEST_F(SlamOrderTest, AnOrderCannotLeaveTheRoot) {
  start_map();
  std::filesystem::create_directories(temp_.path() + "/elsewhere");
  const auto entries = [&] {
    return std::distance(std::filesystem::recursive_directory_iterator(temp_.path()), {});
  };
  const auto before = entries();
  for (const std::string& name :
       {std::string("/tmp/map"), std::string("../map"), std::string("a/b"), std::string(".."),
        std::string("."), std::string(".hidden"), std::string("a..b"), std::string("_running_slam"),
        std::string("-rf"), std::string(""), std::string(65, 'a'), std::string("a b"),
        std::string("caf\xc3\xa9"), std::string("a\nb"), temp_.path() + "/elsewhere/map"}) {
    save(name);
    expect_refused("name");
    load(name);
    expect_refused("name");
  }
  EXPECT_EQ(entries(), before);
}

TEST_F(SlamOrderTest, ALinkInTheRootIsNotFollowed) {
  start_map();
  std::filesystem::create_directories(root());
  std::filesystem::create_directories(temp_.path() + "/elsewhere");
  std::filesystem::create_directory_symlink(temp_.path() + "/elsewhere", root() + "/map");
  save("map");
  expect_refused("no folder of its own");
  EXPECT_TRUE(std::filesystem::is_empty(temp_.path() + "/elsewhere"));
}

TEST_F(SlamOrderTest, TwoThousandSaveOrdersAreOneSave) {
  start_map();
  for (int i = 0; i < 2000; ++i) {
    slam_command_t m = make_order(slam_command_t::COMMAND_SAVE_MAP, "map" + std::to_string(i));
    m.utime += i;
    world_.inject(world_.now(), Domain::kRobot, "SLAM_COMMAND", encode(m));
  }
  wait(seconds(1.5));
  EXPECT_EQ(count_answers(slam_answer_t::OUTCOME_RUNNING), 1);
  EXPECT_EQ(count_answers(slam_answer_t::OUTCOME_DONE), 1);
  EXPECT_EQ(count_answers(slam_answer_t::OUTCOME_REFUSED), 1999);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(root()), {}), 1);
  sweep(0.6, 0.7, 6);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
}

TEST_F(SlamOrderTest, MapsDoNotFillTheDisk) {
  start_map();
  for (int i = 0; i < 200; ++i) {
    std::filesystem::create_directories(root() + "/map" + std::to_string(i));
  }
  save("another");
  expect_refused("holds 200 maps");
  save("map7");
  expect_done();
}

TEST_F(SlamOrderTest, AnOrderThatComesAgainIsAnsweredAgainAndDoneOnce) {
  start_map();
  const slam_command_t save_order = make_order(slam_command_t::COMMAND_SAVE_MAP, "map");
  send("SLAM_COMMAND", save_order);
  send("SLAM_COMMAND", save_order);
  EXPECT_EQ(count_answers(slam_answer_t::OUTCOME_RUNNING), 2);
  wait(seconds(1.5));
  expect_done();
  const auto written = std::filesystem::last_write_time(root() + "/map/foresight.txt");
  send("SLAM_COMMAND", save_order);
  wait(seconds(1.5));
  EXPECT_EQ(count_answers(slam_answer_t::OUTCOME_DONE), 2);
  EXPECT_EQ(answers_.back().command_utime, save_order.utime);
  EXPECT_EQ(std::filesystem::last_write_time(root() + "/map/foresight.txt"), written);
  const slam_command_t reset_order = make_order(slam_command_t::COMMAND_RESET_MAP, "");
  for (int i = 0; i < 3; ++i) send("SLAM_COMMAND", reset_order);
  step(0.5);
  wait(seconds(1));
  EXPECT_EQ(metric("restarts"), 1);
}

TEST_F(SlamOrderTest, SavesNoMapThatIsNotThere) {
  start_map();
  save("map");
  reset();
  save("map");
  expect_refused("no map to save");
  for (int i = 0; i < 35; ++i) step(0.0);
  EXPECT_NE(health_.reason.find("no map to save"), std::string::npos) << health_.reason;
  load("map");  // the first one is still there
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
}

TEST_F(SlamOrderTest, ALoadThatIsOvertakenByAResetIsAnswered) {
  start_map();
  save("map");
  send("SLAM_COMMAND", make_order(slam_command_t::COMMAND_LOAD_MAP, "map"));
  reset();
  const auto given_up = std::find_if(answers_.begin(), answers_.end(),
                                     [](const auto& a) { return a.text.find("given up") == 0; });
  EXPECT_NE(given_up, answers_.end());
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
}

TEST_F(SlamOrderTest, DoesNotTakeTheMapOfAnotherCamera) {
  start_map();
  const int64_t epoch = pose_.epoch;
  save("map");
  CameraModel other = camera_;
  other.fx_px += 1;
  change_camera(other, sideways_pose(0.6));
  load("map");
  expect_refused("another camera");
  sweep(0.0, 0.6, 70);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  EXPECT_NE(pose_.epoch, epoch);
  EXPECT_NE(health_.reason.find("another camera"), std::string::npos) << health_.reason;
}

// ---- the map that outlives slam

class KeptMapTest : public SlamProcessTest {
 protected:
  KeptMapTest() {
    world_.remove("slam");
    add_slam(run_);
    send_camera(camera_);
  }
  std::string kept() const { return params_.map_root + "/_running_slam_7"; }
  // As SIGKILL does it: nothing is cleared away.
  void kill_slam() {
    const std::string aside = temp_.path() + "/aside";
    std::filesystem::rename(kept(), aside);
    world_.remove("slam");
    std::filesystem::rename(aside, kept());
  }
  void map_and_keep() {
    start_map();
    sweep(0.6, 0.9, 18);
    wait(seconds(10));
    sweep(0.9, 1.0, 6);
    ASSERT_TRUE(std::filesystem::exists(kept() + "/foresight.txt"));
  }
  // A new slam that nobody has told the intrinsics yet.
  void start_again(const std::optional<RunIdentity>& run) {
    add_slam(run);
    wait(seconds(0.5));
    pose_ = {};
  }
  RunIdentity run_{"boot", 7, 1234};
};

TEST_F(KeptMapTest, TheMapOutlivesSlam) {
  map_and_keep();
  const int64_t epoch = pose_.epoch;
  kill_slam();
  start_again(run_);
  step(0.95);  // the first image, before any CAMERA_INFO
  expect_tracking_in(epoch);
  EXPECT_GT(snapshots_, 1) << "receivers are given the whole map";
  send_camera(camera_);
  sweep(0.95, 0.5, 30);
  expect_tracking_in(epoch);
  wait(seconds(10));
  step(0.5);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
}

TEST_F(KeptMapTest, ADeliberateStartBeginsAnew) {
  map_and_keep();
  const int64_t epoch = pose_.epoch;
  kill_slam();
  start_again(RunIdentity{"boot", 7, 99999});  // the same number, but another parent
  send_camera(camera_);
  step(0.95);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
  world_.remove("slam");  // on purpose
  EXPECT_FALSE(std::filesystem::exists(kept())) << "of a run that is over";
  start_again(run_);
  send_camera(camera_);
  step(0.95);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
  EXPECT_NE(pose_.epoch, epoch);
}

TEST_F(KeptMapTest, AnEndOnPurposeLeavesNothing) {
  map_and_keep();
  std::filesystem::create_directories(params_.map_root + "/._running_slam_7.part/images");
  world_.remove("slam");
  EXPECT_TRUE(std::filesystem::is_empty(params_.map_root));
}

TEST_F(KeptMapTest, ImagesOfAnotherSessionBeginAnew) {
  for (const double later_s : {-3600.0, 3600.0}) {
    map_and_keep();
    kill_slam();
    start_again(run_);
    send_camera(camera_);
    clock_offset_ = seconds(later_s);
    for (int i = 0; i < 70; ++i) step(0.95);
    EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING) << later_s;
    clock_offset_ = {};
    world_.remove("slam");
    start_again(run_);
    send_camera(camera_);
  }
}

TEST_F(KeptMapTest, OneForgedImageDoesNotLoseTheMap) {
  map_and_keep();
  const int64_t epoch = pose_.epoch;
  kill_slam();
  start_again(run_);
  send_image(scene_.render(camera_, sideways_pose(0.95)), Time{9'000'000'000'000'000'000});
  step(0.95);
  expect_tracking_in(epoch);
}

TEST_F(KeptMapTest, AnotherCameraBeginsAnew) {
  map_and_keep();
  kill_slam();
  start_again(run_);
  CameraModel other = camera_;
  other.fx_px += 1;
  send_camera(other);
  for (int i = 0; i < 70; ++i) step(0.95);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
}

TEST_F(KeptMapTest, AMapWithWhichSlamKeepsDyingIsGivenUp) {
  map_and_keep();
  const int64_t epoch = pose_.epoch;
  for (int i = 0; i < 3; ++i) {
    kill_slam();
    start_again(run_);
  }
  kill_slam();
  start_again(run_);
  send_camera(camera_);
  step(0.95);
  EXPECT_NE(pose_.epoch, epoch);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
}

TEST_F(KeptMapTest, AResetForgetsTheKeptMapToo) {
  map_and_keep();
  slam_command_t m{};
  m.utime = 5;
  m.command = slam_command_t::COMMAND_RESET_MAP;
  send("SLAM_COMMAND", m);
  step(0.95);
  wait(seconds(1));  // the worker may be busy
  EXPECT_FALSE(std::filesystem::exists(kept()));
}

TEST_F(KeptMapTest, ADamagedKeptMapIsNamedAndDoesNoHarm) {
  map_and_keep();
  kill_slam();
  std::ofstream(kept() + "/foresight.txt") << "foresight_map 1\ncamera nonsense\n";
  start_again(run_);
  send_camera(camera_);
  sweep(0, 0.6, 40);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
}

TEST_F(KeptMapTest, NothingIsKeptWhenItIsTurnedOff) {
  world_.remove("slam");
  params_.keep_map_every_s = 0;
  add_slam(run_);
  send_camera(camera_);
  start_map();
  EXPECT_FALSE(std::filesystem::exists(kept()));
}

TEST_F(SlamProcessTest, OnASimulatedClockNothingIsKept) {
  world_.remove("slam");
  world_.add("slam", {Domain::kRobot},
             [&](Node& node) { return std::make_unique<SlamProcess>(node, params_); });
  send_camera(camera_);
  start_map();
  EXPECT_FALSE(std::filesystem::exists(params_.map_root));
}

}  // namespace
}  // namespace foresight
