#include "procs/camera/video_file.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/display.h>
#include <libswscale/swscale.h>
}

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/errors.h"
#include "procs/camera/picture.h"

namespace foresight {
namespace {

struct Deleter {
  void operator()(AVFormatContext* p) const { avformat_close_input(&p); }
  void operator()(AVCodecContext* p) const { avcodec_free_context(&p); }
  void operator()(AVPacket* p) const { av_packet_free(&p); }
  void operator()(AVFrame* p) const { av_frame_free(&p); }
  void operator()(SwsContext* p) const { sws_freeContext(p); }
};
template <class T>
using Owned = std::unique_ptr<T, Deleter>;

constexpr double kDefaultRate_hz = 30;
// A video that ends before this share of the length that its container states is cut.
constexpr double kWholeShare = 0.95;

// EXIF's orientation that does what the container's matrix asks for; 0 if it is no multiple of 90°.
int orientation_of(const AVStream& stream) {
  const uint8_t* data = av_stream_get_side_data(&stream, AV_PKT_DATA_DISPLAYMATRIX, nullptr);
  if (data == nullptr) return 1;
  const auto* matrix = reinterpret_cast<const int32_t*>(data);
  const auto sign = [&](int i) { return matrix[i] > 0x8000 ? 1 : matrix[i] < -0x8000 ? -1 : 0; };
  // A pixel (x, y) is shown at (a x + c y, b x + d y).
  const std::array<int, 4> abcd{sign(0), sign(1), sign(3), sign(4)};
  constexpr std::array<std::array<int, 4>, 8> kTurns{{{1, 0, 0, 1},
                                                      {-1, 0, 0, 1},
                                                      {-1, 0, 0, -1},
                                                      {1, 0, 0, -1},
                                                      {0, 1, 1, 0},
                                                      {0, 1, -1, 0},
                                                      {0, -1, -1, 0},
                                                      {0, -1, 1, 0}}};
  const auto turn = std::find(kTurns.begin(), kTurns.end(), abcd);
  return turn == kTurns.end() ? 0 : static_cast<int>(turn - kTurns.begin()) + 1;
}

// Seconds of "00:00:07.666", as Matroska files state a stream's length; 0 without.
double stated_length_s(const AVFormatContext& file, const AVStream& stream) {
  const AVDictionaryEntry* tag = av_dict_get(stream.metadata, "DURATION", nullptr, 0);
  int hours = 0, minutes = 0;
  double rest_s = 0;
  if (tag != nullptr && std::sscanf(tag->value, "%d:%d:%lf", &hours, &minutes, &rest_s) == 3) {
    return 3600.0 * hours + 60.0 * minutes + rest_s;
  }
  if (stream.duration > 0) return static_cast<double>(stream.duration) * av_q2d(stream.time_base);
  const bool alone = file.nb_streams == 1 && file.duration > 0;
  return alone ? static_cast<double>(file.duration) / AV_TIME_BASE : 0;
}

}  // namespace

struct VideoFile::Decoder {
  explicit Decoder(const std::string& file_path) : path(file_path) {
    av_log_set_level(AV_LOG_QUIET);  // what goes wrong is said by us, in one line
    AVFormatContext* opened = nullptr;
    if (avformat_open_input(&opened, path.c_str(), nullptr, nullptr) != 0) refuse();
    format.reset(opened);
    if (avformat_find_stream_info(format.get(), nullptr) < 0) refuse();
    const AVCodec* codec = nullptr;
    const int index = av_find_best_stream(format.get(), AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (index < 0 || codec == nullptr) refuse();
    stream = format->streams[index];
    context.reset(avcodec_alloc_context3(codec));
    context->thread_count = 1;  // the same frames in every run, where the file is damaged
    if (avcodec_parameters_to_context(context.get(), stream->codecpar) < 0 ||
        avcodec_open2(context.get(), codec, nullptr) < 0) {
      refuse();
    }
    orientation = orientation_of(*stream);
    const double rate_hz = av_q2d(av_guess_frame_rate(format.get(), stream, nullptr));
    frame_s = 1 / (rate_hz > 0 && rate_hz < 1e4 ? rate_hz : kDefaultRate_hz);
  }
  [[noreturn]] void refuse() const {
    throw UnavailableError("source: " + path + ": is not a video that ffmpeg can read");
  }

  // Hands the next packet of the stream to the decoder; false when all have been.
  bool feed() {
    while (av_read_frame(format.get(), packet.get()) >= 0) {
      const bool ours = packet->stream_index == stream->index;
      if (ours && (packet->size == 0 || (packet->flags & AV_PKT_FLAG_DISCARD) != 0)) ++not_shown;
      if (ours) avcodec_send_packet(context.get(), packet.get());
      av_packet_unref(packet.get());
      if (ours) return true;
    }
    if (drained) return false;
    drained = true;
    return avcodec_send_packet(context.get(), nullptr) >= 0;
  }

  // Fills `frame`; false at the end. What cannot be decoded is passed over: later packets can.
  bool decode() {
    constexpr int kMaxFaults = 100;  // of the frames that wait in the decoder at the end
    for (int faults_at_end = 0; faults_at_end < kMaxFaults;) {
      const int result = avcodec_receive_frame(context.get(), frame.get());
      if (result >= 0) return true;
      if (result == AVERROR_EOF) return false;
      if (!feed()) ++faults_at_end;
    }
    return false;
  }

  Time stamp() {
    const int64_t shown = frame->best_effort_timestamp;
    Time time = last + seconds(frame_s);
    if (shown != AV_NOPTS_VALUE) {
      const double at_s = static_cast<double>(shown) * av_q2d(stream->time_base);
      if (count == 0) first_s = at_s;
      time = Time{} + seconds(at_s - first_s);
    }
    // Containers that contradict themselves: order is kept.
    if (count > 0 && time <= last) time = last + milliseconds(1);
    if (count == 0) time = {};
    last = time;
    ++count;
    return time;
  }

  Image pixels() {
    Image image{frame->width, frame->height, 3, {}};
    image.bytes.resize(3 * static_cast<size_t>(image.width_px) * image.height_px);
    scaler.reset(sws_getCachedContext(
        scaler.release(), frame->width, frame->height, static_cast<AVPixelFormat>(frame->format),
        frame->width, frame->height, AV_PIX_FMT_RGB24, SWS_BICUBIC, nullptr, nullptr, nullptr));
    if (!scaler) return {};
    uint8_t* rows[1] = {image.bytes.data()};
    const int strides[1] = {3 * image.width_px};
    sws_scale(scaler.get(), frame->data, frame->linesize, 0, frame->height, rows, strides);
    return orientation > 1 ? oriented(image, orientation) : image;
  }

  std::string path;
  Owned<AVFormatContext> format;
  Owned<AVCodecContext> context;
  Owned<AVPacket> packet{av_packet_alloc()};
  Owned<AVFrame> frame{av_frame_alloc()};
  Owned<SwsContext> scaler;
  AVStream* stream = nullptr;  // of `format`
  int orientation = 1;
  double frame_s = 0, first_s = 0;
  Time last;
  int64_t count = 0;      // decoded
  int64_t not_shown = 0;  // packets that the container does not mean to be seen
  bool drained = false;
};

VideoFile::VideoFile(const std::string& path) : decoder_(std::make_unique<Decoder>(path)) {}
VideoFile::~VideoFile() = default;
VideoFile::VideoFile(VideoFile&&) noexcept = default;
VideoFile& VideoFile::operator=(VideoFile&&) noexcept = default;

std::optional<VideoFrame> VideoFile::next() {
  if (!decoder_->decode()) return std::nullopt;
  const Time time = decoder_->stamp();
  return VideoFrame{time, decoder_->pixels()};
}

std::optional<Time> VideoFile::skip() {
  if (!decoder_->decode()) return std::nullopt;
  return decoder_->stamp();
}

std::string VideoFile::shortfall() const {
  const Decoder& d = *decoder_;
  const int64_t promised = d.stream->nb_frames - d.not_shown;
  const std::string ended = "ended after " + std::to_string(d.count);
  if (d.stream->nb_frames > 0) {
    return d.count >= promised ? "" : ended + " of " + std::to_string(promised) + " frames";
  }
  const double length_s = stated_length_s(*d.format, *d.stream);
  const double reached_s = (d.last - Time{}).seconds() + 2 * d.frame_s;
  if (d.count == 0) return ended + " frames";
  if (reached_s >= kWholeShare * length_s) return "";
  char text[80];
  std::snprintf(text, sizeof text, " frames, at %.1f of %.1f s", (d.last - Time{}).seconds(),
                length_s);
  return ended + text;
}

std::string VideoFile::note() const {
  if (decoder_->orientation == 0) {
    return "the container's rotation is no multiple of 90 degrees and is ignored";
  }
  return "";
}

}  // namespace foresight
