// The control step, the re-fit at a command and the CAN frames must not touch the heap: every
// allocation of this program is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "procs/wam_controller/arm_controller.h"
#include "procs/wam_controller/can_arm.h"
#include "procs/wam_controller/period_jitter.h"
#include "tests/wam_controller/fake_bus.h"
#include "tests/wam_controller/joints.h"

namespace {

std::atomic<long> g_allocations{0};

}  // namespace

// With a sanitizer malloc is its own, and it tells of each call; else glibc's is called from here.
#if defined(__SANITIZE_ADDRESS__)
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*,
                                                                             size_t),
                                                         void (*free_hook)(const volatile void*));
namespace {
const int kInstalled = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, size_t) { ++g_allocations; }, [](const volatile void*) {});
}  // namespace
#else
extern "C" {
void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* old, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

void* malloc(size_t size) {
  ++g_allocations;
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) {
  ++g_allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* old, size_t size) {
  ++g_allocations;
  return __libc_realloc(old, size);
}
void* aligned_alloc(size_t alignment, size_t size) {
  ++g_allocations;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** result, size_t alignment, size_t size) {
  ++g_allocations;
  *result = __libc_memalign(alignment, size);
  return *result == nullptr ? 12 : 0;
}
}
#endif

namespace foresight {
namespace {

TEST(Allocation, TheGuardCountsNewAndMalloc) {
  const long before = g_allocations;
  int* volatile number = new int(3);
  delete number;
  void* volatile block = std::malloc(10);
  std::free(block);
  Eigen::VectorXd vector = Eigen::VectorXd::Zero(50 + static_cast<int>(before % 2));
  EXPECT_GE(g_allocations - before, 3);
  EXPECT_EQ(vector.sum(), 0);
}

// Active, re-fitted at 30 Hz, stopped, in fault and back, with 4 and with 7 joints.
void run_controller(const ArmModel& arm) {
  ArmController controller(arm, {});
  PeriodJitter jitter(milliseconds(2));
  ArmReading reading{Time{1'000'000}, arm.home(), Safety::kIdle, false, {}};
  JointCommand command{reading.time, 1, 0, true, arm.home()};
  const long before = g_allocations;
  double sum = 0;
  for (int i = 0; i < 5000; ++i) {
    reading.time = reading.time + milliseconds(2);
    reading.safety = i % 1000 < 10 ? Safety::kIdle : Safety::kActive;
    reading.fault = i % 1000 == 999 ? "a fault of the safety board" : "";
    if (i % 17 == 0 && i % 1000 < 600) {
      command.time = reading.time;
      ++command.seq;
      command.is_engaged = i % 1000 >= 100 && i % 1000 < 500;
      command.position_rad[0] = 0.001 * (i % 20);
      (void)controller.on_command(reading.time, command);
    }
    sum += controller.step(reading).sum();
    jitter.tick(reading.time);
    if (i % 50 == 0) {
      controller.on_time(reading.time);
      sum += controller.snapshot().target_rad.sum() + jitter.p99_ms(reading.time);
    }
  }
  EXPECT_EQ(g_allocations - before, 0);
  EXPECT_TRUE(std::isfinite(sum));
  EXPECT_GT(controller.gate().count(CommandVerdict::kAccepted), 100);
}

TEST(Allocation, TheControlStepMakesNone) {
  for (const char* name : {"wam4", "wam7"}) {
    run_controller(load_arm_file(kArms + "/" + name + ".yaml"));
  }
}

TEST(Allocation, TheCanBackEndMakesNone) {
  const ArmModel arm = load_arm_file(kArms + "/wam7.yaml");
  FakeBus bus;
  bus.node_count = 7;
  CanArm hardware(bus, arm, JointVector::Constant(7, 1000));
  ASSERT_TRUE(hardware.start());
  hardware.set_zero(hardware.position_counts());
  ArmReading reading;
  const JointVector torque = JointVector::Constant(7, 2);
  const long before = g_allocations;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(hardware.read(Time{i}, &reading));
    hardware.write(torque);
  }
  EXPECT_EQ(g_allocations - before, 0);
}

}  // namespace
}  // namespace foresight
