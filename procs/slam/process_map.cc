// The part of the process that deals with the map on the disk: orders (SLAM_COMMAND, SLAM_ANSWER)
// and the map that outlives this process (docs/decisions/0007).
#include <algorithm>
#include <exception>
#include <utility>

#include "procs/slam/process.h"

namespace foresight {
namespace {

constexpr Duration kFileJobCost = seconds(1);  // on a simulated clock
constexpr Duration kKeepJobCost = milliseconds(200);
constexpr int64_t kKeepShare = 20;  // keeping takes at most one part in so many of the worker
constexpr Duration kKeptAge = seconds(600);  // of a kept map's newest image, on the camera's clock
constexpr Duration kKeptPatience = seconds(2);  // for an image that fits the kept map

std::string count(size_t number, const char* what) { return std::to_string(number) + " " + what; }

std::string size_of(const StoredMap& map) {
  return count(map.keyframes.size(), "keyframes, ") + count(map.points.size(), "points");
}

// What `work` has to say against itself, as one line; empty when it is done.
template <class Work>
std::string trouble_of(const Work& work) {
  try {
    work();
  } catch (const std::exception& error) {  // the file system's and the image library's too
    return error.what();
  }
  return "";
}

}  // namespace

SlamProcess::~SlamProcess() {
  if (kept_) kept_->remove();
}

void SlamProcess::start() {
  if (!run_ || params_.keep_map_every_s <= 0) return;
  if (shelf_.root().empty()) {
    keep_trouble_ = "the map is not kept for a restart: no folder for maps, set map_root";
    return;
  }
  kept_ = std::make_shared<KeptMap>(shelf_.root(), node_.name(), *run_);
  kept_->remove_those_of_ended_runs();
  if (const auto mark = kept_->find()) read_kept(*mark);
}

void SlamProcess::on_command(const slam_command_t& command) {
  const Order order{command.utime, command.command, command.map_name};
  if (file_order_ && file_order_->order == order && !file_order_->is_void) {
    return answer(order, OrderOutcome::kRunning, "goes on");
  }
  if (const OrderAnswer* known = orders_.find(order)) {
    return answer(order, known->outcome, std::string(known->text));
  }
  const bool save = command.command == slam_command_t::COMMAND_SAVE_MAP;
  const bool load = command.command == slam_command_t::COMMAND_LOAD_MAP;
  if (!save && !load && command.command != slam_command_t::COMMAND_RESET_MAP) {
    return refuse(order, "is no order that slam knows");
  }
  if (save || load) {
    const std::string trouble = find_name_trouble(command.map_name);
    if (!trouble.empty()) return refuse(order, trouble);
    if (file_order_) return refuse(order, "a map is being saved or loaded: try again");
  }
  if (!slam_) return refuse(order, "there is no map yet: no CAMERA_INFO has come");
  file_trouble_.clear();
  if (save || load) return begin_file_order(order);
  give_up_load("the map was reset meanwhile");
  slam_->reset("reset by command");
  remove_kept_ = kept_ != nullptr;
  answer(order, OrderOutcome::kDone, "the map is forgotten");
}

void SlamProcess::answer(const Order& order, OrderOutcome outcome, const std::string& text) {
  static_assert(static_cast<int>(OrderOutcome::kRefused) == slam_answer_t::OUTCOME_REFUSED &&
                static_cast<int>(OrderOutcome::kDone) == slam_answer_t::OUTCOME_DONE &&
                static_cast<int>(OrderOutcome::kRunning) == slam_answer_t::OUTCOME_RUNNING);
  orders_.note(order, {outcome, text});
  slam_answer_t message{};
  message.utime = node_.now().us;
  message.command_utime = order.utime;
  message.outcome = static_cast<int8_t>(outcome);
  message.text = text;
  answers_.publish(message);
}

void SlamProcess::refuse(const Order& order, const std::string& why) {
  command_input_.reject(why);
  answer(order, OrderOutcome::kRefused, why);
}

// What went wrong with an order that was taken stays in the health until the next one.
void SlamProcess::fail(const Order& order, const std::string& why) {
  file_trouble_ = why;
  refuse(order, why);
}

void SlamProcess::begin_file_order(const Order& order) {
  auto begun = std::make_shared<FileOrder>(FileOrder{order, {}});
  if (order.command == slam_command_t::COMMAND_SAVE_MAP) {
    if (slam_->statistics().keyframes < 2) return fail(order, "there is no map to save yet");
    begun->map = slam_->stored_map();  // as it is now; images are shared
  }
  file_order_ = std::move(begun);
  answer(order, OrderOutcome::kRunning, "begun");
  continue_mapping();
}

// Reading and writing a map folder takes a second: beside the loop. True if one was started.
bool SlamProcess::start_file_job() {
  if (!file_order_ || file_order_->started) return false;
  file_order_->started = true;
  return node_.run_beside(
      [this, work = file_order_]() -> std::function<void()> {
        const std::string trouble = trouble_of([&] {
          const std::string& name = work->order.map_name;
          if (work->order.command == slam_command_t::COMMAND_SAVE_MAP) {
            shelf_.save(work->map, name);
          } else {
            work->map = shelf_.load(name);
          }
        });
        return [this, work, trouble] {
          file_order_.reset();
          finish(*work, trouble);
          continue_mapping();
        };
      },
      kFileJobCost);
}

void SlamProcess::finish(const FileOrder& done, const std::string& trouble) {
  if (done.is_void) return;  // answered when it was given up
  if (!trouble.empty()) return fail(done.order, trouble);
  const std::string size = size_of(done.map);
  const std::string path = shelf_.path(done.order.map_name);
  if (done.order.command == slam_command_t::COMMAND_SAVE_MAP) {
    return answer(done.order, OrderOutcome::kDone, "saved " + size + " in " + path);
  }
  if (!take_over(done.map)) return fail(done.order, path + ": a map of another camera");
  answer(done.order, OrderOutcome::kDone, "loaded " + size + " from " + path);
}

// A map that was asked for before a reset or a new camera is not wanted any more.
void SlamProcess::give_up_load(const char* why) {
  if (!file_order_ || file_order_->order.command != slam_command_t::COMMAND_LOAD_MAP) return;
  if (!file_order_->is_void) refuse(file_order_->order, std::string("given up: ") + why);
  file_order_->is_void = true;
  if (!file_order_->started) file_order_.reset();
}

bool SlamProcess::take_over(const StoredMap& stored) {
  if (!(stored.camera == *camera_.camera())) return false;
  slam_->restore(stored);
  return true;
}

void SlamProcess::read_kept(const KeptMap::Mark& mark) {
  reading_kept_ = true;
  node_.set_state(ProcessState::kWaiting, "reads the map that the slam before it has kept");
  const bool started = node_.run_beside(
      [this, mark, kept = kept_]() -> std::function<void()> {
        auto map = std::make_shared<StoredMap>();
        const std::string trouble = trouble_of([&] { *map = kept->read(mark); });
        return [this, mark, map, trouble] {
          reading_kept_ = false;
          if (trouble.empty()) {
            kept_start_ = KeptStart{std::move(*map), mark, std::nullopt};
          } else {
            keep_trouble_ = "the map from before is lost: " + trouble;
          }
        };
      },
      kKeepJobCost);
  static_cast<void>(started);  // nothing else has run yet
}

bool SlamProcess::fits_kept(const image_t& message) const {
  const CameraModel& camera = kept_start_->map.camera;
  const Time newest = kept_start_->mark.image;
  return message.utime > newest.us && message.utime <= (newest + kKeptAge).us &&
         message.width_px == camera.width_px && message.height_px == camera.height_px &&
         (!camera_.camera() || *camera_.camera() == camera);
}

// Goes on in the kept map with the first image that can be of the same session; the camera is known
// before it states its intrinsics. True: not yet, the image is passed over.
bool SlamProcess::wait_for_kept(const image_t& message) {
  if (!kept_start_) return false;
  if (!kept_start_->first_image) kept_start_->first_image = node_.now();
  if (!fits_kept(message)) {
    if (node_.now() - *kept_start_->first_image <= kKeptPatience) return true;
    kept_start_.reset();
    return false;
  }
  const KeptStart start = std::move(*kept_start_);
  kept_start_.reset();
  start_map_.reset();  // the kept map has grown from it
  if (!camera_.camera()) camera_.assume(start.map.camera);
  if (!slam_) begin_with_camera();
  slam_->restore(start.map);
  kept_epoch_ = start.mark.epoch;
  return false;
}

// As a tiny map that was never on the disk. (A map that a person loads is never given up.)
void SlamProcess::give_up_tiny_kept(const TrackingResult& result) {
  const SlamOptions& options = params_.options;
  if (!in_kept_map_ || result.state != TrackingState::kLost ||
      result.lost_s <= options.restart_after_s ||
      slam_->statistics().keyframes > options.tiny_map_keyframes) {
    return;
  }
  slam_->reset("lost a tiny map");
}

// Beside the loop, at a bounded rate and a bounded share of the worker. True if it was started.
bool SlamProcess::start_keeping() {
  if (std::exchange(remove_kept_, false)) kept_->remove();  // nobody is to go on in what was reset
  const Duration since = node_.now() - kept_at_;
  const bool due = since < Duration{} || since >= keep_pause_;  // < 0: the clock was set back
  if (!kept_ || !changed_since_kept_ || !due) return false;
  if (slam_->epoch() != core_epoch_ || slam_->statistics().keyframes < 2) return false;
  changed_since_kept_ = false;
  auto map = std::make_shared<const StoredMap>(slam_->stored_map());
  return node_.run_beside(
      [this, map, kept = kept_, mark = KeptMap::Mark{epoch_, last_image_},
       begun = node_.now()]() -> std::function<void()> {
        const std::string trouble = trouble_of([&] { kept->write(mark, *map); });
        return [this, begun, trouble] {
          kept_at_ = node_.now();
          const Duration took = kept_at_ - begun;
          keep_pause_ = std::max(seconds(params_.keep_map_every_s), took * kKeepShare);
          node_.set_metric("keep_map_ms", 1e3 * took.seconds());
          keep_failures_ = trouble.empty() ? 0 : keep_failures_ + 1;
          // Once may be another slam that saves in the same folder.
          keep_trouble_ = keep_failures_ > 1 ? "the map is not kept for a restart: " + trouble : "";
          changed_since_kept_ = changed_since_kept_ || !trouble.empty();
          continue_mapping();
        };
      },
      kKeepJobCost);
}

}  // namespace foresight
