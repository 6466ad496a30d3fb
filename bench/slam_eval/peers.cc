#include "bench/slam_eval/peers.h"

namespace foresight {
namespace {

constexpr PeerResult kPeers[] = {
    {"redkitchen", "ORB-SLAM2", "95.2 %", "31", "1.0 cm", "28, 35", "2660"},
    {"redkitchen", "PTAM", "52 %", "22", "10 cm", "2.1, 3.0", "200"},
    {"redkitchen", "DSO", "97.5 %", "16", "33 cm", "10.6, 78", "–"},
    {"rbt_desk", "ORB-SLAM2", "82.8 %", "17", "2.2 cm", "28, 32", "930"},
    {"rbt_desk", "PTAM", "82.8 %", "14", "3.9 cm", "2.6, 6.1", "430"},
    {"fr1_rpy", "ORB-SLAM2", "67 %", "64", "2.8 cm", "24, 29", "1160"},
    {"fr1_rpy", "PTAM", "20 %", "111", "5.6 cm", "1.7, 2.5", "–"},
    {"fr1_rpy", "DSO", "15 %", "8", "2.3 cm", "15, 50", "–"},
    {"sim_arm", "ORB-SLAM2", "83.7 %", "126", "0.52 cm", "27, 32", "1270"},
    {"sim_arm", "PTAM", "97.3 %", "21", "2.0 cm", "2.6, 4.0", "430"},
    {"sim_arm", "DSO", "96.4 %", "28", "11.7 cm", "10.3, 68", "45000"},
};

}  // namespace

std::vector<PeerResult> peers_on(const std::string& sequence) {
  std::vector<PeerResult> found;
  for (const PeerResult& p : kPeers) {
    if (sequence == p.sequence) found.push_back(p);
  }
  return found;
}

}  // namespace foresight
