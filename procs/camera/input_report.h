// What a run used of its images and what it could not, for the lines at its end: every tool counts
// and names what it refused in the same words.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace foresight {

class InputReport {
 public:
  void use() { ++used_; }
  /// An image that is left out: missing, damaged, of another size.
  void refuse(const std::string& name, const std::string& why);
  /// An image that is used though something is odd about it.
  void warn(const std::string& name, const std::string& what);
  /// What holds for all images; empty: nothing.
  void note(const std::string& what);
  /// A video that ended before what its container promises; empty: it did not.
  void end(const std::string& shortfall) { shortfall_ = shortfall; }

  int used() const { return used_; }
  int refused() const { return refused_; }
  /// All that was listed or promised was there and was used.
  bool complete() const { return refused_ == 0 && shortfall_.empty() && used_ > 0; }
  const std::vector<std::string>& notes() const { return notes_; }
  /// What was odd and what is missing, one line each; the first few images by name.
  std::vector<std::string> lines() const;
  /// What is missing in one line, for an error; empty if complete().
  std::string complaint() const;

 private:
  struct Oddity {
    int images = 0;
    std::string first;
  };
  int used_ = 0, refused_ = 0;
  std::vector<std::string> refusals_;  // the first few
  std::map<std::string, Oddity> oddities_;
  std::vector<std::string> notes_;
  std::string shortfall_;
};

}  // namespace foresight
