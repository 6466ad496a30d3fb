// The receiver beside liblcm's own sender, over loopback multicast (skipped where there is none).
#include "common/udpm_receiver.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/errors.h"
#include "common/lcm_bus.h"

namespace foresight {
namespace {

constexpr const char* kUrl = "udpm://239.255.76.69:17669?ttl=0&recv_buf_size=4194304";

TEST(ParseUdpmUrl, TakesMulticastAddressesOnly) {
  const auto address = parse_udpm_url(kUrl);
  ASSERT_TRUE(address);
  EXPECT_EQ(address->group, 0xefff4c45u);
  EXPECT_EQ(address->port, 17669);
  EXPECT_EQ(address->buffer_bytes, 4194304);
  EXPECT_EQ(parse_udpm_url("udpm://239.1.2.3:99")->buffer_bytes, 0);
  for (const char* url :
       {"memq://", "udpm://", "udpm://239.255.76.67", "udpm://127.0.0.1:7667",
        "udpm://239.255.76.67:0", "udpm://239.255.76.67:70000", "udpm://239.255.76.67:7x", ""}) {
    EXPECT_FALSE(parse_udpm_url(url)) << url;
  }
}

TEST(ChannelPattern, IsANameOrAnExpressionOfTheWholeName) {
  EXPECT_TRUE(ChannelPattern("VIEW").matches("VIEW"));
  EXPECT_FALSE(ChannelPattern("VIEW").matches("VIEWS"));
  EXPECT_TRUE(ChannelPattern("A|B.*").matches("BASE"));
  EXPECT_FALSE(ChannelPattern("A|B.*").matches("AB"));
  EXPECT_TRUE(ChannelPattern(".*").matches("X"));
  EXPECT_THROW(ChannelPattern("("), UsageError);
}

class UdpmReceiverTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      receiver_ = std::make_unique<UdpmReceiver>(*parse_udpm_url(kUrl));
      sender_ = std::make_unique<LcmBus>(kUrl);
    } catch (const UnavailableError& e) {
      GTEST_SKIP() << "no multicast here: " << e.what();
    }
    for (const char* channel : {"SMALL", "LARG.", "END"}) {
      receiver_->listen_to(ChannelPattern(channel));
    }
  }
  // Until END, or a minute of silence.
  std::vector<LcmMessage> until_end() {
    std::vector<LcmMessage> all;
    while (true) {
      pollfd fd{receiver_->file_descriptor(), POLLIN, 0};
      if (poll(&fd, 1, 60'000) <= 0) return all;
      for (LcmMessage& m : receiver_->take()) {
        if (m.channel == "END") return all;
        all.push_back(std::move(m));
      }
    }
  }
  std::unique_ptr<UdpmReceiver> receiver_;
  std::unique_ptr<LcmBus> sender_;
};

TEST_F(UdpmReceiverTest, ReceivesWhatLcmSendsWholeAndInFragments) {
  const std::vector<uint8_t> large(1'500'000, 42);
  for (uint8_t i = 0; i < 100; ++i) sender_->publish("SMALL", std::vector<uint8_t>{i});
  sender_->publish("OTHER", std::vector<uint8_t>{1});
  sender_->publish("LARGE", large);
  sender_->publish("END", {});
  const auto all = until_end();
  ASSERT_EQ(all.size(), 101u);
  for (uint8_t i = 0; i < 100; ++i) EXPECT_EQ(all[i].bytes, std::vector<uint8_t>{i});
  EXPECT_EQ(all[100].bytes, large);
  EXPECT_EQ(receiver_->dropped(), 0);
}

// liblcm's receiver takes them, and can be made to crash by one.
TEST_F(UdpmReceiverTest, IgnoresWhatIsSentToThisHostAlone) {
  const int s = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(17669);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const char forged[] = "LC02\0\0\0\1SMALL\0x";
  sendto(s, forged, sizeof forged, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  close(s);
  sender_->publish("END", {});
  EXPECT_TRUE(until_end().empty());
}

TEST_F(UdpmReceiverTest, SurvivesAFragmentThatWrapsAndGoesOn) {
  const int s = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(17669);
  to.sin_addr.s_addr = htonl(0xefff4c45);
  const unsigned char first[] = {'L', 'C', '0', '3', 0, 0, 0,   9,   0,   0,   0,   100, 0, 0,
                                 0,   0,   0,   0,   0, 2, 'S', 'M', 'A', 'L', 'L', 0,   1};
  const unsigned char wrapping[] = {'L',  'C',  '0',  '3',  0, 0, 0, 9, 0, 0, 0, 100,
                                    0xff, 0xff, 0xff, 0xf0, 0, 1, 0, 2, 1, 2, 3};
  for (const auto& d :
       {std::span<const unsigned char>(first), std::span<const unsigned char>(wrapping)}) {
    sendto(s, d.data(), d.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  close(s);
  sender_->publish("SMALL", std::vector<uint8_t>{5});
  sender_->publish("END", {});
  EXPECT_EQ(until_end().size(), 1u);
  EXPECT_EQ(receiver_->malformed(), 1);
}

TEST_F(UdpmReceiverTest, KeepsTheNewestWhenNobodyTakesThem) {
  const std::vector<uint8_t> large(1'000'000, 1);
  for (int i = 0; i < 100; ++i) {
    sender_->publish("LARGE", large);
    pollfd fd{receiver_->file_descriptor(), POLLIN, 0};
    ASSERT_GE(poll(&fd, 1, 10'000), 0);
  }
  sender_->publish("END", {});
  EXPECT_LE(until_end().size(), UdpmReceiver::kWaiting_bytes / large.size());
}

}  // namespace
}  // namespace foresight
