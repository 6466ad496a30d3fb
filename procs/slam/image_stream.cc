#include "procs/slam/image_stream.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr int64_t kWindow_s = 5;
constexpr int kMostLate = 64;               // images by which a network re-orders
constexpr double kFastest_hz = 1000;        // of any camera
constexpr int64_t kFreeGap = 30;            // images, whatever time has passed
constexpr Duration kFreeStep = seconds(2);  // of stamps, whatever time has passed
constexpr Duration kPersistence = seconds(1);
constexpr int kContenderImages = 3;
constexpr Time kLatestStamp{int64_t{1}
                            << 53};  // the year 2255; sums of two stay far from the limits

// Recorded images may be fed faster than they were taken, hence twice the time that has passed.
Duration allowed_step(Time now, Time last_at) {
  const Duration passed = now > last_at ? now - last_at : Duration{};
  return kFreeStep + passed * 2;
}

bool follows(Time stamp, Time last, Time now, Time last_at) {
  return stamp > last && stamp - last <= allowed_step(now, last_at);
}

}  // namespace

ImageVerdict ImageStream::judge(Time now, Time stamp) {
  if (stamp < Time{} || stamp > kLatestStamp) return ImageVerdict::kAbsurd;
  const auto accept = [&] {
    accepted_ = stamp;
    accepted_at_ = now;
    contender_.reset();
    return ImageVerdict::kNext;
  };
  if (!accepted_ || follows(stamp, *accepted_, now, accepted_at_)) return accept();
  const bool goes_on = contender_ && now >= contender_->since &&
                       follows(stamp, contender_->stamp, now, contender_->at);
  if (!goes_on) contender_ = Contender{now, now, stamp, 0};
  contender_->at = now;
  contender_->stamp = stamp;
  ++contender_->images;
  if (contender_->images >= kContenderImages && now - contender_->since >= kPersistence) {
    return accept();
  }
  return stamp > *accepted_ ? ImageVerdict::kJumps : ImageVerdict::kNotNewer;
}

void ImageStream::count(Time now, Time stamp, int32_t number, int64_t passed_over) {
  ++present(now).arrived;
  const int64_t passed_now = std::max<int64_t>(0, passed_over - passed_over_);
  passed_over_ = passed_over;
  if (!counted_) {
    counted_ = Arrival{now, stamp, number};
    return;
  }
  const Arrival last = *counted_;
  const int64_t step = int64_t{number} - last.number;
  if (step == 0) {
    if (stamp == last.stamp) ++total_.repeated;  // otherwise a source that does not count
  } else if (step < 0 && step >= -kMostLate && stamp < last.stamp) {
    add_loss(now, -1);  // overtaken, and counted as lost when it was
    return;
  } else {
    const double passed_s = std::max(0.0, (now - last.at).seconds());
    const auto most = kFreeGap + static_cast<int64_t>(kFastest_hz * std::min(passed_s, 3600.0));
    if (step < 0 || step - 1 > most) {
      ++total_.source_changes;
      ++present(now).source_changes;
    } else {
      add_loss(now, std::max<int64_t>(0, step - 1 - passed_now));
    }
  }
  counted_ = Arrival{now, stamp, number};
}

void ImageStream::add_loss(Time now, int64_t images) {
  total_.lost = std::max<int64_t>(0, total_.lost + images);
  present(now).lost += images;
}

ImageStream::Second& ImageStream::present(Time now) {
  drop_old(now);
  const int64_t index = now.us / 1'000'000;
  if (seconds_.empty() || seconds_.back().index != index) seconds_.push_back({index});
  return seconds_.back();
}

// A clock that was set back makes the seconds that are yet to come void.
void ImageStream::drop_old(Time now) {
  const int64_t index = now.us / 1'000'000;
  std::erase_if(seconds_, [index](const Second& s) {
    return s.index > index || s.index <= index - kWindow_s;
  });
}

ImageStream::Losses ImageStream::losses(Time now) {
  drop_old(now);
  Losses losses = total_;
  for (const Second& s : seconds_) {
    losses.recently_arrived += s.arrived;
    losses.recently_lost += s.lost;
    losses.recent_source_changes += s.source_changes;
  }
  losses.recently_lost = std::max<int64_t>(0, losses.recently_lost);
  return losses;
}

}  // namespace foresight
