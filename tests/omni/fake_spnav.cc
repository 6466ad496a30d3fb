// A stand-in for libspnav.so.0 and its daemon: its symbols, and fake_spnav_* for the test.
#include <sys/socket.h>
#include <unistd.h>

#include <deque>

namespace {

struct Motion {
  int type, x, y, z, rx, ry, rz;
  unsigned int period;
  int* data;
};
struct Button {
  int type, press, number;
};
union Event {
  int type;
  Motion motion;
  Button button;
};

bool g_daemon = true;
int g_ends[2] = {-1, -1};
std::deque<Event> g_events;

void hang_up() {
  for (int& end : g_ends) {
    if (end >= 0) close(end);
    end = -1;
  }
}

}  // namespace

extern "C" {

int spnav_open() {
  if (!g_daemon || socketpair(AF_UNIX, SOCK_STREAM, 0, g_ends) != 0) return -1;
  return 0;
}
int spnav_close() {
  hang_up();
  return 0;
}
int spnav_fd() { return g_ends[0]; }
int spnav_poll_event(Event* event) {
  if (g_events.empty()) return 0;
  *event = g_events.front();
  g_events.pop_front();
  return event->type;
}

void fake_spnav_daemon(int there) {
  g_daemon = there != 0;
  if (!g_daemon && g_ends[1] >= 0) {
    close(g_ends[1]);
    g_ends[1] = -1;
  }
}
void fake_spnav_motion(const int* six) {
  Event event{};
  event.motion = {1, six[0], six[1], six[2], six[3], six[4], six[5], 16, nullptr};
  g_events.push_back(event);
}
void fake_spnav_button(int number, int press) {
  Event event{};
  event.button = {2, press, number};
  g_events.push_back(event);
}

}  // extern "C"
